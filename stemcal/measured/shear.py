"""All shear tests of a campaign: the maximum force of every specimen, and what each grade comes to."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.measured.columns import DIAMETER, FILE, GRADE, find_column, matching
from stemcal.measured.curves import Curve, CurveOptions, read_curve
from stemcal.measured.outliers import Grubbs, grubbs
from stemcal.measured.reading import Form, read_table
from stemcal.measured.samples import Summary, summarise
from stemcal.measured.scaling import PowerLaw, fit_power_law

_SUFFIXES = (".csv", ".txt", ".dat", ".tsv", ".asc")


@dataclass(frozen=True)
class Specimen:
    """One piece of stem: its grade, its diameter (mm) and its curve."""

    name: str
    grade: float
    diameter: float
    curve: Curve
    excluded: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return the specimen in numbers."""
        return {
            "specimen": self.name,
            "grade": self.grade,
            "diameter": self.diameter,
            "max_force": self.curve.max_force,
            "travel_at_max": self.curve.travel_at_max,
            "work_to_max": self.curve.work_to_max,
            "trimmed_points": self.curve.trimmed,
            "excluded": self.excluded,
            "remarks": list(self.curve.remarks),
        }


@dataclass(frozen=True)
class GradeForces:
    """The maximum forces of one grade; a suspect is named, and still counted.

    `travel` (mm) and `work` (mJ) are those from the preload to the maximum.
    """

    diameter: float
    summary: Summary
    travel: Summary
    work: Summary
    test: Grubbs | None
    suspect: str | None

    def as_dict(self) -> dict[str, Any]:
        """Return the grade as JSON values."""
        test = self.test.as_dict() if self.test else None
        beside = {"travel": self.travel.as_dict(), "work": self.work.as_dict()}
        return {"diameter": self.diameter, **self.summary.as_dict(), **beside, "grubbs": test, "suspect": self.suspect}


@dataclass(frozen=True)
class ShearTests:
    """A whole campaign."""

    specimens: tuple[Specimen, ...]
    grades: tuple[GradeForces, ...]
    law: PowerLaw | None
    synthetic: bool

    def as_dict(self) -> dict[str, Any]:
        """Return all as JSON values."""
        return {
            "specimens": [specimen.as_dict() for specimen in self.specimens],
            "grades": [grade.as_dict() for grade in self.grades],
            "power_law": self.law.as_dict() if self.law else None,
            "synthetic": self.synthetic,
        }

    def remarks(self) -> list[str]:
        """Return what a careful reader must know before using the means."""
        said = [
            f"grade {g.diameter:g} mm: specimen {g.suspect} is an outlier by Grubbs' test "
            f"(G = {g.test.statistic:.3f} > {g.test.critical:.3f}, alpha {g.test.alpha:g}); it is counted; leave it "
            f"out with --exclude {g.suspect} if the laboratory book gives a reason"
            for g in self.grades
            if g.test and g.suspect
        ]
        said += [f"{s.name} is left out, as told by --exclude" for s in self.specimens if s.excluded]
        files: dict[str, list[str]] = {}
        for specimen in self.specimens:
            for remark in specimen.curve.remarks:
                files.setdefault(remark, []).append(specimen.name)
        return said + [f"{', '.join(names)}: {remark}" for remark, names in files.items()]


def measure_shear(
    files: Sequence[Path],
    how: CurveOptions = CurveOptions(),
    index: Mapping[str, tuple[float, float | None]] | None = None,
    exclude: Collection[str] = (),
    alpha: float = 0.05,
) -> ShearTests:
    """Read the files of all specimens.

    Parameters
    ----------
    index : mapping, optional
        Diameter and grade (or None) by the name of the file or its stem.
    exclude : collection of str
        Specimens that do not count.
    alpha : float
        Significance level of the test for outliers.
    """
    specimens = tuple(_specimen(path, how, index or {}, exclude) for path in files)
    unknown = set(exclude) - {s.name for s in specimens}
    if unknown:
        raise UsageError(
            f"--exclude {min(unknown)}: no such specimen; there are {', '.join(s.name for s in specimens)}"
        )
    counted = [s for s in specimens if not s.excluded]
    if not counted:
        raise UsageError("no specimen is left to count")
    diameters = sorted({s.grade for s in counted})
    grades = tuple(_grade(d, [s for s in counted if s.grade == d], alpha) for d in diameters)
    law = fit_power_law([s.diameter for s in counted], [s.curve.max_force for s in counted])
    return ShearTests(specimens, grades, law, any(s.curve.synthetic for s in specimens))


