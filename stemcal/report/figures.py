"""Figures of a study, each made from the stage files alone."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

from stemcal.report.style import BLUE, FAINT, GREEN, INK, ORANGE, new_figure, save, styled
from stemcal.report.terms import surface_value

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "contours",
    "energies",
    "force_travel",
    "half_normal",
    "observed_predicted",
    "pareto",
    "residuals",
    "save",
    "validation",
]

Stage = Mapping[str, Any]
Curve = tuple[Sequence[float], Sequence[float]]
GRID = 41


def pareto(screen: Stage) -> Figure:
    """Return the effects by size, with Lenth's margin of error."""
    effects = sorted(screen["effects"], key=lambda e: abs(e["effect"]))
    figure = new_figure(height=max(2.2, 0.9 + 0.24 * len(effects)))
    with styled():
        axes = figure.add_subplot()
        names = [f"{_plain(e['factor'])}  {_signed(e['effect'])}" for e in effects]
        colours = [ORANGE if e["effect"] < 0 else BLUE for e in effects]
        axes.barh(names, [abs(e["effect"]) for e in effects], color=colours, height=0.7)
        for limit, label, line in _limits(screen):
            axes.axvline(limit, color=INK, linestyle=line, linewidth=1, label=label)
        if axes.lines:
            figure.legend(loc="outside upper right", ncols=3)
        axes.set_xlabel("|effect| on the maximum force, N")
    return figure


def _limits(screen: Stage) -> list[tuple[float, str, str]]:
    """Return the sizes from which an effect counts: value in N, name, line style.

    The t test's limit in N is t₀·s, with the standard error s of an effect taken from the effects and their t.
    """
    lenth, pareto = screen.get("lenth") or {}, screen.get("pareto") or {}
    limits = [(lenth.get("me"), "Lenth ME", "--"), (lenth.get("sme"), "Lenth SME", ":")]
    tested = {row["factor"]: row["t"] for row in pareto.get("rows", []) if row["t"]}
    errors = [abs(e["effect"]) / tested[e["factor"]] for e in screen["effects"] if e["factor"] in tested]
    if errors and pareto.get("t_limit"):
        limits.append((pareto["t_limit"] * max(errors), f"t test, p = {screen['alpha']:g}", "-."))
    return [(value, label, line) for value, label, line in limits if value is not None]


def _signed(effect: float) -> str:
    """Return an effect with its sign and a decimal.

    >>> _signed(-8.0), _signed(74.69)
    ('−8.0', '+74.7')
    """
    return f"{effect:+.1f}".replace("-", "−")


def half_normal(screen: Stage) -> Figure:
    """Return the effects against half-normal scores: what leaves the line is more than chance."""
    effects = sorted(screen["effects"], key=lambda e: abs(e["effect"]))
    count = len(effects)
    scores = [NormalDist().inv_cdf(0.5 + 0.5 * (row + 0.5) / count) for row in range(count)]
    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        pse = (screen.get("lenth") or {}).get("pse")
        if pse is not None:
            axes.plot([0, scores[-1]], [0, pse * scores[-1]], color=FAINT, label="chance (Lenth)")
        for limit, label, line in _limits(screen)[:2]:
            axes.axhline(limit, color=FAINT, linestyle=line, linewidth=1, label=label)
        if axes.lines:
            axes.legend(loc="upper left")
        for score, effect in zip(scores, effects, strict=True):
            chosen = effect["factor"] in screen["significant"]
            axes.plot(score, abs(effect["effect"]), "o", color=BLUE if chosen else FAINT)
            if chosen:
                axes.annotate(
                    _plain(effect["factor"]), (score, abs(effect["effect"])), (2, 6),
                    textcoords="offset points", ha="right", va="bottom", size=8,
                )  # fmt: skip
        axes.set_xlabel("half-normal score")
        axes.set_ylabel("|effect|, N")
    return figure


def _fit(rsm: Stage) -> tuple[list[int], list[float], list[float]]:
    """Return run numbers, observed and predicted forces of the runs that gave one."""
    runs = [run for run in rsm["design"]["runs"] if run["force"] is not None]
    predicted = [float(surface_value(rsm["coefficients"], run["coded"])) for run in runs]
    return [run["run"] for run in runs], [run["force"] for run in runs], predicted


def observed_predicted(rsm: Stage) -> Figure:
    """Return simulated forces against what the surface predicts for them."""
    _, observed, predicted = _fit(rsm)
    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        ends = [min(observed + predicted), max(observed + predicted)]
        axes.plot(ends, ends, color=FAINT, linestyle="--")
        axes.plot(predicted, observed, "o", color=BLUE, alpha=0.85)
        axes.set_xlabel("predicted by the surface, N")
        axes.set_ylabel("simulated, N")
    return figure


