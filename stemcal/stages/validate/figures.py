"""The figures of a validation: measured and simulated responses over the conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from statistics import geometric_mean

from stemcal.doe.comparison import Exponent
from stemcal.naming import DIAMETER, FIRST, FORCE, Named
from stemcal.report.figures.plot import Plot
from stemcal.report.figures.style import BLUE, INK, ORANGE, Axes, Figure, legend_above, new_figure, plain
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model import Study

MOST_RESPONSES = 6  # whose figures the page shows
_MOST_TICKS = 12


def plots(study: Study, validate: ValidateResult) -> list[Plot]:
    """Return the figures of a validation."""
    naming, plots = study.naming, []
    worst = _largest_errors(validate)
    responses = [naming.response, *(other for other in naming.others if other.name in worst)]
    shown = {naming.response.name, *sorted(worst, key=lambda name: -worst[name])[: MOST_RESPONSES - 1]}
    for response in responses:
        spread = _spread_of(study, response)
        text = f"Measured and simulated {response.long}"
        if naming.condition is not None:
            text += "; the circled values were fitted" if validate.fitted else ""
        text += ". Bars show the standard deviation of the measurements." if spread else "."
        name = "validation" if response is naming.response else f"validation-{response.name}"
        draw, on_page = partial(validation, validate, spread, response), response.name in shown
        if response is naming.response and len(responses) > len(shown):
            text += f" Of {len(responses)} responses, the report shows the {len(shown)} with the largest errors."
        plots.append(Plot(name, "validate", text, draw, on_page))
    if naming.is_force_on_stems and validate.measured_exponent and validate.simulated_exponent:
        text = (
            "Measured and simulated force versus diameter on logarithmic axes. The slope of a line is the exponent n "
            "in F ∝ dⁿ."
        )
        plots.append(Plot("growth", "validate", text, partial(growth, validate)))
    return plots


def _largest_errors(validate: ValidateResult) -> dict[str, float]:
    """Return the largest absolute error of each further response, percent."""
    largest: dict[str, float] = {}
    for row in validate.rows:
        for one in row.further:
            largest[one.response] = max(largest.get(one.response, 0.0), abs(one.error_percent or 0.0))
    return largest


def _spread_of(study: Study, response: Named) -> dict[float, float]:
    """Return the standard deviation of what was measured of a response, by the condition."""
    name = FIRST if response is study.naming.response else response.name
    measured = ((target.condition, target.mean_of(name)[1]) for target in study.targets.means)
    return {place: sd for place, sd in measured if sd is not None}


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
    Without a condition the values have one place.
    """
    condition, response = validate.naming.condition, response or validate.naming.response
    rows = _pairs(validate, response)
    with new_figure(height=2.9) as figure:
        axes = figure.add_subplot()
        axes.plot([r.condition for r in rows], [r.measured for r in rows], "o-", color=BLUE, label="measured")
        done = [(r.condition, r.simulated) for r in rows if r.simulated is not None]
        axes.plot(
            [place for place, _ in done],
            [value for _, value in done],
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
        axes.set_xlabel("" if condition is None else plain(condition.axis()))
        axes.set_ylabel(plain(response.axis()))
        if response.apart:
            axes.margins(y=0.1)
        else:
            axes.set_ylim(
                0.0,
                max(axes.get_ylim()[1], *(1.03 * (r.measured + (spread or {}).get(r.condition, 0.0)) for r in rows)),
            )
        if len(at := sorted({row.condition for row in rows})) <= _MOST_TICKS:
            axes.set_xticks(at, [f"{place:g}" if condition is not None else "" for place in at])
        legend_above(axes)
    return figure


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
