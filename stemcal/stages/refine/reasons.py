"""The reason about a refinement in another model."""

from collections.abc import Iterator

from stemcal.note import Note, Remedy
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.verdict.evidence import Evidence
from stemcal.words import series


def missed(evidence: Evidence) -> Iterator[Note]:
    """Yield that the other model does not reach its target."""
    found = evidence.of(RefineResult)
    if found is None or not found.elsewhere or found.converged:
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


RULES = (missed,)
