"""Figure of how well the parameters are known: profiles of the misfit."""

from collections.abc import Mapping

from stemcal.names import Names
from stemcal.report.figures.style import BLUE, FAINT, INK, ORANGE, Axes, Figure, legend_above, new_figure
from stemcal.stages.invert.result import Certainty, InvertResult
from stemcal.stages.invert.words import source


def profiles(invert: InvertResult, labels: Mapping[str, str] | None = None) -> Figure:
    """Return the misfit of each factor with all others free: below the dashed line lies its interval.

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
        figure.supylabel("rise of the misfit (1: the 95 % limit)", fontsize=9)
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
