"""What a verdict says: its word, where the result may be used, each reason, and what mends it."""

from typing import Any

from stemcal.files.durable import plain
from stemcal.files.typed import to_json
from stemcal.numbers import fixed
from stemcal.stages.base import stage_called
from stemcal.stages.verdict import advice, rules
from stemcal.stages.verdict.result import Judged, Use, UseThere, Verdict
from stemcal.text.calibration import change, counted
from stemcal.text.language import say, say_number
from stemcal.text.names import Names, program
from stemcal.text.notes import sentence, states


def word(verdict: Verdict) -> str:
    """Return the verdict as people read it."""
    words = {
        "calibrated": say("Calibrated"),
        "with_reservations": say("Calibrated, with reservations"),
        "not_calibrated": say("Not calibrated"),
    }
    return words[verdict.verdict]


def lines(verdict: Verdict, names: Names) -> list[str]:
    """Return it in three lines at most: the word with its first reason, where it may be used, the next step."""
    more = len(verdict.reasons) - 1
    one, many = "({count} more reason: `stemcal status SPEC`.)", "({count} more reasons: `stemcal status SPEC`.)"
    rest = [say_number(one, many, more)] if more > 0 else []
    return [
        " ".join([opening(verdict, names), *rest]),
        *([" ".join(where)] if (where := uses(verdict, names)) else []),
        *(say("Next: {remedy}", remedy=sentence(reason.remedy, names)) for reason in verdict.reasons[:1]),
    ]


def in_full(verdict: Verdict, names: Names) -> list[str]:
    """Return the word, where it may be used, and every reason with what mends it."""
    each = [
        say("{number}. {reason} Next: {remedy}", number=number, reason=said, remedy=remedy)
        for number, reason in enumerate(verdict.reasons, 1)
        for said, remedy in [(sentence(reason, names), sentence(reason.remedy, names))]
    ]
    where = uses(verdict, names)
    return [say("{verdict}.", verdict=word(verdict)), *([" ".join(where)] if where else []), *each]


def opening(verdict: Verdict, names: Names) -> str:
    """Return the word and the first reason."""
    first = [sentence(reason, names) for reason in verdict.reasons[:1]]
    return " ".join([say("{verdict}.", verdict=word(verdict)), *first])


def verdict_json(verdict: Verdict, names: Names) -> dict[str, Any]:
    """Return the verdict as commands print it: facts, and with each the sentence that it makes."""
    where = verdict.use
    there = verdict.there
    reasons = [{**to_json(reason), "text": sentence(reason, names)} for reason in verdict.reasons]
    for said, reason in zip(reasons, verdict.reasons, strict=True):
        said["remedy"] |= {"text": sentence(reason.remedy, names)}
    facts = {
        "verdict": verdict.verdict,
        "verdict_use": None if where is None else {**to_json(where), "text": use(where, names)},
        "reasons": reasons,
    }
    if there is not None:
        facts["verdict_use_there"] = {**to_json(there), "text": use_there(there, names)}
    content: dict[str, Any] = plain(facts)
    return content


# ---- where it may be used


def uses(verdict: Verdict, names: Names) -> list[str]:
    """Say where the result may be used, here and in the program of a transfer."""
    here = [use(verdict.use, names)] if verdict.use is not None else []
    return [*here, *([use_there(verdict.there, names)] if verdict.there is not None else [])]


def use_there(where: UseThere, names: Names) -> str:
    """Say at which conditions the response agrees in the program of a transfer, and what is off most."""
    good = "Good in {there} (within {within:g} %) at {good:conditions}."
    none = "In {there} not within {within:g} % anywhere."
    if not names.placed:
        good, none = "Good in {there} (within {within:g} %).", "In {there} not within {within:g} %."
    fields = {"there": program(where.solver), "within": where.use.within_percent, "good": where.use.good}
    said = names.say(good if where.use.good else none, **fields)
    worst = where.use.worst
    return said if worst is None else f"{said} {say('Worst there: {miss}.', miss=miss(worst, names))}"


def use(where: Use, names: Names) -> str:
    """Say at which conditions the simulated response agrees, and what is off most."""
    if names.placed:
        good = "Good (within {within:g} %) at {good:conditions}."
        none = "Good (within {within:g} %) at no measured value of the {condition}."
    else:
        good, none = "Good (within {within:g} %).", "Not within {within:g} %."
    fields = {"within": where.within_percent, "good": where.good, "condition": names.condition.long}
    said = names.say(good if where.good else none, **fields)
    if where.worst is None:
        return said
    worst = say("Worst: {response}, {miss}.", response=_response(where.worst, names), miss=miss(where.worst, names))
    return f"{said} {worst}"


