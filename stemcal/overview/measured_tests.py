"""Evaluate curves measured in the laboratory tests of a spec, and show measured values in tables."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stemcal.arrays import Array
from stemcal.cutting.result import break_row
from stemcal.drawing.columns import to_decimals
from stemcal.drawing.table import Column, Table
from stemcal.errors import UsageError
from stemcal.formats import fixed, interval, short, signed_probability, significant
from stemcal.measured.cells import quoted
from stemcal.measured.diameters import Diameters
from stemcal.measured.shear import ShearTests, find_files, measure_shear, note_on, row_of
from stemcal.measured.shear_curves import CurveOptions
from stemcal.measured.statistics import Summary, summarise
from stemcal.notes import Note
from stemcal.responses import ForceTravel, known_response
from stemcal.solvers.options import BREAK_DROP
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, inline
from stemcal.study.model.laboratory_kind import LaboratorySection, words_of
from stemcal.study.model.study import Study


@dataclass(frozen=True, kw_only=True)
class _TestedMean(Spread):
    """Statistics of a response of a test at one diameter (mm), in the unit of the response."""

    test: str
    diameter: float
    response: str
    summary: Summary = inline()


@dataclass(frozen=True)
class _MeasuredTests:
    """The means of all tests, notes on them, and the targets of each test as rows of YAML."""

    means: Rows[_TestedMean]
    notes: tuple[Note, ...]
    synthetic: bool
    targets: dict[str, tuple[str, ...]]


def measure_tests(
    study: Study, folder: Path, how: CurveOptions = CurveOptions(), exclude: Collection[str] = ()
) -> _MeasuredTests:
    """Evaluate the curves in the subfolder of each test; the specimens in `exclude` (TEST/SPECIMEN) are left out."""
    there = [test for test in study.tests if (folder / test.name).is_dir()]
    if not there:
        if not study.tests:
            raise UsageError(f"the spec of {study.name} has no `tests` section; add it, or use `stemcal measure shear`")
        if not folder.is_dir():
            raise UsageError(f"{folder} does not exist; specify a folder that contains one subfolder for each test")
        names = ", ".join(test.name for test in study.tests)
        raise UsageError(f"{folder} has no subfolder of a test; name them after the tests of {study.name}: {names}")
    excluded = [specimen.partition("/") for specimen in exclude]
    if unknown := [parts for parts in excluded if parts[0] not in {test.name for test in there}]:
        raise UsageError(
            f"--exclude {''.join(unknown[0])[:60]!r}: no test is named {unknown[0][0][:60]!r}; write TEST/SPECIMEN, "
            f"as in `{there[0].name}/8mm-1`"
        )
    left_out = {test.name: [specimen for name, _, specimen in excluded if name == test.name] for test in there}
    read = {name: measure_shear(find_files(folder / name), how, None, names) for name, names in left_out.items()}
    unread = [path.name for path in sorted(folder.glob("*")) if path.is_dir() and path.name not in read]
    texts = (f"Folder {quoted(name)} was skipped because no test has this name." for name in unread)
    skipped = [Note("folder_skipped", "info", text) for text in texts]
    notes = [note_on((name,), note) for name, tests in read.items() for note in tests.all_notes()]
    means = Rows(mean for test in there for mean in _means(test, read[test.name]))
    return _MeasuredTests(
        means,
        (*skipped, *notes),
        any(tests.synthetic for tests in read.values()),
        {test.name: tuple(_targets(test, [mean for mean in means if mean.test == test.name])) for test in there},
    )


def _means(test: LaboratorySection, read: ShearTests) -> list[_TestedMean]:
    """Return the statistics of each response in the test's targets; without targets, of the usual responses."""
    wanted = test.measured or test.usual
    means = []
    for grade in read.grades:
        tested = []
        for piece in (specimen for specimen in read.specimens if specimen.grade == grade.diameter):
            travel, force, end = piece.curve.travel, piece.curve.force, break_at(piece.curve.force)
            tested.append(ForceTravel.until_break(travel[:end], force[:end], piece.diameter, test.kind))
        for response in (response for response in test.responses if response.name in wanted):
            values = [value for curve in tested if (value := response.value(curve)) is not None]
            if values:
                name, summary = response.name, summarise(values)
                means.append(_TestedMean(test=test.name, diameter=grade.diameter, response=name, summary=summary))
    return means


def break_at(force: Array) -> int:
    """Return the number of points before the break; all if the curve has no break.

    The break is found as in simulated tests, where elements have failed at the break. Failed elements cannot be counted
    in a real test, so the rule applies after the maximum: a drop while the piece settles on its rollers is no break.

    >>> break_at(np.array([0.0, 8.0, 10.0, 7.0, 4.0, 6.0])), break_at(np.array([0.0, 1.0, 2.0]))
    (4, 3)
    """
    peak = int(np.argmax(force))
    row = break_row(force[peak:], np.ones(len(force) - peak, dtype=np.int64), BREAK_DROP)
    return len(force) if row is None else peak + row


