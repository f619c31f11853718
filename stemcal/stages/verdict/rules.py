"""The rules of the verdict: each looks at the evidence and yields reasons, as notes with a remedy.

A reason of severity ``error`` means not calibrated, one of severity ``warning`` a reservation. The given percentage is
`validate.tolerance_percent`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from stemcal.doe.regression.surface import ROUGH_PERCENT
from stemcal.doe.validation.comparison import ValidationRow
from stemcal.folder.study_folder import StudyFolder
from stemcal.naming import FORCE
from stemcal.note import Note, Remedy, Severity
from stemcal.numbers import signed_probability
from stemcal.stages.invert.result import InvertResult, JointFitted, JointRow
from stemcal.stages.refine.options import refined_here
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.stage import stages_of
from stemcal.stages.verdict import advice, data, words
from stemcal.stages.verdict.data import Evidence
from stemcal.stages.verdict.physics import LIMITS, DoubtAt, DoubtKind, physics_of
from stemcal.stages.verdict.result import Judged, Use, UseThere, Verdict
from stemcal.stages.verdict.trend import trend_of
from stemcal.study.model import Study
from stemcal.words import series

MAJORITY, SOME = 0.5, 0.1
MISSED_PERCENT = 2.0
FAR = 2.0
"""Times its limit from which a doubt of the one calibrated run decides: below, it may be that run's own chance."""
_NEAR_RADIUS, _NEAR_END = 0.98, 0.01
_WITHIN = (
    "Use the parameters only between the measured diameters, or add another kind of test (`tests`), which no such "
    "formula predicts."
)
_BEYOND_DOUBT = 0.001  # p of a contradiction below which no parameters are reported
# What ends a study before its last stage: these reasons say what to do, instead of "not done yet".
_ENDS = ("undeclared_scatter", "probable_unit", "failed_runs", "out_of_reach", "conflict")

Rule = Callable[[Evidence], Iterator[Note]]


def verdict_of(study: Study, folder: StudyFolder, results: Results | None = None) -> Verdict:
    """Judge a study as far as it has come; `results` if they are read already."""
    results = results or fresh_results(study, folder)
    evidence = Evidence(study, results, physics_of(results, folder), folder)
    reasons = [reason for rule in RULES for reason in rule(evidence)]
    if any(reason.kind in _ENDS and reason.severity == "error" for reason in reasons):
        reasons = [reason for reason in reasons if reason.kind != "unfinished"]
    return Verdict.of(reasons, _use(evidence), _use_there(evidence))


# ---- where it may be used


def _use(evidence: Evidence) -> Use | None:
    """Return at which conditions the simulated response agrees, and the largest error; None without a comparison."""
    rows = [row for row in evidence.judged if row.error_percent is not None]
    if not rows or evidence.physics.share > MAJORITY:
        return None
    checked = evidence.validation
    formula = checked.formula if checked is not None else None
    return replace(
        _use_of(evidence, rows),
        held_out=max((row for row in rows if not row.fitted), key=lambda row: row.size, default=None),
        fitted=tuple(dict.fromkeys(row.condition for row in rows if row.fitted)),
        formula_percent=None if formula is None else formula.worst_held_out_percent,
    )


def _use_there(evidence: Evidence) -> UseThere | None:
    """Return at which conditions the refinement in another model agrees."""
    found = evidence.there
    if found is None:
        return None
    rows = [
        Judged(row.response, row.condition, row.error_percent, row.condition == found.condition)
        for row in found.rows
        if row.error_percent is not None
    ]
    return UseThere(found.model.kind, _use_of(evidence, rows)) if rows else None


def _use_of(evidence: Evidence, rows: Sequence[Judged]) -> Use:
    off = [row for row in rows if row.size > evidence.equivalent_percent]
    apart = {row.condition for row in off}
    good = tuple(dict.fromkeys(row.condition for row in rows if row.condition not in apart))
    return Use(evidence.equivalent_percent, good, max(off, key=lambda row: row.size, default=None))


# ---- the rules


