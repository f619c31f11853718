"""Rules of the verdict on the calibration: trend with the diameter, contradictions, misfit, edges, identifiability."""

from collections.abc import Iterator, Sequence
from math import isfinite

import numpy as np

from stemcal.doe.calibration.search_region import extremes
from stemcal.doe.comparison import standard_error
from stemcal.formats import change, counted, interval, series, short, signed_probability
from stemcal.notes import Note, Remedy, Severity
from stemcal.stages.fitting import Surfaces, fit_over, fitted_surfaces, measured_means
from stemcal.stages.invert.options import chose_conditions
from stemcal.stages.invert.result import Certainty, Contradicted, InvertResult, JointFitted, Point
from stemcal.stages.stage import calibrating
from stemcal.stages.verdict import advice, words
from stemcal.stages.verdict.direction_advice import direction_reason
from stemcal.stages.verdict.trend_advice import for_trend, trend_reason
from stemcal.stages.verdict.verdict_rules import BEYOND_DOUBT, Evidence, Rank, ranked
from stemcal.vocabulary import FIRST, Wording

_MISSED_PERCENT = 2.0  # smallest error of a fitted value that is reported
_SAME_SIDE = 0.25  # share of the largest error up to which an error of the other sign is ignored
_NEAR_RADIUS, _NEAR_END = 0.98, 0.01  # share of the radius, and distance from a range end, of the edge