def _targets(test: LaboratorySection, means: Sequence[_TestedMean]) -> list[str]:
    lines = []
    for diameter in sorted({mean.diameter for mean in means}):
        at = {mean.response: mean.summary for mean in means if mean.diameter == diameter}
        with_units = {r.name: (at[r.name], r.unit) for r in test.responses if r.name in at}
        n = min(summary.n for summary in at.values())
        lines.append(row_of(diameter, with_units, n, "{:.4g}".format, test.name))
    return lines


def diameter_tables(stems: Diameters) -> list[Table]:
    """Return tables of the statistics of stem diameters and of their grades."""
    summary, test = stems.summary, stems.normality
    normal = "not rejected" if test.p >= 0.05 else "rejected"
    statistics = (
        ("Stems", f"{summary.n}, {stems.readings} readings"),
        ("Mean, mm", f"{summary.mean:.3f} (95 % CI {interval(summary.mean_interval)})"),
        ("Standard deviation, mm", f"{summary.sd:.3f} (95 % CI {interval(summary.sd_interval)})"),
        ("Coefficient of variation, %", fixed(summary.cv_percent, 2)),
        ("Shapiro–Wilk", f"{test.statistic:.4f}, p {signed_probability(test.p)}, normality {normal}"),
    )
    columns = Column("statistic", "Statistic"), Column("value", "Value")
    grades = [
        Column("diameter", "Grade", "mm", short),
        Column("range", "Diameters", "mm", interval, lambda grade: (grade.low, grade.high)),
        Column("count", "Stems", form=format),
        Column("share_percent", "Share", "%", to_decimals(1)),
        Column("fitted_percent", "Fitted", "%", to_decimals(1)),
    ]
    share = f"The grades contain {stems.share_percent:.1f} % of the stems. A grade does not include its upper limit."
    return [Table(columns, statistics, "Stem diameters"), Table.of(grades, stems.grades, "Grades", [share])]


def shear_tables(tests: ShearTests) -> list[Table]:
    """Return tables of the statistics of each grade and of the maximum shear force of every specimen."""
    diameter = Column("diameter", "Diameter", "mm", short)
    grades = [
        diameter,
        Column("n", "n", form=format),
        Column("mean", "Mean", "N", significant),
        Column("sd", "SD", "N", significant),
        Column("cv_percent", "CV", "%", to_decimals(1)),
        Column("mean_interval", "95 % CI of the mean", "N", interval),
    ]
    specimens = [
        Column("name", "Specimen"),
        diameter,
        Column("maximum", "Maximum", "N", significant, lambda piece: piece.curve.max_force),
        Column("travel", "Travel", "mm", fixed, lambda piece: piece.curve.travel_at_max),
        Column("trimmed", "Points trimmed", "", format, lambda piece: piece.curve.trimmed),
    ]
    if any(piece.row()["cutting_energy"] is not None for piece in tests.specimens):
        specimens[4:4] = [
            Column("energy", "Cutting energy", "mJ", significant, lambda piece: piece.row()["cutting_energy"]),
            Column("fracture", "First fracture", "N", significant, lambda piece: piece.row()["first_fracture_force"]),
        ]
    foot = []
    if (law := tests.power_law) is not None:
        ends = "" if law.exponent_interval is None else f" (95 % CI {interval(law.exponent_interval, 3)})"
        formula = f"F = {significant(law.factor, 3)}·d^{law.exponent:.2f}{ends}"
        foot = [f"{formula} with F in N and d in mm (R² = {law.r2:.3f} for the log–log fit)."]
    return [
        Table.of(grades, tests.grades, "Maximum shear force by grade", foot),
        Table.of(specimens, tests.specimens, "Specimens"),
    ]


def tests_table(tests: _MeasuredTests) -> Table:
    """Return a table of the means measured in laboratory tests."""
    columns = [
        Column("test", "Test"),
        Column("diameter", "Diameter", "mm", short),
        Column("response", "Response", of=lambda mean: words_of(known_response(mean.response))),
        Column("n", "n", form=format, of=lambda mean: mean.summary.n),
        Column("mean", "Mean", "", significant, lambda mean: mean.summary.mean),
        Column("sd", "SD", "", significant, lambda mean: mean.summary.sd),
        Column("unit", "Unit", of=lambda mean: known_response(mean.response).unit),
    ]
    return Table.of(columns, tests.means, "Test measurements")
