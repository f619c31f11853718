"""The response surface as a relief over two factors, and where the solutions lie."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stemcal.report.figures import with_unit
from stemcal.report.style import BLUE, FAINT, INK, ORANGE, new_figure, styled
from stemcal.report.terms import surface_value

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Stage = Mapping[str, Any]
GRID = 25


def relief(rsm: Stage, pair: tuple[str, str], invert: Stage | None = None) -> Figure:
    """Return the predicted force as height over two factors, the others at the solution (at centre without one)."""
    import numpy as np

    across, up = pair
    reach = float(rsm.get("radius") or 1.0)
    at = dict((invert or {}).get("coded") or dict.fromkeys(rsm["names"], 0.0))
    x, y = np.meshgrid(np.linspace(-reach, reach, GRID), np.linspace(-reach, reach, GRID))
    force = np.broadcast_to(surface_value(rsm["coefficients"], {**at, across: x, up: y}), x.shape)
    natural = [_natural(rsm, name, coded) for name, coded in ((across, x), (up, y))]
    figure = new_figure(width=4.7, height=3.8)
    with styled():
        axes = figure.add_subplot(projection="3d")
        axes.plot_surface(*natural, force, cmap="cividis", edgecolor=INK, linewidth=0.15, rstride=2, cstride=2)
        if invert:
            point = [invert["solution"][name] for name in pair]
            axes.plot(*([value] for value in point), [invert["predicted"]], "*", color=ORANGE, markersize=12, zorder=9)
        for setter, text in ((axes.set_xlabel, across), (axes.set_ylabel, up)):
            setter(with_unit(rsm, text), fontsize=8)
        axes.set_zlabel("force, N", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.view_init(elev=26, azim=-128)
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.set_pane_color((0.0, 0.0, 0.0, 0.0))
        axes.set_box_aspect(None, zoom=0.86)
    return figure


def _natural(rsm: Stage, name: str, coded: Any) -> Any:
    entry = rsm["coding"][name]
    return entry["center"] + entry["half_step"] * coded


def solutions(rsm: Stage, invert: Stage) -> Figure:
    """Return for each factor, in coded units, the range over all solutions and the point that was chosen."""
    names = list(invert["solution"])
    figure = new_figure(height=1.3 + 0.42 * len(names))
    with styled():
        axes = figure.add_subplot()
        for row, name in enumerate(reversed(names)):
            low, high = ((bound - _natural(rsm, name, 0.0)) / rsm["coding"][name]["half_step"]
                         for bound in invert["ranges"][name])  # fmt: skip
            axes.plot([low, high], [row, row], color=BLUE, linewidth=6, solid_capstyle="butt", alpha=0.6)
            axes.plot(invert["coded"][name], row, "*", color=ORANGE, markersize=12, markeredgecolor="white")
        reach = float(rsm.get("radius") or 1.0)
        for place, style in ((-reach, ":"), (-1.0, "--"), (1.0, "--"), (reach, ":")):
            axes.axvline(place, color=FAINT, linestyle=style, linewidth=0.9)
        axes.set_yticks(range(len(names)), [name.replace("$", r"\$") for name in reversed(names)])
        axes.set_ylim(-0.6, len(names) - 0.4)
        axes.set_xlabel("coded value")
    return figure
