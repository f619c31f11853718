"""Every figure of a study by name: for the page, the figures folder and `stemcal export figures`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations
from pathlib import Path
from typing import Any

from stemcal.cutting.end_state import Shape
from stemcal.names import Names
from stemcal.naming import FIRST, Named
from stemcal.numbers import short
from stemcal.outputs import make_folder
from stemcal.report.figures.certainty import profiles
from stemcal.report.figures.contour import contours, relief, solutions, with_unit
from stemcal.report.figures.curves import energies, force_travel, measured_band
from stemcal.report.figures.effects import diagnostics, half_normal, observed_predicted, pareto, residuals
from stemcal.report.figures.fracture import fracture
from stemcal.report.figures.frames import fields, fracture_frames, mesh
from stemcal.report.figures.inline import readings
from stemcal.report.figures.style import Figure, png, resize, save, svg, write_both
from stemcal.report.figures.validation import growth, refined, validation
from stemcal.report.records import Details, Records, curves_of
from stemcal.solvers.film import frames_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model import Study

CLAIMING = ("profiles", "solutions")
"""Figures of intervals, which suppose that the model fits: not shown where nothing is calibrated."""
MOST_RESPONSES = 6  # of a validation, whose figures the page shows


@dataclass(frozen=True)
class Plot:
    """A figure: its name, the section it belongs to, its caption, and what draws it.

    Figures that are not `on_page` are drawn by `stemcal export figures` alone; a `detail` is folded on the page.
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
    def readings(self) -> list[dict[str, Any]]:
        """What its lines and bars show, where they are in its `document`."""
        return readings(self.draw()) if self.document else []

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
    if results.refinement is not None and len(results.refinement.rows) > 1:
        plots.append(refinement_plot(results.refinement))
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


