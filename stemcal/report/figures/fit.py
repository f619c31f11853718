"""How well a surface fits its runs, and where it climbs."""

from collections.abc import Sequence
from statistics import NormalDist

from stemcal.report.figures.style import BLUE, FAINT, ORANGE, Axes, Figure, new_figure, plain
from stemcal.stages.surface.result import SurfaceResult

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
