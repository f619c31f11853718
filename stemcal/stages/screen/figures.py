"""The figures of a screening."""

from collections.abc import Mapping
from functools import partial

from stemcal.report.figures.effects import half_normal, pareto
from stemcal.report.figures.plot import Plot
from stemcal.stages.screen.result import ScreenResult


def plots(screen: ScreenResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a screening."""
    response = screen.naming.response.noun
    bars = (
        f"Effects by size; blue raises and orange lowers the {response}. An effect beyond Lenth's margin of error (ME) "
        "or the limit of the t test is significant; beyond SME also after correction for the number of effects."
    )
    line = (
        "Half-normal plot: effects above the line of chance and beyond Lenth's margins are significant. Symbols are "
        "those of the table of effects."
    )
    return [
        Plot("pareto", "screen", bars, partial(pareto, screen, labels)),
        Plot("half-normal", "screen", line, partial(half_normal, screen)),
    ]
