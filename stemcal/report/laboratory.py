"""Tables and figures of what the laboratory brought."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.report.numbers import fixed, interval, probability, short, significant
from stemcal.report.sheets import Sheet
from stemcal.report.style import BLUE, FAINT, INK, ORANGE, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stemcal.measured.curves import Curve

Data = Mapping[str, Any]
SYNTHETIC = "synthetic data, not measured"


def diameter_sheets(data: Data) -> list[Sheet]:
    """Return the normal fit of the stem diameters, and their grades."""
    tests = [
        (test["name"], f"{fixed(test['statistic'], 4)}, p = {probability(test['p'])}{_verdict(test['p'])}")
        for test in data["normality"]
    ]
    rows = (
        ("Stems", f"{data['n']}, {data['readings']} readings"),
        ("Mean, mm", f"{fixed(data['mean'], 3)} (95 % {interval(data['mean_interval'])})"),
        ("Standard deviation, mm", f"{fixed(data['sd'], 3)} (95 % {interval(data['sd_interval'])})"),
        ("Coefficient of variation, %", fixed(data["cv_percent"], 2)),
        *tests,
    )
    grades = tuple(
        (f"{short(g['diameter'])}", f"{short(g['low'])} to {short(g['high'])}", str(g["count"]),
         fixed(g["share_percent"], 1), fixed(g["fitted_percent"], 1))
        for g in data["grades"]
    )  # fmt: skip
    foot = f"Together {fixed(data['share_percent'], 1)} % of the stems; the upper limit belongs to the next grade."
    columns = ("Grade, mm", "Diameters, mm", "Stems", "Share, %", "Fitted, %")
    return [
        Sheet("Stem diameters", ("Statistic", "Value"), rows, texts=2),
        Sheet("Grades", columns, grades, texts=2, foot=(foot,)),
    ]


def _verdict(p: float) -> str:
    return ", normal is tenable" if p >= 0.05 else ", not normal"


def shear_sheets(data: Data) -> list[Sheet]:
    """Return the maximum shear force of every specimen, and what each grade comes to."""
    rows = tuple(
        (
            short(g["diameter"]),
            str(g["n"]),
            significant(g["mean"]),
            significant(g["sd"]),
            fixed(g["cv_percent"], 1),
            interval(g["mean_interval"]),
            f"{g['suspect'] or 'none'}",
        )
        for g in data["grades"]
    )
    columns = ("Diameter, mm", "n", "Mean, N", "SD, N", "CV, %", "95 % of the mean, N", "Outlier")
    foot = ("Outlier: by Grubbs' test, counted nevertheless.", *_law(data["power_law"]))
    return [Sheet("Maximum shear force by grade", columns, rows, texts=0, foot=foot), _specimen_sheet(data)]


def _law(law: Data | None) -> tuple[str, ...]:
    if law is None:
        return ()
    bounds = f" (95 % {interval(law['exponent_interval'], 3)})" if law["exponent_interval"] else ""
    return (
        f"F = {significant(law['factor'], 3)}·d^{fixed(law['exponent'], 2)}{bounds}, F in N, d in mm, "
        f"R² {fixed(law['r2'], 3)} of the logarithms.",
    )


def _specimen_sheet(data: Data) -> Sheet:
    rows = tuple(
        (s["specimen"], short(s["diameter"]), significant(s["max_force"]), fixed(s["travel_at_max"], 2),
         str(s["trimmed_points"]), "left out" if s["excluded"] else "")
        for s in data["specimens"]
    )  # fmt: skip
    columns = ("Specimen", "Diameter, mm", "Maximum, N", "at, mm", "Points trimmed", "")
    return Sheet("Specimens", columns, rows)


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