def surface_plots(rsm: SurfaceResult, invert: InvertResult | None, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a surface; with a solution they show it."""
    observed = f"Simulated {rsm.naming.response.noun} against the surface's prediction."
    checks = (
        "Residuals against the normal distribution (on the line: normal) and in order of the runs (no trend: good), "
        "and how strongly each run influences the surface (large above a Cook's distance of 1, dashed)."
    )
    plots = [
        Plot("observed-predicted", "rsm", observed, partial(observed_predicted, rsm), detail=True),
        Plot("residuals", "rsm", "Residuals of the surface, run by run.", partial(residuals, rsm), detail=True),
    ]
    if rsm.runs_diagnostics:
        plots.append(Plot("diagnostics", "rsm", checks, partial(diagnostics, rsm), wide=True, detail=True))
    for pair in combinations(rsm.names, 2):
        plots += _pair_plots(rsm, pair, invert, labels)
    return plots


def _pair_plots(
    rsm: SurfaceResult, pair: tuple[str, str], invert: InvertResult | None, labels: Mapping[str, str]
) -> list[Plot]:
    """Return contours and relief over two factors."""
    response, alone = rsm.naming.response, len(rsm.names) == 2
    over = f"over {Names(rsm.naming, labels).factors(pair)}"
    held = "" if alone else f", the others at the {'solution' if invert else 'centre'}"
    unit = f" in {response.written}" if response.written else ""
    met = f" Orange: the measured {response.noun}; star: the solution." if invert else ""
    lines = f"{response.capital} {over}{held}, contours{unit}.{met} White dots: design points (numbers: repeats)."
    dots = " Dots: runs, full above the surface and open below it." if alone else ""
    relieved = f"Surface of the {response.noun} {over}{held}, with contours projected on the base.{dots}"
    flat, lifted = (partial(draw, rsm, pair, invert, labels) for draw in (contours, relief))
    return [
        Plot(f"contour-{'-'.join(pair)}", "rsm", lines, flat),
        Plot(f"surface-{'-'.join(pair)}", "rsm", relieved, lifted),
    ]


def inversion_plots(rsm: SurfaceResult, invert: InvertResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a calibration."""
    known, plots = invert.certainty, []
    likelihoods = (
        "Profile of each factor, the others free. The 95 % interval is where the curve is below the dashed line "
        "(shaded); vertical line: the calibrated value."
    )
    exact = (
        "Where the surface meets the target exactly: the range of each factor in coded units; star: the chosen point; "
        "dashed: ±1, dotted: the reach of the design. The error of the surface is not included."
    )
    units = {name: with_unit(rsm, name, labels) for name in invert.point.solution}
    if known is not None:
        plots.append(Plot("profiles", "invert", likelihoods, partial(profiles, invert, units)))
    draw = partial(solutions, rsm, invert, labels)
    return [*plots, Plot("solutions", "invert", exact, draw, detail=True)]


def validation_plots(study: Study, validate: ValidateResult) -> list[Plot]:
    """Return the figures of a validation."""
    naming, plots = study.naming, []
    worst = _largest_errors(validate)
    responses = [naming.response, *(other for other in naming.others if other.name in worst)]
    shown = {naming.response.name, *sorted(worst, key=lambda name: -worst[name])[: MOST_RESPONSES - 1]}
    for response in responses:
        spread = spread_of(study, response)
        text = f"Measured and simulated {response.long}"
        if naming.condition is not None:
            text += "; the parameters are fitted to the ringed values" if validate.fitted else ""
        text += ". Bars: standard deviation of the measurements." if spread else "."
        name = "validation" if response is naming.response else f"validation-{response.name}"
        draw, on_page = partial(validation, validate, spread, response), response.name in shown
        if response is naming.response and len(responses) > len(shown):
            text += f" {len(shown)} of {len(responses)} responses are shown: the first and those of the largest errors."
        plots.append(Plot(name, "validate", text, draw, on_page))
    if naming.is_force_on_stems and validate.measured_exponent and validate.simulated_exponent:
        text = "The same forces on logarithmic axes: the slope is the power of the diameter with which they grow."
        plots.append(Plot("growth", "validate", text, partial(growth, validate)))
    return plots


def _largest_errors(validate: ValidateResult) -> dict[str, float]:
    """Return the largest absolute error of each further response, percent."""
    largest: dict[str, float] = {}
    for row in validate.rows:
        for one in row.further:
            largest[one.response] = max(largest.get(one.response, 0.0), abs(one.error_percent or 0.0))
    return largest


def refinement_plot(refinement: RefineResult) -> Plot:
    """Return the figure of a refinement at several conditions."""
    response = refinement.naming.response.capital
    text = f"{response}: measured, and simulated before and after the refinement; the target is ringed."
    return Plot("refinement", "refine", text, partial(refined, refinement))


def spread_of(study: Study, response: Named) -> dict[float, float]:
    """Return the standard deviation of what was measured of a response, by the condition."""
    name = FIRST if response is study.naming.response else response.name
    measured = ((target.condition, target.mean_of(name)[1]) for target in study.targets.means)
    return {place: sd for place, sd in measured if sd is not None}


def run_plots(study: Study, records: Records) -> list[Plot]:
    """Return the figures of the runs themselves."""
    curves, plots = curves_of(records), []
    if curves:
        chosen = [label for label in curves if records[label].at_solution]
        text = "Force over blade travel: validation runs in colour, all others in grey."
        text += " Dotted: after failure." if any(curve.broke for curve in curves.values()) else ""
        plots.append(Plot("force-travel", "runs", text, partial(force_travel, curves, chosen)))
    calibrated = f"{short(study.targets.calibrate_at)} mm"
    for condition, modes in study.targets.modes.items():
        if (label := f"{short(condition)} mm") in curves and records[label].at_solution:
            text = (
                "The measured curves and the one simulated at the calibration, each until its maximum, at shares of "
                "its own travel; below, the difference of the forces in standard deviations of the specimens."
            )
            name = "measured-curves" if label == calibrated else f"measured-curves-{short(condition)}mm"
            plots.append(Plot(name, "runs", text, partial(measured_band, modes, curves[label])))
    hollow = study.specimen.diameter_ratio > 0.0 or "wall_thickness" in study.names
    for label, record in records.items():
        if record.at_solution:
            plots += _run(label, record.details, label == calibrated, hollow)
    return plots


def _run(label: str, details: Details, on_page: bool, hollow: bool) -> list[Plot]:
    """Return the pictures of one run; the page shows those of the calibration diameter."""
    name, plots = label.replace(" ", ""), []
    if details.energies:
        text, draw = f"Energies over blade travel, stem of {label}.", partial(energies, details.energies)
        plots.append(Plot(f"energies-{name}", "runs", text, draw, on_page, detail=True))
    if details.shape:
        plots += _pictures(label, name, details, on_page, hollow)
    return plots


def _pictures(label: str, name: str, details: Details, on_page: bool, hollow: bool) -> list[Plot]:
    """Return the mesh, the cut stem, and, where the run kept a film, the way from one to the other."""

    def shape() -> Shape:
        return Shape.unpacked(details.shape)

    def plot(figure: str, text: str, draw: Callable[[], Figure], detail: bool = True) -> Plot:
        return Plot(f"{figure}-{name}", "runs", text, draw, on_page, wide=True, detail=detail)

    meshed = f"The mesh of the stem of {label}: from the side with blade and supports (grey), and its cross-section."
    bore = " (the bore between the walls)" if hollow else ""
    cut = (
        f"The stem of {label} at the end of the simulation, which stops after the peak force, before the stem is cut "
        f"through. From the side and in section{bore}, coloured by plastic strain; failed elements are removed. Grey: "
        "the blade, and the supports with their clearance between."
    )
    plots = [
        plot("mesh", meshed, lambda: mesh(shape())),
        plot("fracture", cut, lambda: fracture(shape()), detail=False),
    ]
    if details.film:
        film = f"Cutting of the stem of {label}, in section: travel of the blade and force above each picture."
        largest = (
            f"Stress and displacement in the stem of {label} at the maximum force, in section; travel of the blade and "
            "force above. Each has its own scale."
        )
        plots.append(plot("frames", film, lambda: fracture_frames(frames_of(shape(), details.film))))
        plots.append(plot("fields", largest, lambda: fields(frames_of(shape(), details.film))))
    return plots
