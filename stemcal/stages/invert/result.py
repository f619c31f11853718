"""The result of a calibration: the parameters, other solutions, and their uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from stemcal.doe.calibration.level_set import Assessment
from stemcal.doe.calibration.observations import Scatter
from stemcal.doe.coding import Coding
from stemcal.doe.comparison import Formula
from stemcal.drawing.table import Column, Table
from stemcal.notes import Note
from stemcal.stages.result import Head, Interval, Prediction, StageResult
from stemcal.storage.rows import Rows
from stemcal.storage.typed import absent, inline
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST


@dataclass(frozen=True)
class Point:
    """A point in natural and coded units with its predictions; a saturated surface has no intervals."""

    solution: dict[str, float]
    coded: dict[str, float]
    coded_radius: float
    predicted: float
    mean_interval: Interval | None
    prediction_interval: Interval | None
    inside: bool = True

    @classmethod
    def of(cls, assessed: Assessment, coding: Coding) -> Point:
        """Return an assessed point with its factors by name."""
        natural, coded = coding.to_natural(assessed.coded), dict(zip(coding.names, assessed.coded, strict=True))
        intervals = assessed.mean_interval, assessed.prediction_interval
        point = coding.by_name(natural), coded, assessed.coded_radius, assessed.response
        return cls(*point, *intervals, assessed.inside)


@dataclass(frozen=True)
class ProfileCurve:
    """Rise of the misfit over the values of a factor (its unit), all others free; `allowed` ends the interval."""

    values: tuple[float, ...]
    rise: tuple[float, ...]
    allowed: float


@dataclass(frozen=True)
class PriorRow:
    """What was known of a factor beforehand, in its unit, and from where."""

    factor: str
    mean: float
    sd: float
    unit: str
    source: str


@dataclass(frozen=True, kw_only=True)
class Certainty:
    """What measurements leave possible, all of a joint fit or the target alone: 95 % intervals by profile likelihood.

    `free` factors are those whose interval holds most of their range; along `directions` (coded) nothing measured
    changes, for example by `unseen_changes` (in the factors' `units`). `not_identified` are those and the factors
    that move along such a direction; `loosest` are changes along which the measured values change least. `known_sd`
    is whether standard deviations are treated as known; without `surface_error_known` no run is left over to show
    the error of the surfaces.
    """

    source: Literal["joint", "single"]
    scatter: Scatter
    level: float
    intervals: dict[str, Interval]
    coded_intervals: dict[str, Interval]
    bounded: dict[str, tuple[bool, bool]]
    share: dict[str, float]
    free: tuple[str, ...]
    profiles: dict[str, ProfileCurve]
    not_identified: tuple[str, ...] = ()
    loosest: dict[str, float] = field(default_factory=dict)
    directions: tuple[dict[str, float], ...] = ()
    unseen_changes: tuple[dict[str, float], ...] = ()
    known_sd: bool = False
    surface_error_known: bool = True
    units: dict[str, str]


@dataclass(frozen=True)
class JointRow:
    """A measured mean, the surface's, and error and allowed interval by a fit to the others (of tests: other tests)."""

    condition: float
    response: str
    unit: str
    measured: float
    sd: float | None
    n: int | None
    predicted: float
    error_percent: float
    left_out_error_percent: float | None
    left_out_interval: Interval | None = absent()


@dataclass(frozen=True)
class MeasuredMean:
    """Which measured mean: of a response at a condition."""

    response: str
    condition: float


@dataclass(frozen=True)
class Contradicted:
    """A measured mean that the others contradict: what they allow it to be, and how many standard errors it is off."""

    response: str
    condition: float
    measured: float
    low: float
    high: float
    standard_errors: float
    p: float


@dataclass(frozen=True)
class JointFitted:
    """The result of a joint fit; `rows` are of the force, `further` of the other responses.

    `contradiction` is tested where no degree of freedom is left; `out_of_reach` are means that their own surface takes
    nowhere in the region. `separated` is False where the data leave a direction of the parameters flat.
    """

    rows: Rows[JointRow]
    further: Rows[JointRow]
    scatter: Scatter
    misfit: float | None
    df: int
    p: float | None
    max_abs_error_percent: float
    max_abs_left_out_error_percent: float | None
    formula: Formula | None = None
    contradiction: Contradicted | None = absent()
    out_of_reach: Rows[MeasuredMean] = absent(Rows())
    separated: bool = True


@dataclass(frozen=True, kw_only=True, repr=False)
class InvertResult(StageResult):
    """The calibrated point, the set it was chosen from, the `joint` fit; the values depend on settings `depends_on`."""

    name: ClassVar[str] = "invert"
    shown = ("point.solution",)

    head: Head = inline()
    target: float
    point: Point = inline()
    ranges: dict[str, Interval]
    coded_ranges: dict[str, Interval]
    rule: Literal["least_coded_distance", "others_at_centre", "joint_least_squares"]
    radius: float | None = None
    certainty: Certainty
    condition: float
    target_sd: float | None = None
    target_n: int | None = None
    parameters: dict[str, float]
    depends_on: dict[str, str] | None = absent()
    joint: JointFitted | None = absent()
    priors: Rows[PriorRow] = absent(Rows())
    notes: tuple[Note, ...] = ()

    @classmethod
    def of(cls, study: Study, head: Head, radius: float, point: Point, known: Certainty, **more: Any) -> InvertResult:
        """Return the result for the calibration target; `more` are further fields."""
        target, ranges = study.calibration_target, {"ranges": known.intervals, "coded_ranges": known.coded_intervals}
        return cls(
            head=head,
            target=target.response,
            point=point,
            radius=radius,
            certainty=known,
            condition=target.condition,
            target_sd=target.sd,
            target_n=target.n,
            parameters={**study.midlevels(), **point.solution},
            **(ranges | more),
        )

    @property
    def settles(self) -> Mapping[str, float]:
        return self.parameters

    @property
    def misses(self) -> tuple[float, ...]:
        return () if self.joint is None else tuple(row.error_percent for row in self.joint.rows)

    @property
    def left_out(self) -> dict[float, float | None]:
        """The error of the first response at each fitted condition, predicted from a fit to the others."""
        first = (FIRST, self.naming.response.name)
        rows = () if self.joint is None else self.joint.rows
        return {row.condition: row.left_out_error_percent for row in rows if row.response in first}

    @property
    def prediction(self) -> Prediction | None:
        joint = self.joint
        if joint is None or joint.max_abs_left_out_error_percent is None:
            return None
        condition, several = self.naming.condition, len({row.condition for row in joint.rows}) > 1
        tests = any(row.left_out_interval is not None for row in joint.rows)
        each = "test" if tests else condition.long if condition is not None and several else "response"
        return Prediction(joint.max_abs_left_out_error_percent, joint.formula, in_turn=each)

    def _tables(self) -> dict[str, Table]:
        point = self.point
        rows = [
            (name, value, *self.certainty.intervals[name], point.coded[name], *self.ranges[name])
            for name, value in point.solution.items()
        ]
        keys = ("factor", "solution", "range_low", "range_high", "coded", "exact_low", "exact_high")
        tables = {"invert": Table(tuple(map(Column, keys)), tuple(rows))}
        if self.joint is not None:
            columns = ("condition", "response", "measured", "predicted", "error_percent", "left_out_error_percent")
            tables["invert_responses"] = Table.of(columns, (*self.joint.rows, *self.joint.further))
        return tables
