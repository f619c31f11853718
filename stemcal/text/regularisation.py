"""What is said of a failure strain over element size, on the terminal and in the files for other programs."""

from stemcal.executors.code import code_version
from stemcal.numbers import significant
from stemcal.stages.regularise import HIGHEST, LOWEST, VALID, Regularisation, Regularised
from stemcal.study.model import Study
from stemcal.text.language import all_of, say


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
    if study.material.growing():
        grown = "Parameters of this study follow the stem's diameter: all values here hold for {at:g} mm."
        lines.insert(3, say(grown, at=found.condition))
    if row.low is not None and row.high is not None:
        band = "Each place by itself would take {low:.3g} to {high:.3g}: where the edge comes down matters."
        lines.insert(3, say(band, low=row.low, high=row.high))
    return lines


def not_valid(found: Regularisation, row: Regularised, most_places: int) -> str:
    """Say why an element size is not valid, and what to do where so many places may be asked for."""
    given = {"size": row.element_size, "force": row.force, "aim": found.aim, "lowest": LOWEST, "highest": HIGHEST}
    if abs(row.force / found.aim - 1.0) > VALID:
        return say(
            "with elements of {size:g} mm the force is {force:.4g} N at best, {aim:.4g} N is right: it jumps between "
            "strains; take coarser elements, or more --places",
            **given,
        )
    if not row.bracketed:
        return say(
            "with elements of {size:g} mm some places of the mesh do not reach {aim:.4g} N at any failure strain from "
            "{lowest:g} to {highest:g}; take other elements",
            **given,
        )
    if row.places_needed is None:
        return say("with elements of {size:g} mm the scatter over places of the mesh is not known", **given)
    more = (
        "with elements of {size:g} mm the force scatters by {sd:.3g} % over places of the mesh: the mean over {places} "
        "has a standard error of {se:.3g} %, more than 5 %; take --places {needed} or more"
    )
    other = (
        "with elements of {size:g} mm the force scatters by {sd:.3g} % over places of the mesh: the mean over {places} "
        "has a standard error of {se:.3g} %, more than 5 %; take other elements, {needed} places would be needed"
    )
    return say(
        more if row.places_needed <= most_places else other,
        sd=row.sd_percent,
        se=row.se_percent,
        places=row.places,
        needed=row.places_needed,
        **given,
    )


def curve_lines(found: Regularisation) -> list[str]:
    """Return the comments of a curve's file."""
    sizes = [significant(row.element_size) for row in found.rows if row.found]
    return [
        say("Failure strain over element size, mm. Valid sizes: {sizes} mm.", sizes=all_of(sizes)),
        say("For a maximum force of {aim:.4g} N on a stem of {at:g} mm.", aim=found.aim, at=found.condition),
    ]
