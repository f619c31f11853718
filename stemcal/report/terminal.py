"""Output for the terminal: tables at most 80 columns wide, sentences of a stage, final tables of a study."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Literal

from rich import table as rich
from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from stemcal.drawing.showing import Setting
from stemcal.drawing.table import Table, showable
from stemcal.formats import duration, fixed, significant
from stemcal.report.outcome import KNOWN, shortened, showing_of, tables_of
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.study.model.laboratory_kind import LaboratorySection, words_of
from stemcal.study.model.study import Study
from stemcal.vocabulary import capital

if TYPE_CHECKING:
    from stemcal.cutting.result import CuttingResult

WIDTH = 80
_CROWDED = 8  # a table with at least this number of columns has narrower gaps, so that names are not broken


def stage_tables(stage: StageResult, holds: bool = True) -> list[RenderableType]:
    """Return tables and sentences of a stage; statements on intervals and agreement only for a calibrated study."""
    drawn = [part for table in tables_of(stage, holds=holds) for part in table_drawn(table)]
    return [*drawn, *identifiability(stage, holds)]


def identifiability(stage: StageResult, holds: bool = True) -> list[RenderableType]:
    """Return sentences on the identifiability of the parameters; none if the study is not calibrated."""
    lines = [note.text for note in stage.notes if note.kind == KNOWN] if holds else []
    shown = [Padding(Text(line), (0, 0, 0, 2), expand=False) for line in lines]
    return [Text("Identifiability", style="bold"), *shown, Text("")] if lines else []


def table_drawn(table: Table) -> list[RenderableType]:
    """Return a table as an object that rich prints, followed by the lines of its foot."""
    shown = rich.Table(
        title=Text(table.title, style="bold"),
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1 if len(table.columns) < _CROWDED else 0, 0, 0),
        pad_edge=False,
        show_edge=False,
    )
    texts = list(zip(table.heads, *table.cells, strict=True))
    words = [_widest(word for text in each for word in text.split()) for each in texts]
    whole = [max(word, _widest(cells)) for word, (_, *cells) in zip(words, texts, strict=True)]
    least = whole if sum(whole) + (2 if len(texts) < _CROWDED else 1) * len(texts) <= WIDTH else words
    for column, each, narrowest in zip(table.columns, texts, least, strict=True):  # only headings are broken
        justify: Literal["left", "right"] = "left" if column.left else "right"
        whole_line = _widest(each) == narrowest
        shown.add_column(Text(each[0]), justify=justify, overflow="fold", min_width=narrowest, no_wrap=whole_line)
    for index, row in enumerate(table.cells):
        shown.add_row(*(Text(cell, style="bold" if index in table.strong else "") for cell in row))
    foot = [Padding(Text(line, style="dim"), (0, 0, 0, 2), expand=False) for line in (*table.foot, *table.claimed)]
    return [shown, *foot, Text("")]


def _widest(texts: Iterable[str]) -> int:
    return max(map(cell_len, texts), default=1)


def final_tables(study: Study, results: Results, holds: bool) -> list[Table]:
    """Return the tables printed at the end of a study, such as parameters and forces."""
    setting, tables = Setting(study, results, holds), list[Table]()
    for result in results.done:
        tables += [shortened(result, table) for table in showable(showing_of(result).closing(result, setting), holds)]
    return tables


def simulation_table(
    result: CuttingResult, section: LaboratorySection | None = None, diameter: float = 0.0
) -> RenderableType:
    """Return the table of one simulation: response, energies, elements and steps.

    A laboratory test, described by `section`, begins with its responses and the measured means at the `diameter` (mm).
    """
    table = rich.Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    first = [
        ("Maximum force", f"{significant(result.peak_force)} N"),
        ("  before the filter", f"{significant(result.peak_force_raw)} N"),
        ("  at", f"{result.peak_time:.4f} s, {result.peak_travel:.3f} mm of travel"),
    ]
    if section is not None:
        first = _responses(result, section, diameter)
    rate = result.element_steps_per_second / 1e6
    rows = (
        *first,
        *_fracture_rows(result),
        ("Elements", f"{result.elements} ({result.deleted_elements} deleted before the peak force)"),
        ("Steps", f"{result.steps} in {duration(result.wall_seconds)}, {rate:.1f} M element-steps/s"),
        ("Energy drift", f"{fixed(result.energy_drift_percent, 3)} %"),
        ("Contact energy", f"at least {fixed(result.contact_energy_percent, 3)} % of the work, without friction"),
        ("Kinetic energy", f"at most {fixed(result.kinetic_ratio_percent, 3)} % of the internal energy"),
    )
    for name, value in rows:
        table.add_row(Text(name), Text(value))
    return table


def _responses(result: CuttingResult, section: LaboratorySection, diameter: float) -> list[tuple[str, str]]:
    from stemcal.laboratory.perform import LaboratoryResult

    simulated = result.responses if isinstance(result, LaboratoryResult) else {}
    measured, rows = section.means_at(diameter), []
    for response in section.responses:
        name = response.name
        if name in simulated or name in measured:
            bound = "" if response.before_maximum or result.stroke_was_enough else "at least "
            value, mean = simulated.get(name), measured.get(name)
            text = "not on this curve" if value is None else f"{bound}{significant(value)} {response.unit}"
            if mean is not None:
                text += f", measured {mean.value:g}{'' if mean.sd is None else f' ± {mean.sd:g}'} {response.unit}"
            rows.append((capital(words_of(response)), text))
    return rows


def _fracture_rows(result: CuttingResult) -> list[tuple[str, str]]:
    if result.severed is None:
        at = result.break_travel
        return [] if at is None else [("First fracture at", f"{at:.3f} mm of travel")]
    rows = []
    if result.first_fracture_force is not None:
        first = f"{result.first_fracture_travel:.3f} mm of travel, {significant(result.first_fracture_force)} N"
        rows.append(("First fracture at", first))
    through = f"{result.severed_travel:.3f} mm of travel" if result.severed else "not within the stroke"
    energy = "" if result.cutting_energy is None else f"{significant(result.cutting_energy)} mJ"
    return [*rows, ("Cut through at", through), ("Cutting energy", energy)]
