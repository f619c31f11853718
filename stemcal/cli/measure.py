"""`stemcal measure`: from the laboratory's files to stem grades and measured forces."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stemcal.cli.console import note, say_json, say_tables, say_whole, warn
from stemcal.cli.options import AsJson, Quiet
from stemcal.errors import UsageError
from stemcal.files.reading import decode, read_plain
from stemcal.files.typed import to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stemcal.files.rows import Table
    from stemcal.measured.shear import ShearTests
    from stemcal.note import Note
    from stemcal.study.model import Study

app = typer.Typer(
    no_args_is_help=True,
    help="Read laboratory files: stem diameters, shear tests, other tests of a spec.\n\n"
    "Example: [bold]stemcal measure diameters stems.csv[/bold]",
)

Folder = Annotated[
    Path | None, typer.Option("--out", "-o", metavar="DIR", help="Write tables and figures here (csv, json, svg, png).")
]
Encoding = Annotated[str | None, typer.Option(metavar="NAME", help="utf-8, utf-16, gbk ...", show_default="found out")]
Separator = Annotated[
    str | None, typer.Option(metavar="tab|semicolon|comma|space", help="Between columns.", show_default="found out")
]
Decimal = Annotated[str | None, typer.Option(metavar="point|comma", help="Decimal mark.", show_default="found out")]
SheetName = Annotated[str | None, typer.Option("--sheet", metavar="NAME", help="Which of a workbook.")]
Preload = Annotated[float, typer.Option(metavar="N", min=0, help="Force before which the tool only settles.")]
ForceColumn = Annotated[str | None, typer.Option(metavar="NAME|NUMBER,...", show_default="by name")]
DisplacementColumn = Annotated[str | None, typer.Option(metavar="NAME|NUMBER,...", show_default="by name")]
TimeColumn = Annotated[str | None, typer.Option(metavar="NAME|NUMBER,...", show_default="by name")]
Speed = Annotated[
    str | None,
    typer.Option(metavar="SPEED", help="Of the tool, as 20mm/min, where files hold time and force alone."),
]
ForceUnit = Annotated[str | None, typer.Option(metavar="N|kN|kgf|...", show_default="the header's, else N")]
DisplacementUnit = Annotated[str | None, typer.Option(metavar="mm|cm|...", show_default="the header's, else mm")]
TimeUnit = Annotated[str | None, typer.Option(metavar="s|ms|min", show_default="the header's, else s")]


@app.command()
def diameters(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="One row per stem, repeats in columns or rows.")],
    grades: Annotated[
        str | None, typer.Option(metavar="MM,MM,...", help="Diameters of the grades.", show_default="proposed")
    ] = None,
    step: Annotated[float, typer.Option(metavar="MM", help="Width of a grade.")] = 1.0,
    diameter_column: Annotated[str | None, typer.Option(metavar="NAME|NUMBER,...", show_default="by name")] = None,
    encoding: Encoding = None,
    separator: Separator = None,
    decimal: Decimal = None,
    sheet: SheetName = None,
    out: Folder = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit a normal distribution to stem diameters and assign the stems to grades.

    Example: [bold]stemcal measure diameters configs/data/measured-diameters.csv --grades 7,8,9,10,11[/bold]
    """
    from stemcal.measured.diameters import measure_diameters
    from stemcal.measured.tables import Form
    from stemcal.report.figures import curves as figures
    from stemcal.report.tables import laboratory as tables

    form = Form(encoding, separator, decimal, sheet)
    found = measure_diameters(file, form, _numbers(grades), step, diameter_column)
    content = {"schema_version": 2, "stage": "measure-diameters", **to_json(found)}
    if out:
        _leave_files(out, content, found.stems.table(), {"diameters": figures.diameter_histogram(found)})
    _show(content, found.synthetic, tables.diameter_tables(found), [], as_json, quiet, "")


