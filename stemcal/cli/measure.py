"""`stemcal measure`: diameter grades and calibration targets from laboratory files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stemcal.cli.console import note, say_json, say_tables, say_whole, warn
from stemcal.cli.session import AsJson, Quiet
from stemcal.errors import UsageError
from stemcal.storage.encodings import decode
from stemcal.storage.plain import read_plain
from stemcal.storage.typed import to_json

if TYPE_CHECKING:
    from stemcal.drawing.table import Table
    from stemcal.notes import Note

app = typer.Typer(
    no_args_is_help=True,
    help="Derive diameter grades and calibration targets from measurements.\n\n"
    "Example: [bold]stemcal measure diameters stems.csv[/bold]",
)

_Folder = Annotated[Path | None, typer.Option("--out", "-o", metavar="DIR", help="Folder for tables and figures.")]
_Encoding = Annotated[str | None, typer.Option(metavar="NAME", help="Encoding, such as gbk.", show_default="detected")]
_Separator = Annotated[str | None, typer.Option(metavar="NAME", help="Column separator.", show_default="detected")]
_Decimal = Annotated[str | None, typer.Option(metavar="NAME", help="Point or comma.", show_default="detected")]
_SheetName = Annotated[str | None, typer.Option("--sheet", metavar="NAME", help="Name of the worksheet to read.")]
_Preload = Annotated[float, typer.Option(metavar="N", min=0, help="Preload at which each measured curve starts.")]
_ForceColumn = Annotated[
    str | None, typer.Option(metavar="COLUMN,...", help="Name or number of the force column.", show_default="by name")
]
_DisplacementColumn = Annotated[
    str | None,
    typer.Option(metavar="COLUMN,...", help="Name or number of the displacement column.", show_default="by name"),
]
_ForceUnit = Annotated[
    str | None, typer.Option(metavar="UNIT", help="Unit of the force, such as N or kN.", show_default="heading, else N")
]
_DisplacementUnit = Annotated[
    str | None, typer.Option(metavar="UNIT", help="Unit of the displacement.", show_default="heading, else mm")
]


@app.command()
def diameters(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Table of stem diameters with one row per stem or reading.")
    ],
    grades: Annotated[
        str | None,
        typer.Option(metavar="MM,...", help="Nominal stem diameters of the grades.", show_default="proposed"),
    ] = None,
    step: Annotated[float, typer.Option(metavar="MM", help="Width of each diameter grade.")] = 1.0,
    diameter_column: Annotated[
        str | None,
        typer.Option(metavar="COLUMN,...", help="Name or number of the diameter column.", show_default="by name"),
    ] = None,
    label_column: Annotated[
        str | None, typer.Option(metavar="COLUMN,...", help="Columns that name a stem, or none: one stem per row.")
    ] = None,
    encoding: _Encoding = None,
    separator: _Separator = None,
    decimal: _Decimal = None,
    sheet: _SheetName = None,
    out: _Folder = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit a normal distribution to stem diameters and define diameter grades.

    If the table also has columns of the bore or the thickness of the skin, their means per grade are printed as the
    tables of a spec.

    Example: [bold]stemcal measure diameters configs/data/measured-diameters.csv --grades 7,8,9,10,11[/bold]
    """
    from stemcal.measured.diameters import geometry_section, measure_diameters
    from stemcal.measured.tables import Form
    from stemcal.overview.measured_tests import diameter_tables
    from stemcal.report.measured import write_diameters

    try:
        nominal = [float(part) for part in grades.split(",")] if grades else []
    except ValueError:
        raise UsageError(f"--grades {grades}: write diameters in mm separated by commas, such as 7,8,9,10,11") from None
    form = Form(encoding, separator, decimal, sheet)
    stems = measure_diameters(file, form, nominal, step, diameter_column, label_column)
    content = {"schema_version": 3, "stage": "measure-diameters", **to_json(stems)}
    if out:
        write_diameters(out, content, stems)
    _show(content, stems.synthetic, diameter_tables(stems), stems.notes, as_json, quiet, geometry_section(stems))


