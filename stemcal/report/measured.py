"""Files and figures of laboratory measurements."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stemcal.drawing.style import BLUE, FAINT, INK, ORANGE, Figure, new_figure, save
from stemcal.drawing.table import Column, Table
from stemcal.measured.diameters import Diameters, geometry_section
from stemcal.measured.shear import ShearTests
from stemcal.storage.atomic import write_atomic
from stemcal.storage.canonical import as_json


def write_diameters(folder: Path, content: Mapping[str, Any], stems: Diameters) -> None:
    """Write measured diameters: `content` as JSON, the stems as CSV, sections of a spec as YAML, and the histogram."""
    figures = {"diameters": diameter_histogram(stems)}
    _write(folder, content, Table.of_rows(stems.stems), {"specimen.yaml": geometry_section(stems)}, figures)


def write_shear_tests(folder: Path, content: Mapping[str, Any], tests: ShearTests) -> None:
    """Write shear tests: `content` as JSON, the specimens as CSV, the targets of a spec as YAML, and the figures."""
    rows = [specimen.row() for specimen in tests.specimens]
    notes = Column("notes", of=lambda row: " ".join(map(str, row["notes"])))
    table = Table.of([*(name for name in rows[0] if name != "notes"), notes], rows)
    figures = {"shear-curves": shear_curves(tests), "force-diameter": force_over_diameter(tests)}
    _write(folder, content, table, {"targets.yaml": content["targets"]}, figures)


def _write(
    folder: Path, content: Mapping[str, Any], table: Table, sections: dict[str, str], figures: dict[str, Figure]
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in figures.items():
        for kind in ("svg", "png"):
            save(figure, folder / f"{name}.{kind}")
    stage = content["stage"]
    for name, text in {f"{stage}.json": as_json(content), f"{stage}.csv": table.csv(), **sections}.items():
        if text:
            write_atomic(folder / name, text)


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
        figure.suptitle("synthetic data, not measured", color=INK, fontsize=8, fontstyle="italic")
