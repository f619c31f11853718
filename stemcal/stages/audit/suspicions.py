"""What the numbers of a paper say about each other: checks of an audit that need no printed counterpart."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from stemcal.doe.regression.least_squares import f_test, fit_least_squares, not_estimable
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.files.typed import absent
from stemcal.notes import Note
from stemcal.stages.audit.found import Calibrated, Check, Found
from stemcal.stages.invert.stage import assess_published
from stemcal.stages.printed_tables import Contradiction, printed_terms, term_of
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.surface.runs import UnequalRepeats, pure_error_of
from stemcal.study.model import Study

_STRAIN_RATE = "strain_rate_c"


class RepeatsDiffer(Contradiction):
    """Runs of a stage at the same levels gave different responses, though a solver computed them."""

    stage: str
    runs: int
    low: float
    high: float


class BoxLeavesDesign(Contradiction):
    """A factor may be searched from `low` to `high`, beyond what the runs reach, in coded units too."""

    factor: str
    low: float
    high: float
    coded_low: float
    coded_high: float
    reach: float


class SignDefiesLaw(Contradiction):
    """A significant effect in a stage has the sign that the law excludes.

    `falls_over` is the range of C where both forms of the strain-rate law fall all along it.
    """

    stage: str
    factor: str
    effect: float
    expected: str
    falls_over: tuple[float, float] | None = absent()


class InteractionsDisagree(Contradiction):
    """Surface and screening see an interaction with opposite signs."""

    term: str
    surface: float
    screening: float

    @property
    def of_sign(self) -> bool:
        """It is about the sign."""
        return True


class EquationMissesTarget(Contradiction):
    """What the printed coefficients, and those of the data, give at the printed solution."""

    by_equation: float
    by_data: float
    target: float


class BladeStopsShort(Contradiction):
    """The blade (speed in mm/s, duration in s) travels less than the stem is thick, mm."""

    speed: float
    duration: float
    travel: float
    condition: float


class OneOfMany(Note):
    """The printed solution is one point of a set with the same response, which inside the design has these ranges."""

    solution: dict[str, float]
    ranges: dict[str, tuple[float, float]]


def replicates_differ(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Repeated runs of a solver that computes must agree."""
    if study.published is None or study.published.runs != "computed":
        return
    for result in (stages.screen, stages.surface):
        found = pure_error_of(result.design)
        if isinstance(found, UnequalRepeats):
            yield Found(RepeatsDiffer(result.name, found.runs, found.low, found.high), "method")


def box_leaves_design(study: Study, stages: Calibrated) -> Iterator[Found]:
    """The box that solutions may come from against what the design reaches."""
    for entry in stages.surface.factors:
        factor = study.factor(entry.factor)
        reach = max(abs(run.coded[factor.name]) for run in stages.surface.design.runs)
        low, high = ((end - entry.center) / entry.half_step for end in (factor.low, factor.high))
        if max(abs(low), abs(high)) > reach + 0.02:
            box = BoxLeavesDesign(factor.name, factor.low, factor.high, low, high, reach)
            yield Found(box, "method", f"star:{factor.name}")


