"""Two hundred random designs and forty screenings against base R (lm, drop1, anova, predict), where R is installed."""

import csv
import shutil
import subprocess
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from test_random_designs import CLOSE, random_case

from stemcal.doe.coding import term_columns
from stemcal.doe.designs import plackett_burman
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import RunsFailed
from stemcal.stages.screen.analysis import analyse_screening

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("Rscript") is None, reason="needs R (Debian: r-base-core)"),
]
ORACLE = Path(__file__).with_name("oracle.R")


def sound_case(seed):
    """Return a case all of whose terms can be estimated, and our fit of it."""
    design, y, names = random_case(seed)
    try:
        return (design, y), fit_surface(design, y, names)
    except RunsFailed:
        return sound_case(seed + 1000)


def written(path, case):
    design, y = case
    keep = np.isfinite(y)
    columns = term_columns(design)[keep][:, 1:]
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file)
        out.writerow(["y", *(f"t{i + 1}" for i in range(columns.shape[1]))])
        out.writerows([repr(float(v)), *map(repr, row.tolist())] for v, row in zip(y[keep], columns, strict=True))


def answers_of_r(folder):
    run = subprocess.run(
        ["Rscript", "--vanilla", str(ORACLE), str(folder)], capture_output=True, text=True, timeout=300, check=True
    )
    found = defaultdict(lambda: defaultdict(list))
    for line in run.stdout.splitlines():
        case, quantity, _, value = line.split(",")
        found[case][quantity].append(float(value.replace("NA", "nan")))  # of a saturated model
    return found


@pytest.mark.parametrize("start", range(0, 200, 40))
def test_two_hundred_designs_as_r_fits_them(tmp_path, start):
    fits = {}
    for seed in range(start, start + 40):
        case, fits[str(seed)] = sound_case(seed)
        written(tmp_path / f"{seed}.csv", case)
    found = answers_of_r(tmp_path)
    assert set(found) == set(fits)
    for name, ours in fits.items():
        compare(ours, found[name])


def test_screenings_as_r_fits_them(tmp_path):
    """Plackett–Burman designs of 12 to 32 runs with a run lost in some: effect = 2β, SS, F and p of drop1, to 1e-10."""
    random, fits = np.random.default_rng(11), {}
    for case in range(40):
        k = int(random.integers(3, 10))
        design = plackett_burman(k, runs=int(random.choice([12, 20, 24, 32])))
        y = 100.0 + design @ random.normal(0.0, 8.0, k) + random.normal(0.0, 3.0, len(design))
        if case % 4 == 0 and len(design) > k + 2:
            y[random.integers(len(y))] = np.nan
        fits[str(case)] = analyse_screening(design, y, [f"x{j}" for j in range(k)])
        keep = np.isfinite(y)
        rows = np.column_stack([y[keep], design[keep]])
        head = ",".join(["y", *(f"t{j + 1}" for j in range(k))])
        np.savetxt(tmp_path / f"{case}.csv", rows, "%.17g", ",", header=head, comments="")
    found = answers_of_r(tmp_path)
    assert set(found) == set(fits)
    for name, ours in fits.items():
        theirs, effects = found[name], ours.effects
        assert [e.effect for e in effects] == pytest.approx([2.0 * b for b in theirs["coefficient"][1:]], rel=1e-10)
        assert [e.f for e in effects] == pytest.approx(theirs["f"], rel=1e-10)
        assert [e.p for e in effects] == pytest.approx(theirs["p"], rel=1e-10)
        assert [e.sum_of_squares for e in effects] == pytest.approx(theirs["ss"], rel=1e-10)


def compare(ours, theirs):
    c = ours.coefficients
    assert [x.value for x in c] == pytest.approx(theirs["coefficient"], **CLOSE)
    assert [x.standard_error for x in c] == pytest.approx(theirs["standard_error"], **CLOSE)
    assert [x.low for x in c] == pytest.approx(theirs["low"], **CLOSE)
    assert [x.high for x in c] == pytest.approx(theirs["high"], **CLOSE)
    rows = {row.source: row for row in ours.anova}
    terms = [rows[x.term] for x in c[1:]]
    assert [r.sum_of_squares for r in terms] == pytest.approx(theirs["ss"], **CLOSE)
    assert [r.f for r in terms] == pytest.approx(theirs["f"], **CLOSE)
    assert [r.p for r in terms] == pytest.approx(theirs["p"], **CLOSE)
    for source, quantity in (("Model", "model"), ("Lack of fit", "lack")):
        row = rows[source]
        if row.f is not None:
            assert (row.sum_of_squares, row.f, row.p) == pytest.approx(theirs[quantity], **CLOSE)
    if max(run.leverage for run in ours.runs_diagnostics) < 1.0 - 1e-9:  # else R divides by nothing
        assert ours.press == pytest.approx(theirs["press"][0], **CLOSE)
        assert ours.predicted_r2 == pytest.approx(theirs["predicted_r2"][0], **CLOSE)
        assert [r.cooks_distance for r in ours.runs_diagnostics] == pytest.approx(theirs["cook"], **CLOSE)
        assert [r.studentised for r in ours.runs_diagnostics] == pytest.approx(theirs["studentised"], **CLOSE)
    assert ours.mean_interval(ours.design)[:, 0] == pytest.approx(theirs["mean_low"], **CLOSE)
    assert ours.prediction_interval(ours.design)[:, 1] == pytest.approx(theirs["one_high"], **CLOSE)