def residuals(rsm: Stage) -> Figure:
    """Return residuals over predicted force, the largest named by its run."""
    runs, observed, predicted = _fit(rsm)
    rest = [o - p for o, p in zip(observed, predicted, strict=True)]
    figure = new_figure()
    with styled():
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
        axes.set_xlabel("predicted by the surface, N")
        axes.set_ylabel("simulated − predicted, N")
        axes.margins(x=0.1)
    return figure


def contours(rsm: Stage, pair: tuple[str, str], invert: Stage | None = None) -> Figure:
    """Return lines of equal force over two factors, the others at the solution (at centre without one)."""
    import numpy as np

    across, up = pair
    reach = float(rsm.get("radius") or 1.0)
    at = dict((invert or {}).get("coded") or dict.fromkeys(rsm["names"], 0.0))
    x, y = np.meshgrid(np.linspace(-reach, reach, GRID), np.linspace(-reach, reach, GRID))
    force = np.broadcast_to(surface_value(rsm["coefficients"], {**at, across: x, up: y}), x.shape)
    coding = rsm["coding"]
    natural = [coding[n]["center"] + coding[n]["half_step"] * c for n, c in ((across, x), (up, y))]
    figure = new_figure(height=3.5)
    with styled():
        axes = figure.add_subplot()
        filled = axes.contourf(*natural, force, levels=9, cmap="cividis", alpha=0.9)
        figure.colorbar(filled, ax=axes, label="force, N").outline.set_visible(False)
        if invert:
            _mark_target(axes, natural, force, invert, pair)
        points = {tuple(run["levels"][name] for name in pair) for run in rsm["design"]["runs"]}
        dots: Any = {"color": "white", "markersize": 5, "markeredgecolor": "black", "markeredgewidth": 0.5}
        axes.plot(*zip(*sorted(points), strict=True), "o", **dots, label="runs", clip_on=False, zorder=5)
        axes.set_xlabel(with_unit(rsm, across))
        axes.set_ylabel(with_unit(rsm, up))
    return figure


def _mark_target(axes: Axes, natural: Sequence[Any], force: Any, invert: Stage, pair: tuple[str, str]) -> None:
    """Draw the line on which the surface meets the measured force, and the solution on it."""
    if force.min() < invert["target"] < force.max():
        axes.contour(*natural, force, levels=[invert["target"]], colors=[ORANGE], linewidths=2)
    axes.plot(
        *(invert["solution"][name] for name in pair),
        "*",
        color=ORANGE,
        markeredgecolor="white",
        markersize=13,
    )


def with_unit(rsm: Stage, name: str) -> str:
    """Return a factor's name with its unit, for an axis."""
    unit = next((entry.get("unit", "1") for entry in rsm["factors"] if entry["factor"] == name), "1")
    return _plain(name if unit in ("1", "") else f"{name}, {unit}")


def validation(validate: Stage, spread: Mapping[float, float] | None = None) -> Figure:
    """Return measured and simulated force over diameter; the calibration diameter is ringed.

    `spread` has the standard deviations of the measured forces (N) by diameter.
    """
    rows = validate["rows"]
    figure = new_figure()
    with styled():
        axes = figure.add_subplot()
        axes.plot([r["diameter"] for r in rows], [r["measured"] for r in rows], "o-", color=BLUE, label="measured")
        done = [r for r in rows if r["simulated"] is not None]
        axes.plot(
            [r["diameter"] for r in done],
            [r["simulated"] for r in done],
            "s--",
            color=ORANGE,
            label="simulated",
        )
        barred = [r for r in rows if r["diameter"] in (spread or {})]
        if spread and barred:
            at, means = [r["diameter"] for r in barred], [r["measured"] for r in barred]
            lengths = [spread[r["diameter"]] for r in barred]
            axes.errorbar(at, means, yerr=lengths, fmt="none", ecolor=BLUE, elinewidth=1, capsize=3)
        for row in rows:
            if row["role"] == "calibration":
                axes.plot(row["diameter"], row["measured"], "o", color=INK, fillstyle="none", markersize=13)
        axes.set_xlabel("stem diameter, mm")
        axes.set_ylabel("maximum force, N")
        axes.set_ylim(bottom=0)
        axes.legend(loc="upper left")
    return figure


def force_travel(curves: Mapping[str, Curve], highlighted: Collection[str] = ()) -> Figure:
    """Return force over blade travel for all runs; the highlighted ones stand out and are named."""
    colours = (BLUE, ORANGE, GREEN, "#cc79a7", "#e69f00", "#56b4e9")
    figure = new_figure(width=6.4 if len(curves) > 3 else 4.7)
    with styled():
        axes = figure.add_subplot()
        for name, (travel, force) in curves.items():
            if name not in highlighted:
                axes.plot(travel, force, color=FAINT, linewidth=0.7, alpha=0.6)
        for index, name in enumerate(n for n in curves if n in highlighted):
            axes.plot(*curves[name], color=colours[index % len(colours)], label=_plain(name))
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


def _plain(text: str) -> str:
    """Return text that matplotlib takes as it stands: `$` would begin a formula."""
    return text.replace("$", r"\$")
