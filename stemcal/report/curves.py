"""Figures of force and energies of runs over blade travel, and of laboratory measurements."""

from bisect import bisect_right
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from stemcal.drawing.style import BLUE, FAINT, GREEN, INK, ORANGE, Axes, Figure, legend_above, literal, new_figure
from stemcal.measured.curve_modes import CurveModes
from stemcal.measured.diameters import Diameters
from stemcal.measured.shear import ShearTests
from stemcal.report.records import RunCurve


def force_travel(curves: Mapping[str, RunCurve], highlighted: Collection[str] = (), of_blade: bool = True) -> Figure:
    """Draw force over travel of runs, dotted after the first fracture; `highlighted` runs are coloured and named."""
    colours = (BLUE, ORANGE, GREEN, "#cc79a7", "#e69f00", "#56b4e9")
    with new_figure(width=6.4 if len(curves) > 3 else 4.7) as figure:
        axes = figure.add_subplot()
        for name, curve in curves.items():
            if name not in highlighted:
                _draw(axes, curve, color=FAINT, linewidth=0.7, alpha=0.6)
        for index, name in enumerate(n for n in curves if n in highlighted):
            _draw(axes, curves[name], color=colours[index % len(colours)], label=literal(name))
        axes.margins(x=0)
        axes.set(xlabel="blade travel, mm" if of_blade else "travel, mm", ylabel="force, N", ylim=(0, None))
        if highlighted:
            legend_above(axes, most=6)
    return figure


def _draw(axes: Axes, curve: RunCurve, **style: Any) -> None:
    end = _until_fracture(curve)
    axes.plot(curve.travel[:end], curve.force[:end], **style)
    after = slice(max(end - 1, 0), None)
    axes.plot(curve.travel[after], curve.force[after], **{**style, "label": None, "linestyle": ":"})


def _until_fracture(curve: RunCurve) -> int:
    return len(curve.travel) if curve.broke is None else bisect_right(curve.travel, curve.broke)


def measured_band(modes: CurveModes, simulated: RunCurve) -> Figure:
    """Draw the simulated curve over the mean of the measured curves ± 2 SD; below, their difference in SD."""
    travel, mean, sd = modes.band
    end = _until_fracture(simulated)
    force = modes.at_shares(np.array(simulated.travel[:end]), np.array(simulated.force[:end]))
    with new_figure() as figure:
        axes, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        axes.fill_between(travel, mean - 2.0 * sd, mean + 2.0 * sd, color=FAINT, alpha=0.4, label="measured, ± 2 SD")
        axes.plot(travel, mean, color=INK, label="mean")
        axes.plot(travel, force, color=BLUE, label="simulated")
        below.axhspan(-2.0, 2.0, color=FAINT, alpha=0.4)
        below.plot(travel, (force - mean) / np.maximum(sd, 1e-9), color=BLUE)
        axes.set(ylabel="force, N", ylim=(0, None))
        below.set(xlabel="travel, mm", ylabel="difference, SD")
        axes.margins(x=0)
        legend_above(axes)
    return figure


def energies(rows: Mapping[str, Sequence[float]]) -> Figure:
    """Draw the work of the blade and the energies of the model over blade travel."""
    styles = {
        "external": ("work done by the blade", INK, "-"),
        "internal": ("internal", BLUE, "-"),
        "eroded": ("deleted elements", ORANGE, "-"),
        "contact": ("friction and contact", GREEN, "-"),
        "hourglass": ("hourglass", "#cc79a7", "--"),
        "kinetic": ("kinetic", FAINT, "--"),
    }
    with new_figure() as figure:
        axes = figure.add_subplot()
        for name, (label, colour, line) in styles.items():
            axes.plot(rows["travel"], rows[name], color=colour, linestyle=line, label=label)
        axes.margins(x=0)
        axes.set(xlabel="blade travel, mm", ylabel="energy, mJ", ylim=(0, None))
        legend_above(axes)
    return figure


SYNTHETIC = "synthetic data, not measured"


def diameter_histogram(measured: Diameters) -> Figure:
    """Draw the histogram of stem diameters with the fitted normal distribution and the limits of the grades."""
    values = np.array([stem.diameter for stem in measured.stems])
    edges = np.histogram_bin_edges(values, bins="fd")
    mean, sd = measured.summary.mean, measured.summary.sd or 0.0
    x = np.linspace(min(edges[0], mean - 3 * sd), max(edges[-1], mean + 3 * sd), 200)
    # number of stems in a bin of width w: n·w·φ((x − x̄)/s)/s
    curve = len(values) * (edges[1] - edges[0]) * np.exp(-0.5 * ((x - mean) / sd) ** 2) / (sd * np.sqrt(2 * np.pi))
    with new_figure() as figure:
        axes = figure.add_subplot()
        axes.hist(values, bins=edges.tolist(), color=BLUE, alpha=0.75, edgecolor="white", linewidth=0.6)
        axes.plot(x, curve, color=ORANGE, label=f"normal, {mean:.2f} ± {sd:.2f} mm")
        for limit in sorted({limit for grade in measured.grades for limit in (grade.low, grade.high)}):
            axes.axvline(limit, color=FAINT, linestyle=":", linewidth=0.9)
        axes.set(xlabel="stem diameter, mm", ylabel="stems", ylim=(None, 1.25 * axes.get_ylim()[1]))
        axes.locator_params(axis="y", integer=True)
        axes.legend(loc="upper right")
        _mark(figure, measured.synthetic)
    return figure


def shear_curves(tests: ShearTests) -> Figure:
    """Draw force over travel of all specimens, coloured by diameter grade."""
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
        axes.set(xlabel="blade travel after preload, mm", ylabel="force, N", ylim=(0, None))
        axes.margins(x=0)
        axes.legend(loc="upper right")
        _mark(figure, tests.synthetic)
    return figure


def force_over_diameter(tests: ShearTests) -> Figure:
    """Draw maximum force over diameter: specimens, mean of each grade with its 95 % interval, and the power law."""
    with new_figure() as figure:
        axes = figure.add_subplot()
        diameters, forces = zip(*((s.diameter, s.curve.max_force) for s in tests.specimens), strict=True)
        axes.plot(diameters, forces, "o", color=FAINT, markersize=3, label="specimens")
        means = [(g.diameter, g.summary.mean, g.summary.mean_interval) for g in tests.grades]
        known = [(at, mean, interval[1] - mean) for at, mean, interval in means if interval]
        at, heights, half_widths = zip(*known, strict=True) if known else ((), (), ())
        axes.errorbar(at, heights, yerr=half_widths, fmt="s", color=BLUE, capsize=3, label="mean, 95 %")
        if (law := tests.power_law) is not None:
            d = np.linspace(min(diameters), max(diameters), 100).tolist()
            axes.plot(d, [law.at(x) for x in d], color=ORANGE, label=f"∝ d^{law.exponent:.2f}")
        axes.set(xlabel="stem diameter, mm", ylabel="maximum shear force, N", ylim=(0, None))
        axes.legend(loc="upper left")
        _mark(figure, tests.synthetic)
    return figure


def _mark(figure: Figure, synthetic: bool) -> None:
    if synthetic:
        figure.suptitle(SYNTHETIC, color=INK, fontsize=8, fontstyle="italic")
