"""What a transfer says: what the parameters become in another program, and how near the response is there."""

from stemcal.notes import Weight
from stemcal.numbers import significant
from stemcal.stages.transfer import result as facts
from stemcal.text.language import say
from stemcal.text.names import Names, program
from stemcal.text.notes import Remark, remark, states


def role(name: facts.Role) -> str:
    """Return what a run was made for."""
    return {"search": say("search"), "after": say("result elsewhere"), "before": say("start elsewhere")}[name]


def outcome(stage: facts.TransferResult, names: Names) -> list[str]:
    """Say what the parameters become there, and what they give."""
    moved = [one for one in stage.adjusted if one.value != one.calibrated]
    where, found, start = program(stage.solver.kind), stage.fitted.after, stage.fitted.before
    if found is None:
        return []
    fields = {"there": where, "found": found, "aim": stage.aim, "start": start, "at": stage.condition}
    if not moved:
        kept = "In {there} the calibrated parameters give {found:response .4g}, where {aim:response .4g} is right."
        return [names.say(kept, **fields)]
    values = ", ".join(
        say("{factor} {value}", factor=names.factor(one.factor), value=significant(one.value)) for one in moved
    )
    changed = "For {there}: {values}. It gives {found:response .4g}, where {aim:response .4g} is right."
    known = (
        "For {there}: {values}. It gives {found:response .4g}, where {aim:response .4g} is right; with the calibrated "
        "values {start:response .4g}."
    )
    return [names.say(changed if start is None else known, values=values, **fields)]


def certainty(stage: facts.TransferResult, names: Names) -> list[str]:
    """Say how large the errors there are."""
    if stage.max_abs_error_percent is None:
        return []
    run = [row for row in stage.rows if row.error_percent is not None]
    one = "In {there} the error at {at:conditions} is {error:.1f} %."
    many = "In {there} the largest error at {at:conditions} is {error:.1f} %."
    bare = "In {there} the error is {error:.1f} %."
    template = bare if not names.placed else one if len(run) == 1 else many
    fields = {"at": [row.condition for row in run], "error": stage.max_abs_error_percent}
    return [names.say(template, there=program(stage.solver.kind), **fields)]


def remarks(stage: facts.TransferResult, names: Names) -> list[Remark]:
    """Return what the transfer says beside its tables."""
    said = [remark(note, names) for note in stage.notes]
    if stage.learnt is not None and len(stage.asked) > 1:
        said.append(Remark(_learnt(stage, names), Weight.ASIDE, "learnt"))
    return said


def _learnt(stage: facts.TransferResult, names: Names) -> str:
    assert stage.learnt is not None
    exact = (
        "The {response} there is {scale:.3g} times that of the study's own solver with the calibrated values, and "
        "changes {tilt:.3g} times as much, by ratio, as the surface has it."
    )
    about = (
        "The {response} there is {scale:.3g} times that of the study's own solver with the calibrated values, and "
        "changes {tilt:.3g} times as much, by ratio, as the surface has it; the runs lie about that line with "
        "{sd_percent:.2g} %."
    )
    template = exact if stage.learnt.sd_percent is None else about
    return names.say(template, response=names.response.long, **vars(stage.learnt))


states(
    facts.NotRunThere,
    "transfer.budget left no run with the result at {conditions:conditions}.",
    otherwise="Nothing was run there at {conditions:conditions}: first the response at the calibration must be right.",
    by="converged",
)
states(
    facts.BeyondRange,
    "{factor:factor} {value:.4g} lies outside the study's range ({low:g} to {high:g}), as transfer.adjust allows.",
    otherwise="{factor:factor} {value:.4g} lies outside the study's range ({low:g} to {high:g}), which belongs to the "
    "study's mesh and lengths.",
    by="allowed",
)
states(
    facts.StillRose,
    "In {count} run there the {names.response.long} still rose when the stroke ended: it is a lower bound. A longer "
    "stroke (transfer.test.duration) tells more.",
    "In {count} runs there the {names.response.long} still rose when the stroke ended: they are lower bounds. A longer "
    "stroke (transfer.test.duration) tells more.",
    by="runs",
)
states(
    facts.FailedThere,
    "Runs there with the result failed at {conditions:conditions} ({reason}).",
    otherwise="The run there with the result failed ({reason}).",
    by="names.placed",
)
states(
    facts.NotReached,
    {
        "budget": "The {names.response.long} there is still {missed_percent:.1f} % from {aim:response .4g}: "
        "transfer.budget allows no further run. Raise it, or give {factors:factors} a wider range under "
        "transfer.adjust. The best point is kept.",
        "out_of_reach": "The {names.response.long} there is {missed_percent:.1f} % from {aim:response .4g} at the end "
        "of the range of {factors:factors}. Give it a wider one, or name a further factor, under transfer.adjust.",
        "settled": "The {names.response.long} there is {missed_percent:.1f} % from {aim:response .4g}, and no step is "
        "left between the runs: it jumps there, or does not follow {factors:factors}. The mean over places of the mesh "
        "(phases under transfer.solver, of the embedded solver) jumps less.",
    },
    by="stopped",
)
