"""Measured means, response surfaces, and the fit of the surfaces to the means; shared by stages and verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from math import log

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.likelihood import Fit, Prior, fit
from stemcal.doe.calibration.observations import Observation
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.coding import Coding
from stemcal.doe.regression.anova import AnovaRow, Coefficient
from stemcal.doe.regression.section import AnySurface, Bend, Place, Section, fit_whole
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.runs.record import Outcome
from stemcal.stages.result import CodedScale, DesignRun, DesignRuns, StageResult
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, absent, inline
from stemcal.study.model.measured_targets import Target
from stemcal.study.model.study import Study
from stemcal.vocabulary import CUTTING, FIRST, Variable, Vocabulary, Wording


@dataclass(frozen=True)
class Measured:
    """A measured mean of a response at a condition; means of the same specimens have the same name in `specimens`."""

    condition: float
    response: str
    value: float
    sd: float | None = None
    n: int | None = None
    naming: Vocabulary = CUTTING
    specimens: str = ""

    @property
    def named(self) -> Variable:
        """Name and unit of the response."""
        return self.naming.named(self.response)

    @property
    def leads(self) -> bool:
        """Whether the error of a fit includes the mean: it is of the first response or of one declared in the spec."""
        return self.response == FIRST or self.named in self.naming.others


def measured_of(target: Target, responses: Sequence[str], naming: Vocabulary = CUTTING) -> list[Measured]:
    """Return the measured means of these responses at one condition."""
    return [
        Measured(target.condition, name, mean, sd, target.count_of(name), naming, target.specimens_of(name))
        for name, (mean, sd) in ((name, target.mean_of(name)) for name in responses)
        if mean
    ]


def fit_over(
    measured: Sequence[Measured], surfaces: Sequence[AnySurface], region: Region, priors: Sequence[Prior] = ()
) -> Fit:
    """Fit the factors to measured means, each with its response surface, and to priors, within a region."""
    observations = [
        Observation(s, mean.value, mean.sd, mean.n, mean.response, mean.specimens)
        for mean, s in zip(measured, surfaces, strict=True)
    ]
    return fit(observations, region, priors)


def priors_of(study: Study, coding: Coding) -> tuple[Prior, ...]:
    """Return the priors of the factors of a surface."""
    scales = zip(coding.names, coding.centre, coding.half_step, strict=True)
    return tuple(
        Prior(j, known.mean, known.sd, centre, half_step)
        for j, (name, centre, half_step) in enumerate(scales)
        if (known := study.factor(name).prior) is not None
    )


def measured_means(study: Study) -> list[Measured]:
    """Return the means to fit: every fitted response at every condition of a joint fit, or else a single mean."""
    targets, responses = study.joint_targets or (study.calibration_target,), study.fitted_responses
    return [mean for target in targets for mean in measured_of(target, responses, study.naming)]


@dataclass(frozen=True)
class FactorCoding:
    """A factor of the surface: its coding and range in its unit, its symbol and label."""

    factor: str
    center: float
    half_step: float
    symbol: str
    label: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class FitSummary:
    """Coefficients and statistics of a surface of another response, or at another condition, than the main surface."""

    coefficients: Rows[Coefficient]
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    press: float | None
    cv_percent: float | None
    runs_failed: int
    anova: Rows[AnovaRow] = absent(Rows())

    @classmethod
    def of(cls, fit: Surface, whole: bool) -> FitSummary:
        """Return the summary of a fit; with the analysis of variance if `whole`."""
        values = {each.name: getattr(fit, each.name) for each in fields(cls)}
        return cls(**(values if whole else {**values, "anova": Rows()}))


@dataclass(frozen=True, kw_only=True)
class ConditionRun(Spread):
    """One run of the response surface design at a condition of a joint fit."""

    run: int
    outcome: Outcome = inline()


_Answered = DesignRun | ConditionRun
_Further = Sequence[tuple[Array, float]]  # coded points with their responses


@dataclass(frozen=True, kw_only=True)
class AtCondition(Spread):
    """The runs of the design at one condition of a joint fit; `fit` is of the first response, `responses` of others."""

    condition: float
    runs: Rows[ConditionRun]
    fit: FitSummary = inline()
    responses: dict[str, FitSummary] | None = absent()


@dataclass(frozen=True)
class ConditionAxis:
    """The condition as the last coordinate of one surface over factors and conditions.

    Its coded value is (ln d − center)/half_step if `logarithmic`, otherwise (d − center)/half_step. `at` is the
    condition of the calibration. A factor may grow with a power of the condition: if the exponent is a factor too,
    `growing` maps the name of the first to that of the exponent and the reference condition. `logarithms` are responses
    whose logarithm is fitted. `left_out_percent`: for each response, the errors of left-out runs (root mean square) in
    a fit to the response and in a fit to its logarithm.
    """

    name: str
    center: float
    half_step: float
    logarithmic: bool
    at: float
    growing: dict[str, tuple[str, float]]
    logarithms: tuple[str, ...] = ()
    left_out_percent: dict[str, tuple[float | None, float | None]] = field(default_factory=dict)
    bend: Bend | None = None

    def coded(self, condition: float) -> float:
        return ((log(condition) if self.logarithmic else condition) - self.center) / self.half_step


class Surfaces(StageResult):
    """A result with the response surfaces over the coded factors, for the stages that follow.

    `factors` has the coding of the factors; the surfaces are valid up to the coded distance `radius` from the centre.
    `design` has the runs at the calibration condition, `conditions` those at every condition of a joint fit. With
    `over` there is instead one surface over factors and conditions for each response, all of them fitted to the runs of
    `design`.
    """

    names: tuple[str, ...]
    factors: Rows[FactorCoding]
    coding: dict[str, CodedScale]
    radius: float
    design: DesignRuns
    coefficients: Rows[Coefficient]
    conditions: Rows[AtCondition]
    over: ConditionAxis | None
    deterministic: bool

    @cached_property
    def scales(self) -> Coding:
        names, centre, half_step = zip(*((f.factor, f.center, f.half_step) for f in self.factors), strict=True)
        return Coding(names, centre, half_step)

    @cached_property
    def fitted(self) -> AnySurface:
        """Surface of the first response at the calibration condition."""
        return self.refitted(self.design.runs) if self.over is None else self.section(self.over.at)

    def section(
        self, condition: float, response: str = FIRST, further: Sequence[tuple[float, Array, float]] = ()
    ) -> Section:
        """Return the surface at one condition, also fitted to `further` runs (condition, coded factors, response)."""
        assert self.over is not None
        axis, shared, runs = self.over, self.axes, self.design.runs
        coded = [[run.coded[name] for name in shared] for run in runs]
        coded += [self._place(where).z(x)[0].tolist() for where, x, _ in further]
        values = np.array([run.number(response) for run in runs] + [value for *_, value in further])
        terms = [row.term for row in self.coefficients]
        whole = fit_whole(coded, values, shared, terms, response in axis.logarithms)
        whole = replace(whole, deterministic=True) if self.deterministic else whole
        return Section(whole, self._place(condition), response in axis.logarithms)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the coordinates: all factors or, with `over`, the factors except exponents, then the condition."""
        if self.over is None:
            return self.names
        exponents = {exponent for exponent, _ in self.over.growing.values()}
        return (*(name for name in self.names if name not in exponents), self.over.name)

    def _place(self, condition: float) -> Place:
        assert self.over is not None
        places = {name: j for j, name in enumerate(self.names)}
        grown = self.over.growing.items()
        growing = {places[name]: (places[exponent], log(condition / at)) for name, (exponent, at) in grown}
        return Place(self.scales, self.over.coded(condition), growing)

    def refitted(self, answered: Sequence[_Answered], further: _Further = (), response: str = FIRST) -> Surface:
        """Fit a surface with the same terms to new responses of the runs, in design order, and to `further` points."""
        runs = self.design.runs
        coded = [[run.coded[name] for name in self.names] for run in runs] + [list(map(float, x)) for x, _ in further]
        values = [run.outcome.number(response) for run in answered] + [value for _, value in further]
        written = Wording(self.naming.with_primary(response))
        surface = fit_surface(coded, values, self.names, [row.term for row in self.coefficients], written)
        return replace(surface, deterministic=True) if self.deterministic else surface

    @cached_property
    def region(self) -> Region:
        """Region in which the surface is valid: the ranges of the factors, within `radius`."""
        low, high = ([getattr(entry, end) for entry in self.factors] for end in ("low", "high"))
        return Region(self.scales.to_coded(low), self.scales.to_coded(high), self.radius)

    def factor(self, name: str) -> FactorCoding:
        return next(entry for entry in self.factors if entry.factor == name)


def fitted_surfaces(study: Study, surface: Surfaces, further: Sequence[tuple[Array, Array]] = ()) -> list[AnySurface]:
    """Return the surface of each measured mean, also fitted to `further` points (coded) with the responses there."""
    means = measured_means(study)
    if surface.over is not None:
        points: dict[str, list[tuple[float, Array, float]]] = {mean.response: [] for mean in means}
        for x, y in further:
            for mean, value in zip(means, y.tolist(), strict=True):
                points[mean.response].append((mean.condition, x, value))
        return [surface.section(mean.condition, mean.response, points[mean.response]) for mean in means]
    if not study.joint_targets and not further:
        return [surface.fitted]
    at = {part.condition: part.runs for part in surface.conditions}
    return [
        surface.refitted(
            at[mean.condition] if at else surface.design.runs, [(x, float(y[i])) for x, y in further], mean.response
        )
        for i, mean in enumerate(means)
    ]


def fit_of_study(study: Study, surface: Surfaces) -> Fit:
    """Return the fit of the factors to all fitted means and priors of the study."""
    surfaces, priors = fitted_surfaces(study, surface), priors_of(study, surface.scales)
    return fit_over(measured_means(study), surfaces, surface.region, priors)
