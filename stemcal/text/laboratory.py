"""What is said of a laboratory's files, and of a virtual test beside what was measured."""

from collections.abc import Sequence

from stemcal.measured import remarks as lab
from stemcal.numbers import significant
from stemcal.study.model.measured_targets import Mean
from stemcal.text.language import all_of, say
from stemcal.text.names import Names
from stemcal.text.notes import sentence, states

_MOST = 10


def remark_text(remark: lab.LabRemark) -> str:
    """Return a remark as a sentence."""
    return sentence(remark, Names())


def response_text(value: float | None, unit: str, measured: Mean | None, at_least: bool = False) -> str:
    """Return a response of a virtual test, which its curve may lack or only bound, and what was measured.

    >>> response_text(41.234, "N/mm", Mean(value=42.1, sd=2.5, n=10))
    '41.23 N/mm, measured 42.1 ± 2.5 N/mm'
    """
    there = "at least {value} {unit}" if at_least else "{value} {unit}"
    told = say("not on this curve") if value is None else say(there, value=significant(value), unit=unit)
    if measured is None:
        return told
    target = f"{measured.value:g}" if measured.sd is None else f"{measured.value:g} ± {measured.sd:g}"
    return say("{told}, measured {target} {unit}", told=told, target=target, unit=unit)


states(
    lab.RowsLeftOut,
    "{rows} row without numbers for force or displacement is left out",
    "{rows} rows without numbers for force or displacement are left out",
    by="rows",
)
states(
    lab.RowsApart,
    "{rows} more row of numbers lies apart from the curve in the file and is not read",
    "{rows} more rows of numbers lie apart from the curve in the file and are not read",
    by="rows",
)
states(lab.SheetSkipped, "sheet {sheet} holds no curve and is not read")
states(
    lab.FolderSkipped,
    {False: "folder {folder} is not read: no test has this name", True: "folder {folder} is not read beside {taken}"},
    by=lambda note: bool(note.taken),
)
states(lab.SideBySide, "{specimens} specimens side by side")
states(
    lab.SharedDisplacement,
    "{specimens} specimens share the displacement {column}; if they are channels of one, name the one that counts with "
    "--force-column",
)
states(lab.SpeedUnused, "the file has a displacement, --speed is not used")
states(lab.DisplacementFromTime, "displacement is time {column} times {speed:g} mm/s")
states(lab.PressingIsPositive, "force counted positive in pressing")
states(lab.LargestAtEnd, "the force is largest at the last point: the test may have ended before the maximum")
states(
    lab.Outlier,
    "grade {grade:g} mm: specimen {specimen} is an outlier by Grubbs' test (G = {statistic:.3f} > {critical:.3f}, "
    "alpha {alpha:g}); it is still included; --exclude leaves it out if the laboratory book gives a reason",
)
states(lab.Excluded, "{specimen} is left out, as --exclude asks")
states(
    lab.NearGrades,
    "grades {lower:g} and {upper:g} mm differ by less than 3 % and are counted apart; if they are one, write one of "
    "them into the names of both, or into the column grade of an index",
)
states(
    lab.PreloadOfWeakStems,
    "the preload of {preload:g} N is {percent:.0f} % of the maximum at {grade:g} mm, {force:.3g} N: travel and work "
    "are counted from there only, the maximum is as measured; --preload {lower:.1g} is a hundredth of it",
    percent=lambda remark, _names: 100.0 * remark.preload / remark.force,
    lower=lambda remark, _names: 0.01 * remark.force,
)
states(lab.EqualNames, "{names:all} have one name: one specimen twice? leave one out with --exclude")
states(
    lab.ColumnChosen,
    {
        "force": "force from {column}, not {rest}; --force-column takes another",
        "displacement": "displacement from {column}, not {rest}; --displacement-column takes another",
    },
    by="quantity",
    rest=lambda remark, _names: ", ".join(remark.others),
)
states(
    lab.OfFiles,
    "{files}: {said}",
    files=lambda remark, _names: _some_of(remark.names),
    said=lambda remark, names: sentence(remark.remark, names),
)
states(
    lab.NotThere,
    "the index names {missing}, which is not there",
    "the index names {missing}, which are not there",
    by=lambda remark: remark.names,
    missing=lambda remark, _names: _some_of(remark.names),
)
states(
    lab.EqualCurves,
    "{specimens} hold the same curve; leave one out with --exclude",
    specimens=lambda remark, _names: all_of(remark.names[:_MOST]),
)


def _some_of(names: Sequence[str]) -> str:
    """List names, of many the first."""
    if len(names) <= _MOST:
        return ", ".join(names)
    return say("{first} and {more} more", first=", ".join(names[:_MOST]), more=len(names) - _MOST)
