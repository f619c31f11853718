"""The outcome of a refinement, its errors and its notes."""

from collections.abc import Iterator

from stemcal.naming import Names, program
from stemcal.note import Note, Remedy
from stemcal.numbers import significant
from stemcal.stages.refine.result import RefineResult
from stemcal.study.model import Study
from stemcal.words import counted


def outcome(stage: RefineResult, names: Names) -> list[str]:
    """Return what the refinement changed, and the error that is left."""
    if stage.elsewhere:
        return _there(stage, names)
    count = len(stage.made)
    runs = "Solution checked in 1 run" if count == 1 else f"Solution corrected in {count} runs"
    error = f"{abs(stage.error_percent):.2f} %, {'' if stage.converged else 'not '}within the tolerance of"
    return [f"{runs}: the error is {error} {stage.tolerance_percent:g} %."]


def _there(stage: RefineResult, names: Names) -> list[str]:
    row, there = stage.fitted, program(stage.model.kind)
    if row.after is None:
        return []
    target = f"the target is {names.quantity(stage.aim)}"
    moved = [one for one in stage.adjusted if one.value != one.calibrated]
    if not moved:
        return [f"In {there} the calibrated parameters give {names.quantity(row.after)}; {target}."]
    values = ", ".join(f"{names.factor(one.factor)} {significant(one.value)}" for one in moved)
    before = "" if row.before is None else f", the calibrated values give {names.quantity(row.before)}"
    return [f"For {there}: {values}. These give {names.quantity(row.after)}{before}; {target}."]


def certainty(stage: RefineResult, names: Names) -> list[str]:
    """Return how large the errors are in another model."""
    if not stage.elsewhere or stage.max_abs_error_percent is None:
        return []
    at = [row.condition for row in stage.rows if row.error_percent is not None]
    where = f" ({names.conditions(at)})" if names.placed else ""
    return [f"In {program(stage.model.kind)} the largest error is {stage.max_abs_error_percent:.1f} %{where}."]


def shortfall(stage: RefineResult) -> str:
    """Return how far from the target a refinement ended that did not reach it."""
    return f"refine: {abs(stage.error_percent):.2f} % from the target after {counted(len(stage.made), 'run')}"


# ---- notes


def notes_of(stage: RefineResult, study: Study) -> list[Note]:
    """Return why the target was not reached, where the surface was wrong, and what is missing in another model."""
    names = Names(stage.naming)
    return [
        *_not_reached(stage, names),
        *_first_outside(stage, names),
        *(_in_another_model(stage, study, names) if stage.elsewhere else _found_by_simulation(stage)),
    ]


def _not_reached(stage: RefineResult, names: Names) -> Iterator[Note]:
    if stage.stopped == "tolerance":
        return
    missed, response = abs(stage.error_percent), names.response.long
    factors = names.factors(one.factor for one in stage.adjusted)
    still = f"The {response} is still {missed:.2f} % from the target; the best point is kept."
    text, remedy = {
        (False, "budget"): (
            still,
            f"Raise refine.budget, or check whether the {response} jumps between neighbouring points.",
        ),
        (False, "settled"): (
            f"The error is {missed:.2f} %, and no parameters nearby reduce it. The rest is model error or measurement "
            f"scatter.",
            "",
        ),
        (True, "budget"): (still, f"Raise refine.budget, or give {factors} a wider range under refine.adjust."),
        (True, "out_of_reach"): (
            f"The {response} is {missed:.1f} % from the target at the limit of the range of {factors}.",
            "Give it a wider range, or add another factor, under refine.adjust.",
        ),
        (True, "settled"): (
            f"The {response} is {missed:.1f} % from the target, and smaller steps do not help: it jumps, or does not "
            f"depend on {factors}.",
            "Average over several positions of the mesh (`replicates` of the embedded solver), or adjust another "
            "factor.",
        ),
    }[stage.elsewhere, stage.stopped]
    yield Note("not_reached", "warning", text, Remedy(remedy) if remedy else None)


def _first_outside(stage: RefineResult, names: Names) -> Iterator[Note]:
    """Compare the runs of the first point, the solution of the surface, with their prediction intervals."""
    first = [run for run in stage.made if run.levels == stage.made[0].levels and run.how == stage.made[0].how]
    if outside := [run.condition for run in first if run.inside_interval is False]:
        where = f" ({names.conditions(outside)})" if names.placed else ""
        text = (
            f"At the solution of the surface the simulated {names.response.long} is outside its prediction "
            f"interval{where}: the surface is less accurate there than its residuals indicate."
        )
        yield Note("first_outside", "warning", text)


def _found_by_simulation(stage: RefineResult) -> Iterator[Note]:
    if stage.parameters != stage.made[0].levels:
        text = "The parameters are results of the refinement, not of `invert.rule`."
        yield Note("found_by_simulation", "info", text)


def _in_another_model(stage: RefineResult, study: Study, names: Names) -> Iterator[Note]:
    for one in stage.adjusted:
        factor = study.factor(one.factor)
        if not factor.low <= one.value <= factor.high:
            text = (
                f"{one.factor} {one.value:.4g} is outside the study's range ({factor.low:g} to {factor.high:g}); that "
                "range is for the study's own model."
            )
            yield Note("beyond_range", "warning", text)
    if censored := sum(run.outcome.censored for run in stage.made):
        bounds = "it is a lower bound" if censored == 1 else "they are lower bounds"
        runs = counted(censored, "run")
        text = f"In {runs} the {names.response.long} was still rising at the end of the stroke: {bounds}."
        yield Note("still_rose", "warning", text, Remedy("Increase refine.duration."))
    after = {run.condition: run.outcome for run in stage.made if run.levels == stage.parameters}
    if left := [row.condition for row in stage.rows if row.condition not in after]:
        why = "the budget is used up" if stage.converged else "the target at the calibration was not reached"
        remedy = Remedy("Raise refine.budget.") if stage.converged else None
        text = f"The result was not simulated at {names.conditions(left)}, because {why}."
        yield Note("not_run_there", "warning", text, remedy)
    if failed := [at for at, found in after.items() if not found.ok]:
        text = f"Runs with the result failed{names.at(*failed)} ({after[failed[0]].reason})."
        yield Note("failed_there", "warning", text)
