"""What is said of the mesh: how far its place and its element size move the response at the solution."""

from collections.abc import Iterator

from stemcal.doe.calibration.mesh_scatter import MeshScatter
from stemcal.notes import Weight
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.mesh.stage import ScatterUnknown
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, states


def certainty(stage: MeshResult, names: Names) -> list[str]:
    """Say how far the place of the mesh and the element size move the response."""
    return [_places(stage, names), *_sizes(stage, names)]


outcome = certainty


def remarks(stage: MeshResult, names: Names) -> list[Remark]:
    """Return what the mesh says beside its tables."""
    said = [Remark(_places(stage, names), Weight.TRUST, "places")]
    said += [Remark(sentence, Weight.TRUST, sentence) for sentence in _sizes(stage, names)]
    said += [Remark(sentence, Weight.NUMBERS, "size_failed") for sentence in _failed(stage, names)]
    said += [Remark(_further(name, found, names), Weight.TRUST, name) for name, found in (stage.further or {}).items()]
    return [*said, *(remark(note, names) for note in stage.notes)]


def _places(stage: MeshResult, names: Names) -> str:
    scatter, conditions = stage.scatter, {row.condition for row in stage.rows}
    fields = {
        "places": scatter.placements,
        "sd": scatter.sd_percent,
        "common": 100.0 * scatter.common**0.5,
        "apart": abs(100.0 * (scatter.mean_factor - 1.0)),
    }
    below, one = scatter.mean_factor < 1.0, len(conditions) == 1
    templates = {
        (True, True): "Over {places} places of the mesh the response at the solution has a standard deviation of "
        "{sd:.1f} %; their mean is {apart:.1f} % below the study's own mesh.",
        (True, False): "Over {places} places of the mesh the response at the solution has a standard deviation of "
        "{sd:.1f} %; their mean is {apart:.1f} % above the study's own mesh.",
        (False, True): "Over {places} places of the mesh the response at the solution has a standard deviation of "
        "{sd:.1f} %, {common:.1f} % of it shared by all conditions; their mean is {apart:.1f} % below the study's own "
        "mesh.",
        (False, False): "Over {places} places of the mesh the response at the solution has a standard deviation of "
        "{sd:.1f} %, {common:.1f} % of it shared by all conditions; their mean is {apart:.1f} % above the study's own "
        "mesh.",
    }
    return names.say(templates[one, below], **fields)


def _sizes(stage: MeshResult, names: Names) -> Iterator[str]:
    below = (
        "Elements of {size} give a response {apart:.1f} % below the study's own: the calibrated values belong to their "
        "element size, and this is in no interval."
    )
    above = (
        "Elements of {size} give a response {apart:.1f} % above the study's own: the calibrated values belong to their "
        "element size, and this is in no interval."
    )
    for size in stage.sizes:
        apart = 100.0 * (size.factor - 1.0)
        yield names.say(below if apart < 0.0 else above, size=size.element_size, apart=abs(apart))


def _failed(stage: MeshResult, names: Names) -> Iterator[str]:
    for row in stage.rows:
        if row.outcome.response is None:
            template = "No response with elements of {size} at {condition:condition} ({reason}): left out."
            yield names.say(template, size=row.mesh, condition=row.condition, reason=row.outcome.reason)


def _further(name: str, found: MeshScatter, names: Names) -> str:
    template = "{label} at the solution has a standard deviation of {sd:.1f} % over the places of the mesh."
    return names.say(template, label=names.naming.named(name).label, sd=found.sd_percent)


states(ScatterUnknown, "The values of {response} at each place of the mesh are unknown: its scatter is in no interval.")
