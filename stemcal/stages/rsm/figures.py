"""Figures of a response surface: its fit to the runs, and the surface over each pair of factors."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain, combinations, repeat
from statistics import NormalDist
from typing import Any

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.regression.section import AnySurface
from stemcal.drawing import style
from stemcal.drawing.plot import Plot
from stemcal.stages.fitting import Measured
from stemcal.stages.rsm.result import RsmResult
from stemcal.vocabulary import FIRST, Wording

_Pair = tuple[str, str]
_Grid = tuple[Array, Array, Array]
_NORMAL = NormalDist()
_GRID = 41  # points of the grid along each factor
_LONGEST, _LONGEST_IN_SPACE = 46, 28  # characters per line of an axis label, in a plane and in a 3D figure
_STYLES = ("--", ":", "-.", (0, (1, 1)), (0, (6, 1)), (0, (4, 1, 1, 1, 1, 1)))  # one line style per mean of a joint fit
_HEIGHT = "viridis"  # colour map whose lightness increases steadily


@dataclass(frozen=True)
class Solution:
    """The calibrated levels, the measured response, and the `further` means of a joint fit with a surface each."""

    levels: Mapping[str, float]
    target: float
    further: tuple[tuple[Measured, AnySurface], ...] = ()


def rsm_plots(rsm: RsmResult, solved: Solution | None, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a surface, with the solution marked if there is one."""
    observed = f"Simulated {rsm.naming.response.long} of each run versus the value predicted by the response surface."
    checks = (
        "Normal probability plot of the residuals (left), residuals versus predicted values (middle) and Cook's "
        "distance of each run (right). If the residuals are normally distributed, the points in the left plot lie "
        "close to the dashed line. A run with a Cook's distance above 1 strongly influences the response surface."
    )
    plots = [Plot("observed-predicted", "rsm", observed, partial(observed_predicted, rsm), detail=True)]
    if rsm.runs_diagnostics:
        plots.append(Plot("diagnostics", "rsm", checks, partial(diagnostics, rsm), wide=True, detail=True))
    for pair in combinations(rsm.names, 2):
        plots += _of_pair(rsm, pair, solved, labels)
    return plots


def _of_pair(rsm: RsmResult, pair: _Pair, solved: Solution | None, labels: Mapping[str, str]) -> list[Plot]:
    response = rsm.naming.response
    over = f"as a function of {Wording(rsm.naming, labels).factors(pair)}"
    single = len(rsm.names) == 3
    others, whose = ("factor", "its") if single else ("factors", "their")
    value = f"{whose} {'calibrated' if solved else 'centre'} {'value' if single else 'values'}"
    held = "" if len(rsm.names) == 2 else f", with the remaining {others} fixed at {value}"
    unit = f" ({response.written})" if response.written else ""
    met = f" The orange line marks the measured {response.long}; the star marks the calibrated point." if solved else ""
    if solved is not None and solved.further:
        met = (
            " Each orange line marks a measured mean on its own response surface, the thick line that of the contours; "
            "the star marks the point of the joint fit."
        )
    lines = f"Contours of the {response.long}{unit} {over}{held}.{met} The white dots are design points."
    base = "The contours are projected onto the base of the plot."
    relieved = f"Response surface of the {response.long} {over}{held}. {base}"
    return [
        Plot(f"contour-{'-'.join(pair)}", "rsm", lines, partial(contours, rsm, pair, solved, labels)),
        Plot(f"surface-{'-'.join(pair)}", "rsm", relieved, partial(relief, rsm, pair, solved, labels)),
    ]


def observed_predicted(rsm: RsmResult) -> style.Figure:
    """Draw the simulated responses versus those predicted by the surface."""
    runs = [(run.response, run.coded) for run in rsm.design.runs if run.response is not None]
    observed, predicted = [response for response, _ in runs], [float(rsm.response_at(coded)) for _, coded in runs]
    if rsm.over is not None:  # the surface may be fitted to the logarithm, at several conditions
        observed, predicted = ([getattr(row, name) for row in rsm.runs_diagnostics] for name in ("response", "fitted"))
    with style.new_figure() as figure:
        axes = figure.add_subplot()
        ends = [min(observed + predicted), max(observed + predicted)]
        axes.plot(ends, ends, color=style.FAINT, linestyle="--")
        axes.plot(predicted, observed, "o", color=style.BLUE, alpha=0.85)
        headed = rsm.regressed.response.headed
        labels = map(style.literal, map(headed, ("predicted by the surface", "simulated")))
        axes.set(**dict(zip(("xlabel", "ylabel"), labels, strict=True)))
    return figure


