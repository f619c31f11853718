"""The result of the stage invert: the parameters, other solutions, and the uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from stemcal.doe.calibration.observations import Scatter
from stemcal.doe.calibration.solution_ranges import Assessment
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
    """A point in natural and coded units with predictions; intervals are None if the surface has no residual error."""

    solution: dict[str, float]
    coded: dict[str, float]
    coded_radius: float
    predicted: float
    mean_interval: Interval | None
    prediction_interval: Interval | None
    inside: bool = True

    @classmethod
    def of(cls, assessed: Assessment, coding: Coding) -> Point:
        """Return the point of an assessment, with its factors by name."""
        natural, coded = coding.to_natural(assessed.coded), dict(zip(coding.names, assessed.coded, strict=True))
        intervals = assessed.mean_interval, assessed.prediction_interval
        point = coding.by_name(natural), coded, assessed.coded_radius, assessed.response
        return cls(*point, *intervals, assessed.inside)


@dataclass(frozen=True)
class ProfileCurve:
    """Least misfit at each value of a factor: its `rise` above the minimum, and the rise `allowed` in the interval."""

    values: tuple[float, ...]
    rise: tuple[float, ...]
    allowed: float


@dataclass(frozen=True)
class PriorRow:
    """The prior of a factor in its unit, and its source."""

    factor: str
    mean: float
    sd: float
    unit: str
    source: str


@dataclass(frozen=True, kw_only=True)
class Certainty:
    """Uncertainty of the parameters: 95 % intervals by profile likelihood; `source` is a joint fit or one target.

    `free` factors have an interval over most of their range. Along `directions` (coded), which are the `unseen_changes`
    of the factors in their `units`, the fitted responses do not change to first order. `not_identified` are the factors
    in these directions and the free ones; `loosest` is the change with the least effect on the responses. `known_sd`:
    standard deviations are treated as known; `surface_error_known`: the surfaces have residual degrees of freedom.
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
    """A measured mean and the prediction of its surface at the joint solution.

    The left-out error and interval are from a fit without this mean, or without all means of its test or condition.
    """

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
    """The response and condition of a measured mean."""

    response: str
    condition: float


@dataclass(frozen=True)
class Contradicted:
    """A mean that contradicts the others: they predict it from `low` to `high`, and it is `standard_errors` away."""

    response: str
    condition: float
    measured: float
    low: float
    high: float
    standard_errors: float
    p: float


@dataclass(frozen=True)
class JointFitted:
    """The result of a joint fit: measured means and predictions.

    `rows` has the means of the first response and of responses that the spec declares, `further` the other means.
    `contradiction` is the mean that contradicts the others; `out_of_reach` are means outside the range of their
    surface. `separated` is False if the fit hardly changes along a direction of the parameters.
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
    """The calibrated point, the ranges of all solutions, and the joint fit; valid with the settings `depends_on`."""

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
        """Error (%) of the first response in the cross-validation, by fitted condition."""
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
