"""What the numbers of a paper say about each other: checks of an audit that need no printed counterpart."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from stemcal.doe.regression.least_squares import f_test, fit_least_squares, not_estimable
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.stages.audit.found import Calibrated, Check, Found
from stemcal.stages.invert.single import assess_published
from stemcal.stages.printed_tables import printed_terms, term_of
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.surface.runs import UnequalRepeats, pure_error_of
from stemcal.study.model import Study

_STRAIN_RATE, EQUATION = "strain_rate_c", "equation: at the printed solution"


def replicates_differ(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Repeated runs of a solver that computes must agree."""
    if study.published is None or study.published.runs != "computed":
        return
    for result in (stages.screen, stages.surface):
        name, found = result.name, pure_error_of(result.design)
        if isinstance(found, UnequalRepeats):
            sentence = (
                f"{found.runs} runs at the same levels gave {found.low:g} to {found.high:g} N. A deterministic solver "
                "gives one force for one set of levels, so these runs differed in something not recorded."
            )
            yield Found(
                f"runs: repeated runs of {name}", "design", "repeated runs differ", "one force", sentence, "method"
            )


def box_leaves_design(study: Study, stages: Calibrated) -> Iterator[Found]:
    """The box that solutions may come from against what the design reaches."""
    for entry in stages.surface.factors:
        factor = study.factor(entry.factor)
        reach = max(abs(run.coded[factor.name]) for run in stages.surface.design.runs)
        ends = [(end - entry.center) / entry.half_step for end in (factor.low, factor.high)]
        if max(map(abs, ends)) > reach + 0.02:
            yield Found(
                f"search box: {factor.name}",
                "extrapolation",
                f"{factor.low:g} to {factor.high:g}",
                f"coded {ends[0]:+.2f} to {ends[1]:+.2f}",
                f"search box: {factor.name} from {factor.low:g} to {factor.high:g} is coded {ends[0]:+.2f} to "
                f"{ends[1]:+.2f}, the runs reach ±{reach:.3f}: beyond them the surface extrapolates",
                "method",
                f"star levels {factor.name}",
            )


def signs_defy_law(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Effects whose sign the law of the material excludes."""
    for factor in study.factors:
        for where, value in _effects(factor.name, stages):
            if factor.expected_sign is not None and value * (1 if factor.expected_sign == "+" else -1) < 0.0:
                yield Found(
                    f"{where}: {factor.name}",
                    "law",
                    f"{value:+.4g} N",
                    f"sign {factor.expected_sign}",
                    f"{where}: {factor.name} acts with {value:+.4g} N, the law asks for the sign "
                    f"{factor.expected_sign}{_law(study, factor.name)}",
                    "conclusion",
                    f"sign of {factor.name}",
                )


def _effects(name: str, stages: Calibrated) -> Iterator[tuple[str, float]]:
    """Yield the effect of a factor where it is significant, by stage."""
    if name in stages.screen.significant:
        yield "screening", stages.screen.effect(name).effect
    test, coefficient = stages.surface.anova_row(name), stages.surface.coefficient(name)
    if test is not None and coefficient is not None and test.p is not None and test.p < 0.05:
        yield "surface", coefficient.value


def _law(study: Study, name: str) -> str:
    """Say what both forms of the strain-rate law give for C, computed over strain rates from 10⁻³ to 10⁴ 1/s."""
    if name != _STRAIN_RATE or "strain_rate_p" not in study.names:
        return ""
    c, p = study.factor(name), study.factor("strain_rate_p")
    rises = [
        (rate / c.high) ** exponent - (rate / c.low) ** exponent
        for rate in (10.0**power for power in range(-3, 5))
        for exponent in (p.low, p.high, 1.0 / p.low, 1.0 / p.high)
    ]
    if max(rises) >= 0.0:
        return ""
    return (
        f": from C = {c.low:g} to {c.high:g} both 1 + (rate/C)^P and 1 + (rate/C)^(1/P) fall at every strain rate "
        "from 0.001 to 10000 1/s"
    )


def interactions_disagree(_study: Study, stages: Calibrated) -> Iterator[Found]:
    """An interaction that screening and surface see with opposite signs."""
    surface = stages.surface
    for a, b in combinations(surface.names, 2):
        term = f"{a}:{b}"
        test, beta = surface.anova_row(term), surface.coefficient(term)
        seen = _screened_interaction(stages.screen, a, b)
        significant = test is not None and (test.p or 1.0) < 0.05
        if significant and beta is not None and seen is not None and seen * beta.value < 0.0:
            yield Found(
                f"interaction: {term}",
                "sign",
                f"{beta.value:+.3g} N",
                f"{seen:+.3g} N",
                f"interaction: {term} is {beta.value:+.3g} N in the surface and {seen:+.3g} N in the screening runs "
                "(fitted beside all main effects): one of the designs sees something else",
                "method",
            )


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
    yield Found(
        EQUATION,
        "value",
        f"{target:g} N",
        f"{by_equation:.2f} N",
        f"equation: at the printed solution the printed coefficients give {by_equation:.2f} N, those of the data "
        f"{point.point.predicted:.2f} N; the target is {target:g} N",
        "result",
        "equation",
    )


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


def solution_is_one_of_many(study: Study, stages: Calibrated) -> list[str]:
    """Remark that one target force cannot fix several parameters."""
    if study.published is None or len(study.published.solution) < 2:
        return []
    ranges = [f"{name} {lo:.4g} to {hi:.4g}" for name, (lo, hi) in stages.inversion.ranges.items()]
    printed = ", ".join(f"{name} {value:g}" for name, value in study.published.solution.items())
    return [
        f"The solution {printed} is one point of a whole set with the same force; inside the design it reaches over "
        f"{'; '.join(ranges)}."
    ]


def stroke_too_short(study: Study, _stages: Calibrated) -> Iterator[Found]:
    """The way of the blade against the stem it is to cut."""
    way, condition = study.loading.speed * study.loading.duration, study.calibration_target.condition
    if way < condition:
        yield Found(
            "loading",
            "setup",
            f"{study.loading.speed * 60:g} mm/min for {study.loading.duration:g} s",
            f"{way:.2f} mm",
            f"loading: {study.loading.speed * 60:g} mm/min for {study.loading.duration:g} s is {way:.2f} mm of travel, "
            f"{100 * way / condition:.0f} % of an {condition:g} mm stem: no cut is completed, and a maximum that comes "
            "later is not seen",
            "method",
        )


SUSPICIONS: tuple[Check, ...] = (
    equation_misses_target,
    replicates_differ,
    box_leaves_design,
    signs_defy_law,
    interactions_disagree,
    stroke_too_short,
)