def miss(worst: Judged, names: Names) -> str:
    """Say how far a simulated response is off, and to which side.

    >>> miss(Judged("force", 11.0, 42.0, fitted=False), Names())
    '42 % low at 11 mm'
    """
    low, high = "{size} % low at {condition:condition}", "{size} % high at {condition:condition}"
    if not names.placed:
        low, high = "{size} % low", "{size} % high"
    error = worst.error_percent or 0.0
    return names.say(low if error > 0.0 else high, size=_size(error), condition=worst.condition)


def _response(judged: Judged, names: Names) -> str:
    return names.naming.named(judged.response).long


def _size(percent: float) -> str:
    """Write a size in percent, with a decimal below 10.

    >>> _size(-42.3), _size(4.23)
    ('42', '4.2')
    """
    return fixed(abs(percent), 0 if abs(percent) >= 10.0 else 1)


# ---- reasons


states(
    rules.TransferMissed,
    {
        "measured": "In {solver:program} the {names.response.long} is {missed_percent:.1f} % from the measured one.",
        "study": "In {solver:program} the {names.response.long} is {missed_percent:.1f} % from that of the study's own "
        "solver.",
    },
    by="aims_at",
)
states(rules.OnTheEdge, "The solution lies on the edge of the region searched.")
states(rules.Misfit, "The misfit is {times:.1f} times what the measured scatter explains (p {p:p}).")
states(rules.ValidationFromTable, "The validation is read from a table, not simulated with these parameters.")
states(rules.Unchecked, "Nothing checks the result independently.")
states(
    rules.Unfinished,
    "Not done yet: {titles}.",
    titles=lambda reason, _names: ", ".join(stage_called(name).title for name in reason.stages),
)


@sentence.register
def _(reason: rules.Conflict, names: Names) -> str:
    found = reason.contradiction
    if found is None:
        worst = "No parameters within the ranges bring all errors below {least_error_percent:.0f} %."
        return names.say(worst, least_error_percent=reason.least_error_percent)
    placed = (
        "The measured {response} at {condition:condition}, {measured}, contradicts what else is fitted: that allows "
        "{low} to {high}, {standard_errors:.1f} standard errors off."
    )
    plain = (
        "The measured {response}, {measured}, contradicts what else is fitted: that allows {low} to {high}, "
        "{standard_errors:.1f} standard errors off."
    )
    named = names.naming.named(found.response)
    values = {end: counted(named, getattr(found, end), found.measured) for end in ("measured", "low", "high")}
    fields = {"condition": found.condition, "standard_errors": found.standard_errors, **values}
    return names.say(placed if names.placed else plain, response=named.long, **fields)


states(
    rules.OutOfReach,
    "The measured {target:response g} is above what the ranges reach, {low:.4g} to {high:response}.",
    otherwise="The measured {target:response g} is below what the ranges reach, {low:.4g} to {high:response}.",
    by=lambda reason: reason.target > reason.high,
)
states(
    rules.TargetMissed,
    "The simulated {response} misses the value that it was fitted to: {miss}.",
    response=lambda reason, names: _response(reason.worst, names),
    miss=lambda reason, names: miss(reason.worst, names),
)
states(
    rules.ValidationFailed,
    "The validation has no {names.response.long} at {conditions:conditions}: the run failed.",
    otherwise="The validation has no {names.response.long}: the run failed.",
    by="names.placed",
)
states(
    rules.CheckMissed,
    "The simulated {response} is {miss}.",
    response=lambda reason, names: _response(reason.worst, names),
    miss=lambda reason, names: miss(reason.worst, names),
)
states(
    rules.DoubtfulPhysics,
    {
        "hourglass": "In {doubt.runs} of {checked} runs the physics is doubtful: hourglass energy up to {worst} %.",
        "inertia": "In {doubt.runs} of {checked} runs the physics is doubtful: inertia carries up to {worst} % of the "
        "force.",
        "drift": "In {doubt.runs} of {checked} runs the physics is doubtful: the energy balance drifts by up to "
        "{worst} %.",
        "stroke": "In {doubt.runs} of {checked} runs the physics is doubtful: the force was not clearly past its "
        "maximum when the stroke ended.",
    },
    by="doubt.kind",
    worst=lambda reason, _names: _size(reason.doubt.worst or 0.0),
)


