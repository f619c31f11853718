"""Figures of the verification page, in colours that are safe for colour-blind readers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from stemcal.drawing.style import BLUE, FAINT, GREEN, INK, ORANGE, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stemcal.cutting.result import ForceHistory

Arrays = tuple[np.ndarray, ...]
COLOURS = (BLUE, ORANGE, GREEN)
MARKS = "os^"


def loops(found: Mapping[float, Arrays]) -> Figure:
    """Draw stress over strain for each β: path and stress computed, corners of the closed form."""
    with new_figure(7.2, 3.1) as figure:
        panels = figure.subplots(1, len(found), sharey=True)
        for axes, (beta, (path, stress, strains, corners)) in zip(panels, found.items(), strict=True):
            axes.axhline(0.0, color=FAINT, linewidth=0.6)
            axes.plot(100.0 * np.append(0.0, strains), np.append(0.0, corners), color=ORANGE, label="closed form")
            axes.plot(100.0 * path[29::30], stress[29::30], "o", color=BLUE, markersize=3, label="computed")
            axes.set_title(f"β = {beta:g}")
            axes.set_xlabel("strain, %")
        panels[0].set_ylabel("stress, MPa")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def rate(curves: Mapping[str, Arrays]) -> Figure:
    """Draw yield stress over strain rate: formula as a line, computed as points."""
    with new_figure(4.9, 3.2) as figure:
        axes = figure.add_subplot()
        for (name, (fine, formula, rates, found)), colour, mark in zip(curves.items(), COLOURS, MARKS, strict=False):
            axes.plot(fine, formula, color=colour)
            axes.plot(rates, found, mark, color=colour, markersize=5, label=name)
        axes.set_xscale("log")
        axes.set_xlabel("axial strain rate, 1/s")
        axes.set_ylabel("yield stress, MPa")
        axes.legend(loc="upper left")
    return figure


def wave(bars: Mapping[str, Arrays], scale: float) -> Figure:
    """Draw stress over ρcv along the bar at some times, for each kind of far end."""
    with new_figure(7.2, 3.0) as figure:
        panels = figure.subplots(1, len(bars), sharey=True)
        for axes, (end, (times, stress, _)) in zip(panels, bars.items(), strict=True):
            fine = np.linspace(0.0, 1.0, 2001)
            place = (np.arange(stress.shape[1]) + 0.5) / stress.shape[1]
            for at, colour in zip((0.4, 0.8, 1.3, 1.7), COLOURS, strict=False):
                now = int(np.searchsorted(times, at))
                axes.plot(place, -stress[now] / scale, color=colour, label=f"t = {at:g} L/c")
                # stresses are those of the positions at the start of the step
                exact = exact_wave(fine, times[times < times[now]].max(), end)
                axes.plot(fine, exact, color=colour, linestyle="--", linewidth=0.8)
            axes.set_title(f"{end} end")
            axes.set_xlabel("place along the bar, x/L")
        panels[0].set_ylabel("compressive stress, −σ/ρcv")
        panels[1].legend(loc="upper left")
    return figure


def exact_wave(place: np.ndarray, time: float, end: str) -> np.ndarray:
    """Return the stress over ρcv: a step on its way out, and its image from the far end on its way back."""
    back = np.where(place > 2.0 - time, 1.0, 0.0)
    return np.where(place < time, 1.0, 0.0) + (back if end == "fixed" else -back)


def convergence(curves: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Figure:
    """Draw error over number of elements, both logarithmic, with a line of slope −2."""
    with new_figure(6.4, 3.6) as figure:
        axes = figure.add_subplot()
        for (name, (counts, errors)), colour, mark in zip(curves.items(), COLOURS, MARKS, strict=True):
            axes.loglog(counts, 100.0 * errors, marker=mark, color=colour, label=name, markersize=5)
        guide = np.array([3.0, 32.0])
        axes.loglog(guide, 200.0 / guide**2, color=FAINT, linewidth=2.5, alpha=0.6, label="slope −2", zorder=0)
        ticks = [2, 4, 8, 16, 32]
        axes.set_xticks(ticks, [str(n) for n in ticks])
        axes.set_yticks([0.1, 1.0, 10.0], ["0.1", "1", "10"])
        axes.minorticks_off()
        axes.set_xlabel("elements on a side")
        axes.set_ylabel("error, %")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def sliding(thrown: Mapping[tuple[float, float], Arrays], friction: Arrays) -> Figure:
    """Draw speed over time of thrown blocks, and the coefficient of friction over speed."""
    with new_figure(7.2, 3.0) as figure:
        left, right = figure.subplots(1, 2)
        for ((mu, first), (time, found, exact)), colour, mark in zip(thrown.items(), COLOURS, MARKS, strict=False):
            left.plot(1e3 * time, exact, color=colour)
            left.plot(
                1e3 * time[::10], found[::10], mark, color=colour, markersize=4, label=f"μ = {mu:g}, {first:g} mm/s"
            )
        left.set_xlabel("time, ms")
        left.set_ylabel("speed, mm/s")
        left.legend()
        speed, found, law = friction
        sliding_on = speed > 5.0
        right.plot(speed[sliding_on][::-5], found[sliding_on][::-5], "o", color=BLUE, markersize=4, label="computed")
        right.plot(speed[sliding_on], law[sliding_on], color=ORANGE, label="law")
        right.set_xlabel("speed, mm/s")
        right.set_ylabel("friction over weight")
        right.set_ylim(0.0, 0.32)
        right.legend()
    return figure


def taylor(profiles: Mapping[str, tuple[np.ndarray, np.ndarray]], length: float, radius: float) -> Figure:
    """Draw the outline of the rod, lying, foot to the left."""
    with new_figure(6.4, 3.1) as figure:
        axes = figure.add_subplot()
        axes.plot(
            [0.0, length, length, 0.0], [radius, radius, -radius, -radius], "--", color=FAINT, label="at the start"
        )
        for (name, (z, r)), colour, width in zip(profiles.items(), COLOURS, (2.4, 0.9), strict=False):
            outline = np.concatenate([r, -r[::-1]])
            axes.plot(np.concatenate([z, z[::-1]]), outline, color=colour, linewidth=width, label=name)
        axes.axvline(0.0, color=INK, linewidth=2.5)
        axes.set_aspect("equal")
        axes.set_xlabel("distance from the wall, mm")
        axes.set_ylabel("radius, mm")
        axes.legend(loc="upper right")
    return figure


def energy(history: ForceHistory) -> Figure:
    """Draw the parts of the energy stacked over travel below the blade's work, and the balance's error."""
    with new_figure(6.4, 4.6) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        _stack(upper, history)
        upper.plot(history.travel, history.external, color=INK, linewidth=1.8, label="work of the blade")
        upper.set_ylabel("energy, mJ")
        upper.legend(loc="upper left", reverse=True)
        lower.axhline(0.0, color=FAINT, linewidth=0.6)
        lower.plot(history.travel, 100.0 * history.balance / history.external.max(), color=ORANGE)
        lower.set_ylabel("error, %\nof the work")
        lower.set_xlabel("travel of the blade, mm")
        lower.set_ylim(-1.0, 1.0)
    return figure


def _stack(axes: Axes, history: ForceHistory) -> None:
    names = ("internal", "hourglass", "eroded", "contact", "kinetic")
    colours = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#777777")
    axes.stackplot(
        history.travel, *[getattr(history, name) for name in names], labels=names, colors=colours, alpha=0.75
    )
