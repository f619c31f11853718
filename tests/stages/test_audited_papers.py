"""Simulated papers: sound ones have no finding, a planted fault is found first."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from stemcal import workflow
from stemcal.doe.designs.catalogue import central_composite, plackett_burman
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import stars
from stemcal.doe.regression.surface import fit_surface
from stemcal.doe.screening.analysis import analyse_screening
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.stages.audit.consistency import LevelsSwapped, MisprintedLevel, SurfaceContradictsScreening
from stemcal.stages.audit.stage import AuditResult, NoValidationTable
from stemcal.stages.printed_tables import Contradiction, Difference
from stemcal.study.reading import load_study

NAMES = ("yield_stress", "failure_strain", "elastic_modulus", "density", "poisson_ratio")
LOW, HIGH = (10.0, 0.01, 800.0, 1000.0, 0.2), (20.0, 0.05, 1200.0, 1200.0, 0.4)
UNITS = ("MPa", "", "MPa", "kg/m3", "")
ACTIVE = NAMES[:2]
DIAMETERS = (7.0, 8.0, 9.0, 10.0)
Table = list[list[object]]


@dataclass
class Paper:
    """What a paper prints: runs, analyses, forces; a fault changes one of them."""

    screen: Table
    rsm: Table
    effects: Table
    anova: Table
    coefficients: Table
    validate: Table
    printed_validation: Table
    target: float
    claims: dict[str, str] = field(default_factory=dict)


def force(x: np.ndarray, random: np.random.Generator, noise: float) -> np.ndarray:
    """120 + 30a + 12b − 3ab + 2a² of the two active factors, coded over the star distance, with noise."""
    a, b = x[:, 0], x[:, 1]
    rest = 0.8 * x[:, 2] - 0.6 * x[:, 3] if x.shape[1] > 2 else 0.0
    mean = 120 + 30 * a + 12 * b - 3 * a * b + 2 * a**2 + rest
    return np.asarray(np.round(mean + noise * random.standard_normal(len(x)), 1))


def sound(seed: int, noise: float = 1.5) -> Paper:
    """A paper whose tables follow from its runs, rounded as papers do."""
    random = np.random.default_rng(seed)
    star = 2**0.5
    coded = plackett_burman(len(NAMES))
    screening = analyse_screening(coded, y := force(coded * star, random, noise), NAMES)
    levels = Coding.from_ranges(NAMES, LOW, HIGH).to_natural(coded)
    ccd = central_composite(2, 5, "rotatable")
    coding = Coding.from_ranges(ACTIVE, LOW[:2], HIGH[:2], reach=star)
    runs = np.round(coding.to_natural(ccd), 5)
    forces = force(ccd, random, noise)
    fit = fit_surface(coding.to_coded(runs), forces, ACTIVE)
    target = float(np.round(fit.predict([0.4, 0.2])[0], 1))
    measured = [round(target * (d / 8) ** 2.2, 1) for d in DIAMETERS]
    simulated = [round(m * (1 + noise / target * random.standard_normal()), 1) for m in measured]
    errors = [100 * (m - s) / m for m, s in zip(measured, simulated, strict=True)]
    return Paper(
        screen=[[*NAMES, "force"], *[[*row, f] for row, f in zip(levels.tolist(), y.tolist(), strict=True)]],
        rsm=[[*ACTIVE, "force"], *[[*row, f] for row, f in zip(runs.tolist(), forces.tolist(), strict=True)]],
        effects=[
            ["factor", "effect", "f", "p", "stars"],
            *[[e.factor, f"{e.effect:.2f}", f"{e.f:.2f}", f"{e.p:.4f}", stars(e.p)] for e in screening.effects],
        ],
        anova=[
            ["source", "sum_of_squares", "df", "f", "stars"],
            *[
                [r.source, f"{r.sum_of_squares:.2f}", r.df, "" if r.f is None else f"{r.f:.2f}", r.stars]
                for r in fit.anova
            ],
        ],
        coefficients=[["term", "value"], *[[c.term, f"{c.value:.3f}"] for c in fit.coefficients]],
        validate=[["diameter", "force"], *map(list, zip(DIAMETERS, simulated, strict=True))],
        printed_validation=[
            ["diameter", "measured", "simulated", "error_percent"],
            *[[d, m, s, f"{e:.1f}"] for d, m, s, e in zip(DIAMETERS, measured, simulated, errors, strict=True)],
        ],
        target=target,
        claims={"max_abs_error_percent": f"{max(map(abs, errors)):.1f}"},
    )


def write(paper: Paper, folder: Path) -> Path:
    for name in ("screen", "rsm", "effects", "anova", "coefficients", "validate", "printed_validation"):
        with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows(getattr(paper, name))
    factors = "\n".join(
        f"  - {{name: {n}, {f'unit: {u}, ' if u else ''}low: {a:g}, high: {b:g}}}"
        for n, u, a, b in zip(NAMES, UNITS, LOW, HIGH, strict=True)
    )
    forces = "\n".join(f"    - {{diameter: {d:g} mm, force: {m} N}}" for d, m, *_ in paper.printed_validation[1:])
    claims = ", ".join(f'{name}: "{text}"' for name, text in paper.claims.items())
    spec = f"""\
