"""Figures that question a result: residuals, runs that sway the surface, where it climbs, how forces grow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import exp, log
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

from stemcal.report.style import BLUE, FAINT, GREEN, ORANGE, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Stage = Mapping[str, Any]
_NORMAL = NormalDist()


def diagnostics(rsm: Stage) -> Figure:
    """Return residuals against the normal law and over the runs, and how much each run sways the surface.

    Source: Montgomery, Design and Analysis of Experiments, ch. 10.
    """
    rows, residuals = rsm["runs_diagnostics"], studentised(rsm)
    runs = [row["run"] for row in rows]
    figure = new_figure(width=6.4, height=2.4)
    with styled():
        normal, order, influence = figure.subplots(1, 3)
        _normal_plot(normal, residuals)
        order.axhline(0, color=FAINT, linewidth=1)
        order.plot(runs, residuals, "o", color=BLUE, markersize=4)
        order.set_ylabel("studentised residual")
        influence.bar(runs, [row["cooks_distance"] or 0.0 for row in rows], color=BLUE, width=0.7)
        influence.axhline(1.0, color=ORANGE, linestyle="--", linewidth=1)
        influence.set_ylabel("Cook's distance")
        for axes in (order, influence):
            axes.set_xlabel("run")
    return figure


def studentised(rsm: Stage) -> list[float]:
    """Return the residuals over their own standard errors, r/(s·√(1 − h)); 0 where the surface must meet the run."""
    scatter = next(row["mean_square"] for row in rsm["anova"] if row["source"] == "Residual")
    parts = [(row["residual"], (scatter or 0.0) * (1.0 - row["leverage"])) for row in rsm["runs_diagnostics"]]
    return [residual / variance**0.5 if variance > 1e-12 * (scatter or 1.0) else 0.0 for residual, variance in parts]


def growth(validate: Stage) -> Figure:
    """Return measured and simulated force over diameter on logarithmic axes, F = c·dⁿ through each."""
    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        axes.set_xscale("log")
        axes.set_yscale("log")
        for name, mark, colour in (("measured", "o", BLUE), ("simulated", "s", ORANGE)):
            rows = [row for row in validate["rows"] if row[name] is not None]
            _power_law(axes, [r["diameter"] for r in rows], [r[name] for r in rows], validate[f"{name}_exponent"], name)
            axes.plot([r["diameter"] for r in rows], [r[name] for r in rows], mark, color=colour)
        _plain_ticks(axes, [row["diameter"] for row in validate["rows"]])
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("maximum force, N")
        axes.legend(loc="upper left")
    return figure


def _power_law(
    axes: Axes, diameters: Sequence[float], forces: Sequence[float], exponent: Mapping[str, float | None], name: str
) -> None:
    """Draw c·dⁿ with the geometric mean's c."""
    n = exponent["value"] or 0.0
    c = exp(sum(log(f / d**n) for d, f in zip(diameters, forces, strict=True)) / len(forces))
    ends = [min(diameters), max(diameters)]
    known = exponent["low"] is not None and exponent["high"] is not None  # two diameters leave no scatter to tell
    label = f"{name}: n = {n:.2f}" + (f" ({exponent['low']:.2f} to {exponent['high']:.2f})" if known else "")
    colour, line = (BLUE, "-") if name == "measured" else (ORANGE, "--")
    axes.plot(ends, [c * d**n for d in ends], linestyle=line, color=colour, label=label)


def _plain_ticks(axes: Axes, diameters: Sequence[float]) -> None:
    from matplotlib.ticker import NullFormatter, NullLocator, StrMethodFormatter

    axes.set_xticks(sorted(set(diameters)), [f"{d:g}" for d in sorted(set(diameters))])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="y", which="minor", labelsize=7)


def _normal_plot(axes: Axes, residuals: Sequence[float]) -> None:
    """Draw sorted residuals over normal scores, (i − ½)/n; a sample of the normal law lies on the line."""
    count = len(residuals)
    scores = [_NORMAL.inv_cdf((rank + 0.5) / count) for rank in range(count)]
    axes.plot([scores[0], scores[-1]], [scores[0], scores[-1]], color=FAINT, linestyle="--", linewidth=1)
    axes.plot(scores, sorted(residuals), "o", color=BLUE, markersize=4)
    axes.set_xlabel("normal score")
    axes.set_ylabel("studentised residual")


def ridge(rsm: Stage, invert: Stage | None = None) -> Figure:
    """Return the largest force that the surface predicts at each coded radius, and where it is.

    Source: Draper, Technometrics 5 (1963) 469.
    """
    rows = rsm["ridge"]
    radius = [row["radius"] for row in rows]
    figure = new_figure(width=6.4, height=2.8)
    with styled():
        force, place = figure.subplots(1, 2)
        known = [row for row in rows if row["standard_error"] is not None]  # none where runs are as many as terms
        low, high = ([row["predicted"] + sign * 2.0 * row["standard_error"] for row in known] for sign in (-1.0, 1.0))
        force.fill_between([row["radius"] for row in known], low, high, color=BLUE, alpha=0.2, linewidth=0)
        force.plot(radius, [row["predicted"] for row in rows], "o-", color=BLUE, markersize=4)
        if invert is not None:
            force.axhline(invert["target"], color=ORANGE, linestyle="--", label="measured force")
            force.legend(loc="upper left")
        force.set_ylabel("largest predicted force, N")
        marks = zip(rsm["names"], ("o-", "s--", "^-.", "D:"), (BLUE, ORANGE, GREEN, "#cc79a7"), strict=False)
        for name, mark, colour in marks:
            values = [row["coded"][name] for row in rows]
            place.plot(radius, values, mark, color=colour, markersize=4, label=name.replace("$", r"\$"))
        place.set_ylabel("coded value there")
        place.legend(loc="upper left")
        for axes in (force, place):
            axes.set_xlabel("coded radius")
    return figure
