"""Measured and simulated force over the diameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import geometric_mean
from typing import TYPE_CHECKING

from stemcal.doe.validation.diameters import Exponent
from stemcal.report.figures.style import BLUE, INK, ORANGE, legend_above, new_figure, styled
from stemcal.stages.validate import ValidateResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_TICKS = 12


def validation(validate: ValidateResult, spread: Mapping[float, float] | None = None) -> Figure:
    """Return measured and simulated force over diameter; the calibration diameter is ringed.

    `spread` has the standard deviations of the measured forces (N) by diameter.
    """
    rows = validate.compared
    figure = new_figure(height=2.9)
    with styled():
        axes = figure.add_subplot()
        axes.plot([r.diameter for r in rows], [r.measured for r in rows], "o-", color=BLUE, label="measured")
        done = [(r.diameter, r.simulated) for r in rows if r.simulated is not None]
        axes.plot(
            [diameter for diameter, _ in done],
            [force for _, force in done],
            "s--",
            color=ORANGE,
            label="simulated",
        )
        barred = [r for r in rows if r.diameter in (spread or {})]
        if spread and barred:
            at, means = [r.diameter for r in barred], [r.measured for r in barred]
            lengths = [spread[r.diameter] for r in barred]
            axes.errorbar(at, means, yerr=lengths, fmt="none", ecolor=BLUE, elinewidth=1, capsize=3)
        for row in rows:
            if row.role == "calibration":
                axes.plot(row.diameter, row.measured, "o", color=INK, fillstyle="none", markersize=13)
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("maximum force, N")
        axes.set_ylim(bottom=0)
        if len(at := sorted({row.diameter for row in rows})) <= _MOST_TICKS:
            axes.set_xticks(at, [f"{diameter:g}" for diameter in at])
        legend_above(axes)
    return figure


def growth(validate: ValidateResult) -> Figure:
    """Return measured and simulated force over diameter on logarithmic axes, F = c·dⁿ through each."""
    rows = validate.compared
    measured = [(row.diameter, row.measured) for row in rows]
    simulated = [(row.diameter, row.simulated) for row in rows if row.simulated is not None]
    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        axes.set_xscale("log")
        axes.set_yscale("log")
        _power_law(axes, measured, validate.measured_exponent, "measured", "o", "-", BLUE)
        _power_law(axes, simulated, validate.simulated_exponent, "simulated", "s", "--", ORANGE)
        _plain_ticks(axes, [row.diameter for row in rows])
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("maximum force, N")
        legend_above(axes, most=1)
    return figure


def _power_law(
    axes: Axes,
    points: Sequence[tuple[float, float]],
    exponent: Exponent | None,
    name: str,
    mark: str,
    line: str,
    colour: str,
) -> None:
    """Draw points and, where there is one, the law through them: it passes the mean of their logarithms."""
    diameters, forces = [d for d, _ in points], [force for _, force in points]
    if exponent is not None:
        n, ends = exponent.value, [min(diameters), max(diameters)]
        factor = geometric_mean(forces) / geometric_mean(diameters) ** n
        known = f" ({exponent.low:.2f} to {exponent.high:.2f})" if exponent.low is not None else ""
        axes.plot(
            ends, [factor * d**n for d in ends], linestyle=line, color=colour, label=f"{name}: n = {n:.2f}{known}"
        )
    axes.plot(diameters, forces, mark, color=colour)


def _plain_ticks(axes: Axes, diameters: Sequence[float]) -> None:
    from matplotlib.ticker import NullFormatter, NullLocator, StrMethodFormatter

    axes.set_xticks(sorted(set(diameters)), [f"{d:g}" for d in sorted(set(diameters))])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="y", which="minor", labelsize=7)
