"""The figures of a response surface: how well it fits its runs, and itself over each pair of factors."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations
from statistics import NormalDist

from stemcal.naming import Names
from stemcal.report.figures.plot import Plot
from stemcal.report.figures.style import BLUE, FAINT, ORANGE, Axes, Figure, new_figure, plain
from stemcal.stages.surface.contour import Solution, contours, relief
from stemcal.stages.surface.result import SurfaceResult

_NORMAL = NormalDist()


def plots(rsm: SurfaceResult, solved: Solution | None, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a surface; with a solution they show it."""
    observed = f"Simulated {rsm.naming.response.noun} versus the value predicted by the response surface."
    checks = (
        "Normal plot of the residuals (a straight line if normal), residuals in run order (no trend expected), and the "
        "influence of each run (strong above a Cook's distance of 1, dashed line)."
    )
    plots = [
        Plot("observed-predicted", "rsm", observed, partial(observed_predicted, rsm), detail=True),
        Plot("residuals", "rsm", "Residuals of the surface for each run.", partial(residuals, rsm), detail=True),
    ]
    if rsm.runs_diagnostics:
        plots.append(Plot("diagnostics", "rsm", checks, partial(diagnostics, rsm), wide=True, detail=True))
    for pair in combinations(rsm.names, 2):
        plots += _pair_plots(rsm, pair, solved, labels)
    return plots


def _pair_plots(
    rsm: SurfaceResult, pair: tuple[str, str], solved: Solution | None, labels: Mapping[str, str]
) -> list[Plot]:
    """Return contours and relief over two factors."""
    response, alone = rsm.naming.response, len(rsm.names) == 2
    over = f"versus {Names(rsm.naming, labels).factors(pair)}"
    held = "" if alone else f", with the other factors at the {'solution' if solved else 'centre'}"
    unit = f" in {response.written}" if response.written else ""
    met = f" Orange: the measured {response.noun}; star: the solution." if solved else ""
    lines = f"Contours of the {response.noun}{unit} {over}{held}.{met} White dots: design points; numbers: repeats."
    dots = " Dots: runs, filled above the surface and open below it." if alone else ""
    relieved = f"Response surface of the {response.noun} {over}{held}, with contours projected onto the base.{dots}"
    flat, lifted = (partial(draw, rsm, pair, solved, labels) for draw in (contours, relief))
    return [
        Plot(f"contour-{'-'.join(pair)}", "rsm", lines, flat),
        Plot(f"surface-{'-'.join(pair)}", "rsm", relieved, lifted),
    ]


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
    """Draw sorted residuals over normal scores, (i − ½)/n; a sample of the normal law is on the line."""
    count = len(residuals)
    scores = [_NORMAL.inv_cdf((rank + 0.5) / count) for rank in range(count)]
    axes.plot([scores[0], scores[-1]], [scores[0], scores[-1]], color=FAINT, linestyle="--", linewidth=1)
    axes.plot(scores, sorted(residuals), "o", color=BLUE, markersize=4)
    axes.set_xlabel("normal score")
    axes.set_ylabel("studentised residual")
