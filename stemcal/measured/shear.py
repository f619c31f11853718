"""The shear tests in a folder: the maximum force of every specimen, and the statistics of each diameter grade."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from stemcal.errors import UsageError
from stemcal.formats import did_you_mean, listed
from stemcal.measured.cells import quoted
from stemcal.measured.diameters import checked_diameter
from stemcal.measured.headings import DIAMETER, FILE, GRADE, MILLIMETRES, millimetres_in
from stemcal.measured.shear_curves import CurveOptions, ShearCurve, read_curves
from stemcal.measured.statistics import Summary, outlier_of, summarise
from stemcal.measured.tables import read_table
from stemcal.notes import Note, Remedy
from stemcal.power_law import PowerLaw, fit_power_law
from stemcal.responses import CUT, WHOLE_CUT, ForceTravel, known_response
from stemcal.storage.typed import Spread, inline

_SUFFIXES = (".csv", ".txt", ".dat", ".tsv", ".asc", ".tra", ".xlsx", ".xlsm", ".xls")
_MOST = 10  # names listed in a note
_LONGEST_ROW = 70  # a longer row (characters) is written in several lines


@dataclass(frozen=True)
class TestedSpecimen:
    """A tested piece of stem: its diameter grade (mm), its measured diameter (mm) and its curve."""

    name: str
    grade: float
    diameter: float
    curve: ShearCurve

    def row(self) -> dict[str, object]:
        """Return the name, the measured values (N, mm, mJ) and the notes of the specimen by column name."""
        c = self.curve
        values = {"max_force": c.max_force, "travel_at_max": c.travel_at_max, "work_to_max": c.work_to_max}
        specimen = {"specimen": self.name, "grade": self.grade, "diameter": self.diameter}
        test = ForceTravel.until_break(c.travel, c.force, self.diameter, CUT)
        whole_cut = {name: known_response(name).value(test) for name in WHOLE_CUT}
        return specimen | values | whole_cut | {"trimmed_points": c.trimmed, "notes": c.notes}


@dataclass(frozen=True, kw_only=True)
class _GradeForces(Spread):
    """Statistics of a grade: maximum force (N), and travel (mm) and work (mJ) from the preload to the maximum."""

    diameter: float
    summary: Summary = inline()
    travel: Summary
    work: Summary


@dataclass(frozen=True)
class ShearTests:
    """The specimens that are not excluded, and their statistics; `notes` are those on no single specimen."""

    specimens: tuple[TestedSpecimen, ...]
    grades: tuple[_GradeForces, ...]
    power_law: PowerLaw | None
    synthetic: bool
    notes: tuple[Note, ...] = ()

    def all_notes(self) -> list[Note]:
        """Return all notes; a note that several specimens share is listed once, with their names."""
        specimens: dict[Note, list[str]] = {}
        for specimen in self.specimens:
            for note in specimen.curve.notes:
                specimens.setdefault(note, []).append(specimen.name)
        return [*self._outliers(), *(note_on(names, note) for note, names in specimens.items()), *self.notes]

    def _outliers(self) -> Iterator[Note]:
        for grade in self.grades:
            tested = [specimen for specimen in self.specimens if specimen.grade == grade.diameter]
            if (index := outlier_of([specimen.curve.max_force for specimen in tested])) is not None:
                name = tested[index].name
                text = f"The maximum force of specimen {name} is an outlier (Grubbs' test). "
                text += "The specimen is still included."
                remedy = Remedy(f"If the laboratory records justify excluding the specimen, use --exclude {name}")
                yield Note("outlier", "caution", text, remedy)


def note_on(names: Sequence[str], note: Note) -> Note:
    """Return the note with the names of the files, specimens or tests that it concerns."""
    return replace(note, text=f"{_some_of(names)}: {note.text}")


def _some_of(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return ", ".join(names[:_MOST]) + more


def measure_shear(
    files: Sequence[Path],
    how: CurveOptions = CurveOptions(),
    index: Mapping[str, tuple[float, float | None]] | None = None,
    exclude: Collection[str] = (),
) -> ShearTests:
    """Read the files of the machine and evaluate all specimens except the excluded ones (`exclude`).

    `index` maps the name of a file, with or without extension, to its diameter and grade (mm; the grade may be None).
    """
    listed = index or {}
    name_counts = Counter(name for path in files for name in _names_of(path))
    bases = {path: next((name for name in _names_of(path) if name_counts[name] == 1), str(path)) for path in files}
    for entry in (entry for entry in listed if name_counts[entry.partition("#")[0]] > 1):
        raise UsageError(f"--index: {quoted(entry)} is the name of several files; write the folder: `7mm/{entry}`")
    tested = tuple(s for path, base in bases.items() for s in _specimens(path, base, how, listed))
    names = [s.name for s in tested]
    if unknown := set(exclude) - set(names):
        raise UsageError(f"--exclude {quoted(min(unknown))}: no such specimen; {did_you_mean(min(unknown), names)}")
    specimens = tuple(s for s in tested if s.name not in exclude)
    if not specimens:
        raise UsageError("--exclude: all specimens are excluded; remove one of the `--exclude` options")
    grades = []
    for nominal in sorted({s.grade for s in specimens}):
        curves = [s.curve for s in specimens if s.grade == nominal]
        force = summarise([curve.max_force for curve in curves])
        travel = summarise([curve.travel_at_max for curve in curves])
        work = summarise([curve.work_to_max for curve in curves])
        grades.append(_GradeForces(diameter=nominal, summary=force, travel=travel, work=work))
    law = fit_power_law([s.diameter for s in specimens], [s.curve.max_force for s in specimens])
    excluded = [Note("excluded", "info", f"Specimen {name} is excluded by `--exclude`.") for name in exclude]
    parts = {entry: entry.partition("#") for entry in listed}  # the specimen ``a#1`` may be listed as ``a.csv#1``
    stems = {entry: f"{Path(file).stem}{mark}{label}" for entry, (file, mark, label) in parts.items()}
    known = {*name_counts, *names}
    missing = [entry for entry, stem in stems.items() if entry not in known and stem not in known]
    text = f"The index lists files that do not exist: {_some_of(missing)}."
    notes = (*excluded, *([Note("not_there", "warning", text)] if missing else []))
    return ShearTests(specimens, tuple(grades), law, any(s.curve.synthetic for s in specimens), notes)


def _names_of(path: Path) -> list[str]:
    """Return the names by which an index may list a file, the shortest first: without and with the folders above it.

    >>> _names_of(Path("shear/7mm/1.csv"))[:4]
    ['1', '1.csv', '7mm/1', '7mm/1.csv']
    """
    ends = [path.parts[-count:-1] for count in range(1, len(path.parts) + 1)]
    return ["/".join((*end, name)) for end in ends for name in dict.fromkeys((path.stem, path.name))]


def find_files(folder: Path) -> list[Path]:
    """Return a single data file, or all data files in a folder and its subfolders, sorted so that 7mm precedes 10mm."""
    if folder.is_file():
        return [folder]
    if not folder.is_dir():
        raise UsageError(f"{folder} does not exist; pass a folder of force–travel files or a single file")
    files = [path for path in folder.rglob("*") if path.suffix.lower() in _SUFFIXES and path.is_file()]
    index = ("index", "specimens")  # tables of the user, not of the machine
    files = [path for path in files if path.stem.lower() not in index and not path.name.startswith(("~$", "."))]
    if not files:
        raise UsageError(f"{folder}: no files with the extension {listed(_SUFFIXES)}; add files of the testing machine")
    # in a path that is split at its numbers, texts and numbers alternate; numbers are compared as numbers
    parts = {path: list(enumerate(re.split(r"([0-9]+)", str(path)))) for path in files}
    return sorted(files, key=lambda path: [(i % 2, float(part) if i % 2 else 0.0, part) for i, part in parts[path]])


def read_index(path: Path) -> dict[str, tuple[float, float | None]]:
    """Return the diameter and grade (mm) of each file from a table with the columns file, diameter, grade (if any)."""
    table = read_table(path)
    names, diameters, grade = table.matching(FILE), table.matching(DIAMETER, MILLIMETRES), table.matching(GRADE)
    if not names or not diameters:
        there = f"the index must have columns `file` and `diameter` (found {table.listed_columns()})"
        raise UsageError(f"{path}: {there}; rename the columns")
    name, diameter = names[0], diameters[0]
    scale, index = table.scale_of(diameter, MILLIMETRES, "mm"), {}
    grades = table.values(grade[0]) if grade else [None] * len(table.rows)
    for cells, value, nominal in zip(table.rows, table.values(diameter), grades, strict=True):
        place = f"{path}: {quoted(cells[name])}"
        if value is None:
            raise UsageError(f"{place}: {quoted(cells[diameter])} is not a diameter")
        file = cells[name].replace("\\", "/").removeprefix("./")
        size = checked_diameter(value * scale, place)
        index[file] = size, None if nominal is None else checked_diameter(nominal, place)
    return index


def _specimens(
    path: Path, base: str, how: CurveOptions, index: Mapping[str, tuple[float, float | None]]
) -> Iterator[TestedSpecimen]:
    """Yield the specimens of a file, named `base` or base#label; diameters are from index, content or file name."""
    try:
        curves = read_curves(path, how)
    except UsageError as error:
        has_place = str(path) in str(error) or "--" in str(error)[:2]
        raise UsageError(str(error) if has_place else f"{path}: {error}") from None
    file_names = _names_of(path)[::-1]
    for curve in curves:
        name = f"{base}#{curve.label}" if curve.label else base
        entries = [*(f"{file}#{curve.label}" for file in file_names), *file_names]
        listed, grade = next((index[entry] for entry in entries if entry in index), (None, None))
        over = _first_length(curve.titles)
        of_name = _first_length((path.stem, path.parent.name)) if over is None else None
        diameter = next((value for value in (listed, curve.diameter, over, of_name) if value is not None), None)
        if diameter is None:
            raise UsageError(
                f"{path}: the diameter is unknown; write the diameter in the file name (7mm-1.csv), above the columns "
                "(7.1 mm), above the data (Diameter: 7.02 mm) or in an index file (`--index` of `measure shear`)"
            )
        checked_diameter(diameter, f"{path}: specimen {quoted(name)}")
        nominal = next((value for value in (grade, of_name) if value is not None), float(round(diameter)))
        checked_diameter(nominal, f"{path}: specimen {quoted(name)}: grade")
        yield TestedSpecimen(name, nominal, diameter, curve)


