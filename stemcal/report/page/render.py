"""The study as one HTML file: words first, then tables and figures; nothing is loaded from anywhere.

The page depends on the spec, the stage files and the records only, so the same folder gives the same bytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.errors import UsageError
from stemcal.files.durable import write_durably
from stemcal.folder.store import StudyFolder
from stemcal.report.figures.gallery import Plot, gallery
from stemcal.report.figures.style import inline
from stemcal.report.numbers import short
from stemcal.report.page import sentences
from stemcal.report.page.headline import headline
from stemcal.report.records import Records, provenance_rows, read_records, run_warnings
from stemcal.report.tables.appendix import checks_sheet, design_sheet, page_sheets
from stemcal.report.tables.setting import setting_sheets
from stemcal.report.tables.sheet import Sheet, borne
from stemcal.report.tables.stages import sheets_of
from stemcal.report.verdict import CLAIMING, shown_notes
from stemcal.stages.base import stage_called, stages_of
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.rules import verdict_of
from stemcal.words import counted

if TYPE_CHECKING:
    from stemcal.study.model import Study


_LATER = ("climb", "refine")  # their runs follow from each other; a failed one is answered by the next


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
    path = folder.path / "report.html"
    write_durably(path, render(study, folder))
    return path


def render(study: Study, folder: StudyFolder) -> str:
    """Return the page."""
    from jinja2 import Environment, PackageLoader

    results = fresh_results(study, folder)
    done = list(results.done())
    if not done:
        raise UsageError(
            "\n".join(results.stale) or f"{folder.path}: no stage is done yet; run `stemcal run SPEC` first"
        )
    records = read_records(results, folder)
    plots = gallery(study, results, records)
    names, verdict = [result.name for result in done], verdict_of(study, folder, results)
    environment = Environment(
        loader=PackageLoader("stemcal.report.page", "."), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("page.html").render(
        study=study,
        title=study.title or study.name,
        question=question(study),
        warnings=[*study.warnings, *results.stale, *failures(done), *run_warnings(records)],
        missing=[stage.title for stage in stages_of(study) if stage.name not in names],
        verdict=verdict,
        word=verdict.word,
        outcome=sentences.outcome(results, verdict.holds),
        certainty=[*sentences.certainty(results, verdict.holds), *from_table(study, results)],
        headline=headline(results.inversion, study, verdict.holds),
        setting=setting_sheets(study),
        sections=[section(result, plots, verdict) for result in done],
        runs=run_sheets(results, records),
        pictures=pictures_of("runs", plots),
        provenance=[*provenance_rows(records), ("Spec", study.source.name), ("Solver", study.solver.kind)],
    )


def question(study: Study) -> str:
    """Return what the study asks."""
    target = study.calibration_target
    count = counted(len(study.factors), "parameter")
    return (
        f"Which values of {count} make a simulated stem of {short(target.diameter)} mm diameter resist "
        f"cutting with the measured maximum force of {short(target.force)} N, and do they hold at "
        f"{counted(len(study.targets.forces) - 1, 'other diameter')}?"
    )


def from_table(study: Study, results: Results) -> list[str]:
    """Say that a table cannot simulate what was calibrated here."""
    if study.solver.kind != "table" or results.validation is None:
        return []
    return ["The validation forces were read from a table, not simulated with the parameters found here."]


def failures(done: list[StageResult]) -> list[str]:
    """Name the runs of designs and of the validation that gave no force."""
    return [
        f"{stage_called(result.name).title}, run {label.removeprefix(f'{result.name} ')} failed: "
        f"{outcome.message or outcome.reason}"
        for result in done
        if result.name not in _LATER
        for label, outcome in result.runs()
        if not outcome.ok
    ]


def section(result: StageResult, plots: list[Plot], verdict: Verdict) -> Section:
    """Return a stage's tables, figures and notes, as far as the verdict bears them."""
    sheets = tuple(borne([*sheets_of(result), *page_sheets(result)], verdict.holds))
    title = stage_called(result.name).title
    pictures = pictures_of(result.name, [plot for plot in plots if verdict.holds or plot.name not in CLAIMING])
    return Section(result.name, title, sheets, pictures, shown_notes(result, verdict.holds))


def run_sheets(results: Results, records: Records) -> list[Sheet]:
    """Return the designs run by run, and what the solver told of every run."""
    sheets = []
    if (screen := results.screen) is not None:
        symbols = {effect.factor: effect.symbol for effect in screen.effects}
        sheets.append(design_sheet("Runs: screening", screen.design, symbols))
    if (surface := results.surface) is not None:
        symbols = {entry.factor: entry.symbol for entry in surface.factors}
        sheets.append(design_sheet("Runs: response surface", surface.design, symbols))
    checks = checks_sheet(records)
    return sheets if checks is None else [*sheets, checks]


def pictures_of(section: str, plots: list[Plot]) -> tuple[Picture, ...]:
    """Return the drawn figures of a section."""
    return tuple(
        Picture(inline(plot.draw(), f"{section}{number}", plot.caption), plot.caption, plot.wide)
        for number, plot in enumerate(plot for plot in plots if plot.section == section and plot.on_page)
    )
