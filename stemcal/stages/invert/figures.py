"""The figures of a calibration: how well the parameters are known, and where the surface meets the target."""

from collections.abc import Mapping
from functools import partial

from stemcal.naming import Names
from stemcal.report.figures.plot import Plot
from stemcal.report.figures.style import (
    BLUE,
    FAINT,
    INK,
    ORANGE,
    Axes,
    Figure,
    axis_of,
    legend_above,
    new_figure,
    plain,
)
from stemcal.stages.fitting import Surfaces
from stemcal.stages.invert.result import Certainty, InvertResult
from stemcal.stages.invert.words import source


def plots(surface: Surfaces, invert: InvertResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a calibration."""
    known, plots = invert.certainty, []
    likelihoods = (
        "Profile of the misfit for each factor, with the other factors refitted. The 95 % interval (shaded) is where "
        "the curve is below the dashed line; vertical line: the calibrated value."
    )
    exact = (
        "Exact solutions of the surface: range of each factor in coded units. Star: selected solution; dashed: ±1; "
        "dotted: limit of the design region. The error of the surface is not included."
    )
    units = {name: axis_of(labels.get(name, name), surface.factor(name).unit) for name in invert.point.solution}
    if known is not None:
        plots.append(Plot("profiles", "invert", likelihoods, partial(profiles, invert, units), claims=True))
    draw = partial(solutions, surface, invert, labels)
    return [*plots, Plot("solutions", "invert", exact, draw, detail=True, claims=True)]


def profiles(invert: InvertResult, labels: Mapping[str, str] | None = None) -> Figure:
    """Return the misfit of each factor with all others free: its interval is below the dashed line.

    `labels` has what to write at the axis of a factor, its name by default.
    """
    names, called = list(invert.point.solution), Names(invert.naming)
    with new_figure(height=1.5 * len(names) + 0.4) as figure:
        for row, name in enumerate(names, 1):
            axes = figure.add_subplot(len(names), 1, row)
            if invert.certainty_alone is not None:
                _profile(axes, invert.certainty_alone, name, ORANGE, source(invert.certainty_alone, invert, called))
            if invert.certainty is not None:
                _profile(axes, invert.certainty, name, BLUE, source(invert.certainty, invert, called))
            axes.axhline(1.0, color=FAINT, linestyle="--", linewidth=1)
            axes.axvline(invert.point.solution[name], color=INK, linewidth=0.8)
            axes.set_ylim(0.0, 3.0)
            axes.set_xlabel((labels or {}).get(name, name))
            if row == 1 and invert.certainty_alone is not None:
                legend_above(axes)
        figure.supylabel("increase in misfit (1: 95 % limit)", fontsize=9)
    return figure


def _profile(axes: Axes, part: Certainty, name: str, colour: str, label: str) -> None:
    points = profile_points(part, name)
    axes.plot(*zip(*points, strict=True), color=colour, label=label)
    axes.axvspan(*part.intervals[name], color=colour, alpha=0.12, linewidth=0)


def profile_points(part: Certainty, name: str) -> list[tuple[float, float]]:
    """Return the profile of a factor over its limit, through the ends of its interval, where it is 1 by definition."""
    curve, ends = part.profiles[name], zip(part.intervals[name], part.bounded[name], strict=True)
    points = [(value, rise / (curve.allowed or 1.0)) for value, rise in zip(curve.values, curve.rise, strict=True)]
    return sorted(points + [(end, 1.0) for end, bounded in ends if bounded])


def solutions(surface: Surfaces, invert: InvertResult, labels: Mapping[str, str] | None = None) -> Figure:
    """Return for each factor, in coded units, the range over all solutions and the point that was chosen."""
    names = list(invert.point.solution)
    with new_figure(height=1.3 + 0.42 * len(names)) as figure:
        axes = figure.add_subplot()
        for row, name in enumerate(reversed(names)):
            low, high = ((bound - surface.coding[name].center) / surface.coding[name].half_step
                         for bound in invert.ranges[name])  # fmt: skip
            axes.plot([low, high], [row, row], color=BLUE, linewidth=6, solid_capstyle="butt", alpha=0.6)
            axes.plot(invert.point.coded[name], row, "*", color=ORANGE, markersize=12, markeredgecolor="white")
        reach = surface.radius or 1.0
        for place, style in ((-reach, ":"), (-1.0, "--"), (1.0, "--"), (reach, ":")):
            axes.axvline(place, color=FAINT, linestyle=style, linewidth=0.9)
        axes.set_yticks(range(len(names)), [plain((labels or {}).get(name, name)) for name in reversed(names)])
        axes.set_ylim(-0.6, len(names) - 0.4)
        axes.set_xlabel("coded value")
    return figure
