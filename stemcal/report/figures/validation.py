"""Measured and simulated responses over the conditions: of the validation, before and after a refinement."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import geometric_mean

from stemcal.doe.validation.comparison import Exponent
from stemcal.naming import DIAMETER, FORCE, Named
from stemcal.report.figures.style import BLUE, FAINT, GREEN, INK, ORANGE, Axes, Figure, legend_above, new_figure, plain
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.validate.result import ValidateResult

_MOST_TICKS = 12


@dataclass(frozen=True)
class _Pair:
    """What was measured and simulated of a response at one value of the condition."""

    condition: float
    role: str
    measured: float
    simulated: float | None


def validation(
    validate: ValidateResult, spread: Mapping[float, float] | None = None, response: Named | None = None
) -> Figure:
    """Return a response measured and simulated over the condition; that of the calibration is ringed.

    `spread` has the standard deviations of the measurements by the condition; the first response is the default.
    Without a condition the two stand side by side.
    """
    condition, response = validate.naming.condition, response or validate.naming.response
    pairs = _pairs(validate, response)
    if condition is None:
        return _side_by_side(pairs, spread or {}, response)
    return _over(condition, pairs, spread, response)


def _pairs(validate: ValidateResult, response: Named) -> list[_Pair]:
    if response == validate.naming.response:
        return [_Pair(row.condition, row.role, row.measured, row.simulated) for row in validate.compared]
    return [
        _Pair(
            row.compared.condition,
            row.compared.role,
            response.counted(further.measured, further.measured),
            response.counted(further.simulated, further.measured),
        )
        for row in validate.rows
        for further in row.further
        if further.response == response.name
    ]


def _side_by_side(pairs: Sequence[_Pair], spread: Mapping[float, float], response: Named) -> Figure:
    """Draw what was measured, with its scatter, beside what was simulated."""
    with new_figure(width=3.4, height=2.9) as figure:
        axes = figure.add_subplot()
        for pair in pairs:
            axes.errorbar(0, pair.measured, yerr=spread.get(pair.condition), fmt="o", color=BLUE, capsize=4)
            if pair.simulated is not None:
                axes.plot(1, pair.simulated, "s", color=ORANGE)
        axes.set_xticks([0, 1], ["measured", "simulated"])
        axes.set_xlim(-0.6, 1.6)
        axes.set_ylabel(plain(response.axis()))
        axes.margins(y=0.4)
    return figure


def _over(condition: Named, rows: Sequence[_Pair], spread: Mapping[float, float] | None, response: Named) -> Figure:
    with new_figure(height=2.9) as figure:
        axes = figure.add_subplot()
        axes.plot([r.condition for r in rows], [r.measured for r in rows], "o-", color=BLUE, label="measured")
        done = [(r.condition, r.simulated) for r in rows if r.simulated is not None]
        axes.plot(
            [condition for condition, _ in done],
            [response for _, response in done],
            "s--",
            color=ORANGE,
            label="simulated",
        )
        barred = [r for r in rows if r.condition in (spread or {})]
        if spread and barred:
            at, means = [r.condition for r in barred], [r.measured for r in barred]
            lengths = [spread[r.condition] for r in barred]
            axes.errorbar(at, means, yerr=lengths, fmt="none", ecolor=BLUE, elinewidth=1, capsize=3)
        for row in rows:
            if row.role == "fitted":
                axes.plot(row.condition, row.measured, "o", color=INK, fillstyle="none", markersize=13)
        axes.set_xlabel(plain(condition.axis()))
        axes.set_ylabel(plain(response.axis()))
        if response.apart:
            axes.margins(y=0.1)
        else:
            axes.set_ylim(
                0.0,
                max(axes.get_ylim()[1], *(1.03 * (r.measured + (spread or {}).get(r.condition, 0.0)) for r in rows)),
            )
        if len(at := sorted({row.condition for row in rows})) <= _MOST_TICKS:
            axes.set_xticks(at, [f"{condition:g}" for condition in at])
        legend_above(axes)
    return figure


def growth(validate: ValidateResult) -> Figure:
    """Return measured and simulated force over diameter on logarithmic axes, F = c·dⁿ through each."""
    rows = validate.compared
    measured = [(row.condition, row.measured) for row in rows]
    simulated = [(row.condition, row.simulated) for row in rows if row.simulated is not None]
    with new_figure() as figure:
        axes = figure.add_subplot()
        axes.set_xscale("log")
        axes.set_yscale("log")
        _power_law(axes, measured, validate.measured_exponent, "measured", "o", "-", BLUE)
        _power_law(axes, simulated, validate.simulated_exponent, "simulated", "s", "--", ORANGE)
        _plain_ticks(axes, [row.condition for row in rows])
        axes.set_xlabel(DIAMETER.axis())
        axes.set_ylabel(FORCE.axis())
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
    conditions, responses = [d for d, _ in points], [response for _, response in points]
    if exponent is not None:
        n, ends = exponent.value, [min(conditions), max(conditions)]
        factor = geometric_mean(responses) / geometric_mean(conditions) ** n
        known = f" ({exponent.low:.2f} to {exponent.high:.2f})" if exponent.low is not None else ""
        axes.plot(
            ends, [factor * d**n for d in ends], linestyle=line, color=colour, label=f"{name}: n = {n:.2f}{known}"
        )
    axes.plot(conditions, responses, mark, color=colour)


def _plain_ticks(axes: Axes, conditions: Sequence[float]) -> None:
    from matplotlib.ticker import NullFormatter, NullLocator, StrMethodFormatter

    axes.set_xticks(sorted(set(conditions)), [f"{d:g}" for d in sorted(set(conditions))])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="y", which="minor", labelsize=7)


_SERIES = (("measured", "o-", BLUE), ("before", "^:", FAINT), ("after", "D-", GREEN))


def refined(stage: RefineResult) -> Figure:
    """Return the responses over the condition; the target is ringed."""
    condition = stage.naming.condition
    with new_figure(height=3.1) as figure:
        axes = figure.add_subplot()
        for key, style, colour in _SERIES:
            points = [(row.condition, value) for row in stage.rows if (value := getattr(row, key)) is not None]
            axes.plot([at for at, _ in points], [value for _, value in points], style, color=colour, label=key)
        axes.plot(stage.condition, stage.aim, "o", color=INK, fillstyle="none", markersize=13)
        at = [row.condition for row in stage.rows]
        axes.set_xticks(at, [f"{value:g}" for value in at] if condition is not None else [""] * len(at))
        axes.set_xlabel("" if condition is None else plain(condition.axis()))
        axes.set_ylabel(plain(stage.naming.response.axis()))
        axes.set_ylim(bottom=0)
        legend_above(axes, most=3)
    return figure
