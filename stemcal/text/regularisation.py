"""What is said of a failure strain over element size, on the terminal and in the files for other programs."""

from __future__ import annotations

from stemcal.executors.code import code_version
from stemcal.stages.regularise import Regularisation, Regularised
from stemcal.study.model import Study
from stemcal.text.language import all_of, say
from stemcal.text.numbers import significant


def material_lines(study: Study, found: Regularisation, row: Regularised, force: float) -> list[str]:
    """Return the comments of a material's file."""
    given = {"size": row.element_size, "strain": row.failure_strain, "places": row.places, "mean": row.force}
    lines = [
        say("Stem of study {name}, calibrated by stemcal {version}.", name=study.name, version=code_version()),
        say("Units: mm, tonne, s, N, MPa. Elements fail each by itself at the failure strain of this card."),
        say(
            "It holds for elements of {size:g} mm: failure strain {strain:.4g}; with it the mean force over {places} "
            "places of the mesh is {mean:.4g} N at {at:g} mm, {aim:.4g} N were measured.",
            **given,
            at=found.condition,
            aim=found.aim,
        ),
        say("check.k is to give {force:.4g} N; curve.csv has other element sizes.", force=force),
    ]
    if row.low is not None and row.high is not None:
        band = "Each place by itself would take {low:.3g} to {high:.3g}: where the edge comes down matters."
        lines.insert(3, say(band, low=row.low, high=row.high))
    return lines


def curve_lines(found: Regularisation) -> list[str]:
    """Return the comments of a curve's file."""
    sizes = [significant(row.element_size) for row in found.rows if row.found]
    return [
        say("Failure strain over element size, mm. Valid sizes: {sizes} mm.", sizes=all_of(sizes)),
        say("For a maximum force of {aim:.4g} N on a stem of {at:g} mm.", aim=found.aim, at=found.condition),
    ]