@app.command()
def shear(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="File or folder with force–travel curves.")],
    index: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Table that lists the specimen diameter for each file.")
    ] = None,
    preload: _Preload = 5.0,
    exclude: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Specimen to exclude (can be repeated).")
    ] = None,
    spec: Annotated[Path | None, typer.Option(metavar="SPEC", help="Spec to which the targets are written.")] = None,
    work: Annotated[bool, typer.Option("--work", help="Also write targets for the work.")] = False,
    force_column: _ForceColumn = None,
    displacement_column: _DisplacementColumn = None,
    force_unit: _ForceUnit = None,
    displacement_unit: _DisplacementUnit = None,
    encoding: _Encoding = None,
    separator: _Separator = None,
    decimal: _Decimal = None,
    sheet: _SheetName = None,
    out: _Folder = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Convert shear test curves to peak forces and calibration targets.

    The command reads the diameters from file names (`7mm-1.csv`), header rows or the `--index` table.

    Example: [bold]stemcal measure shear configs/data/measured-shear[/bold]
    """
    from stemcal.measured.shear import find_files, measure_shear, read_index, section_of, target_rows
    from stemcal.measured.shear_curves import CurveOptions
    from stemcal.measured.tables import Form
    from stemcal.overview.measured_tests import shear_tables
    from stemcal.report.measured import write_shear_tests

    form = Form(encoding, separator, decimal, sheet)
    how = CurveOptions(form, force_column, displacement_column, force_unit, displacement_unit, preload)
    listed = read_index(index) if index else {}
    files = [path for path in find_files(folder) if index is None or path.resolve() != index.resolve()]
    tests = measure_shear(files, how, listed, exclude or [])
    rows, targets, notes = [specimen.row() for specimen in tests.specimens], target_rows(tests, work), tests.all_notes()
    results = {"specimens": rows, "grades": tests.grades, "power_law": tests.power_law, "synthetic": tests.synthetic}
    section = section_of(targets)
    content = {"schema_version": 2, "stage": "measure-shear", **to_json(results), "targets": section}
    if spec:
        _write_targets(spec, {"": targets})
    if out:
        write_shear_tests(out, content, tests)
    _show(content, tests.synthetic, shear_tables(tests), notes, as_json, quiet, section)
    if spec and not quiet:
        note(f"wrote the targets to {spec}; check the spec with `stemcal check {spec}`")


@app.command()
def tests(
    spec: Annotated[Path, typer.Argument(metavar="SPEC", help="Spec with a section for each laboratory test.")],
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Folder with one subfolder of measured curves for each test.")
    ],
    preload: _Preload = 5.0,
    exclude: Annotated[
        list[str] | None, typer.Option(metavar="TEST/NAME", help="Specimen to exclude (can be repeated).")
    ] = None,
    write: Annotated[bool, typer.Option("--write", help="Write the calibration targets to the spec.")] = False,
    force_column: _ForceColumn = None,
    displacement_column: _DisplacementColumn = None,
    force_unit: _ForceUnit = None,
    displacement_unit: _DisplacementUnit = None,
    encoding: _Encoding = None,
    separator: _Separator = None,
    decimal: _Decimal = None,
    sheet: _SheetName = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Convert curves measured in laboratory tests to calibration targets.

    For each test in the spec, the command calculates the responses that have targets. If a test has no targets, the
    command calculates the default responses for that kind of test.

    Example: [bold]stemcal measure tests study.yaml lab --write[/bold]
    """
    from stemcal.cli.session import study_or_exit
    from stemcal.measured.shear_curves import CurveOptions
    from stemcal.measured.tables import Form
    from stemcal.overview.measured_tests import measure_tests, tests_table

    form = Form(encoding, separator, decimal, sheet)
    how = CurveOptions(form, force_column, displacement_column, force_unit, displacement_unit, preload)
    measured = measure_tests(study_or_exit(spec), folder, how, exclude or [])
    section = "\n  - ".join(["targets:", *(row for rows in measured.targets.values() for row in rows)])
    means = to_json(measured.means)
    content = {"schema_version": 2, "stage": "measure-tests", "means": means, "targets": measured.targets}
    if write:
        _write_targets(spec, measured.targets)
    _show(content, measured.synthetic, [tests_table(measured)], measured.notes, as_json, quiet, section)
    if write and not quiet:
        note(f"wrote the targets of the tests to {spec}; check the spec with `stemcal check {spec}`")


def _write_targets(spec: Path, targets: Mapping[str, Sequence[str]]) -> None:
    """Write the targets of each test (rows of YAML) to a spec; raise if the spec would be invalid."""
    from stemcal.storage.atomic import write_atomic
    from stemcal.study.reading import read_study
    from stemcal.study.reading.read import with_rows
    from stemcal.study.types.strict_yaml import MAX_BYTES

    try:
        before = decode(read_plain(spec, MAX_BYTES))
    except OSError as error:
        raise UsageError(f"{spec}: {error.strerror}") from None
    if before is None:
        raise UsageError(f"{spec} is not a text file; save the spec as UTF-8 text")
    text = with_rows(before, targets)
    read_study(text.encode("utf-8"), spec)
    write_atomic(spec, text)


def _show(
    content: object, synthetic: bool, tables: list[Table], notes: Iterable[Note], as_json: bool, quiet: bool, yaml: str
) -> None:
    if as_json:
        say_json(content)
    else:
        say_tables(*tables)
        say_whole(*([yaml] if yaml else []))
    if synthetic:
        warn("the files are marked as synthetic; do not publish their values as measurements")
    for remark in [] if quiet else notes:
        note(f"note: {remark}")
