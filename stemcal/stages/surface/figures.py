"""The figures of a response surface."""

from collections.abc import Mapping
from functools import partial
from itertools import combinations

from stemcal.names import Names
from stemcal.report.figures.contour import contours, relief
from stemcal.report.figures.effects import diagnostics, observed_predicted, residuals
from stemcal.report.figures.plot import Plot
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.surface.result import SurfaceResult


def plots(rsm: SurfaceResult, invert: InvertResult | None, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a surface; with a solution they show it."""
    observed = f"Simulated {rsm.naming.response.noun} against the surface's prediction."
    checks = (
        "Residuals against the normal distribution (on the line: normal) and in order of the runs (no trend: good), "
        "and how strongly each run influences the surface (large above a Cook's distance of 1, dashed)."
    )
    plots = [
        Plot("observed-predicted", "rsm", observed, partial(observed_predicted, rsm), detail=True),
        Plot("residuals", "rsm", "Residuals of the surface, run by run.", partial(residuals, rsm), detail=True),
    ]
    if rsm.runs_diagnostics:
        plots.append(Plot("diagnostics", "rsm", checks, partial(diagnostics, rsm), wide=True, detail=True))
    for pair in combinations(rsm.names, 2):
        plots += _pair_plots(rsm, pair, invert, labels)
    return plots


def _pair_plots(
    rsm: SurfaceResult, pair: tuple[str, str], invert: InvertResult | None, labels: Mapping[str, str]
) -> list[Plot]:
    """Return contours and relief over two factors."""
    response, alone = rsm.naming.response, len(rsm.names) == 2
    over = f"over {Names(rsm.naming, labels).factors(pair)}"
    held = "" if alone else f", the others at the {'solution' if invert else 'centre'}"
    unit = f" in {response.written}" if response.written else ""
    met = f" Orange: the measured {response.noun}; star: the solution." if invert else ""
    lines = f"{response.capital} {over}{held}, contours{unit}.{met} White dots: design points (numbers: repeats)."
    dots = " Dots: runs, full above the surface and open below it." if alone else ""
    relieved = f"Surface of the {response.noun} {over}{held}, with contours projected on the base.{dots}"
    flat, lifted = (partial(draw, rsm, pair, invert, labels) for draw in (contours, relief))
    return [
        Plot(f"contour-{'-'.join(pair)}", "rsm", lines, flat),
        Plot(f"surface-{'-'.join(pair)}", "rsm", relieved, lifted),
    ]
