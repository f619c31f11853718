"""Figures of what the laboratory brought."""

from stemcal.measured.diameters import Diameters
from stemcal.measured.shear import ShearTests
from stemcal.report.figures.style import BLUE, FAINT, INK, ORANGE, Figure, new_figure, styled

SYNTHETIC = "synthetic data, not measured"


def diameter_histogram(found: Diameters) -> Figure:
    """Return the histogram of stem diameters with the fitted normal curve and the limits of the grades."""
    import numpy as np

    values = np.array([stem.diameter for stem in found.stems])
    edges = np.histogram_bin_edges(values, bins="fd")
    mean, sd = found.summary.mean, found.summary.sd or 0.0
    x = np.linspace(min(edges[0], mean - 3 * sd), max(edges[-1], mean + 3 * sd), 200)
    # n·w·φ((x − x̄)/s)/s
    curve = len(values) * (edges[1] - edges[0]) * np.exp(-0.5 * ((x - mean) / sd) ** 2) / (sd * np.sqrt(2 * np.pi))
    with new_figure() as figure:
        axes = figure.add_subplot()
        axes.hist(values, bins=edges.tolist(), color=BLUE, alpha=0.75, edgecolor="white", linewidth=0.6)
        axes.plot(x, curve, color=ORANGE, label=f"normal, {mean:.2f} ± {sd:.2f} mm")
        for limit in sorted({limit for grade in found.grades for limit in (grade.low, grade.high)}):
            axes.axvline(limit, color=FAINT, linestyle=":", linewidth=0.9)
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("stems")
        axes.set_ylim(top=1.25 * axes.get_ylim()[1])
        axes.locator_params(axis="y", integer=True)
        axes.legend(loc="upper right")
    return _marked(figure, found.synthetic)


def shear_curves(tests: ShearTests) -> Figure:
    """Return force over travel of all specimens, coloured by grade."""
    import matplotlib

    with new_figure(width=6.4) as figure:
        axes = figure.add_subplot()
        colours = matplotlib.colormaps["viridis"]
        for number, grade in enumerate(tests.grades):
            colour = colours(0.9 * number / max(1, len(tests.grades) - 1))
            curves = [specimen.curve for specimen in tests.specimens if specimen.grade == grade.diameter]
            for index, curve in enumerate(curves):
                label = f"{grade.diameter:g} mm" if index == 0 else None
                axes.plot(curve.travel, curve.force, color=colour, linewidth=0.8, alpha=0.8, label=label)
        axes.set_xlabel("blade travel after preload, mm")
        axes.set_ylabel("force, N")
        axes.set_ylim(bottom=0)
        axes.margins(x=0)
        axes.legend(loc="upper right")
    return _marked(figure, tests.synthetic)


def force_over_diameter(tests: ShearTests) -> Figure:
    """Return the maximum force of every specimen, the grades' means with intervals, and the power law."""
    import numpy as np

    with new_figure() as figure:
        axes = figure.add_subplot()
        counted = [specimen for specimen in tests.specimens if not specimen.excluded]
        diameters = [specimen.diameter for specimen in counted]
        axes.plot(diameters, [s.curve.max_force for s in counted], "o", color=FAINT, markersize=3, label="specimens")
        means = [(g.diameter, g.summary.mean, g.summary.mean_interval) for g in tests.grades]
        known = [(at, mean, interval[1] - mean) for at, mean, interval in means if interval]
        at, heights, reach = zip(*known, strict=True) if known else ((), (), ())
        axes.errorbar(at, heights, yerr=reach, fmt="s", color=BLUE, capsize=3, label="mean, 95 %")
        if (law := tests.power_law) is not None:
            d = np.linspace(min(diameters), max(diameters), 100).tolist()
            axes.plot(d, [law.at(x) for x in d], color=ORANGE, label=f"∝ d^{law.exponent:.2f}")
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("maximum shear force, N")
        axes.set_ylim(bottom=0)
        axes.legend(loc="upper left")
    return _marked(figure, tests.synthetic)


def _marked(figure: Figure, synthetic: bool) -> Figure:
    """Write across the figure of made-up data that they are."""
    if synthetic:
        with styled():
            figure.suptitle(SYNTHETIC, color=INK, fontsize=8, fontstyle="italic")
    return figure
