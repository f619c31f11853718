"""The study as one HTML file: words first, then tables and figures; nothing is loaded from anywhere.

The page depends on the spec, the stage files and the records only, so the same folder gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stemcal.errors import UsageError
from stemcal.report import words
from stemcal.report.appendix import checks_sheet, design_sheet, page_sheets
from stemcal.report.gallery import Plot, gallery
from stemcal.report.numbers import interval, short, significant
from stemcal.report.records import provenance_rows, read_records, run_warnings
from stemcal.report.setting import setting_sheets
from stemcal.report.sheets import Sheet, sheets_of
from stemcal.report.style import inline

if TYPE_CHECKING:
    from stemcal.study.model import Study
    from stemcal.study.store import StudyFolder

Stage = Mapping[str, Any]
Stages = dict[str, Stage]
STAGES = ("screen", "climb", "rsm", "invert", "refine", "validate")
OPTIONAL = ("climb", "refine")
TITLES = {
    "screen": "Screening",
    "rsm": "Response surface",
    "invert": "Calibration",
    "climb": "Climb",
    "refine": "Refinement",
    "validate": "Validation",
}


@dataclass(frozen=True)
class Picture:
    """An SVG with the caption below it."""

    svg: str
    caption: str
    wide: bool = False


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
    plots = gallery(study, stages, records)
    environment = Environment(
        loader=PackageLoader("stemcal.report", "."), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("page.html").render(
        study=study,
        title=study.title or study.name,
        question=question(study),
        warnings=[*study.warnings, *stale, *failures(stages), *run_warnings(records)],
        missing=[TITLES[name] for name in STAGES if name not in (*stages, *OPTIONAL)],
        outcome=words.outcome(stages),
        certainty=[*words.certainty(stages), *from_table(study, stages)],
        headline=headline(stages.get("invert"), study),
        setting=setting_sheets(study),
        sections=[section(name, stages, plots) for name in stages],
        runs=run_sheets(stages, records),
        pictures=pictures_of("runs", plots),
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


def section(name: str, stages: Stages, plots: list[Plot]) -> Section:
    """Return a stage's tables, figures and notes."""
    stage = stages[name]
    sheets = (*sheets_of(stage), *page_sheets(stage))
    return Section(name, TITLES[name], sheets, pictures_of(name, plots), tuple(stage.get("notes", ())))


def run_sheets(stages: Stages, records: Mapping[str, Mapping[str, Any]]) -> list[Sheet]:
    """Return the designs run by run, and what the solver told of every run."""
    done = [name for name in ("screen", "rsm") if name in stages]
    designs = [design_sheet(f"Runs: {TITLES[name].lower()}", stages[name]) for name in done]
    checks = checks_sheet(records)
    return designs if checks is None else [*designs, checks]


def pictures_of(section: str, plots: list[Plot]) -> tuple[Picture, ...]:
    """Return the drawn figures of a section."""
    return tuple(
        Picture(inline(plot.draw(), f"{section}{number}", plot.caption), plot.caption, plot.wide)
        for number, plot in enumerate(plot for plot in plots if plot.section == section and plot.on_page)
    )
