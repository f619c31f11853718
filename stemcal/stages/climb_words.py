"""The outcome of the climb between screening and surface, in sentences."""

from stemcal.names import Names
from stemcal.numbers import fixed
from stemcal.stages.climb import ClimbResult


def outcome(stage: ClimbResult, names: Names) -> list[str]:
    """Return how near the steps came to the target."""
    stepped = f"{len(stage.rows)} runs stepped {names.factors(stage.names)} together towards the target."
    reached = "The target was passed" if stage.passed else "The target was not reached"
    return [
        "1 run was made at the centre." if len(stage.rows) == 1 else stepped,
        f"{reached}; step {stage.best_step} came nearest, {fixed(abs(stage.error_percent), 1)} % from it.",
    ]