@sentence.register
def _(reason: rules.SolutionDoubtful, names: Names) -> str:
    somewhere = {
        "hourglass": "With the calibrated parameters hourglass energy is {worst} % at {condition:condition}: above "
        "10 % the force may be a third off, above 20 % a half.",
        "inertia": "With the calibrated parameters inertia carries {worst} % of the force at {condition:condition}.",
        "drift": "With the calibrated parameters the energy balance drifts by {worst} % at {condition:condition}.",
        "stroke": "With the calibrated parameters the force was not clearly past its maximum when the stroke ended at "
        "{condition:condition}.",
    }
    nowhere = {
        "hourglass": "With the calibrated parameters hourglass energy is {worst} %: above 10 % the force may be a "
        "third off, above 20 % a half.",
        "inertia": "With the calibrated parameters inertia carries {worst} % of the force.",
        "drift": "With the calibrated parameters the energy balance drifts by {worst} %.",
        "stroke": "With the calibrated parameters the force was not clearly past its maximum when the stroke ended.",
    }
    template = (somewhere if names.placed else nowhere)[reason.at.doubt.kind]
    return names.say(template, worst=_size(reason.at.doubt.worst or 0.0), condition=reason.at.condition)


@sentence.register
def _(reason: rules.NotIdentified, names: Names) -> str:
    together = [change(name, size, reason.units[name], names) for name, size in reason.changes.items()]
    combination = (
        "Not identified: {factors:factors}. One combination is known, not each: {changes:all} together change hardly "
        "anything that was fitted."
    )
    alone = "Not identified: {factors:factors}. What was fitted hardly changes with it."
    return names.say(combination if len(together) > 1 else alone, factors=reason.factors, changes=together)


states(
    rules.SignAgainstExpectation,
    "The effect of {factors:factors} has the other sign than the study expects.",
)
states(
    rules.RoughResponse,
    "Equal inputs give equal answers, but the surface misses its runs by {cv_percent:.1f} %: the response is rough, or "
    "no quadratic follows it.",
)


# ---- remedies


states(advice.ContinueStudy, "`stemcal run SPEC` goes on.")
states(advice.EnterResults, "Do the runs of the sheet, then `stemcal enter SPEC SHEET`; `stemcal run SPEC` writes it.")
states(advice.VaryAnother, "Vary a further factor: {factor:factor} is at the end of what it can be.")
states(advice.AddRefinement, "Add `refine: {{}}` to the spec: it simulates at the solution and corrects it.")
states(
    advice.RaiseBudget,
    "Raise `budget` under `refine` to {budget}, or look whether the response jumps between neighbouring points.",
)
states(
    advice.MendTransfer,
    {
        "budget": "Raise `budget` under `transfer` to {budget}, or give {factors:factors} a wider range under `adjust` "
        "there.",
        "out_of_reach": "Give {factors:factors} a wider range, or name a further factor, under `adjust` of `transfer`.",
        "settled": "Take the mean over places of the mesh there (`phases` of the embedded solver), or another factor.",
    },
    by="stopped",
)
states(advice.SimulateValidation, "Validate with a solver that simulates.")
states(advice.RetryValidation, "`stemcal run SPEC --retry`.")
states(
    advice.IntegrateFully,
    {
        "": "`element: full` under `solver` has no hourglass energy, at about 20 times the time.",
        "size": "`element: full` under `solver` has no hourglass energy, at about 20 times the time; `element_size: "
        "{finer.element_size}` may bring it under {limit_percent:g} %, at about {finer.times:g} times.",
        "both": "`element: full` under `solver` has no hourglass energy, at about 20 times the time; `element_size: "
        "{finer.element_size}` and `time_step: {finer.time_step:g} us` may bring it under "
        "{limit_percent:g} %, at about {finer.times:g} times.",
    },
    by=lambda remedy: "" if remedy.finer is None else "size" if remedy.finer.time_step is None else "both",
)
states(advice.LengthenStroke, "`duration: {duration:g} s` under `loading` doubles the stroke.")
states(
    advice.CheckModel,
    "Check {factors:factors} in the model: the law, the units, and the `expected_sign` of the spec.",
)


