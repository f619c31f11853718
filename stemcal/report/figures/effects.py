"""Effects of a screening by size and against chance, and how well a surface fits its runs."""

from collections.abc import Mapping, Sequence
from statistics import NormalDist
from typing import Any

from stemcal.report.figures.style import BLUE, FAINT, INK, ORANGE, Axes, Figure, legend_above, new_figure, plain
from stemcal.report.tables.columns import response_decimals
from stemcal.stages.screen.result import Limit, ScreenResult
from stemcal.stages.screen.words import limit_label
from stemcal.stages.surface.result import SurfaceResult

_LINES = {"lenth": "--", "lenth_all": ":", "t": "-."}


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
    """Return an effect with its sign and so many decimals.

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


_NORMAL = NormalDist()


def _fit(rsm: SurfaceResult) -> tuple[list[int], list[float], list[float]]:
    """Return run numbers, observed and predicted forces of the runs that gave one."""
    runs = [(run.run, run.response, run.coded) for run in rsm.design.runs if run.response is not None]
    predicted = [float(rsm.response_at(coded)) for _, _, coded in runs]
    return [number for number, _, _ in runs], [response for _, response, _ in runs], predicted


def observed_predicted(rsm: SurfaceResult) -> Figure:
    """Return simulated forces against what the surface predicts for them."""
    _, observed, predicted = _fit(rsm)
    with new_figure() as figure:
        axes = figure.add_subplot()
        ends = [min(observed + predicted), max(observed + predicted)]
        axes.plot(ends, ends, color=FAINT, linestyle="--")
        axes.plot(predicted, observed, "o", color=BLUE, alpha=0.85)
        axes.set_xlabel(plain(rsm.naming.response.axis("predicted by the surface")))
        axes.set_ylabel(plain(rsm.naming.response.axis("simulated")))
    return figure


def residuals(rsm: SurfaceResult) -> Figure:
    """Return residuals over predicted force, the largest named by its run."""
    runs, observed, predicted = _fit(rsm)
    rest = [o - p for o, p in zip(observed, predicted, strict=True)]
    with new_figure() as figure:
        axes = figure.add_subplot()
        axes.axhline(0, color=FAINT, linewidth=1)
        axes.plot(predicted, rest, "o", color=BLUE, alpha=0.85)
        worst = max(range(len(rest)), key=lambda i: abs(rest[i]))
        axes.annotate(
            f"run {runs[worst]}",
            (predicted[worst], rest[worst]),
            (6, 0),
            textcoords="offset points",
            va="center",
            size=8,
        )
        axes.set_xlabel(plain(rsm.naming.response.axis("predicted by the surface")))
        axes.set_ylabel(plain(rsm.naming.response.axis("simulated − predicted")))
        axes.margins(x=0.1)
    return figure


def diagnostics(rsm: SurfaceResult) -> Figure:
    """Return residuals against the normal law and over the runs, and how strongly each run influences the surface.

    Source: Montgomery, Design and Analysis of Experiments, ch. 10.
    """
    rows, residuals = rsm.runs_diagnostics, studentised(rsm)
    runs = [row.run for row in rows]
    with new_figure(width=6.4, height=2.4) as figure:
        normal, order, influence = figure.subplots(1, 3)
        _normal_plot(normal, residuals)
        order.axhline(0, color=FAINT, linewidth=1)
        order.plot(runs, residuals, "o", color=BLUE, markersize=4)
        order.set_ylabel("studentised residual")
        influence.bar(runs, [row.cooks_distance or 0.0 for row in rows], color=BLUE, width=0.7)
        influence.axhline(1.0, color=ORANGE, linestyle="--", linewidth=1)
        influence.set_ylabel("Cook's distance")
        for axes in (order, influence):
            axes.set_xlabel("run")
    return figure


def studentised(rsm: SurfaceResult) -> list[float]:
    """Return the residuals over their own standard errors, r/(s·√(1 − h)); 0 where the surface must meet the run."""
    scatter = row.mean_square if (row := rsm.anova_row("Residual")) else None
    parts = [(row.residual, (scatter or 0.0) * (1.0 - row.leverage)) for row in rsm.runs_diagnostics]
    return [residual / variance**0.5 if variance > 1e-12 * (scatter or 1.0) else 0.0 for residual, variance in parts]


def _normal_plot(axes: Axes, residuals: Sequence[float]) -> None:
    """Draw sorted residuals over normal scores, (i − ½)/n; a sample of the normal law lies on the line."""
    count = len(residuals)
    scores = [_NORMAL.inv_cdf((rank + 0.5) / count) for rank in range(count)]
    axes.plot([scores[0], scores[-1]], [scores[0], scores[-1]], color=FAINT, linestyle="--", linewidth=1)
    axes.plot(scores, sorted(residuals), "o", color=BLUE, markersize=4)
    axes.set_xlabel("normal score")
    axes.set_ylabel("studentised residual")
