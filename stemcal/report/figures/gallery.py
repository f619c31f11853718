"""Every figure of a study by name: what the page shows, what the figures folder holds, what `stemcal plot` draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stemcal.cutting.end_state import Shape
from stemcal.naming import FIRST, Named
from stemcal.outputs import make_folder
from stemcal.report.figures.certainty import corner, profiles
from stemcal.report.figures.contour import contours, relief, solutions, with_unit
from stemcal.report.figures.curves import energies, force_travel
from stemcal.report.figures.effects import half_normal, pareto
from stemcal.report.figures.fields import fields
from stemcal.report.figures.fit import diagnostics, observed_predicted, residuals, ridge
from stemcal.report.figures.fracture import fracture
from stemcal.report.figures.frames import fracture_frames, mesh
from stemcal.report.figures.style import png, resize, save, svg, write_both
from stemcal.report.figures.validation import growth, validation
from stemcal.report.records import Details, Records, curves_of
from stemcal.solvers.film import frames_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import ValidateResult
from stemcal.text.numbers import short

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stemcal.study.model import Study


CLAIMING = ("profiles", "posterior", "solutions")
"""Figures of intervals, which suppose that the model fits: not shown where nothing is calibrated."""


@dataclass(frozen=True)
class Plot:
    """A figure: its name, the section it belongs to, its caption, and what draws it.

    Figures that are not `on_page` are drawn by `stemcal plot` alone, not with the report; a `detail` is folded on it.
    """

    name: str
    section: str
    caption: str
    make: Callable[[], Figure]
    on_page: bool = True
    wide: bool = False
    detail: bool = False

    def draw(self) -> Figure:
        """Return the figure, made once: page and files share it."""
        if "figure" not in self.__dict__:
            self.__dict__["figure"] = self.make()
        figure: Figure = self.__dict__["figure"]
        return figure

    @cached_property
    def document(self) -> str:
        """The figure as SVG."""
        return svg(self.draw())

    @cached_property
    def pixels(self) -> bytes:
        """The figure as PNG."""
        return png(self.draw())


def gallery(study: Study, results: Results, records: Records) -> list[Plot]:
    """Return the figures that the finished stages and their records allow, none of them drawn yet."""
    plots: list[Plot] = []
    labels = {factor.name: factor.label for factor in study.factors}
    if results.screen is not None:
        plots += screening_plots(results.screen, labels)
    if results.surface is not None:
        plots += surface_plots(results.surface, results.inversion, labels)
        plots += inversion_plots(results.surface, results.inversion, labels) if results.inversion is not None else []
    if results.validation is not None:
        plots += validation_plots(study, results.validation)
    return plots + run_plots(study, records)


def write_figures(plots: list[Plot], folder: Path) -> list[Path]:
    """Write every figure as SVG and PNG into a folder; returns the files."""
    make_folder(folder)
    return [path for plot in plots for path in write_both(plot.document, plot.pixels, folder / plot.name)]


def write_as(plots: list[Plot], folder: Path, kinds: Sequence[str], dpi: float, width: float | None) -> list[Path]:
    """Write figures in these formats, with this resolution and width (mm); returns the files."""
    make_folder(folder)
    paths = []
    for plot in plots:
        figure = plot.make()
        if width is not None:
            resize(figure, width)
        for kind in kinds:
            paths.append(folder / f"{plot.name}.{kind}")
            save(figure, paths[-1], dpi)
    return paths


def screening_plots(screen: ScreenResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a screening."""
    bars = (
        f"Effects by size, blue raises and orange lowers the {screen.naming.response.noun}. Beyond Lenth's margin of "
        "error (ME) or the limit of the t test an effect is more than chance; beyond the margin SME even as one of so "
        "many."
    )
    line = "Half-normal plot: effects above the line of chance and beyond Lenth's margins are more than chance."
    return [
        Plot("pareto", "screen", bars, partial(pareto, screen, labels)),
        Plot("half-normal", "screen", line, partial(half_normal, screen, labels), detail=True),
    ]


