"""The response surface over two factors, as contours and as a relief, and where the solutions lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stemcal.report.figures.style import BLUE, FAINT, INK, ORANGE, new_figure, plain, styled
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.surface.result import SurfaceResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GRID, COARSE = 41, 25  # values of each factor, in contours and in reliefs


@dataclass(frozen=True)
class Section:
    """The surface over two factors, the others held: values (GRID, GRID) in natural units, force in N."""

    across: Any
    up: Any
    force: Any


def section_of(rsm: SurfaceResult, pair: tuple[str, str], invert: InvertResult | None, count: int) -> Section:
    """Return the surface over a pair, the others at the solution, or at the centre without one."""
    reach = rsm.radius or 1.0
    at = invert.point.coded if invert is not None else dict.fromkeys(rsm.names, 0.0)
    x, y = np.meshgrid(np.linspace(-reach, reach, count), np.linspace(-reach, reach, count))
    force = rsm.force_at({**at, pair[0]: x, pair[1]: y})
    return Section(rsm.coding[pair[0]].natural(x), rsm.coding[pair[1]].natural(y), force)


def contours(rsm: SurfaceResult, pair: tuple[str, str], invert: InvertResult | None = None) -> Figure:
    """Return lines of equal force over two factors, the others at the solution (at centre without one)."""
    across, up = pair
    section = section_of(rsm, pair, invert, GRID)
    figure = new_figure(height=3.5)
    with styled():
        axes = figure.add_subplot()
        filled = axes.contourf(section.across, section.up, section.force, levels=9, cmap="cividis", alpha=0.9)
        figure.colorbar(filled, ax=axes, label="force, N").outline.set_visible(False)
        if invert is not None:
            _mark_target(axes, section, invert, pair)
        points = {tuple(run.levels[name] for name in pair) for run in rsm.design.runs}
        dots: Any = {"color": "white", "markersize": 5, "markeredgecolor": "black", "markeredgewidth": 0.5}
        axes.plot(*zip(*sorted(points), strict=True), "o", **dots, label="runs", clip_on=False, zorder=5)
        axes.set_xlabel(with_unit(rsm, across))
        axes.set_ylabel(with_unit(rsm, up))
    return figure


def _mark_target(axes: Axes, section: Section, invert: InvertResult, pair: tuple[str, str]) -> None:
    """Draw the line on which the surface meets the measured force, and the solution on it."""
    if section.force.min() < invert.target < section.force.max():
        axes.contour(section.across, section.up, section.force, levels=[invert.target], colors=[ORANGE], linewidths=2)
    axes.plot(
        *(invert.point.solution[name] for name in pair),
        "*",
        color=ORANGE,
        markeredgecolor="white",
        markersize=13,
    )


def with_unit(rsm: SurfaceResult, name: str) -> str:
    """Return a factor's name with its unit, for an axis."""
    unit = rsm.factor(name).unit
    return plain(name if unit in ("1", "") else f"{name}, {unit}")


def relief(rsm: SurfaceResult, pair: tuple[str, str], invert: InvertResult | None = None) -> Figure:
    """Return the predicted force as height over two factors, the others at the solution (at centre without one)."""
    across, up = pair
    section = section_of(rsm, pair, invert, COARSE)
    figure = new_figure(width=4.7, height=3.8)
    with styled():
        axes = figure.add_subplot(projection="3d")
        axes.plot_surface(
            section.across,
            section.up,
            section.force,
            cmap="cividis",
            edgecolor=INK,
            linewidth=0.15,
            rstride=2,
            cstride=2,
        )
        if invert is not None:
            point = [invert.point.solution[name] for name in pair]
            axes.plot(
                *([value] for value in point), [invert.point.predicted], "*", color=ORANGE, markersize=12, zorder=9
            )
        for setter, text in ((axes.set_xlabel, across), (axes.set_ylabel, up)):
            setter(with_unit(rsm, text), fontsize=8)
        axes.set_zlabel("force, N", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.view_init(elev=26, azim=-128)
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.set_pane_color((0.0, 0.0, 0.0, 0.0))
        axes.set_box_aspect(None, zoom=0.86)
    return figure


def solutions(rsm: SurfaceResult, invert: InvertResult) -> Figure:
    """Return for each factor, in coded units, the range over all solutions and the point that was chosen."""
    names = list(invert.point.solution)
    figure = new_figure(height=1.3 + 0.42 * len(names))
    with styled():
        axes = figure.add_subplot()
        for row, name in enumerate(reversed(names)):
            low, high = ((bound - rsm.coding[name].center) / rsm.coding[name].half_step
                         for bound in invert.ranges[name])  # fmt: skip
            axes.plot([low, high], [row, row], color=BLUE, linewidth=6, solid_capstyle="butt", alpha=0.6)
            axes.plot(invert.point.coded[name], row, "*", color=ORANGE, markersize=12, markeredgecolor="white")
        reach = rsm.radius or 1.0
        for place, style in ((-reach, ":"), (-1.0, "--"), (1.0, "--"), (reach, ":")):
            axes.axvline(place, color=FAINT, linestyle=style, linewidth=0.9)
        axes.set_yticks(range(len(names)), [plain(name) for name in reversed(names)])
        axes.set_ylim(-0.6, len(names) - 0.4)
        axes.set_xlabel("coded value")
    return figure
