"""Two hundred random designs against base R (lm, drop1, anova, predict), to 1e-8, where R is installed."""

from __future__ import annotations

import csv
import shutil
import subprocess
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from test_random_designs import CLOSE, random_case

from stemcal.doe.regression.surface import fit_surface
from stemcal.doe.regression.terms import term_columns
from stemcal.errors import RunsFailed

pytestmark = pytest.mark.skipif(shutil.which("Rscript") is None, reason="needs R (Debian: r-base-core)")
ORACLE = Path(__file__).with_name("oracle.R")


def sound_case(seed):
    """Return a case all of whose terms can be estimated, and our fit of it."""
    design, y, names, weights, blocks = random_case(seed)
    try:
        return (design, y, weights, blocks), fit_surface(design, y, names, weights=weights, blocks=blocks)
    except RunsFailed:
        return sound_case(seed + 1000)


def written(path, case):
    design, y, weights, blocks = case
    keep = np.isfinite(y)
    columns = term_columns(design)[keep][:, 1:]
    w = np.ones(len(y)) if weights is None else weights
    b = [1] * len(y) if blocks is None else blocks
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file)
        out.writerow(["y", "w", "b", *(f"t{i + 1}" for i in range(columns.shape[1]))])
        rows = zip(y[keep], w[keep], np.array(b)[keep], columns, strict=True)
        out.writerows([repr(float(v)), repr(float(u)), k, *map(repr, row.tolist())] for v, u, k, row in rows)


def answers_of_r(folder):
    run = subprocess.run(
        ["Rscript", "--vanilla", str(ORACLE), str(folder)], capture_output=True, text=True, timeout=300, check=True
    )
    found = defaultdict(lambda: defaultdict(list))
    for line in run.stdout.splitlines():
        case, quantity, _, value = line.split(",")
        found[case][quantity].append(float(value))
    return found


@pytest.mark.parametrize("start", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in range(40, 200, 40))])
def test_two_hundred_designs_as_r_fits_them(tmp_path, start):
    fits = {}
    for seed in range(start, start + 40):
        case, fits[str(seed)] = sound_case(seed)
        written(tmp_path / f"{seed}.csv", case)
    found = answers_of_r(tmp_path)
    assert set(found) == set(fits)
    for name, ours in fits.items():
        compare(ours, found[name])


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
    if "mean_low" in theirs:
        assert ours.mean_interval(ours.design)[:, 0] == pytest.approx(theirs["mean_low"], **CLOSE)
        assert ours.prediction_interval(ours.design)[:, 1] == pytest.approx(theirs["one_high"], **CLOSE)