@app.command()
def shear(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Force-displacement files, or one of them.")],
    pattern: Annotated[
        str | None,
        typer.Option(metavar="GLOB", help="Which files.", show_default="*.csv, .txt, .dat, .tsv, .asc, .tra, .xls(x)"),
    ] = None,
    index: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table with columns file, diameter and perhaps grade.")
    ] = None,
    preload: Preload = 5.0,
    exclude: Annotated[
        list[str] | None, typer.Option(metavar="SPECIMEN", help="Leave a specimen out; repeatable.")
    ] = None,
    alpha: Annotated[
        float, typer.Option(metavar="P", min=0.0001, max=0.5, help="Level of Grubbs' test for outliers.")
    ] = 0.05,
    spec: Annotated[
        Path | None, typer.Option(metavar="SPEC", help="Replace the rows of the cutting test in this spec.")
    ] = None,
    travel_and_work: Annotated[
        bool, typer.Option("--travel-and-work", help="Targets for travel to the maximum and work done by then, too.")
    ] = False,
    force_column: ForceColumn = None,
    displacement_column: DisplacementColumn = None,
    time_column: TimeColumn = None,
    speed: Speed = None,
    force_unit: ForceUnit = None,
    displacement_unit: DisplacementUnit = None,
    time_unit: TimeUnit = None,
    encoding: Encoding = None,
    separator: Separator = None,
    decimal: Decimal = None,
    sheet: SheetName = None,
    out: Folder = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find the peak shear force of every specimen and convert the means of the grades to targets.

    The diameter of a specimen is read from the file name (7mm-1.csv), above its data, or from an index.

    Example: [bold]stemcal measure shear configs/data/measured-shear[/bold]
    """
    from stemcal.measured.channels import CurveOptions
    from stemcal.measured.shear import find_files, measure_shear, read_index, target_rows
    from stemcal.measured.shear_curves import speed_of
    from stemcal.measured.tables import Form

    columns, units = (force_column, displacement_column, time_column), (force_unit, displacement_unit, time_unit)
    known = speed_of(speed) if speed is not None else None
    how = CurveOptions(Form(encoding, separator, decimal, sheet), *columns, *units, known, preload)
    how.check()
    listed = read_index(index) if index else {}
    files = [path for path in find_files(folder, pattern) if index is None or path.resolve() != index.resolve()]
    tests = measure_shear(files, how, listed, exclude or [], alpha)
    _finish_shear(tests, target_rows(tests, travel_and_work), spec, out, as_json, quiet)


@app.command()
def tests(
    spec: Annotated[Path, typer.Argument(metavar="SPEC", help="The study whose tests they are.")],
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A folder of sheets for each test, by its name.")],
    preload: Preload = 5.0,
    exclude: Annotated[
        list[str] | None, typer.Option(metavar="TEST/SPECIMEN", help="Leave a specimen out; repeatable.")
    ] = None,
    write: Annotated[bool, typer.Option("--write", help="Write the rows of the tests into the spec.")] = False,
    force_column: ForceColumn = None,
    displacement_column: DisplacementColumn = None,
    time_column: TimeColumn = None,
    speed: Speed = None,
    force_unit: ForceUnit = None,
    displacement_unit: DisplacementUnit = None,
    time_unit: TimeUnit = None,
    encoding: Encoding = None,
    separator: Separator = None,
    decimal: Decimal = None,
    sheet: SheetName = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find slope, peak force and work of every specimen and convert the means to targets.

    Means are computed for the responses in the targets of each test, otherwise for the usual ones.

    Example: [bold]stemcal measure tests study.yaml lab --write[/bold]
    """
    from stemcal.cli.session import read_study
    from stemcal.measured.channels import CurveOptions
    from stemcal.measured.shear_curves import speed_of
    from stemcal.measured.tables import Form
    from stemcal.overview.measured_tests import measure_tests
    from stemcal.report.tables.laboratory import tests_table
    from stemcal.study.reading.amend import with_rows

    columns, units = (force_column, displacement_column, time_column), (force_unit, displacement_unit, time_unit)
    known = speed_of(speed) if speed is not None else None
    how = CurveOptions(Form(encoding, separator, decimal, sheet), *columns, *units, known, preload)
    found = measure_tests(read_study(spec), folder, how, exclude or [])
    section = "\n  - ".join(["targets:", *(row for rows in found.targets.values() for row in rows)])
    content = {"schema_version": 2, "stage": "measure-tests", "means": to_json(found.means), "targets": found.targets}
    if write:
        _rewrite(spec, lambda text: with_rows(text, found.targets))
    _show(content, found.synthetic, [tests_table(found)], found.notes, as_json, quiet, section)
    if write and not quiet:
        note(f"wrote rows of tests into the targets of {spec}; see what is right and wrong: stemcal check {spec}")


