"""The audit of a paper: everything printed is computed again, and what does not agree is listed.

First the cells of the printed tables and the printed claims, then what the numbers say about each other: levels
against runs, box against design, equation against solution, signs against the law.
"""

from collections.abc import Iterator, Sequence

from stemcal.doe.regression.surface import fit_surface
from stemcal.stages.audit.found import Calibrated, Consequence, Found
from stemcal.stages.printed_numbers import agrees
from stemcal.stages.printed_tables import (
    Agreement,
    Contradiction,
    Difference,
    audit_cells,
    audit_surface,
    printed_validation,
    table,
)
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import Study

_FAR, _SEEN = 0.1, 0.02  # coded units
_NONE = Agreement(0, 0)


class LevelDiffers(Contradiction):
    """A level of the coding table against that of the runs; `rounded` if it is the latter at the printed digits.

    `coded_as_printed` is where it would be as printed; `far` if rounding has moved it far from there.
    """

    factor: str
    coded: float
    printed: str
    level: float
    coded_as_printed: float
    rounded: bool
    far: bool


class DesignDiffers(Contradiction):
    """A level that so many runs are printed with, and how many cells of the analysis each of the two brings out."""

    factor: str
    runs: int
    printed: float
    used: float
    with_printed: Agreement
    with_used: Agreement


def cells_differ(_study: Study, stages: Calibrated) -> Iterator[Found]:
    """Printed cells that their own data contradict."""
    for audited in stages.published():
        for different in audited.differences:
            yield cell_found(different)


def cell_found(different: Difference) -> Found:
    """Return a printed cell that differs: one of the equation changes the result."""
    consequence: Consequence = "result" if different.table == "coefficients" else "conclusion"
    return Found(different, consequence, f"{different.table}:{different.cell.term}")


def claims_differ(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Printed claims, such as a largest error, that do not hold."""
    claims = study.published.claims if study.published else {}
    results: list[object] = [stages.surface]
    if study.published and study.published.validation:
        results.insert(0, printed_validation(study, study.published.validation)[0])
    cells = [(name, "", text, _claimed(name, results)) for name, text in claims.items()]
    for different in audit_cells({"claims": cells}).differences:
        yield Found(different, "conclusion")


def _claimed(name: str, results: Sequence[object]) -> float | None:
    """Return what the results say of a claim, the first that knows it."""
    known = (getattr(result, name) for result in results if hasattr(result, name))
    value = next(known, None)
    return value if isinstance(value, int | float) else None


def levels_differ(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Levels as the coding table prints them against the levels that the runs had."""
    if study.published is None or study.published.levels is None:
        return
    header, rows = table(study.published.levels)
    runs = stages.surface.design.runs
    for cells in rows:
        coded = float(cells[0])
        for name, text in zip(header[1:], cells[1:], strict=True):
            ran = [(run.levels[name], run.coded[name]) for run in runs]
            level, at = min(ran, key=lambda pair: abs(pair[1] - coded))
            printed = float(text)
            if abs(at - coded) <= 0.01 and abs(printed - level) > 1e-9 * abs(level):
                scale = stages.surface.factor(name)
                yield _level(name, coded, text, level, (printed - scale.center) / scale.half_step)


def _level(name: str, coded: float, text: str, level: float, coded_as_printed: float) -> Found:
    rounded = agrees(text, level)
    moved = abs(coded_as_printed - coded)
    far = rounded and moved > _FAR
    return Found(
        LevelDiffers(name, coded, text, level, coded_as_printed, rounded, far),
        "method" if far or moved > _SEEN else "print",
        f"star:{name}" if abs(coded) > 1.0 + 1e-6 else f"level:{name}:{float(text):g}",
    )


def design_differs(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Levels of the printed runs against those that the analysis needs."""
    if study.published is None or study.published.design is None:
        return
    header, rows = table(study.published.design)
    surface = stages.surface
    for name in (heading for heading in header[:-1] if heading in surface.names):
        used_levels = [run.levels[name] for run in surface.design.runs]
        pairs = [(float(cells[header.index(name)]), used) for cells, used in zip(rows, used_levels, strict=True)]
        for printed, used in sorted({pair for pair in pairs if abs(pair[0] - pair[1]) > 1e-9 * abs(pair[1])}):
            taken = _cells_with(study, surface, header, rows)
            count = sum(pair == (printed, used) for pair in pairs)
            kept = surface.published.tables.get("anova", _NONE) if surface.published else _NONE
            differs = DesignDiffers(name, count, printed, used, taken, kept)
            yield Found(differs, "result", f"level:{name}:{printed:g}")


def _cells_with(study: Study, surface: SurfaceResult, header: list[str], rows: list[list[str]]) -> Agreement:
    """Count the printed ANOVA cells that agree when the design is taken as printed."""
    columns = [header.index(name) for name in surface.names]
    natural = [[float(cells[column]) for column in columns] for cells in rows]
    coded, responses = surface.scales.to_coded(natural), [float(cells[-1]) for cells in rows]
    refit = fit_surface(coded, responses, surface.names, each_once=False)
    audited = audit_surface(study, refit.anova, refit.coefficients)
    return audited.tables.get("anova", _NONE) if audited else _NONE