schema_version: 1
name: paper
factors:
{factors}
solver: {{kind: table, screen: screen.csv, rsm: rsm.csv, validate: validate.csv}}
loading: {{speed: 500 mm/min, duration: 1.2 s}}
published:
  screening: effects.csv
  anova: anova.csv
  coefficients: coefficients.csv
  validation: printed_validation.csv
  claims: {{{claims}}}
targets:
  calibrate_at: 8 mm
  forces:
{forces}
rsm: {{factors: [yield_stress, failure_strain]}}
"""
    path = folder / "paper.yaml"
    path.write_text(spec, encoding="utf-8")
    return path


def audited(paper: Paper, folder: Path) -> AuditResult:
    return workflow.audit(load_study(write(paper, folder)), StudyFolder(folder / "out"), InlineExecutor())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_sound_paper_has_no_finding(tmp_path: Path, seed: int) -> None:
    found = audited(sound(seed), tmp_path)
    assert list(found.findings) == []
    assert found.agree == found.of


def _row(table: Table, name: str) -> list[object]:
    return next(row for row in table if row[0] == name)


def sign_of_a_square(paper: Paper) -> None:
    row = _row(paper.coefficients, "yield_stress^2")
    row[1] = f"{-float(str(row[1])):.3f}"


def misprinted_level(paper: Paper) -> None:
    """The high level of yield stress, 18.53553, stands two units of its last digit too high: 18.53555 would be nothing,
    so the paper prints two decimals and the digit before the last."""
    for row in paper.rsm[1:]:
        row[0] = round(float(str(row[0])), 2)
        row[1] = round(float(str(row[1])), 4)


def swapped_levels(paper: Paper) -> None:
    for row in paper.screen[1:]:
        row[1] = 0.06 - float(str(row[1]))


def boasting_claim(paper: Paper) -> None:
    paper.claims["max_abs_error_percent"] = "<0.3"


def shifted_surface(paper: Paper) -> None:
    """All of the surface's runs are 40 N higher than the screening's: another loading, perhaps."""
    for row in paper.rsm[1:]:
        row[-1] = float(str(row[-1])) + 40.0
    row = _row(paper.coefficients, "1")
    row[1] = f"{float(str(row[1])) + 40.0:.3f}"


@pytest.mark.parametrize(
    ("fault", "kind", "values"),
    [
        (sign_of_a_square, Difference, {"table": "coefficients", "of_sign": True}),
        (swapped_levels, LevelsSwapped, {"factor": "failure_strain"}),
        (boasting_claim, Difference, {"table": "claims", "of_sign": False}),
        (shifted_surface, SurfaceContradictsScreening, {}),
    ],
)
def test_a_planted_fault_is_found_first(
    tmp_path: Path, fault: Callable[[Paper], None], kind: type[Contradiction], values: dict[str, object]
) -> None:
    paper = sound(5)
    fault(paper)
    first = audited(paper, tmp_path).findings[0].found.fact
    assert isinstance(first, kind)
    assert {name: getattr(first, name) for name in values} == values


def test_a_misprinted_level_is_found_first_and_mended(tmp_path: Path) -> None:
    """As in the paper behind this tool: the analysis was made with 18.54, the table prints 18.55."""
    paper = sound(6)
    misprinted_level(paper)
    coding = Coding.from_ranges(ACTIVE, LOW[:2], HIGH[:2], reach=2**0.5)
    runs = np.array([row[:2] for row in paper.rsm[1:]], dtype=float)
    fit = fit_surface(coding.to_coded(runs), [float(str(row[2])) for row in paper.rsm[1:]], ACTIVE)
    paper.anova[1:] = [[r.source, f"{r.sum_of_squares:.4f}", r.df, "", r.stars] for r in fit.anova]
    paper.coefficients[1:] = [[c.term, f"{c.value:.4f}"] for c in fit.coefficients]
    printed: Sequence[list[object]] = [row for row in paper.rsm[1:] if row[0] == 18.54]
    assert len(printed) == 2
    for row in printed:
        row[0] = 18.55
    found = audited(paper, tmp_path).findings
    first = found[0].found.fact
    assert isinstance(first, MisprintedLevel)
    assert (first.printed, first.level) == (18.55, 18.54)
    assert len(found) == 1 and len(found[0].found.follows) > 5


def test_a_paper_without_a_validation_table_is_not_refused(tmp_path: Path) -> None:
    path = write(sound(1), tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(", validate: validate.csv", "").replace("  validation: printed_validation.csv\n", "")
                    .replace("  claims:", "  # claims:"), encoding="utf-8")  # fmt: skip
    found = workflow.audit(load_study(path), StudyFolder(tmp_path / "out"), InlineExecutor())
    assert not found.findings and NoValidationTable() in found.notes