def _finish_shear(
    tests: ShearTests, targets: Sequence[str], spec: Path | None, out: Path | None, as_json: bool, quiet: bool
) -> None:
    """Write what was asked for, show the rest."""
    from stemcal.files.rows import Column, Rows, Table
    from stemcal.measured.shear import SpecimenRow, section_of
    from stemcal.report.figures import curves as figures
    from stemcal.report.tables import laboratory as tables
    from stemcal.study.reading.amend import with_rows

    rows, section = Rows(map(SpecimenRow.of, tests.specimens)), section_of(targets)
    told = {"specimens": rows, "grades": tests.grades, "power_law": tests.power_law, "synthetic": tests.synthetic}
    content = {"schema_version": 2, "stage": "measure-shear", **to_json(told), "targets": section}
    study = _rewrite(spec, lambda text: with_rows(text, {"": targets})) if spec else None
    if out:
        drawn = {"shear-curves": figures.shear_curves(tests), "force-diameter": figures.force_over_diameter(tests)}
        notes = Column("notes", of=lambda row: " ".join(map(str, row.notes)))
        table = Table.of([*(name for name in vars(rows[0]) if name != "notes"), notes], rows)
        _leave_files(out, content, table, drawn, section)
    _show(content, tests.synthetic, tables.shear_tables(tests), tests.all_notes(), as_json, quiet, section)
    if study is not None and not quiet:
        if further := _beyond_stroke(tests, study):
            note(further)
        note(f"wrote targets into {spec}; see what is right and wrong: stemcal check {spec}")


def _beyond_stroke(tests: ShearTests, study: Study) -> str:
    """Say that curves are longer than what the simulated blade travels, mm; nothing if they are not."""
    from stemcal.overview.foresight import lasting

    longest, diameter = max((grade.travel.mean, grade.diameter) for grade in tests.grades)
    stroke = study.loading.stroke_at(diameter)
    if longest <= stroke:
        return ""
    longer = lasting(study, longest, diameter).text
    return (
        f"note: the measured force has its maximum at up to {longest:.3g} mm of the machine's travel, which has the "
        f"give of frame and clamps in it; the simulated blade travels {stroke:.3g} mm in all. {longer} "
        "Forces are compared, not travel, unless --travel-and-work writes it too"
    )


def _rewrite(spec: Path, change: Callable[[str], str]) -> Study:
    """Change the text of a spec; one that would then be wrong is left as it was."""
    from stemcal.files.durable import write_atomic
    from stemcal.study.reading import read_study
    from stemcal.study.types.strict_yaml import MAX_BYTES

    try:
        before = decode(read_plain(spec, MAX_BYTES))
    except OSError as error:
        raise UsageError(f"{spec}: {error.strerror}") from None
    if before is None:
        raise UsageError(f"{spec} is not text; save it in UTF-8")
    text = change(before)
    study = read_study(text.encode("utf-8"), spec)
    write_atomic(spec, text)
    return study


def _numbers(text: str | None) -> list[float]:
    """Return numbers separated by commas."""
    try:
        return [float(part) for part in text.split(",")] if text else []
    except ValueError:
        raise UsageError(f"--grades {text}: give diameters in mm separated by commas, as in 7,8,9,10,11") from None


def _leave_files(
    folder: Path, content: Mapping[str, Any], rows: Table, figures: dict[str, Figure], section: str = ""
) -> None:
    """Write the results as JSON, their rows as CSV, the figures as SVG and PNG."""
    from stemcal.files.durable import as_json, write_atomic
    from stemcal.report.figures.style import save_both

    folder.mkdir(parents=True, exist_ok=True)
    stage = content["stage"]
    texts = {f"{stage}.json": as_json(content), f"{stage}.csv": rows.csv(), "targets.yaml": section}
    for name, text in texts.items():
        if text:
            write_atomic(folder / name, text)
    for name, figure in figures.items():
        save_both(figure, folder / name)


def _show(
    content: object,
    synthetic: bool,
    found: Iterable[Table],
    notes: Iterable[Note],
    as_json: bool,
    quiet: bool,
    yaml: str,
) -> None:
    if as_json:
        say_json(content)
    else:
        say_tables(*found)
        say_whole(*([yaml] if yaml else []))
    if synthetic:
        warn("the files are marked as synthetic; do not publish them as measured")
    for one in [] if quiet else notes:
        note(f"note: {one}")
