"""What the closed loop says: how near it ended, and what its runs tell of the surface."""

from collections.abc import Iterator

from stemcal.notes import Weight
from stemcal.stages.refine.result import RefineResult
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark


def outcome(stage: RefineResult, names: Names) -> list[str]:
    """Say how far from the target the loop ended."""
    within = (
        "{count} run at the solution: the error is {error:fixed 2} %, within the tolerance of {tolerance:g} %.",
        "{count} runs corrected the solution: the error is {error:fixed 2} %, within the tolerance of {tolerance:g} %.",
    )
    beyond = (
        "{count} run at the solution: the error is {error:fixed 2} %, not within the tolerance of {tolerance:g} %.",
        "{count} runs corrected the solution: the error is {error:fixed 2} %, not within the tolerance of "
        "{tolerance:g} %.",
    )
    fields = {"error": abs(stage.error_percent), "tolerance": stage.tolerance_percent}
    return [names.say_number(*(within if stage.converged else beyond), len(stage.rows), **fields)]


def shortfall(stage: RefineResult) -> str:
    """Say how far from the target a loop ended that did not meet its tolerance."""
    one = "refine: {error:.2f} % from the target after {count} run"
    many = "refine: {error:.2f} % from the target after {count} runs"
    return say_number(one, many, len(stage.rows), error=abs(stage.error_percent))


def remarks(stage: RefineResult, names: Names) -> list[Remark]:
    """Return what the loop tells of the surface, and why it ended."""
    return list(_of_numbers(stage, names))


def _of_numbers(stage: RefineResult, names: Names) -> Iterator[Remark]:
    if any(row.iteration == 1 and row.inside_interval is False for row in stage.rows):
        yield Remark(_outside(stage, names), Weight.USE, "first_outside")
    if stage.stopped is not None:
        yield Remark(_end(stage), Weight.ASIDE if stage.stopped == "tolerance" else Weight.USE, "stopped")
        return
    if not stage.converged:
        yield Remark(_not_converged(stage, names), Weight.USE, "not_converged")
    if stage.iteration > 1:
        found = "The point is the one found by simulation, no longer the one that the rule of `invert` chose."
        yield Remark(say(found), Weight.ASIDE, "found_by_simulation")


def _outside(stage: RefineResult, names: Names) -> str:
    one = (
        "At the surface's solution the simulated {response}, {simulated:response}, lies outside the prediction "
        "interval: the surface misses more there than its residuals show."
    )
    many = (
        "At the joint solution the simulated {response} lies outside the prediction interval at {conditions:all}: the "
        "surfaces miss more there than their residuals show."
    )
    anywhere = (
        "At the joint solution the simulated {response} lies outside the prediction interval: the surfaces miss more "
        "there than their residuals show."
    )
    first = [row for row in stage.rows if row.iteration == 1 and row.inside_interval is False]
    jointly = anywhere if names.naming.condition is None else many
    return names.say(
        jointly if stage.at_conditions else one,
        response=names.response.long,
        simulated=first[0].outcome.response,
        conditions=[names.naming.place(row.condition) for row in first if row.condition is not None],
    )


def _end(stage: RefineResult) -> str:
    ends = {
        "tolerance": "After {runs} runs the largest error is {error:.2f} %, within the tolerance.",
        "budget": "After {runs} runs the largest error is {error:.2f} %; refine.budget allows no further iteration.",
        "settled": (
            "After {runs} runs the joint fit no longer moves: the largest error is {error:.2f} %, and no parameters "
            "nearby do better. What remains is the model's error or the measured scatter, not the surfaces'."
        ),
    }
    return say(ends[stage.stopped or "budget"], runs=len(stage.rows), error=stage.max_abs_error_percent)


def _not_converged(stage: RefineResult, names: Names) -> str:
    of_stems = (
        "After {runs} runs the simulated {response} is still {error:.2f} % from the target; the best point is kept. "
        "Raise refine.budget, or refine the mesh: the {response} may jump between points."
    )
    of_others = (
        "After {runs} runs the simulated {response} is still {error:.2f} % from the target; the best point is kept. "
        "Raise refine.budget, or compute more finely: the {response} may jump between points."
    )
    return say(
        of_stems if names.naming.is_cutting else of_others,
        runs=len(stage.rows),
        response=names.response.long,
        error=abs(stage.error_percent),
    )
