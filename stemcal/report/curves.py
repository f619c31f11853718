"""Figures of force and energies of runs over blade travel."""

from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from stemcal.drawing.style import BLUE, FAINT, GREEN, INK, ORANGE, Axes, Figure, legend_above, literal, new_figure
from stemcal.measured.curve_modes import CurveModes
from stemcal.report.records import RunCurve


def force_travel(curves: Mapping[str, RunCurve], highlighted: Collection[str] = (), of_blade: bool = True) -> Figure:
    """Draw force over travel of runs, dotted after the first fracture; `highlighted` runs are coloured and named."""
    colours = (BLUE, ORANGE, GREEN, "#cc79a7", "#e69f00", "#56b4e9")
    with new_figure(width=6.4 if len(curves) > 3 else 4.7) as figure:
        axes = figure.add_subplot()
        for name, curve in curves.items():
            if name not in highlighted:
                _draw(axes, curve, color=FAINT, linewidth=0.7, alpha=0.6)
        for index, name in enumerate(n for n in curves if n in highlighted):
            _draw(axes, curves[name], color=colours[index % len(colours)], label=literal(name))
        axes.margins(x=0)
        axes.set(xlabel="blade travel, mm" if of_blade else "travel, mm", ylabel="force, N", ylim=(0, None))
        if highlighted:
            legend_above(axes, most=6)
    return figure


def _draw(axes: Axes, curve: RunCurve, **style: Any) -> None:
    end = _until_fracture(curve)
    axes.plot(curve.travel[:end], curve.force[:end], **style)
    after = slice(max(end - 1, 0), None)
    axes.plot(curve.travel[after], curve.force[after], **{**style, "label": None, "linestyle": ":"})


def _until_fracture(curve: RunCurve) -> int:
    return len(curve.travel) if curve.broke is None else bisect_right(curve.travel, curve.broke)


def measured_band(modes: CurveModes, simulated: RunCurve) -> Figure:
    """Draw the simulated curve over the mean of the measured curves ± 2 SD; below, their difference in SD."""
    travel, mean, sd = modes.band
    end = _until_fracture(simulated)
    force = modes.at_shares(np.array(simulated.travel[:end]), np.array(simulated.force[:end]))
    with new_figure() as figure:
        axes, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        axes.fill_between(travel, mean - 2.0 * sd, mean + 2.0 * sd, color=FAINT, alpha=0.4, label="measured, ± 2 SD")
        axes.plot(travel, mean, color=INK, label="mean")
        axes.plot(travel, force, color=BLUE, label="simulated")
        below.axhspan(-2.0, 2.0, color=FAINT, alpha=0.4)
        below.plot(travel, (force - mean) / np.maximum(sd, 1e-9), color=BLUE)
        axes.set(ylabel="force, N", ylim=(0, None))
        below.set(xlabel="travel, mm", ylabel="difference, SD")
        axes.margins(x=0)
        legend_above(axes)
    return figure


def energies(rows: Mapping[str, Sequence[float]]) -> Figure:
    """Draw the work of the blade and the energies of the model over blade travel."""
    styles = {
        "external": ("work done by the blade", INK, "-"),
        "internal": ("internal", BLUE, "-"),
        "eroded": ("deleted elements", ORANGE, "-"),
        "contact": ("friction and contact", GREEN, "-"),
        "hourglass": ("hourglass", "#cc79a7", "--"),
        "kinetic": ("kinetic", FAINT, "--"),
    }
    with new_figure() as figure:
        axes = figure.add_subplot()
        for name, (label, colour, line) in styles.items():
            axes.plot(rows["travel"], rows[name], color=colour, linestyle=line, label=label)
        axes.margins(x=0)
        axes.set(xlabel="blade travel, mm", ylabel="energy, mJ", ylim=(0, None))
        legend_above(axes)
    return figure