def _unfinished(evidence: Evidence) -> Iterator[Note]:
    done = {result.name for result in evidence.results.done}
    missing = [stage for stage in stages_of(evidence.study) if stage.name not in done]
    if missing:
        by_hand = "Write the results into the sheet of the study folder, then `stemcal run SPEC`."
        remedy = Remedy(by_hand if evidence.study.kind.answers == "asks_people" else "`stemcal run SPEC` continues.")
        there_alone = all(stage.seen(evidence.study) is not evidence.study for stage in missing)
        severity: Severity = "warning" if there_alone else "error"
        titles = ", ".join(stage.title for stage in missing)
        yield Note("unfinished", severity, f"Not done yet: {titles}.", remedy)


def _reach(evidence: Evidence) -> Iterator[Note]:
    if any(data.units(evidence)):
        return  # no range corrects a unit
    surface, found, study = evidence.surface, evidence.inversion, evidence.study
    if surface is None:
        return
    if study.joint_targets:
        yield from _conflict(evidence)
        return
    target = study.calibration_target.response
    low, high = advice.reach(surface, study) if found is None else (target, target)
    if not low <= target <= high:
        text = words.out_of_reach(target, low, high, evidence.names)
        yield Note("out_of_reach", "error", text, advice.to_reach(study, surface, target))


def _trend(evidence: Evidence) -> Iterator[Note]:
    """Yield that the error follows the diameter: no other change of the model or the data helps against that."""
    study, surface, found = evidence.study, evidence.surface, evidence.inversion
    if surface is None or found is None or not (study.naming.is_force_on_stems and study.naming.is_cutting):
        return
    joint, checked = found.joint, evidence.validation
    if joint is not None:
        rows = [
            (row.condition, row.measured, row.predicted, _standard_error(row))
            for row in joint.rows
            if row.response == FORCE.name
        ]
        worst = joint.max_abs_error_percent
    elif checked is not None and not evidence.is_given:
        rows = [
            (row.condition, row.measured, row.simulated, _standard_error(row))
            for row in checked.compared
            if row.simulated
        ]
        worst = checked.worst_percent or 0.0
    else:
        return
    law = trend_of(*zip(*rows, strict=True)) if len(rows) > 2 else None
    if law is None or not study.kind.force_history:
        return
    how = "faster" if law.exponent > 0.0 else "more slowly"
    text = (
        f"The error depends on the diameter: the measured force grows {how} than the simulated one, by a factor "
        f"d^{abs(law.exponent):.2f} (largest error {worst:.1f} %)."
    )
    if joint is not None:
        remedy = advice.for_trend(study, surface, found.point.solution)
    else:
        then = "With the surfaces of all of them, stemcal can compute what removes the trend."
        remedy = advice.fit_all(study, "conditions", then)
    yield Note("trend", "error" if evidence.mostly_off else "warning", text, remedy)


def _standard_error(row: JointRow | ValidationRow) -> float | None:
    """Return the standard error of a measured mean as a part of it, None where it is unknown."""
    return None if row.sd is None or row.n is None else row.sd / row.n**0.5 / row.measured


def _conflict(evidence: Evidence) -> Iterator[Note]:
    """Yield which measured mean the others contradict, or that the fit misses one where no scatter is known."""
    found = evidence.inversion
    joint = found.joint if found is not None else None
    if found is None or joint is None or found.priors:
        return
    apart, missed = joint.contradiction, joint.max_abs_error_percent > evidence.equivalent_percent
    if apart is not None:
        one_place = len({row.condition for row in (*joint.rows, *joint.further)}) == 1
        beyond = evidence.mostly_off or (one_place and joint.df < 1 and apart.p < _BEYOND_DOUBT)
        text = words.contradiction(apart, joint, evidence.names)
        yield Note("conflict", "error" if beyond else "warning", text, _of_conflict(evidence, joint))
    elif missed and joint.p is None:
        text = f"The joint fit misses a measured value by {joint.max_abs_error_percent:.0f} %."
        yield Note("conflict", "error" if evidence.mostly_off else "warning", text, _of_conflict(evidence, joint))


