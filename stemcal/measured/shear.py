"""All shear tests of a campaign: the maximum force of every specimen, and the statistics of each grade."""

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from stemcal.errors import UsageError
from stemcal.formats import did_you_mean, listed
from stemcal.measured.diameters import checked_diameter
from stemcal.measured.headings import DIAMETER, FILE, GRADE, MILLIMETRES, millimetres_in, quoted
from stemcal.measured.shear_curves import CurveOptions, ShearCurve, read_curves
from stemcal.measured.statistics import Summary, outlier_of, summarise
from stemcal.measured.tables import columns_of, matching, read_table, scale_of
from stemcal.notes import Note, Remedy
from stemcal.power_law import PowerLaw, fit_power_law
from stemcal.responses import CUT, WHOLE_CUT, ForceTravel, known_response
from stemcal.storage.typed import Spread, inline

_SUFFIXES = (".csv", ".txt", ".dat", ".tsv", ".asc", ".tra", ".xlsx", ".xlsm", ".xls")
_MOST = 10  # names in a note
_LONGEST_ROW = 70  # characters of a row in one line


@dataclass(frozen=True)
class TestedSpecimen:
    """One piece of stem: its grade, its diameter (mm) and its curve."""

    name: str
    grade: float
    diameter: float
    curve: ShearCurve

    def row(self) -> dict[str, object]:
        """Return the specimen in numbers by name: N, mm, mJ."""
        c = self.curve
        numbers = {"max_force": c.max_force, "travel_at_max": c.travel_at_max, "work_to_max": c.work_to_max}
        who = {"specimen": self.name, "grade": self.grade, "diameter": self.diameter}
        test = ForceTravel.until_break(c.travel, c.force, self.diameter, CUT)
        whole = {name: known_response(name).value(test) for name in WHOLE_CUT}
        return who | numbers | whole | {"trimmed_points": c.trimmed, "notes": c.notes}


@dataclass(frozen=True, kw_only=True)
class _GradeForces(Spread):
    """The maximum forces of one grade. `travel` (mm) and `work` (mJ) are those from the preload to the maximum."""

    diameter: float
    summary: Summary = inline()
    travel: Summary
    work: Summary


@dataclass(frozen=True)
class ShearTests:
    """A whole campaign without the excluded specimens; `notes` concern no single specimen."""

    specimens: tuple[TestedSpecimen, ...]
    grades: tuple[_GradeForces, ...]
    power_law: PowerLaw | None
    synthetic: bool
    notes: tuple[Note, ...] = ()

    def all_notes(self) -> list[Note]:
        """Return the notes on outliers, specimens, files and the campaign."""
        files: dict[Note, list[str]] = {}
        for specimen in self.specimens:
            for note in specimen.curve.notes:
                files.setdefault(note, []).append(specimen.name)
        return [*self._outliers(), *(note_on(names, note) for note, names in files.items()), *self.notes]

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
    """Return a note with the files, specimens or tests that it concerns."""
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
    """Read the files of all specimens but those to `exclude`.

    The `index` has diameter and grade (or None) by the name of the file or its stem.
    """
    listed = index or {}
    shared = Counter(tail for path in files for tail in _tails(path))
    bases = {path: next((tail for tail in _tails(path) if shared[tail] == 1), str(path)) for path in files}
    for entry in (entry for entry in listed if shared[entry.partition("#")[0]] > 1):
        message = f"--index: {quoted(entry)} is the name of several files; write the folder, as in `7mm/{entry}`"
        raise UsageError(message)
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
    parts = {name: name.partition("#") for name in listed}  # the specimen ``a.csv#1`` may be called ``a#1``
    stems = {name: f"{Path(file).stem}{mark}{label}" for name, (file, mark, label) in parts.items()}
    there = {*shared, *names}
    missing = [name for name, stem in stems.items() if name not in there and stem not in there]
    text = f"The index lists files that do not exist: {_some_of(missing)}."
    notes = (*excluded, *([Note("not_there", "warning", text)] if missing else []))
    return ShearTests(specimens, tuple(grades), law, any(s.curve.synthetic for s in specimens), notes)


def _tails(path: Path) -> list[str]:
    """Return what a file may be called, the shortest first: its name, and with the folders above it.

    >>> _tails(Path("shear/7mm/1.csv"))[:4]
    ['1', '1.csv', '7mm/1', '7mm/1.csv']
    """
    ends = [path.parts[-count:-1] for count in range(1, len(path.parts) + 1)]
    return ["/".join((*end, name)) for end in ends for name in dict.fromkeys((path.stem, path.name))]


def find_files(folder: Path) -> list[Path]:
    """Return the machine's files in a folder and those below it, sorted by name, 7mm before 10mm; a file itself."""
    if folder.is_file():
        return [folder]
    if not folder.is_dir():
        raise UsageError(f"{folder} does not exist; pass a folder of force–travel files or a single file")
    files = [path for path in folder.rglob("*") if path.suffix.lower() in _SUFFIXES and path.is_file()]
    # neither an index nor a temporary file of Excel and others
    own = ("index", "specimens")
    files = [path for path in files if path.stem.lower() not in own and not path.name.startswith(("~$", "."))]
    if not files:
        message = f"{folder}: no files with the extension {listed(_SUFFIXES)} found; add files from the testing machine"
        raise UsageError(message)
    return sorted(files, key=_by_number)


