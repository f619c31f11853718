"""Figures of what the laboratory brought."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.report.figures.style import BLUE, FAINT, INK, ORANGE, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stemcal.measured.curves import Curve

Data = Mapping[str, Any]
SYNTHETIC = "synthetic data, not measured"


def diameter_histogram(data: Data) -> Figure:
    """Return the histogram of stem diameters with the fitted normal curve and the limits of the grades."""
    import numpy as np

    values = np.array([stem["diameter"] for stem in data["stems"]])
    edges = np.histogram_bin_edges(values, bins="fd")
    mean, sd = data["mean"], data["sd"]
    x = np.linspace(min(edges[0], mean - 3 * sd), max(edges[-1], mean + 3 * sd), 200)
    # n·w·φ((x − x̄)/s)/s
    curve = len(values) * (edges[1] - edges[0]) * np.exp(-0.5 * ((x - mean) / sd) ** 2) / (sd * np.sqrt(2 * np.pi))
    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        axes.hist(values, bins=edges.tolist(), color=BLUE, alpha=0.75, edgecolor="white", linewidth=0.6)
        axes.plot(x, curve, color=ORANGE, label=f"normal, {mean:.2f} ± {sd:.2f} mm")
        for limit in sorted({g[side] for g in data["grades"] for side in ("low", "high")}):
            axes.axvline(limit, color=FAINT, linestyle=":", linewidth=0.9)
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("stems")
        axes.set_ylim(top=1.25 * axes.get_ylim()[1])
        axes.locator_params(axis="y", integer=True)
        axes.legend(loc="upper right")
    return _marked(figure, data)


def shear_curves(curves: Mapping[float, Sequence[Curve]], synthetic: bool = False) -> Figure:
    """Return force over travel of all specimens, coloured by grade."""
    import matplotlib

    figure = new_figure(width=6.4)
    with styled():
        axes = figure.add_subplot()
        colours = matplotlib.colormaps["viridis"]
        for number, (grade, specimens) in enumerate(curves.items()):
            colour = colours(0.9 * number / max(1, len(curves) - 1))
            for index, curve in enumerate(specimens):
                label = f"{grade:g} mm" if index == 0 else None
                axes.plot(curve.travel, curve.force, color=colour, linewidth=0.8, alpha=0.8, label=label)
        axes.set_xlabel("blade travel after preload, mm")
        axes.set_ylabel("force, N")
        axes.set_ylim(bottom=0)
        axes.margins(x=0)
        axes.legend(loc="upper right")
    return _marked(figure, {"synthetic": synthetic})


def force_over_diameter(data: Data) -> Figure:
    """Return the maximum force of every specimen, the grades' means with intervals, and the power law."""
    import numpy as np

    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        counted = [s for s in data["specimens"] if not s["excluded"]]
        dots = [[s[name] for s in counted] for name in ("diameter", "max_force")]
        axes.plot(*dots, "o", color=FAINT, markersize=3, label="specimens")
        grades = [g for g in data["grades"] if g["mean_interval"]]
        reach = [g["mean_interval"][1] - g["mean"] for g in grades]
        at, means = [g["diameter"] for g in grades], [g["mean"] for g in grades]
        axes.errorbar(at, means, yerr=reach, fmt="s", color=BLUE, capsize=3, label="mean, 95 %")
        law = data["power_law"]
        if law:
            d = np.linspace(min(dots[0]), max(dots[0]), 100)
            axes.plot(d, law["factor"] * d ** law["exponent"], color=ORANGE, label=f"∝ d^{law['exponent']:.2f}")
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("maximum shear force, N")
        axes.set_ylim(bottom=0)
        axes.legend(loc="upper left")
    return _marked(figure, data)


def _marked(figure: Figure, data: Data) -> Figure:
    """Write across the figure of made-up data that they are."""
    if data["synthetic"]:
        with styled():
            figure.suptitle(SYNTHETIC, color=INK, fontsize=8, fontstyle="italic")
    return figure