def signs_defy_law(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Effects whose sign the law of the material excludes."""
    for factor in study.factors:
        for stage, value in _effects(factor.name, stages):
            if factor.expected_sign is not None and value * (1 if factor.expected_sign == "+" else -1) < 0.0:
                falls = _falls_over(study, factor.name)
                sign = SignDefiesLaw(stage, factor.name, value, factor.expected_sign, falls)
                yield Found(sign, "conclusion", f"sign:{factor.name}")


def _effects(name: str, stages: Calibrated) -> Iterator[tuple[str, float]]:
    """Yield the effect of a factor where it is significant, by stage."""
    if name in stages.screen.significant:
        yield stages.screen.name, stages.screen.effect(name).effect
    test, coefficient = stages.surface.anova_row(name), stages.surface.coefficient(name)
    if test is not None and coefficient is not None and test.p is not None and test.p < 0.05:
        yield stages.surface.name, coefficient.value


def _falls_over(study: Study, name: str) -> tuple[float, float] | None:
    """Return C's range if both forms of the law fall along it at every strain rate from 10⁻³ to 10⁴ 1/s."""
    if name != _STRAIN_RATE or "strain_rate_p" not in study.names:
        return None
    c, p = study.factor(name), study.factor("strain_rate_p")
    rises = [
        (rate / c.high) ** exponent - (rate / c.low) ** exponent
        for rate in (10.0**power for power in range(-3, 5))
        for exponent in (p.low, p.high, 1.0 / p.low, 1.0 / p.high)
    ]
    return (c.low, c.high) if max(rises) < 0.0 else None


def interactions_disagree(_study: Study, stages: Calibrated) -> Iterator[Found]:
    """An interaction that screening and surface see with opposite signs."""
    surface = stages.surface
    for a, b in combinations(surface.names, 2):
        term = f"{a}:{b}"
        test, beta = surface.anova_row(term), surface.coefficient(term)
        seen = _screened_interaction(stages.screen, a, b)
        significant = test is not None and (test.p or 1.0) < 0.05
        if significant and beta is not None and seen is not None and seen * beta.value < 0.0:
            yield Found(InteractionsDisagree(term, beta.value, seen), "method")


def _screened_interaction(screen: ScreenResult, a: str, b: str) -> float | None:
    """Return the coefficient of a·b from the screening runs, fitted beside all main effects, which it is aliased with.

    None where it cannot be estimated, or is not told apart from the residual that is left (95 %).
    """
    runs, names = [run for run in screen.design.runs if run.response is not None], screen.design.varied
    main = np.array([[run.coded[name] for name in names] for run in runs])
    product = main[:, names.index(a)] * main[:, names.index(b)]
    matrix = np.column_stack([np.ones(len(runs)), main, product])
    if len(runs) <= matrix.shape[1] or not_estimable(matrix, ("1", *names, "ab")):
        return None
    fit = fit_least_squares(matrix, np.array([run.response for run in runs], dtype=float))
    test = f_test(float(fit.partial_ss[-1]), 1, fit.mean_square, fit.df)
    return float(fit.coefficients[-1]) if test is None or test[1] < 0.05 else None


def equation_misses_target(study: Study, stages: Calibrated) -> Iterator[Found]:
    """The printed equation at the printed solution against the target it was solved for."""
    published = study.published
    if published is None or published.coefficients is None or not published.solution:
        return
    target = study.calibration_target.response
    by_equation = _printed_prediction(study, stages.surface)
    point, _ = assess_published(study, stages.surface)
    if by_equation is None or point is None or abs(by_equation - target) <= 0.005 * target:
        return
    yield Found(EquationMissesTarget(by_equation, point.point.predicted, target), "result", "equation")


def _printed_prediction(study: Study, surface: SurfaceResult) -> float | None:
    """Evaluate the printed equation at the printed solution; None if a term is missing."""
    coding, published = surface.scales, study.published
    if published is None or published.coefficients is None or any(n not in published.solution for n in coding.names):
        return None
    printed = printed_terms(study, published.coefficients)
    beta = [printed.get(term_of(study, term)) for term in term_names(coding.names)]
    if any(value is None for value in beta):
        return None
    point = coding.to_coded([published.solution[name] for name in coding.names])
    return float(sum(b * column for b, column in zip(beta, term_columns(point)[0], strict=True) if b is not None))


def solution_is_one_of_many(study: Study, stages: Calibrated) -> list[Note]:
    """Note that one target cannot fix several parameters."""
    if study.published is None or len(study.published.solution) < 2:
        return []
    return [OneOfMany(dict(study.published.solution), dict(stages.inversion.ranges))]


def stroke_too_short(study: Study, _stages: Calibrated) -> Iterator[Found]:
    """The way of the blade against the stem it is to cut."""
    loading, condition = study.loading, study.calibration_target.condition
    travel = loading.speed * loading.duration
    if travel < condition:
        yield Found(BladeStopsShort(loading.speed, loading.duration, travel, condition), "method")


SUSPICIONS: tuple[Check, ...] = (
    equation_misses_target,
    replicates_differ,
    box_leaves_design,
    signs_defy_law,
    interactions_disagree,
    stroke_too_short,
)