@ranked(Rank.TREND)
def anisotropy(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the tests along and across the axis require different moduli of an isotropic model."""
    surface, solved = evidence.of(Surfaces), evidence.of(InvertResult)
    if surface is not None and solved is not None:
        yield from direction_reason(evidence, surface, solved.point.solution)


@ranked(Rank.TREND)
def trend(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the errors of a joint fit have a trend with the diameter."""
    study, surface, solved = evidence.study, evidence.of(Surfaces), evidence.of(InvertResult)
    if surface is None or solved is None or solved.joint is None:
        return
    if _all_out_of_reach(evidence, surface, solved.point, solved.joint) is not None:
        return  # wider factor ranges are advised first
    rows = [
        (row.condition, row.measured, row.predicted, standard_error(row.measured, row.sd, row.n))
        for row in solved.joint.rows
        if row.response == study.naming.response.name
    ]
    worst, solution = solved.joint.max_abs_error_percent, solved.point.solution
    reasons = list(trend_reason(evidence, rows, worst, lambda: for_trend(study, surface, solution)))
    if reasons and solved.priors:  # the rule `misfit` reports a trend that the priors cause
        means = measured_means(study)
        free = fit_over(means, fitted_surfaces(study, surface), surface.region)
        values = dict(zip([(mean.response, mean.condition) for mean in means], free.predict(free.best)[0], strict=True))
        rows = [(at, measured, float(values[FIRST, at]), error) for at, measured, _, error in rows]
        reasons = reasons if any(trend_reason(evidence, rows, worst, lambda: Remedy(""))) else []
    yield from reasons


@ranked(Rank.REACH)
def conflict(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if a measured mean contradicts the others, or the error is large and the scatter is unknown."""
    surface, solved = evidence.of(Surfaces), evidence.of(InvertResult)
    if surface is None or solved is None or (joint := solved.joint) is None:
        return
    if solved.priors or any(anisotropy(evidence)):
        return
    apart, beyond, kind = joint.contradiction, evidence.mostly_off, "conflict"
    if apart is None and (joint.p is not None or joint.max_abs_error_percent <= evidence.equivalent_percent):
        return
    if (reach := _all_out_of_reach(evidence, surface, solved.point, joint)) is not None:
        kind, text = "out_of_reach", reach
    elif apart is None:
        text = f"The largest error of the joint fit is {joint.max_abs_error_percent:.0f} %."
    else:
        one_place = len({row.condition for row in (*joint.rows, *joint.further)}) == 1
        beyond = beyond or (one_place and joint.df < 1 and apart.p < BEYOND_DOUBT)
        text = _contradiction(apart, evidence.names)
    remedy, coded = _to_reconcile(evidence, joint, solved), list(solved.point.coded.values())
    if joint.out_of_reach and _on_edge(surface, coded):  # if each mean can be reached, wider ranges do not help
        remedy = advice.from_the_edge(evidence.study, surface, coded, joint=True)
    yield Note(kind, "error" if beyond else "warning", text, remedy)


def _all_out_of_reach(evidence: Evidence, surface: Surfaces, point: Point, joint: JointFitted) -> str | None:
    """Return a sentence if the errors have one sign because the factor ranges do not reach some means, else None."""
    errors = [row.error_percent for row in (*joint.rows, *joint.further)]
    worst = max(errors, key=abs)
    if any(error * worst < -_SAME_SIDE * worst**2 for error in errors):
        return None
    if not (joint.out_of_reach and _on_edge(surface, list(point.coded.values()))):
        return None
    names, places = evidence.names, [(mean.response, mean.condition) for mean in joint.out_of_reach]
    for mean, fitted in zip(measured_means(evidence.study), fitted_surfaces(evidence.study, surface), strict=True):
        if (mean.named.name, mean.condition) == places[0]:
            low, high = (float(fitted.predict(end)[0]) for end in extremes(fitted, surface.region))
            count = f"{len(places)} of {counted(len(errors), 'measured value')}"
            return (
                f"The factor ranges are too narrow for {count}: the {mean.named.long}{names.at(mean.condition)} is "
                f"{mean.named.text(mean.value, '.4g')}, but the ranges allow only "
                f"{interval((low, high))}{mean.named.unit_suffix}."
            )
    return None


def _contradiction(apart: Contradicted, names: Wording) -> str:
    named = names.naming.named(apart.response)
    values = (named.table_value(value, apart.measured) for value in (apart.measured, apart.low, apart.high))
    measured, low, high = (f"{short(value, 4)}{named.unit_suffix}" for value in values)
    return (
        f"The measured {named.long}{names.at(apart.condition)} ({measured}) contradicts the other measurements, which "
        f"predict a value between {low} and {high} (difference: {apart.standard_errors:.1f} standard errors)."
    )


@ranked(Rank.IDENTIFICATION)
def on_the_edge(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the solution is on the edge of the search region, unless `conflict` has a remedy already."""
    surface, solved = evidence.of(Surfaces), evidence.of(InvertResult)
    if surface is None or solved is None:
        return
    if solved.joint is not None and (any(conflict(evidence)) or any(anisotropy(evidence))):
        return  # these rules have a remedy
    place = evidence.results.parameters
    coded = surface.scales.to_coded([place[name] for name in surface.names]).tolist()
    if _on_edge(surface, coded):
        joint = solved.joint is not None and not solved.priors
        remedy = advice.from_the_edge(evidence.study, surface, coded, joint)
        if solved.joint is not None and not solved.joint.separated:  # the misfit is almost constant up to the edge
            remedy = _to_identify(evidence, solved.certainty)
        yield Note("on_the_edge", "warning", "The solution is at the limit of the search range.", remedy)


def _on_edge(surface: Surfaces, coded: Sequence[float]) -> bool:
    radius = sum(value**2 for value in coded) ** 0.5
    region = surface.region
    ends = zip(coded, region.low.tolist(), region.high.tolist(), strict=True)
    at_end = any(min(value - a, b - value) <= _NEAR_END * (b - a) for value, a, b in ends)
    return at_end or radius >= _NEAR_RADIUS * surface.radius


@ranked(Rank.MODEL)
def misfit(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the fit misses the means by more than their scatter, also when any one of them is left out."""
    solved = evidence.of(InvertResult)
    joint = solved.joint if solved is not None else None
    if solved is None or joint is None or joint.p is None or joint.misfit is None or joint.p >= 0.05:
        return
    if (joint.contradiction is not None and not solved.priors) or any(anisotropy(evidence)):
        return  # reported by the rule `conflict`
    beyond = bool(solved.priors) and joint.p < BEYOND_DOUBT
    times, p = joint.misfit / joint.df, signed_probability(joint.p)
    text = f"The misfit is {times:.1f} times the value expected from the scatter of the measurements (p {p})."
    remedy, solution = _to_reconcile(evidence, joint, solved), solved.point.solution
    if solved.priors:  # name the prior farthest from the solution in standard deviations
        prior = max(solved.priors, key=lambda prior: abs(solution[prior.factor] - prior.mean) / prior.sd)
        unit = f"the unit of the prior for {prior.factor}"
        remedy = Remedy(f"Check the source ({prior.source}) and {unit}, or remove the prior.")
    yield Note("misfit", "error" if beyond else "warning", text, remedy)


@ranked(Rank.IDENTIFICATION)
def not_identified(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the measurements do not determine some factors, or some combinations of factors."""
    solved = evidence.of(InvertResult)
    if solved is not None and (known := solved.certainty).not_identified:
        factors = series(known.not_identified, "or")
        changes = [change(name, size, known.units[name]) for name, size in known.loosest.items()]
        hardly = f" because the fitted responses hardly depend on {factors}."
        if len(changes) > 1:
            hardly = f". If {series(changes)}, the fitted responses hardly change."
        text = f"The fit does not determine {factors}{hardly}"
        yield Note("not_identified", "warning", text, _to_identify(evidence, known))


@ranked(Rank.MODEL)
def target_missed(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the largest error of a simulation at a fitted value exceeds the tolerance."""
    fitted = [row for row in evidence.judged if row.fitted and row.error_percent is not None]
    if not fitted:
        return
    worst = max(fitted, key=lambda row: row.size)
    last = calibrating(evidence.study)
    options = None if last.name == InvertResult.name else last.options(evidence.study)  # options of the refinement
    tolerance = _MISSED_PERCENT if options is None else max(options.tolerance_percent, _MISSED_PERCENT)
    if worst.size <= (evidence.equivalent_percent if evidence.study.joint_targets else tolerance):
        return
    far = [row for row in fitted if row.size > evidence.equivalent_percent]
    severity: Severity = "error" if len(far) == len(fitted) or evidence.mostly_off else "warning"
    remedy = Remedy("Add `refine: {}` to the spec to correct the solution by simulation.", "refine: {}")
    if options is not None:
        more, check = 2 * options.budget, "check whether the response is discontinuous between neighbouring points"
        remedy = Remedy(f"Raise `refine.budget` to {more}, or {check}.", f"refine: {{budget: {more}}}")
    if evidence.study.joint_targets:  # further runs cannot resolve a contradiction between measurements
        reasons = [*anisotropy(evidence), *conflict(evidence)]
        remedy = next((reason.remedy for reason in reasons if reason.remedy), remedy)
    text = f"{words.miss(worst, evidence.names)}, although this measurement was included in the fit."
    yield Note("target_missed", severity, text, remedy)


def _to_identify(evidence: Evidence, known: Certainty) -> Remedy:
    """Return the remedy for undetermined factors: fit more data, or add a prior of the least certain factor."""
    study = evidence.study
    free = list(known.not_identified or known.share)
    without = [name for name in free if study.factor(name).prior is None]
    widest = max(without or free, key=lambda name: known.share[name])
    prior = f", or add a prior for {widest} from the literature" if without else ""
    measure = f"measure another response{',' if prior else ' or'} perform another kind of test{prior}."
    returned = study.naming.further if study.kind.gives_curve else study.naming.others
    left_out = [named.name for named in returned if named.name not in study.fitted_responses]
    if any(_within_reach(evidence, name) for name in left_out):
        return advice.fit_all(study, "responses", f"If {widest} remains undetermined, {measure}")
    if len(study.targets.means) > max(len(study.joint_targets), 1) and not chose_conditions(study):
        return advice.fit_all(study, "conditions", f"If {widest} remains undetermined, {measure}")
    curve = ""
    if len(known.loosest) > 1:
        changes = series(change(name, size, known.units[name]) for name, size in known.loosest.items())
        curve = f", and the sets that fit equally well: they change together ({changes})"
    publish = f"Without new data, publish the 95 % confidence intervals instead of single values{curve}."
    return Remedy(f"{measure[:1].upper()}{measure[1:]} {publish}")


def _within_reach(evidence: Evidence, response: str) -> bool:
    mean, sd = evidence.study.calibration_target.mean_of(response)
    surface = evidence.of(Surfaces)
    if mean is None or surface is None:
        return False
    values = [value for run in surface.design.runs if isfinite(value := run.number(response))]
    return bool(values) and min(values) - 2.0 * (sd or 0.0) <= mean <= max(values) + 2.0 * (sd or 0.0)


def _to_reconcile(evidence: Evidence, joint: JointFitted, solved: InvertResult) -> Remedy:
    study, surface = evidence.study, evidence.of(Surfaces)
    conditions = {row.condition for row in (*joint.rows, *joint.further)}
    apart = joint.contradiction
    if len(conditions) > 1 and apart is not None:
        name, at = study.naming.named(apart.response).long, Wording(study.naming).at(apart.condition)
        errors = [row.error_percent for row in sorted(joint.rows, key=lambda row: row.condition)]
        steps, then = np.diff(errors), f"add a factor that affects the {name}{at}."
        if surface is not None and len(errors) > 2 and (np.all(steps > 0.0) or np.all(steps < 0.0)):
            grown = for_trend(study, surface, solved.point.solution).text
            then = f"{grown[:1].lower()}{grown[1:]}"
        return Remedy(
            f"Check the unit of the measured {name}{at}, the specimens and the testing machine. Then repeat the "
            f"measurement. If the measured value is confirmed, {then}"
        )
    if len(conditions) > 1:
        return Remedy("Check the measurements. If the measured values are confirmed, add a factor to the model.")
    return Remedy("Check the measurements. Then add another factor, or fit fewer responses (`invert.responses`).")


RULES = (anisotropy, trend, conflict, target_missed, misfit, not_identified, on_the_edge)