def find_files(folder: Path, pattern: str | None = None) -> list[Path]:
    """Return the machine's files in a folder and those below it, sorted by name, 7mm before 10mm."""
    if not folder.is_dir():
        raise UsageError(f"{folder} is no folder; give the one that holds a file per specimen")
    found = folder.rglob(pattern) if pattern else (p for p in folder.rglob("*") if p.suffix.lower() in _SUFFIXES)
    files = sorted(
        (path for path in found if path.is_file() and path.stem.lower() not in ("index", "specimens")), key=_by_number
    )
    if not files:
        books = sum(path.suffix.lower() in (".xls", ".xlsx", ".ods") for path in folder.rglob("*"))
        remedy = f"; save its {books} workbooks as CSV" if books else "; name others with --pattern"
        raise UsageError(f"{folder}: no files {pattern or ', '.join('*' + s for s in _SUFFIXES)} in it{remedy}")
    return files


def _by_number(path: Path) -> list[tuple[bool, float, str]]:
    """Return a key that sorts numbers within names by their value."""
    return [(part.isdigit(), float(part) if part.isdigit() else 0.0, part) for part in re.split(r"(\d+)", str(path))]


def read_index(path: Path, form: Form = Form()) -> dict[str, tuple[float, float | None]]:
    """Return diameter and grade of each file from a table with the columns file, diameter and perhaps grade."""
    table = read_table(path, form)
    name = find_column(table, FILE, "file")
    diameter, grade = find_column(table, DIAMETER, "diameter"), matching(table, GRADE)
    found = {}
    for row, cells in enumerate(table.rows):
        value = table.number(row, diameter)
        if value is None:
            raise UsageError(f"{path}: {cells[name]}: {cells[diameter]!r} is no diameter")
        found[Path(cells[name]).name] = (value, table.number(row, grade[0]) if grade else None)
    return found


def _specimen(
    path: Path, how: CurveOptions, index: Mapping[str, tuple[float, float | None]], exclude: Collection[str]
) -> Specimen:
    try:
        curve = read_curve(path, how)
    except UsageError as error:
        raise UsageError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    listed, grade = index.get(path.name, index.get(path.stem, (None, None)))
    named = named_grade(path)
    diameter = listed or curve.diameter or named
    if diameter is None:
        raise UsageError(
            f"{path}: its diameter is unknown; put it into the name (7mm-1.csv), into a line above the data "
            "(Diameter: 7.02 mm) or into an index file (--index)"
        )
    nominal = grade or named or float(round(diameter))
    return Specimen(path.stem, nominal, diameter, curve, path.stem in exclude)


def named_grade(path: Path) -> float | None:
    """Return the grade in mm that stands in the name of a file or of its folder.

    >>> named_grade(Path("shear/10mm-3.csv")), named_grade(Path("7.5 mm/a.txt")), named_grade(Path("a/b.csv"))
    (10.0, 7.5, None)
    """
    for text in (path.stem, path.parent.name):
        match = re.search(r"(\d+(?:[.,]\d+)?)[ _]?mm", text, re.IGNORECASE)
        if match:
            return float(match[1].replace(",", "."))
    return None


def _grade(diameter: float, specimens: Sequence[Specimen], alpha: float) -> GradeForces:
    forces = [specimen.curve.max_force for specimen in specimens]
    test = grubbs(forces, alpha)
    suspect = specimens[test.index].name if test and test.is_outlier else None
    travel = summarise([specimen.curve.travel_at_max for specimen in specimens])
    work = summarise([specimen.curve.work_to_max for specimen in specimens])
    return GradeForces(diameter, summarise(forces), travel, work, test, suspect)