def surface_plots(rsm: SurfaceResult, invert: InvertResult | None, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a surface; with a solution they show it."""
    plots = _fit_plots(rsm)
    for pair in combinations(rsm.names, 2):
        plots += _pair_plots(rsm, pair, invert, labels)
    if rsm.ridge:
        text = (
            f"Ridge of steepest ascent: the largest {rsm.naming.response.noun} at each distance from the centre, with "
            "two standard errors, and the coded values that give it."
        )
        along = partial(ridge, rsm, invert, labels)
        plots.append(Plot("ridge", "rsm", text, along, wide=True, detail=True))
    return plots


def _fit_plots(rsm: SurfaceResult) -> list[Plot]:
    """Return what tells how well the surface meets its runs."""
    against = f"Simulated {rsm.naming.response.noun} against the surface's prediction."
    left = "What the surface leaves unexplained, run by run."
    plots = [
        Plot("observed-predicted", "rsm", against, partial(observed_predicted, rsm), detail=True),
        Plot("residuals", "rsm", left, partial(residuals, rsm), detail=True),
    ]
    if rsm.runs_diagnostics:
        text = (
            "Residuals against the normal law (on the line: normal) and in order of the runs (no trend: good), and how "
            "much each run sways the surface (Cook's distance above 1, dashed: much)."
        )
        plots.append(Plot("diagnostics", "rsm", text, partial(diagnostics, rsm), wide=True, detail=True))
    return plots


def _pair_plots(
    rsm: SurfaceResult, pair: tuple[str, str], invert: InvertResult | None, labels: Mapping[str, str]
) -> list[Plot]:
    """Return contours and relief over two factors."""
    response, alone = rsm.naming.response, len(rsm.names) == 2
    noun, scale = response.noun, f" in {response.written}" if response.written else ""
    held = "the others at the solution" if invert else "the others at the centre"
    key = f" Orange: where the measured {noun} is met; star: the solution." if invert else ""
    dots = " White dots: runs, with their number where there are several."
    raised = " Dots: runs, full above the surface and open below it." if alone else ""
    over = " and ".join(labels.get(name, name) for name in pair) + ("" if alone else f", {held}")
    lines = f"{response.capital} over {over}; lines bear it{scale}.{key}{dots}"
    relieved = f"Relief of the {noun} over {over}; its lines on the floor.{raised}"
    flat, lifted = (partial(draw, rsm, pair, invert, labels) for draw in (contours, relief))
    return [
        Plot(f"contour-{'-'.join(pair)}", "rsm", lines, flat),
        Plot(f"surface-{'-'.join(pair)}", "rsm", relieved, lifted),
    ]


def inversion_plots(rsm: SurfaceResult, invert: InvertResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a calibration."""
    caption = (
        "Where the surface meets the target exactly: each factor's range, in coded units; star: the chosen point; "
        "dashed: ±1, dotted: the reach of the design. Its error is left out here."
    )
    exact = Plot("solutions", "invert", caption, partial(solutions, rsm, invert, labels), detail=True)
    return [*_certainty(rsm, invert, labels), exact]


def _certainty(rsm: SurfaceResult, invert: InvertResult, named: Mapping[str, str]) -> list[Plot]:
    if invert.certainty is None:
        return []
    labels = {name: with_unit(rsm, name, named) for name in invert.point.solution}
    caption = (
        "Profile of each factor, the others free. Where the curve is below the dashed line (shaded) lies the 95 % "
        "range; upright: the calibrated value."
    )
    plots = [Plot("profiles", "invert", caption, partial(profiles, invert, labels))]
    if invert.certainty.posterior is not None:
        text = "Posterior of the parameters with uniform priors over the region; dashed: 95 %."
        plots.append(Plot("posterior", "invert", text, partial(corner, invert.certainty.posterior, labels)))
    return plots


def validation_plots(study: Study, validate: ValidateResult) -> list[Plot]:
    """Return the figures of a validation."""
    naming, plots = study.naming, []
    compared = {further.response for row in validate.rows for further in row.further}
    for response in (naming.response, *(other for other in naming.others if other.name in compared)):
        spread = spread_of(study, response)
        bars = " Bars: standard deviation of the measurements." if spread else ""
        ring = f"; the ringed {naming.condition_noun} is the calibration's" if naming.condition is not None else ""
        caption = f"Measured and simulated {response.long}{ring}.{bars}"
        name = "validation" if response is naming.response else f"validation-{response.name}"
        plots.append(Plot(name, "validate", caption, partial(validation, validate, spread, response)))
    if naming.is_force_on_stems and validate.measured_exponent and validate.simulated_exponent:
        text = "The same forces on logarithmic axes: the slope is the power of the diameter with which they grow."
        plots.append(Plot("growth", "validate", text, partial(growth, validate)))
    return plots


def spread_of(study: Study, response: Named) -> dict[float, float]:
    """Return the standard deviation of what was measured of a response, by the condition."""
    name = FIRST if response is study.naming.response else response.name
    told = ((target.condition, target.mean_of(name)[1]) for target in study.targets.means)
    return {place: sd for place, sd in told if sd is not None}


def run_plots(study: Study, records: Records) -> list[Plot]:
    """Return the figures of the runs themselves."""
    curves, plots = curves_of(records), []
    if curves:
        chosen = [label for label in curves if records[label].at_solution]
        dotted = (
            " Dotted: after the stem has broken, not cutting any more." if any(c.broke for c in curves.values()) else ""
        )
        caption = f"Force over blade travel: validation runs in colour, all others in grey.{dotted}"
        plots.append(Plot("force-travel", "runs", caption, partial(force_travel, curves, chosen)))
    calibrated = f"{short(study.targets.calibrate_at)} mm"
    hollow = study.specimen.diameter_ratio > 0.0 or "wall_thickness" in study.names
    for label, record in records.items():
        if record.at_solution:
            plots += _run(label, record.details, label == calibrated, hollow)
    return plots


def _run(label: str, details: Details, on_page: bool, hollow: bool) -> list[Plot]:
    """Return the pictures of one run; the page shows those of the calibration diameter."""
    name, plots = label.replace(" ", ""), []
    if details.energies:
        caption = f"Energies over blade travel, stem of {label}."
        draw = partial(energies, details.energies)
        plots.append(Plot(f"energies-{name}", "runs", caption, draw, on_page, detail=True))
    if details.shape:
        plots += _pictures(label, name, details, on_page, hollow)
    return plots


def _pictures(label: str, name: str, details: Details, on_page: bool, hollow: bool) -> list[Plot]:
    """Return the mesh, the cut stem, and, where the run kept a film, the way from one to the other."""
    packed, film = details.shape, details.film
    mesh = f"The mesh of the stem of {label}: from the side with blade and supports (grey), and its cross-section."
    section = "in section (the bore between the walls)" if hollow else "in section"
    cut = (
        f"The stem of {label} at the end of the simulation, notched by the blade: it ends when the force has dropped "
        f"for good, before the stem is cut through. From the side and {section}, coloured by plastic strain; elements "
        "that failed are gone. Grey: the blade, and the supports with their clearance between."
    )
    plots = [
        Plot(
            f"mesh-{name}",
            "runs",
            mesh,
            partial(_mesh, packed),
            on_page,
            wide=True,
            detail=True,
        ),
        Plot(f"fracture-{name}", "runs", cut, partial(_fracture, packed), on_page, wide=True),
    ]
    if film:
        way = f"How the stem of {label} is cut, in section: travel of the blade and force on it above each picture."
        plots.append(
            Plot(
                f"frames-{name}",
                "runs",
                way,
                partial(_frames, packed, film),
                on_page,
                wide=True,
                detail=True,
            )
        )
    if film:
        told = (
            f"Stress and displacement in the stem of {label} where the force is largest, in section; travel of the "
            "blade and force above. Each has its own scale."
        )
        draw = partial(_fields, packed, film)
        plots.append(Plot(f"fields-{name}", "runs", told, draw, on_page, wide=True, detail=True))
    return plots


def _fracture(packed: Any) -> Figure:
    return fracture(Shape.unpacked(packed))


def _mesh(packed: Any) -> Figure:
    return mesh(Shape.unpacked(packed))


def _fields(packed: Any, film: Any) -> Figure:
    return fields(frames_of(Shape.unpacked(packed), film))


def _frames(packed: Any, film: Any) -> Figure:
    return fracture_frames(frames_of(Shape.unpacked(packed), film))
