"""The figures of a screening: effects by size, and against chance."""

from collections.abc import Mapping
from functools import partial
from statistics import NormalDist
from typing import Any

from stemcal.report.figures.plot import Plot
from stemcal.report.figures.style import BLUE, FAINT, INK, ORANGE, Figure, legend_above, new_figure, plain
from stemcal.report.tables.columns import response_decimals
from stemcal.stages.screen.result import Limit, ScreenResult
from stemcal.stages.screen.words import limit_label

_LINES = {"lenth": "--", "lenth_all": ":", "t": "-."}


def plots(screen: ScreenResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a screening."""
    response = screen.naming.response.noun
    bars = (
        f"Effects by size: blue increases and orange decreases the {response}. An effect beyond Lenth's margin of "
        f"error (ME) "
        "or the limit of the t test is significant; beyond SME also after correction for the number of effects."
    )
    line = (
        "Half-normal plot: significant effects are above the line and beyond Lenth's margins. Symbols as in "
        "the table of effects."
    )
    return [
        Plot("pareto", "screen", bars, partial(pareto, screen, labels)),
        Plot("half-normal", "screen", line, partial(half_normal, screen)),
    ]


def pareto(screen: ScreenResult, labels: Mapping[str, str] | None = None) -> Figure:
    """Return the effects by size, with Lenth's margin of error; `labels` has what to write for a factor."""
    effects = sorted(screen.effects, key=lambda e: abs(e.effect))
    with new_figure(height=max(2.2, 0.9 + 0.24 * len(effects))) as figure:
        axes = figure.add_subplot()
        places = response_decimals(screen.naming.response, [e.effect for e in effects], 1)
        names = [f"{plain((labels or {}).get(e.factor, e.factor))}  {_signed(e.effect, places)}" for e in effects]
        colours = [ORANGE if e.effect < 0 else BLUE for e in effects]
        axes.barh(names, [abs(e.effect) for e in effects], color=colours, height=0.7)
        for limit in screen.limits():
            axes.axvline(limit.value, color=INK, **_line(limit, screen))
        if axes.lines:
            figure.legend(loc="outside upper right", ncols=3)
        axes.set_xlabel(plain(screen.naming.response.headed(f"|effect| on the {screen.naming.response.long}")))
    return figure


def _line(limit: Limit, screen: ScreenResult) -> dict[str, Any]:
    """Return how the line of a limit looks, and what it is called."""
    return {"linestyle": _LINES[limit.method], "linewidth": 1, "label": limit_label(limit, screen.alpha)}


def _signed(effect: float, places: int = 1) -> str:
    """Return an effect with its sign and a number of decimals.

    >>> _signed(-8.0), _signed(74.69)
    ('−8.0', '+74.7')
    """
    return f"{effect:+.{places}f}".replace("-", "−")


def half_normal(screen: ScreenResult) -> Figure:
    """Return |effect| against the half-normal quantile Φ⁻¹(½ + ½(i − ½)/m); real effects leave the line of chance.

    Source: C. Daniel, Technometrics 1 (1959), 311–341.
    """
    effects, m = sorted(screen.effects, key=lambda e: abs(e.effect)), len(screen.effects)
    points = [(NormalDist().inv_cdf(0.5 + 0.5 * (i + 0.5) / m), e) for i, e in enumerate(effects)]
    with new_figure() as figure:
        axes = figure.add_subplot()
        if screen.lenth.pse is not None:
            last = points[-1][0]
            axes.plot([0, last], [0, screen.lenth.pse * last], color=FAINT, label="chance (Lenth)")
        for limit in (one for one in screen.limits() if one.method != "t"):
            axes.axhline(limit.value, color=FAINT, **_line(limit, screen))
        if axes.lines:
            legend_above(axes)
        for quantile, effect in points:
            chosen, size = effect.factor in screen.significant, abs(effect.effect)
            axes.plot(quantile, size, "o", color=BLUE if chosen else FAINT)
            if chosen:
                axes.annotate(
                    plain(effect.symbol or effect.factor), (quantile, size), (0, 4),
                    textcoords="offset points", ha="center", va="bottom", size=8,
                )  # fmt: skip
        axes.set_xlabel("half-normal score")
        axes.set_ylabel(plain(screen.naming.response.headed("|effect|")))
    return figure