def _of_conflict(evidence: Evidence, joint: JointFitted) -> Remedy:
    """Widen a range where a mean is out of reach by itself; if each is reached, no range is changed."""
    surface = evidence.surface
    assert surface is not None and evidence.inversion is not None
    coded = list(evidence.inversion.point.coded.values())
    if joint.out_of_reach and _on_edge(evidence, coded):
        return advice.from_the_edge(evidence.study, surface, coded)
    return advice.to_reconcile(evidence.study, joint)


def _target(evidence: Evidence) -> Iterator[Note]:
    fitted = [row for row in evidence.judged if row.fitted and row.error_percent is not None]
    if not fitted:
        return
    worst = max(fitted, key=lambda row: row.size)
    refine = refined_here(evidence.study)
    tolerance = MISSED_PERCENT if refine is None else max(refine.tolerance_percent, MISSED_PERCENT)
    if worst.size <= (evidence.equivalent_percent if evidence.study.joint_targets else tolerance):
        return
    far = [row for row in fitted if row.size > evidence.equivalent_percent]
    severity: Severity = "error" if len(far) == len(fitted) or evidence.mostly_off else "warning"
    remedy = _refine_more(refine.budget if refine is not None else None)
    if evidence.study.joint_targets:  # no further run reconciles measurements that contradict each other
        remedy = next((conflict.remedy for conflict in _conflict(evidence) if conflict.remedy), remedy)
    yield Note("target_missed", severity, f"{words.miss(worst, evidence.names)}, although it was fitted.", remedy)


def _refine_more(budget: int | None) -> Remedy:
    if budget is None:
        return Remedy("Add `refine: {}` to the spec: it simulates the solution and corrects it.", "refine: {}")
    raised = f"Raise `budget` under `refine` to {2 * budget}, or check whether the response jumps between near points."
    return Remedy(raised, f"refine: {{budget: {2 * budget}}}")


def _physics(evidence: Evidence) -> Iterator[Note]:
    """Yield doubts that make all forces unreliable."""
    return (note for note in _doubts(evidence) if note.severity == "error")


def _some_physics(evidence: Evidence) -> Iterator[Note]:
    """Yield doubts about a few runs: they come after a trend, which such runs do not make."""
    return (note for note in _doubts(evidence) if note.severity == "warning")


def _doubts(evidence: Evidence) -> Iterator[Note]:
    """Yield what is doubtful of many runs; and of runs with the calibrated parameters, unless most are doubtful."""
    found = evidence.physics
    severity: Severity = "error" if found.share > MAJORITY else "warning"
    for doubt in found.doubts if found.share >= SOME else ():
        yield Note("physics", severity, words.doubtful(doubt, found.checked), advice.for_physics(evidence.study, doubt))
    worst: dict[DoubtKind, DoubtAt] = {}
    for at in found.at_solution if found.share <= MAJORITY else ():
        before = worst.get(at.doubt.kind)
        if before is None or (at.fitted, at.doubt.worst or 0.0) > (before.fitted, before.doubt.worst or 0.0):
            worst[at.doubt.kind] = at
    for kind, at in worst.items():
        far = at.doubt.worst is None or at.doubt.worst > FAR * LIMITS[kind]
        text = words.doubtful_solution(at, evidence.names)
        remedy = advice.for_physics(evidence.study, at.doubt)
        yield Note("physics_of_solution", "error" if at.fitted and far else "warning", text, remedy)


def _edge(evidence: Evidence) -> Iterator[Note]:
    surface = evidence.surface
    if surface is None or evidence.inversion is None:
        return
    joint = evidence.inversion.joint
    if joint is not None and any(_conflict(evidence)):
        return  # the rule on the conflict has the remedy
    place = evidence.results.parameters
    coded = surface.scales.to_coded([place[name] for name in surface.names]).tolist()
    if _on_edge(evidence, coded):
        text = "The solution is on the edge of the search region."
        yield Note("on_the_edge", "warning", text, _from_the_edge(evidence, coded))