def _by_number(path: Path) -> list[tuple[bool, float, str]]:
    parts = re.split(r"([0-9]+)", str(path))
    return [(place % 2 == 1, float(part) if place % 2 else 0.0, part) for place, part in enumerate(parts)]


def read_index(path: Path) -> dict[str, tuple[float, float | None]]:
    """Return diameter and grade of each file from a table with the columns file, diameter and perhaps grade."""
    table = read_table(path)
    names, diameters, grade = matching(table, FILE), matching(table, DIAMETER, MILLIMETRES), matching(table, GRADE)
    if not names or not diameters:
        raise UsageError(
            f"{path}: the index must have columns `file` and `diameter` (found {columns_of(table)}); rename the columns"
        )
    name, diameter = names[0], diameters[0]
    scale = scale_of(table, diameter, MILLIMETRES, "mm")
    index = {}
    for row, cells in enumerate(table.rows):
        value, place = table.number(row, diameter), f"{path}: {quoted(cells[name])}"
        if value is None:
            raise UsageError(f"{place}: {quoted(cells[diameter])} is not a diameter")
        nominal = table.number(row, grade[0]) if grade else None
        known = checked_diameter(value * scale, place)
        file = cells[name].replace("\\", "/").removeprefix("./")
        index[file] = known, None if nominal is None else checked_diameter(nominal, place)
    return index


def _specimens(
    path: Path, base: str, how: CurveOptions, index: Mapping[str, tuple[float, float | None]]
) -> list[TestedSpecimen]:
    """Return the specimens of one file, which is called `base`."""
    try:
        curves = read_curves(path, how)
    except UsageError as error:
        known = str(path) in str(error) or "--" in str(error)[:2]
        raise UsageError(str(error) if known else f"{path}: {error}") from None
    return [_specimen(path, f"{base}#{c.label}" if c.label else base, c, index) for c in curves]


def _specimen(
    path: Path, name: str, curve: ShearCurve, index: Mapping[str, tuple[float, float | None]]
) -> TestedSpecimen:
    names = _tails(path)[::-1]
    entries = [*(f"{one}#{curve.label}" for one in names), *names]
    listed, grade = next((index[entry] for entry in entries if entry in index), (None, None))
    named = _named_grade(path) if curve.over is None else None
    diameter = next((value for value in (listed, curve.diameter, curve.over, named) if value is not None), None)
    if diameter is None:
        raise UsageError(
            f"{path}: the diameter is unknown; write the diameter in the file name (7mm-1.csv), above the columns "
            "(7.1 mm), above the data (Diameter: 7.02 mm) or in an index file (`--index` of `measure shear`)"
        )
    checked_diameter(diameter, f"{path}: specimen {quoted(name)}")
    nominal = next((value for value in (grade, named) if value is not None), float(round(diameter)))
    checked_diameter(nominal, f"{path}: specimen {quoted(name)}: grade")
    return TestedSpecimen(name, nominal, diameter, curve)


def _named_grade(path: Path) -> float | None:
    """Return the grade in mm in the name of a file or of its folder."""
    return next((found for text in (path.stem, path.parent.name) if (found := millimetres_in(text)) is not None), None)


def target_rows(tests: ShearTests, work: bool = False) -> list[str]:
    """Return a row in YAML for every grade: means (the `work` if asked for), sd, number of specimens; also comments."""
    rows = ["# SYNTHETIC data, not measured"] if tests.synthetic else []
    for grade in tests.grades:
        means = {"force": (grade.summary, "N"), "travel": (grade.travel, "mm")}
        if work:
            means |= {"work": (grade.work, "mJ")}
        rows.append(row_of(grade.diameter, means, grade.summary.n, _short))
    return rows


def section_of(rows: Sequence[str]) -> str:
    """Return the section `targets` with these rows as YAML."""
    return "".join(["targets:\n", *(f"  {row if row.startswith('#') else f'- {row}'}\n" for row in rows)])


def row_of(
    diameter: float, means: Mapping[str, tuple[Summary, str]], n: int, shown: Callable[[float], str], test: str = ""
) -> str:
    """Return a row of YAML for means by response, each with its unit."""
    values = ", ".join(f"{name}: {shown(mean.mean)} {unit}" for name, (mean, unit) in means.items())
    known = {name: f"{shown(mean.sd)} {unit}" for name, (mean, unit) in means.items() if mean.sd is not None}
    sd = next(iter(known.values()), "")
    if len(means) > 1:
        sd = f"{{{', '.join(f'{name}: {one}' for name, one in known.items())}}}" if known else ""
    of_test = f"test: {test}, " if test else ""
    means_of, rest = f"{{{of_test}diameter: {diameter:g} mm, {values}", f"{sd and f'sd: {sd}, '}n: {n}}}"
    return f"{means_of}, {rest}" if len(means_of) + len(rest) <= _LONGEST_ROW else f"{means_of},\n     {rest}"


def _short(value: float) -> str:
    """Return a value with as many digits as a laboratory has."""
    return f"{value:.4g}" if value < 1000 else f"{value:.1f}"
