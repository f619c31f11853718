"""The study as one HTML file: words first, then tables and figures; nothing is loaded from anywhere.

The page depends on the spec, the stage files and the records only, so the same folder gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stemcal.errors import UsageError
from stemcal.report import figures, words
from stemcal.report.numbers import interval, short, significant
from stemcal.report.records import curves_of, provenance_rows, read_records, run_warnings
from stemcal.report.sheets import Sheet, run_sheet, sheets_of
from stemcal.report.style import inline

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stemcal.study.model import Study
    from stemcal.study.store import StudyFolder

Stage = Mapping[str, Any]
Stages = dict[str, Stage]
STAGES = ("screen", "rsm", "invert", "validate")
TITLES = {
    "screen": "Screening",
    "rsm": "Response surface",
    "invert": "Calibration",
    "validate": "Validation",
}


@dataclass(frozen=True)
class Picture:
    """An SVG with the caption below it."""

    svg: str
    caption: str


@dataclass(frozen=True)
class Section:
    """One stage of the page."""

    anchor: str
    title: str
    sheets: tuple[Sheet, ...]
    pictures: tuple[Picture, ...]
    notes: tuple[str, ...]


def write_page(study: Study, folder: StudyFolder) -> Path:
    """Write ``report.html`` from the stages that are done; returns its path."""
    from stemcal.study.durable import write_durably

    path = folder.path / "report.html"
    write_durably(path, render(study, folder))
    return path


def render(study: Study, folder: StudyFolder) -> str:
    """Return the page."""
    from jinja2 import Environment, PackageLoader

    stages, stale = fresh_stages(study, folder)
    if not stages:
        raise UsageError("\n".join(stale) or f"{folder.path}: no stage is done yet; run `stemcal run SPEC` first")
    records = read_records(stages.values(), folder)
    environment = Environment(
        loader=PackageLoader("stemcal.report", "."), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("page.html").render(
        study=study,
        title=study.title or study.name,
        question=question(study),
        warnings=[*study.warnings, *stale, *failures(stages), *run_warnings(records)],
        missing=[TITLES[name] for name in STAGES if name not in stages],
        outcome=words.outcome(stages),
        certainty=[*words.certainty(stages), *from_table(study, stages)],
        headline=headline(stages.get("invert"), study),
        factors=factor_sheet(study),
        sections=[section(name, stages) for name in stages],
        runs=[run_sheet(TITLES[name], stages[name]) for name in ("screen", "rsm") if name in stages],
        curves=curve_picture(curves_of(records)),
        provenance=[*provenance_rows(records), ("Spec", study.source.name), ("Solver", study.solver.kind)],
    )


def question(study: Study) -> str:
    """Return what the study asks."""
    target = study.calibration_target
    count = words.counted(len(study.factors), "parameter")
    return (
        f"Which values of {count} make a simulated stem of {short(target.diameter)} mm diameter resist "
        f"cutting with the measured maximum force of {short(target.force)} N, and do they hold at "
        f"{words.counted(len(study.targets.forces) - 1, 'other diameter')}?"
    )


def from_table(study: Study, stages: Stages) -> list[str]:
    """Say that a table cannot simulate what was calibrated here."""
    if study.solver.kind != "table" or "validate" not in stages:
        return []
    return ["The validation forces were read from a table, not simulated with the parameters found here."]


def headline(invert: Stage | None, study: Study) -> list[dict[str, str]]:
    """Return the calibrated parameters for the top of the page."""
    if invert is None:
        return []
    return [
        {
            "name": study.factor(name).label or name,
            "value": significant(value),
            "unit": "" if study.factor(name).unit == "1" else study.factor(name).unit,
            "range": interval(invert["ranges"].get(name)),
        }
        for name, value in invert["solution"].items()
    ]


def factor_sheet(study: Study) -> Sheet:
    """Return the factors with their ranges, as the spec gives them."""
    rows = tuple((f.symbol, f.name, f.label, f.unit, short(f.low), short(f.high)) for f in study.factors)
    return Sheet("Factors", ("", "Factor", "Meaning", "Unit", "Low", "High"), rows, texts=4)


def fresh_stages(study: Study, folder: StudyFolder) -> tuple[Stages, list[str]]:
    """Return the stages that fit the spec and each other, and why the others are left out."""
    from stemcal.solvers import make_solver
    from stemcal.stages.lineage import read_fresh

    solver = make_solver(study)
    stages: Stages = {}
    reasons = []
    for name in filter(folder.has_stage, STAGES):
        try:
            stages[name] = read_fresh(study, solver, folder, name)
        except UsageError as error:
            reasons.append(str(error))
    return stages, list(dict.fromkeys(reasons))


def failures(stages: Stages) -> list[str]:
    """Name the runs that gave no force."""
    sentences = []
    for name, stage in stages.items():
        runs = stage["rows"] if name == "validate" else stage.get("design", {}).get("runs", [])
        for run in runs:
            if run.get("status", "ok") != "ok":
                label = run.get("run") or f"{short(run.get('diameter'))} mm"
                reason = run.get("message") or run.get("reason")
                sentences.append(f"{TITLES[name]}, run {label} failed: {reason}")
    return sentences


def section(name: str, stages: Stages) -> Section:
    """Return a stage's tables, figures and notes."""
    stage = stages[name]
    pictures = tuple(
        Picture(inline(figure, f"{name}{number}", caption), caption)
        for number, (figure, caption) in enumerate(_PICTURES[name](stages))
    )
    return Section(name, TITLES[name], tuple(sheets_of(stage)), pictures, tuple(stage.get("notes", ())))


def _screen_pictures(stages: Stages) -> list[tuple[Figure, str]]:
    screen = stages["screen"]
    return [
        (
            figures.pareto(screen),
            "Effects by size, blue raises and orange lowers the force; dashed: Lenth's margin of error.",
        ),
        (figures.half_normal(screen), "Half-normal plot: effects far above the line are more than chance."),
    ]


def _surface_pictures(stages: Stages) -> list[tuple[Figure, str]]:
    rsm, invert = stages["rsm"], stages.get("invert")
    held = "the others at the solution" if invert else "the others at the centre"
    contour = partial(figures.contours, rsm, invert=invert)
    return [
        (figures.observed_predicted(rsm), "Simulated force against the surface's prediction."),
        (figures.residuals(rsm), "What the surface leaves unexplained, run by run."),
        *(
            (
                contour(pair),
                f"Force over {pair[0]} and {pair[1]}, {held}. {_CONTOUR_KEY if invert else ''}".strip(),
            )
            for pair in combinations(rsm["names"], 2)
        ),
    ]


_CONTOUR_KEY = "Orange: where the measured force is met; star: the solution; white dots: runs."


def _validation_pictures(stages: Stages) -> list[tuple[Figure, str]]:
    caption = "Measured and simulated maximum force; the ringed diameter is the calibration's."
    return [(figures.validation(stages["validate"]), caption)]


def _no_pictures(_stages: Stages) -> list[tuple[Figure, str]]:
    return []


_PICTURES = {
    "screen": _screen_pictures,
    "rsm": _surface_pictures,
    "invert": _no_pictures,
    "validate": _validation_pictures,
}


def curve_picture(curves: Mapping[str, tuple[list[float], list[float]]]) -> Picture | None:
    """Return force over travel of all runs, the validation's in colour; None if no run kept its curve."""
    if not curves:
        return None
    validation = [label for label in curves if label.endswith(" mm")]
    caption = "Force over blade travel: validation runs in colour, all others in grey."
    return Picture(inline(figures.force_travel(curves, validation), "curves", caption), caption)
