"""What the refinement reports: the parameters, the error that is left, and why it ended."""

from stemcal.notes import Weight
from stemcal.numbers import significant
from stemcal.stages.refine import result as facts
from stemcal.stages.refine.result import RefineResult
from stemcal.text.language import say, say_number
from stemcal.text.names import Names, program
from stemcal.text.notes import Remark, remark, states


def outcome(stage: RefineResult, names: Names) -> list[str]:
    """Say what the refinement changed, and the error that is left."""
    return _there(stage, names) if stage.elsewhere else _here(stage, names)


def _here(stage: RefineResult, names: Names) -> list[str]:
    error = f"{abs(stage.error_percent):.2f} %, {'' if stage.converged else 'not '}within the tolerance of"
    one, many = "{count} run at the solution", "{count} runs corrected the solution"
    return [f"{say_number(one, many, len(stage.made))}: the error is {error} {stage.tolerance_percent:g} %."]


def _there(stage: RefineResult, names: Names) -> list[str]:
    moved = [one for one in stage.adjusted if one.value != one.calibrated]
    values = ", ".join(f"{names.factor(one.factor)} {significant(one.value)}" for one in moved)
    kept = "In {there} the calibrated parameters give {found:response .4g}; the target is {aim:response .4g}."
    changed = "For {there}: {values}. It gives {found:response .4g}; the target is {aim:response .4g}."
    known = (
        "For {there}: {values}. It gives {found:response .4g}, with the calibrated values {start:response .4g}; the "
        "target is {aim:response .4g}."
    )
    row = stage.fitted
    template = kept if not moved else changed if row.before is None else known
    fields = {"there": program(stage.model.kind), "found": row.after, "start": row.before, "aim": stage.aim}
    return [] if row.after is None else [names.say(template, values=values, **fields)]


def certainty(stage: RefineResult, names: Names) -> list[str]:
    """Say how large the errors are in another model."""
    if not stage.elsewhere or stage.max_abs_error_percent is None:
        return []
    at = [row.condition for row in stage.rows if row.error_percent is not None]
    template = "In {there} the largest error is {error:.1f} %" + (" ({at:conditions})." if names.placed else ".")
    return [names.say(template, there=program(stage.model.kind), at=at, error=stage.max_abs_error_percent)]


def shortfall(stage: RefineResult) -> str:
    """Say how far from the target a refinement ended that did not reach it."""
    one = "refine: {error:.2f} % from the target after {count} run"
    many = "refine: {error:.2f} % from the target after {count} runs"
    return say_number(one, many, len(stage.made), error=abs(stage.error_percent))


def remarks(stage: RefineResult, names: Names) -> list[Remark]:
    """Return the notes, and whether the point is still that of the surface."""
    said = [remark(note, names) for note in stage.notes]
    if not stage.elsewhere and stage.parameters != stage.made[0].levels:
        found = "The parameters were found by simulation; they are no longer those that `invert.rule` chose."
        said.append(Remark(say(found), Weight.ASIDE, "found_by_simulation"))
    return said


states(
    facts.FirstOutside,
    "At the solution of the surface the simulated {names.response.long} is outside its prediction interval "
    "({conditions:conditions}): the surface is less accurate there than its residuals indicate.",
    otherwise="At the solution of the surface the simulated {names.response.long} is outside its prediction interval: "
    "the surface is less accurate there than its residuals indicate.",
    by="names.placed",
)
states(
    facts.NotRunThere,
    "refine.budget left no run of the result at {conditions:conditions}.",
    otherwise="The result was not run at {conditions:conditions}, because the target at the calibration was not "
    "reached.",
    by="converged",
)
states(
    facts.BeyondRange,
    "{factor:factor} {value:.4g} is outside the study's range ({low:g} to {high:g}); that range is for the study's own "
    "model.",
)
states(
    facts.StillRose,
    "In {count} run the {names.response.long} still rose at the end of the stroke: it is a lower bound. Increase "
    "refine.test.duration.",
    "In {count} runs the {names.response.long} still rose at the end of the stroke: they are lower bounds. Increase "
    "refine.test.duration.",
    by="runs",
)
states(
    facts.FailedThere,
    "Runs with the result failed at {conditions:conditions} ({reason}).",
    otherwise="The run with the result failed ({reason}).",
    by="names.placed",
)
states(
    facts.NotReached,
    {
        "here budget": "The {names.response.long} is still {missed_percent:.2f} % from the target; the best point is "
        "kept. Raise refine.budget, or check whether the {names.response.long} jumps between neighbouring points.",
        "here settled": "The error is {missed_percent:.2f} %, and no parameters nearby reduce it. What remains is the "
        "error of the model or the measured scatter.",
        "there budget": "The {names.response.long} is still {missed_percent:.1f} % from the target; the best point is "
        "kept. Raise refine.budget, or give {factors:factors} a wider range under refine.adjust.",
        "there out_of_reach": "The {names.response.long} is {missed_percent:.1f} % from the target at the end of the "
        "range of {factors:factors}. Give it a wider range, or add another factor, under refine.adjust.",
        "there settled": "The {names.response.long} is {missed_percent:.1f} % from the target, and no step is left "
        "between the runs: it jumps, or does not depend on {factors:factors}. Average over several positions of the "
        "mesh (replicates of the embedded solver), or adjust another factor.",
    },
    by=lambda note: f"{'there' if note.factors else 'here'} {note.stopped}",
)