def diagnostics(rsm: RsmResult) -> style.Figure:
    """Draw residuals and influence of each run; source: Montgomery, Design and Analysis of Experiments, ch. 10."""
    rows = rsm.runs_diagnostics
    residuals = [row.studentised or 0.0 for row in rows]  # None if the surface passes through the run
    # normal scores of (i − ½)/n; normally distributed residuals are on the line
    scores = [_NORMAL.inv_cdf((rank + 0.5) / len(rows)) for rank in range(len(rows))]
    with style.new_figure(width=6.4, height=2.4) as figure:
        normal, over, influence = figure.subplots(1, 3)
        normal.plot([scores[0], scores[-1]], [scores[0], scores[-1]], color=style.FAINT, linestyle="--", linewidth=1)
        normal.plot(scores, sorted(residuals), "o", color=style.BLUE, markersize=4)
        normal.set(xlabel="normal score", ylabel="studentised residual")
        over.axhline(0, color=style.FAINT, linewidth=1)
        over.plot([row.fitted for row in rows], residuals, "o", color=style.BLUE, markersize=4)
        over.set(xlabel=style.literal(rsm.regressed.response.headed("predicted")), ylabel="studentised residual")
        distances = [row.cooks_distance or 0.0 for row in rows]
        influence.bar([row.run for row in rows], distances, color=style.BLUE, width=0.7)
        influence.axhline(1.0, color=style.ORANGE, linestyle="--", linewidth=1)
        influence.set(xlabel="run", ylabel="Cook's distance")
    return figure


def _section_of(rsm: RsmResult, pair: _Pair, solved: Solution | None) -> _Grid:
    """Return grids (_GRID, _GRID) of both factors and the response, with other factors at the solution or centre."""
    centre = {name: scale.center for name, scale in rsm.coding.items()}
    levels = [(centre if solved is None else solved.levels)[name] for name in rsm.names]
    at = rsm.scales.by_name(rsm.scales.to_coded(levels))
    x, y = np.meshgrid(*(np.linspace(*rsm.drawn_between(name), _GRID) for name in pair))
    response = rsm.response_at({**at, pair[0]: x, pair[1]: y})
    return rsm.coding[pair[0]].natural(x), rsm.coding[pair[1]].natural(y), response


def contours(
    rsm: RsmResult, pair: _Pair, solved: Solution | None = None, labels: Mapping[str, str] | None = None
) -> style.Figure:
    """Draw contours over two factors, with the others at the solution or centre; `labels` replace factor names."""
    grid = _section_of(rsm, pair, solved)
    levels = levels_of(grid[2])
    counts = Counter((run.levels[pair[0]], run.levels[pair[1]]) for run in rsm.design.runs)
    dots: Any = {"color": "white", "markersize": 5.5, "markeredgecolor": "black", "markeredgewidth": 0.6}
    with style.new_figure(height=3.7) as figure:
        axes = figure.add_subplot()
        filled = axes.contourf(*grid, levels=levels, cmap=_HEIGHT)
        lines = axes.contour(*grid, levels=levels, colors=["white"], linewidths=0.7, alpha=0.8)
        figure.colorbar(filled, ax=axes, label=_height(rsm), ticks=levels[::2]).outline.set_visible(False)
        axes.clabel(lines, fmt="%g", fontsize=7.5, colors="white")
        axes.plot(*zip(*sorted(counts), strict=True), "o", **dots, label="runs", clip_on=False, zorder=5)
        for point in (point for point, count in counts.items() if count > 1):
            axes.annotate(str(counts[point]), point, (5, 4), textcoords="offset points", size=8, color="white")
        if solved is not None:
            _mark_target(axes, rsm, grid, solved, pair)
        _label(axes, rsm, pair, labels)
    return figure


