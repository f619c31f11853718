"""What the climb between screening and surface says."""

from stemcal.notes import Weight
from stemcal.stages.climb import ClimbResult
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark


def outcome(stage: ClimbResult, names: Names) -> list[str]:
    """Say how near the steps came to the target."""
    walked = "{count} runs stepped {factors:factors} together towards the target."
    near = "The target was passed; step {step} came nearest, {error:fixed 1} % from it."
    short = "The target was not reached; step {step} came nearest, {error:fixed 1} % from it."
    return [
        names.say_number("{count} run stayed at the centre.", walked, len(stage.rows), factors=stage.names),
        names.say(near if stage.passed else short, step=stage.best_step, error=abs(stage.error_percent)),
    ]


def remarks(stage: ClimbResult, names: Names) -> list[Remark]:
    """Return where the surface is centred, that the walk ended too early, and which factors it took."""
    centred = (
        "Of {count} steps along the slope of the screening, step {step} is nearest to the target ({error:+.1f} %): "
        "the surface is centred there."
    )
    edge = (
        "The walk ended at the edge of the ranges before the {response} passed the target, which may lie outside: "
        "widen the ranges, or check whether the {response} can reach it at all."
    )
    nearest = say(centred, count=len(stage.rows), step=stage.best_step, error=stage.error_percent)
    said = [Remark(nearest, Weight.ASIDE, "nearest_step")]
    if not stage.passed:
        said.append(Remark(say(edge, response=names.response.long), Weight.NUMBERS, "target_not_passed"))
    return [*said, *(remark(note, names) for note in stage.notes)]