def _first_length(texts: Iterable[str]) -> float | None:
    return next((length for text in texts if (length := millimetres_in(text)) is not None), None)


def target_rows(tests: ShearTests, work: bool = False) -> list[str]:
    """Return the target of every grade as a row of YAML, with its `work` if wanted; a comment marks synthetic data."""
    rows = ["# SYNTHETIC data, not measured"] if tests.synthetic else []
    for grade in tests.grades:
        means = {"force": (grade.summary, "N"), "travel": (grade.travel, "mm")}
        if work:
            means |= {"work": (grade.work, "mJ")}
        # rounded as laboratories report forces
        rows.append(row_of(grade.diameter, means, grade.summary.n, lambda v: f"{v:.4g}" if v < 1000 else f"{v:.1f}"))
    return rows


def section_of(rows: Sequence[str]) -> str:
    """Return the `targets` section of a spec with these rows, as YAML."""
    return "".join(["targets:\n", *(f"  {row if row.startswith('#') else f'- {row}'}\n" for row in rows)])


def row_of(
    diameter: float, means: Mapping[str, tuple[Summary, str]], n: int, shown: Callable[[float], str], test: str = ""
) -> str:
    """Return a target as a row of YAML from statistics and unit of each response; `shown` formats their numbers."""
    values = ", ".join(f"{name}: {shown(mean.mean)} {unit}" for name, (mean, unit) in means.items())
    sds = {name: f"{shown(mean.sd)} {unit}" for name, (mean, unit) in means.items() if mean.sd is not None}
    sd = next(iter(sds.values()), "")
    if len(means) > 1:
        sd = f"{{{', '.join(f'{name}: {text}' for name, text in sds.items())}}}" if sds else ""
    of_test = f"test: {test}, " if test else ""
    means_of, rest = f"{{{of_test}diameter: {diameter:g} mm, {values}", f"{sd and f'sd: {sd}, '}n: {n}}}"
    return f"{means_of}, {rest}" if len(means_of) + len(rest) <= _LONGEST_ROW else f"{means_of},\n     {rest}"
