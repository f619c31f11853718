"""Every figure of a study by name: what the page shows, what the figures folder holds, what `stemcal plot` draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stemcal.report import figures
from stemcal.report.certainty import corner, profiles
from stemcal.report.fracture import fracture
from stemcal.report.numbers import short
from stemcal.report.records import curves_of
from stemcal.report.relief import relief, solutions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stemcal.study.model import Study

Stage = Mapping[str, Any]
Stages = Mapping[str, Stage]
Records = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Plot:
    """A figure: its name, the section it belongs to, its caption, and what draws it."""

    name: str
    section: str
    caption: str
    draw: Callable[[], Figure]
    on_page: bool = True


def gallery(study: Study, stages: Stages, records: Records) -> list[Plot]:
    """Return the figures that the finished stages and their records allow, none of them drawn yet."""
    plots: list[Plot] = []
    if "screen" in stages:
        plots += _screening(stages["screen"])
    if "rsm" in stages:
        plots += _surface(stages["rsm"], stages.get("invert"))
    if "rsm" in stages and "invert" in stages:
        plots += _inversion(stages["rsm"], stages["invert"])
    if "validate" in stages:
        plots += _validation(study, stages["validate"])
    return plots + _runs(study, records)


def write_figures(plots: list[Plot], folder: Path) -> list[Path]:
    """Write every figure as SVG and PNG into a folder; returns the files."""
    from stemcal.report.style import save_both

    folder.mkdir(parents=True, exist_ok=True)
    return [path for plot in plots for path in save_both(plot.draw(), folder / plot.name)]


def _screening(screen: Stage) -> list[Plot]:
    bars = "Effects by size, blue raises and orange lowers the force; dashed: Lenth's margin of error."
    line = "Half-normal plot: effects far above the line are more than chance."
    return [
        Plot("pareto", "screen", bars, partial(figures.pareto, screen)),
        Plot("half-normal", "screen", line, partial(figures.half_normal, screen)),
    ]


def _surface(rsm: Stage, invert: Stage | None) -> list[Plot]:
    held = "the others at the solution" if invert else "the others at the centre"
    key = " Orange: where the measured force is met; star: the solution; white dots: runs." if invert else ""
    plots = [
        Plot(
            "observed-predicted",
            "rsm",
            "Simulated force against the surface's prediction.",
            partial(figures.observed_predicted, rsm),
        ),
        Plot("residuals", "rsm", "What the surface leaves unexplained, run by run.", partial(figures.residuals, rsm)),
    ]
    for pair in combinations(rsm["names"], 2):
        over, name = f"{pair[0]} and {pair[1]}, {held}", "-".join(pair)
        plots += [
            Plot(f"contour-{name}", "rsm", f"Force over {over}.{key}", partial(figures.contours, rsm, pair, invert)),
            Plot(f"surface-{name}", "rsm", f"Relief of the force over {over}.", partial(relief, rsm, pair, invert)),
        ]
    return plots


def _inversion(rsm: Stage, invert: Stage) -> list[Plot]:
    caption = (
        "Range of each factor over all solutions, in coded units; star: the chosen point; dashed: ±1, dotted: the "
        "reach of the design."
    )
    return [Plot("solutions", "invert", caption, partial(solutions, rsm, invert)), *_certainty(invert)]


def _certainty(invert: Stage) -> list[Plot]:
    if "certainty" not in invert:
        return []
    caption = "Profile of each factor, the others free: where a curve is below the dashed line, the factor may be."
    plots = [Plot("profiles", "invert", caption, partial(profiles, invert))]
    if invert["certainty"]["posterior"]:
        text = "Posterior of the parameters with uniform priors over the region; dashed: 95 %."
        plots.append(Plot("posterior", "invert", text, partial(corner, invert)))
    return plots


def _validation(study: Study, validate: Stage) -> list[Plot]:
    spread = {target.diameter: target.sd for target in study.targets.forces if target.sd is not None}
    bars = " Bars: standard deviation of the measurements." if spread else ""
    caption = f"Measured and simulated maximum force; the ringed diameter is the calibration's.{bars}"
    return [Plot("validation", "validate", caption, partial(figures.validation, validate, spread))]


def _runs(study: Study, records: Records) -> list[Plot]:
    curves, plots = curves_of(records), []
    if curves:
        chosen = [label for label in curves if label.endswith(" mm")]
        caption = "Force over blade travel: validation runs in colour, all others in grey."
        plots.append(Plot("force-travel", "runs", caption, partial(figures.force_travel, curves, chosen)))
    calibrated = f"{short(study.targets.calibrate_at)} mm"
    for label, record in records.items():
        plots += _run(label, record["details"], label == calibrated)
    return plots


def _run(label: str, details: Mapping[str, Any], on_page: bool) -> list[Plot]:
    """Return the pictures of one run; the page shows those of the calibration diameter."""
    name, plots = label.replace(" ", ""), []
    if details.get("energies"):
        caption = f"Energies over blade travel, stem of {label}."
        draw = partial(figures.energies, details["energies"])
        plots.append(Plot(f"energies-{name}", "runs", caption, draw, on_page))
    if details.get("shape"):
        caption = (
            f"The cut stem of {label} at the end of the test, from the side and in section, coloured by plastic "
            "strain; elements that failed are gone; grey: blade and supports."
        )
        plots.append(Plot(f"fracture-{name}", "runs", caption, partial(_fracture, details["shape"]), on_page))
    return plots


def _fracture(packed: Mapping[str, Any]) -> Figure:
    from stemcal.cutting.shape import Shape

    return fracture(Shape.unpacked(packed))