def relief(
    rsm: RsmResult, pair: _Pair, solved: Solution | None = None, labels: Mapping[str, str] | None = None
) -> style.Figure:
    """Draw the surface over two factors, with the others at the solution (star) or centre, and contours below it."""
    grid = _section_of(rsm, pair, solved)
    levels = levels_of(grid[2])
    base = levels[0] - 0.35 * (levels[-1] - levels[0])
    with style.new_figure(height=3.9) as figure:
        axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
        axes.contourf(*grid, levels=levels, zdir="z", offset=base, cmap=_HEIGHT, alpha=0.6)
        axes.plot_surface(*grid, cmap=_HEIGHT, edgecolor="#00000055", linewidth=0.3, rstride=4, cstride=4, zorder=2)
        if solved is not None:
            point = *([solved.levels[name]] for name in pair), [rsm.predict(solved.levels).response]
            axes.plot(*point, "*", color=style.ORANGE, markeredgecolor="white", markersize=14, zorder=9)
        _label(axes, rsm, pair, labels, _LONGEST_IN_SPACE)
        axes.set_zlabel(style.in_lines(_height(rsm), _LONGEST_IN_SPACE))
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.label.set_size(8)
        axes.set_zlim(base, levels[-1])
        axes.set_zticks([level for level in levels[::2] if level > base])
        axes.tick_params(labelsize=7, pad=0)
        axes.view_init(elev=24, azim=-128)
        style.frame_in_space(axes)
    return figure


def _height(rsm: RsmResult) -> str:
    return style.literal(rsm.naming.response.headed(rsm.naming.response.noun))


def levels_of(response: Any) -> Any:
    """Return round contour levels that span the responses."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=10, steps=[1, 2, 2.5, 5, 10]).tick_values(float(response.min()), float(response.max()))


def _label(axes: Any, rsm: RsmResult, pair: _Pair, labels: Mapping[str, str] | None, longest: int = _LONGEST) -> None:
    from matplotlib.ticker import MaxNLocator

    for axis, setter, name in ((axes.xaxis, axes.set_xlabel, pair[0]), (axes.yaxis, axes.set_ylabel, pair[1])):
        setter(style.in_lines(style.axis_of((labels or {}).get(name, name), rsm.factor(name).unit), longest))
        axis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))


def _mark_target(axes: style.Axes, rsm: RsmResult, grid: _Grid, solved: Solution, pair: _Pair) -> None:
    """Draw the solution and, for each fitted mean, the contour of its surface at the measured value."""
    levels = [np.full(grid[0].size, solved.levels[name]) for name in rsm.names]
    for name, values in zip(pair, grid[:2], strict=True):
        levels[rsm.names.index(name)] = values.ravel()
    points = rsm.scales.to_coded(np.column_stack(levels))
    several = len({FIRST, *(mean.response for mean, _ in solved.further)}) > 1
    for (mean, surface), dashes in zip(solved.further, chain(_STYLES, repeat(":")), strict=False):
        place = Wording(mean.naming).conditions([mean.condition]) if mean.naming.condition is not None else ""
        name = ", ".join(filter(None, (mean.named.noun if several else "", place)))
        lines: Any = {"linestyles": [dashes], "linewidths": 1.4}
        heights = surface.predict(points).reshape(grid[0].shape)
        if heights.min() < mean.value < heights.max():
            axes.contour(*grid[:2], heights, levels=[mean.value], colors=[style.ORANGE], **lines)
            axes.plot([], [], color=style.ORANGE, linestyle=dashes, linewidth=1.4, label=style.literal(name))
    if solved.further:
        style.legend_above(axes)
    if grid[2].min() < solved.target < grid[2].max():
        axes.contour(*grid, levels=[solved.target], colors=[style.ORANGE], linewidths=2.2)
    at = (solved.levels[name] for name in pair)
    axes.plot(*([level] for level in at), "*", color=style.ORANGE, markeredgecolor="white", markersize=14, zorder=6)
