"""The rows of a sheet that are not taken: a kind for each reason, with where the row stands and what it says."""

from stemcal.files.typed import Tagged


class Refused(Tagged):
    """A row that is not taken: where it stands, which run it names."""

    place: str
    run: str


class UnknownRun(Refused):
    """No run of the study is called so."""


class OtherStudy(Refused):
    """The row is of another study's sheet, which may ask for runs of the same names and levels."""

    given: str
    own: str


class OtherReplicate(Refused):
    """The run has no such replicate."""

    replicate: str


class SeveralMeant(Refused):
    """Several runs are called so, and neither condition nor replicate tells which is meant."""


class OtherLevels(Refused):
    """The run was asked for at another level, or another condition."""

    name: str
    given: str
    asked: float
    unit: str


class Unreadable(Refused):
    """A cell holds no number, for this reason."""

    response: str
    given: str
    why: str
    unit: str
    wanted: str
    readings: tuple[float, ...] = ()


class Incomplete(Refused):
    """A response is missing beside the others."""

    response: str


class FailedWithValue(Refused):
    """The run is said to have failed and to have given a value."""


class NoReason(Refused):
    """The run is said to have failed, not why."""


class BrokenRow(Refused):
    """The row has more cells than the heading, so that nobody knows which belongs where."""


class ToldTwice(Refused):
    """Two rows tell different results of the run."""

    other: str


class KnownOtherwise(Refused):
    """Another result of the run was entered before."""

    given: str
    known: str
    who: str
    when: str


class NothingToWithdraw(Refused):
    """The run has no result that could be withdrawn."""


class FarOff(Refused):
    """A value is far from all others at the same condition."""

    response: str
    value: float
    low: float
    high: float
    count: int