states(
    advice.SmoothResponse,
    {
        "phases": "`phases: {phases}` under `solver` averages over places of the mesh; or add runs: `rsm: "
        "{{extra_runs: 4}}`.",
        "replicates": "`replicates: {replicates}` under `solver` averages over chance; or add runs: `rsm: "
        "{{extra_runs: 4}}`.",
        "": "Add runs: `rsm: {{extra_runs: 4}}`, or make the response smoother.",
    },
    by=lambda remedy: "phases" if remedy.phases else "replicates" if remedy.replicates else "",
)


states(
    advice.Identify,
    {
        "responses": "`invert: {{responses: all}}` fits what else was measured; if that is not enough, measure another "
        "response or another kind of test, or give {factor:factor} a prior from the literature.",
        "conditions": "`invert: {{{key}: all}}` fits all that was measured; if that is not enough, measure another "
        "response or another kind of test, or give {factor:factor} a prior from the literature.",
        None: "Measure another response or another kind of test, or give {factor:factor} a prior from the literature.",
    },
    by="unfitted",
    key=lambda _remedy, names: names.naming.fitted_at.partition(".")[2],
)
states(
    advice.WidenRange,
    {"high": "Raise `high` of {factor:factor} to about {to}.", "low": "Lower `low` of {factor:factor} to about {to}."},
    by="end",
    to=lambda remedy, _names: f"{remedy.value:g} {remedy.unit}".removesuffix(" 1"),
)
states(
    advice.NoRangeReaches,
    "The range of {factors:factors} alone does not reach it; check units, loading and specimen.",
    otherwise="The range of {factors:factors} alone does not reach it; check units and what the simulation holds "
    "fixed.",
    by="names.naming.is_cutting",
)
states(
    advice.CheckPrior,
    "Check the prior of {factor:factor} against its source ({source}), its unit and the test it is from; then the "
    "model, or leave the prior out.",
)


@sentence.register
def _(remedy: advice.FitFewer, names: Names) -> str:
    conditions = (
        "Vary a further factor, or fit only the {condition} of use (`{key}`): the model does not follow all that was "
        "measured."
    )
    responses = (
        "Check these measurements; then vary a further factor, or fit fewer responses (`invert.responses`): the model "
        "does not follow all that was measured."
    )
    template = conditions if names.placed and remedy.over == "conditions" else responses
    return names.say(template, condition=names.condition.long, key=names.naming.fitted_at)


states(
    advice.FitAll,
    {
        "responses": "`invert: {{responses: all}}` fits all responses together; until then use the result where it is "
        "good.",
        "conditions": "`invert: {{{key}: all}}` fits all of them together; until then use the result where it is good.",
    },
    by="over",
    key=lambda _remedy, names: names.naming.fitted_at.partition(".")[2],
)


@sentence.register
def _(remedy: advice.MeasureMore, names: Names) -> str:
    fewer = "Measure at another {condition}, or leave one out of `{fitted_at}`."
    more = "Measure at another {condition}."
    other = "Measure under another condition too, or a further response that `invert.responses` leaves out."
    template = other if not names.placed else fewer if remedy.fitted > 1 else more
    return names.say(template, condition=names.condition.long, fitted_at=names.naming.fitted_at)


states(
    advice.MendInput,
    {
        "inertia": "Mend it in the solver's own input: less mass scaling or a slower blade.",
        "hourglass": "Mend it in the solver's own input: a finer mesh or fully integrated elements.",
        "drift": "Mend it in the solver's own input: a smaller time step.",
        "stroke": "Mend it in the solver's own input: a longer stroke.",
    },
    by="doubt",
)
states(
    advice.ScaleMassLess,
    "`mass_scaling: {mass_scaling:g}` and `time_step: {time_step:g} us` under `solver` bring inertia under "
    "{limit_percent:g} % in most runs, at about {times:g} times the time.",
    otherwise="`mass_scaling: {mass_scaling:g}` under `solver` brings inertia under {limit_percent:g} % in most runs, "
    "at about {times:g} times the time.",
    by="time_step",
)
states(
    advice.HalveTimeStep,
    "`time_step_safety: {time_step_safety:g}` and `time_step: {time_step:g} us` under `solver` halve the time step.",
    otherwise="`time_step_safety: {time_step_safety:g}` under `solver` halves the time step.",
    by="time_step",
)
