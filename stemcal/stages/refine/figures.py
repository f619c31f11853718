"""The figure of a refinement: the responses before and after it."""

from functools import partial

from stemcal.report.figures.plot import Plot
from stemcal.report.figures.style import BLUE, FAINT, GREEN, INK, Figure, legend_above, new_figure, plain
from stemcal.stages.refine.result import RefineResult

_SERIES = (("measured", "o-", BLUE), ("before", "^:", FAINT), ("after", "D-", GREEN))


def plots(stage: RefineResult) -> list[Plot]:
    """Return the figure of a refinement at several conditions."""
    response = stage.naming.response.capital
    text = f"{response}: measured, and simulated before and after the refinement; the target is ringed."
    return [Plot("refinement", "refine", text, partial(refined, stage))] if len(stage.rows) > 1 else []


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
