"""Force and energies of runs over the travel of the blade."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

from stemcal.report.figures.style import BLUE, FAINT, GREEN, INK, ORANGE, new_figure, plain, styled
from stemcal.report.records import Curve

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def force_travel(curves: Mapping[str, Curve], highlighted: Collection[str] = ()) -> Figure:
    """Return force over blade travel for all runs; the highlighted ones stand out and are named."""
    colours = (BLUE, ORANGE, GREEN, "#cc79a7", "#e69f00", "#56b4e9")
    figure = new_figure(width=6.4 if len(curves) > 3 else 4.7)
    with styled():
        axes = figure.add_subplot()
        for name, curve in curves.items():
            if name not in highlighted:
                axes.plot(curve.travel, curve.force, color=FAINT, linewidth=0.7, alpha=0.6)
        for index, name in enumerate(n for n in curves if n in highlighted):
            axes.plot(curves[name].travel, curves[name].force, color=colours[index % len(colours)], label=plain(name))
        axes.set_xlabel("blade travel, mm")
        axes.set_ylabel("force, N")
        axes.margins(x=0)
        axes.set_ylim(bottom=0)
        if highlighted:
            axes.legend(loc="upper left")
    return figure


def energies(rows: Mapping[str, Sequence[float]]) -> Figure:
    """Return the energies of a run over blade travel: work done, and where it went."""
    styles = {
        "external": ("work of the blade", INK, "-"),
        "internal": ("internal", BLUE, "-"),
        "eroded": ("in eroded elements", ORANGE, "-"),
        "contact": ("friction and contact", GREEN, "-"),
        "hourglass": ("hourglass", "#cc79a7", "--"),
        "kinetic": ("kinetic", FAINT, "--"),
    }
    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        for name, (label, colour, line) in styles.items():
            axes.plot(rows["travel"], rows[name], color=colour, linestyle=line, label=label)
        axes.set_xlabel("blade travel, mm")
        axes.set_ylabel("energy, mJ")
        axes.margins(x=0)
        axes.set_ylim(bottom=0)
        axes.legend(loc="upper left")
    return figure