def _from_the_edge(evidence: Evidence, coded: Sequence[float]) -> Remedy:
    """Widen a range, unless the joint fit is there because of scatter or a flat valley."""
    surface, found = evidence.surface, evidence.inversion
    assert surface is not None and found is not None
    joint, known = found.joint, found.certainty
    if joint is None or known is None or (joint.separated and joint.presses_outwards):
        return advice.from_the_edge(evidence.study, surface, coded)
    return advice.to_identify(evidence.study, known)


def _on_edge(evidence: Evidence, coded: Sequence[float]) -> bool:
    surface = evidence.surface
    assert surface is not None
    radius = sum(value**2 for value in coded) ** 0.5
    region = surface.region(evidence.study)
    ends = zip(coded, region.low.tolist(), region.high.tolist(), strict=True)
    at_end = any(min(value - a, b - value) <= _NEAR_END * (b - a) for value, a, b in ends)
    return at_end or radius >= _NEAR_RADIUS * surface.radius


def _misfit(evidence: Evidence) -> Iterator[Note]:
    found = evidence.inversion
    joint = found.joint if found is not None else None
    if found is None or joint is None or joint.p is None or joint.misfit is None or joint.p >= 0.05:
        return
    if joint.contradiction is not None and not found.priors:
        return  # the conflict names it
    beyond = bool(found.priors) and joint.p < _BEYOND_DOUBT
    times, p = joint.misfit / joint.df, signed_probability(joint.p)
    text = f"The misfit is {times:.1f} times that expected from the scatter of the measurements (p {p})."
    remedy = _check_prior(found) or advice.to_reconcile(evidence.study, joint)
    yield Note("misfit", "error" if beyond else "warning", text, remedy)


def _check_prior(found: InvertResult) -> Remedy | None:
    """Return the remedy for the prior that is farthest from the solution, in its standard deviations."""
    solution = found.point.solution
    worst = max(found.priors, key=lambda prior: abs(solution[prior.factor] - prior.mean) / prior.sd, default=None)
    if worst is None:
        return None
    check = f"Check the prior of {worst.factor} against its source ({worst.source}), its unit and its test"
    return Remedy(f"{check}; then check the model, or leave the prior out.")


def _validation(evidence: Evidence) -> Iterator[Note]:
    study = evidence.study
    if evidence.validation is None:
        return
    if evidence.is_given:
        text = "The validation is read from a sheet, not simulated with these parameters."
        yield Note("validation_from_table", "warning", text, Remedy("Validate with a solver that simulates."))
        return
    held_out = [row for row in evidence.judged if not row.fitted]
    failed = tuple(row.condition for row in held_out if row.error_percent is None)
    if failed:
        names = evidence.names
        text = f"The validation has no {names.response.long}{names.at(*failed)}: the run failed."
        yield Note("validation_failed", "warning", text, Remedy("`stemcal run SPEC --retry` repeats failed runs."))
    off = [row for row in held_out if row.size > evidence.equivalent_percent]
    if off:
        worst = max(off, key=lambda row: row.size)
        left_out = worst.response not in (study.naming.response.name, *study.fitted_responses)
        until = "Until then use the result only where it agrees."
        remedy = advice.fit_all(study, "responses" if left_out else "conditions", until)
        if not left_out and advice.chose_conditions(study):  # no advice undoes an earlier one
            remedy = Remedy("Use the result only where it agrees, or add a factor that the error depends on.")
        severity: Severity = "error" if evidence.mostly_off else "warning"
        yield Note("validation", severity, f"{words.miss(worst, evidence.names)}.", remedy)
    if not held_out and not _left_out(evidence):
        yield Note("unchecked", "warning", "No independent measurement checks the result.", advice.measure_more(study))


def _formula(evidence: Evidence) -> Iterator[Note]:
    """Yield a reservation where a formula predicts what was not fitted, or was left out in turn, at least as well."""
    checked, found = evidence.validation, evidence.inversion
    if checked is None or evidence.is_given:
        return
    joint, formula = found.joint if found is not None else None, checked.formula
    if formula is not None and checked.no_better_than_formula:
        held_out = f"{formula.worst_held_out_percent:.1f} %, the model within {checked.worst_held_out_percent:.1f} %"
        text = f"The formula F = a·d^{formula.exponent:.3g} predicts the held-out diameters within {held_out}."
    elif (
        not checked.held_out
        and joint is not None
        and joint.null is not None
        and joint.null.beaten_by(joint.max_abs_left_out_error_percent) is False
    ):
        text = words.left_out_by_formula(joint)
    else:
        return
    yield Note("no_better_than_formula", "warning", text, Remedy(_WITHIN))


