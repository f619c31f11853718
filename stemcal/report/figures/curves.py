"""Force and energies of runs over the travel of the blade."""

from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from stemcal.measured.curve_modes import CurveModes
from stemcal.report.figures.style import BLUE, FAINT, GREEN, INK, ORANGE, Axes, Figure, legend_above, new_figure, plain
from stemcal.report.records import Curve


def force_travel(curves: Mapping[str, Curve], highlighted: Collection[str] = (), of_blade: bool = True) -> Figure:
    """Return force over travel, that of the blade or of another test, for all runs; highlighted ones are named.

    After the stem has broken a curve is dotted: there it tells of the released stem, not of cutting.
    """
    colours = (BLUE, ORANGE, GREEN, "#cc79a7", "#e69f00", "#56b4e9")
    with new_figure(width=6.4 if len(curves) > 3 else 4.7) as figure:
        axes = figure.add_subplot()
        for name, curve in curves.items():
            if name not in highlighted:
                _draw(axes, curve, color=FAINT, linewidth=0.7, alpha=0.6)
        for index, name in enumerate(n for n in curves if n in highlighted):
            _draw(axes, curves[name], color=colours[index % len(colours)], label=plain(name))
        axes.set_xlabel("blade travel, mm" if of_blade else "travel, mm")
        axes.set_ylabel("force, N")
        axes.margins(x=0)
        axes.set_ylim(bottom=0)
        if highlighted:
            legend_above(axes, most=6)
    return figure


def _draw(axes: Axes, curve: Curve, **style: Any) -> None:
    """Draw a curve as a line until the stem has broken and dotted from there."""
    end = _until_broken(curve)
    axes.plot(curve.travel[:end], curve.force[:end], **style)
    after = slice(max(end - 1, 0), None)
    axes.plot(curve.travel[after], curve.force[after], **{**style, "label": None, "linestyle": ":"})


def _until_broken(curve: Curve) -> int:
    """Return how many points of a curve stand before the stem has broken."""
    return len(curve.travel) if curve.broke is None else bisect_right(curve.travel, curve.broke)


def measured_band(modes: CurveModes, simulated: Curve) -> Figure:
    """Return the measured curves' mean and scatter with the simulated one; below, by how many SD it is off where."""
    travel, mean, sd = modes.band
    end = _until_broken(simulated)
    force = modes.at_shares(np.array(simulated.travel[:end]), np.array(simulated.force[:end]))
    with new_figure() as figure:
        axes, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        axes.fill_between(travel, mean - 2.0 * sd, mean + 2.0 * sd, color=FAINT, alpha=0.4, label="measured, ± 2 SD")
        axes.plot(travel, mean, color=INK, label="their mean")
        axes.plot(travel, force, color=BLUE, label="simulated")
        below.axhspan(-2.0, 2.0, color=FAINT, alpha=0.4)
        below.plot(travel, (force - mean) / np.maximum(sd, 1e-9), color=BLUE)
        axes.set_ylabel("force, N")
        axes.set_ylim(bottom=0)
        below.set_ylabel("off by, SD")
        below.set_xlabel("travel, mm")
        axes.margins(x=0)
        legend_above(axes)
    return figure


def energies(rows: Mapping[str, Sequence[float]]) -> Figure:
    """Return the energies of a run over blade travel: work done, and where it went."""
    styles = {
        "external": ("work of the blade", INK, "-"),
        "internal": ("internal", BLUE, "-"),
        "eroded": ("in eroded elements", ORANGE, "-"),
        "contact": ("friction and contact", GREEN, "-"),
        "hourglass": ("hourglass", "#cc79a7", "--"),
        "kinetic": ("kinetic", FAINT, "--"),
    }
    with new_figure() as figure:
        axes = figure.add_subplot()
        for name, (label, colour, line) in styles.items():
            axes.plot(rows["travel"], rows[name], color=colour, linestyle=line, label=label)
        axes.set_xlabel("blade travel, mm")
        axes.set_ylabel("energy, mJ")
        axes.margins(x=0)
        axes.set_ylim(bottom=0)
        legend_above(axes)
    return figure
