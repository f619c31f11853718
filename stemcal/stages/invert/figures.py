"""The figures of a calibration."""

from collections.abc import Mapping
from functools import partial

from stemcal.report.figures.certainty import profiles
from stemcal.report.figures.contour import solutions, with_unit
from stemcal.report.figures.plot import Plot
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.surface.result import SurfaceResult


def plots(rsm: SurfaceResult, invert: InvertResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a calibration."""
    known, plots = invert.certainty, []
    likelihoods = (
        "Profile of each factor, the others free. The 95 % interval is where the curve is below the dashed line "
        "(shaded); vertical line: the calibrated value."
    )
    exact = (
        "Where the surface meets the target exactly: the range of each factor in coded units; star: the chosen point; "
        "dashed: ±1, dotted: the reach of the design. The error of the surface is not included."
    )
    units = {name: with_unit(rsm, name, labels) for name in invert.point.solution}
    if known is not None:
        plots.append(Plot("profiles", "invert", likelihoods, partial(profiles, invert, units), claims=True))
    draw = partial(solutions, rsm, invert, labels)
    return [*plots, Plot("solutions", "invert", exact, draw, detail=True, claims=True)]