def _left_out(evidence: Evidence) -> bool:
    """Whether what is left out of a joint fit in turn is predicted within the percentage."""
    found = evidence.inversion
    error = found.joint.max_abs_left_out_error_percent if found is not None and found.joint is not None else None
    return error is not None and error <= evidence.equivalent_percent


def _identified(evidence: Evidence) -> Iterator[Note]:
    found = evidence.inversion
    known = None if found is None else found.certainty
    if known is None or not known.not_identified:
        return
    text = words.not_identified(known)
    yield Note("not_identified", "warning", text, advice.to_identify(evidence.study, known))


def _signs(evidence: Evidence) -> Iterator[Note]:
    against = tuple(
        factor.name
        for factor in evidence.study.factors
        if factor.expected_sign and _sign_found(evidence, factor.name) == {"+": "-", "-": "+"}[factor.expected_sign]
    )
    if against:
        text = f"The effect of {series(against)} has the opposite sign to the expected one."
        remedy = Remedy(f"Check {series(against)} in the model: the law, the units and `expected_sign`.")
        yield Note("sign_against_expectation", "warning", text, remedy)


def _sign_found(evidence: Evidence, factor: str) -> str | None:
    """Return the sign of an effect that is sure: by the interval of the surface's slope, else by the screening."""
    surface, screen = evidence.surface, evidence.screen
    slope = None if surface is None else surface.coefficient(factor)
    if slope is not None and slope.low is not None and slope.high is not None and slope.low * slope.high > 0.0:
        return "+" if slope.value > 0.0 else "-"
    if screen is not None and factor in screen.significant:
        return "+" if screen.effect(factor).effect > 0.0 else "-"
    return None


def _there(evidence: Evidence) -> Iterator[Note]:
    found = evidence.there
    if found is None or found.converged:
        return
    budget, factors = 2 * found.budget, series([one.factor for one in found.adjusted])
    wider = f"give {factors} a wider range under `refine.adjust`"
    remedies = {
        "budget": Remedy(f"Raise `refine.budget` to {budget}, or {wider}.", f"refine: {{budget: {budget}}}"),
        "out_of_reach": Remedy(f"{wider.capitalize()}, or add another factor there."),
    }
    aim = "the measured one" if found.aims_at_measured else "that of the study's own model"
    missed = f"differs from {aim} by {abs(found.error_percent):.1f} %."
    text = f"In {found.model.kind} the {evidence.names.response.long} {missed}"
    smoother = Remedy("Average over mesh positions in `refine.in`, or adjust another factor.")
    yield Note("missed_there", "warning", text, remedies.get(found.stopped, smoother))


def _rough(evidence: Evidence) -> Iterator[Note]:
    surface = evidence.surface
    if surface is None:
        return
    if not surface.without_scatter:
        return
    if (cv := surface.cv_percent) is not None and abs(cv) > ROUGH_PERCENT:
        text = (
            f"Repeated runs agree exactly, but the surface deviates from its runs by {abs(cv):.1f} %: the response is "
            f"not smooth, or not quadratic."
        )
        yield Note("rough_response", "warning", text, advice.to_smooth(evidence.study, surface, _levels(evidence)))


def _levels(evidence: Evidence) -> dict[str, float] | None:
    return None if evidence.inversion is None else evidence.results.parameters


RULES: tuple[Rule, ...] = (
    data.chance,
    data.units,
    data.failed_runs,
    _physics,
    _unfinished,
    _trend,
    _some_physics,
    _reach,
    _signs,
    _rough,
    _target,
    _misfit,
    _validation,
    _formula,
    data.few_runs,
    _identified,
    _edge,
    _there,
)
"""In the order in which their reasons are given, and so their advice: data, physics, reach, model, identification."""
