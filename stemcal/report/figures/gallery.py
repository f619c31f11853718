"""Every figure of a study by name: for the page, the figures folder and `stemcal export figures`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import combinations
from pathlib import Path

from stemcal.cutting.end_state import Shape
from stemcal.naming import FIRST, Named
from stemcal.numbers import short
from stemcal.outputs import make_folder
from stemcal.report.figures.certainty import profiles
from stemcal.report.figures.contour import contours, relief, solutions, with_unit
from stemcal.report.figures.curves import energies, force_travel, measured_band
from stemcal.report.figures.effects import half_normal, pareto
from stemcal.report.figures.fit import diagnostics, observed_predicted, residuals
from stemcal.report.figures.fracture import fracture
from stemcal.report.figures.frames import fields, fracture_frames, mesh
from stemcal.report.figures.refinement import refined
from stemcal.report.figures.style import Figure, png, resize, save, svg, write_both
from stemcal.report.figures.validation import growth, validation
from stemcal.report.records import Details, Records, curves_of
from stemcal.solvers.film import frames_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model import Study
from stemcal.text.captions import caption
from stemcal.text.names import Names

CLAIMING = ("profiles", "solutions")
"""Figures of intervals, which suppose that the model fits: not shown where nothing is calibrated."""


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
    names = Names(screen.naming)
    return [
        Plot("pareto", "screen", caption(names, "pareto"), partial(pareto, screen, labels)),
        Plot("half-normal", "screen", caption(names, "half-normal"), partial(half_normal, screen)),
    ]


def surface_plots(rsm: SurfaceResult, invert: InvertResult | None, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a surface; with a solution they show it."""
    names = Names(rsm.naming)

    def folded(name: str, words: str, draw: Callable[[], Figure], wide: bool = False) -> Plot:
        return Plot(name, "rsm", caption(names, words), draw, wide=wide, detail=True)

    plots = [folded("observed-predicted", "observed", partial(observed_predicted, rsm))]
    plots.append(folded("residuals", "residuals", partial(residuals, rsm)))
    if rsm.runs_diagnostics:
        plots.append(folded("diagnostics", "diagnostics", partial(diagnostics, rsm), wide=True))
    for pair in combinations(rsm.names, 2):
        plots += _pair_plots(rsm, pair, invert, labels)
    return plots


def _pair_plots(
    rsm: SurfaceResult, pair: tuple[str, str], invert: InvertResult | None, labels: Mapping[str, str]
) -> list[Plot]:
    """Return contours and relief over two factors."""
    names, alone = Names(rsm.naming, labels), len(rsm.names) == 2
    held = "" if alone else " at the solution" if invert else " at the centre"
    scale = "lines in" if names.response.written else "lines"
    met, dots = ["met"] if invert else [], ["raised dots"] if alone else []
    lines = caption(names, f"contour{held}", scale, *met, "white dots", factors=pair)
    relieved = caption(names, f"relief{held}", *dots, factors=pair)
    flat, lifted = (partial(draw, rsm, pair, invert, labels) for draw in (contours, relief))
    return [
        Plot(f"contour-{'-'.join(pair)}", "rsm", lines, flat),
        Plot(f"surface-{'-'.join(pair)}", "rsm", relieved, lifted),
    ]


def inversion_plots(rsm: SurfaceResult, invert: InvertResult, labels: Mapping[str, str]) -> list[Plot]:
    """Return the figures of a calibration."""
    names, known, plots = Names(invert.naming), invert.certainty, []
    units = {name: with_unit(rsm, name, labels) for name in invert.point.solution}
    if known is not None:
        plots.append(Plot("profiles", "invert", caption(names, "profiles"), partial(profiles, invert, units)))
    exact, draw = caption(Names(), "solutions"), partial(solutions, rsm, invert, labels)
    return [*plots, Plot("solutions", "invert", exact, draw, detail=True)]


def validation_plots(study: Study, validate: ValidateResult) -> list[Plot]:
    """Return the figures of a validation."""
    naming, plots = study.naming, []
    compared = {further.response for row in validate.rows for further in row.further}
    for response in (naming.response, *(other for other in naming.others if other.name in compared)):
        spread = spread_of(study, response)
        fitted = sum(row.role == "calibration" for row in validate.compared)
        ringed = "validation together" if fitted > 1 else "validation ringed"
        ringed = "validation" if naming.condition is None else ringed
        text = caption(Names(naming.with_primary(response.name)), ringed, *(["bars"] if spread else []))
        name = "validation" if response is naming.response else f"validation-{response.name}"
        plots.append(Plot(name, "validate", text, partial(validation, validate, spread, response)))
    if naming.is_force_on_stems and validate.measured_exponent and validate.simulated_exponent:
        text = caption(Names(naming), "growth")
        plots.append(Plot("growth", "validate", text, partial(growth, validate)))
    return plots


def refinement_plot(refinement: RefineResult) -> Plot:
    """Return the figure of a refinement at several conditions."""
    return Plot("refinement", "refine", caption(Names(refinement.naming), "refinement"), partial(refined, refinement))


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
        dotted = ["dotted"] if any(curve.broke for curve in curves.values()) else []
        text = caption(Names(), "force", *dotted)
        plots.append(Plot("force-travel", "runs", text, partial(force_travel, curves, chosen)))
    calibrated = f"{short(study.targets.calibrate_at)} mm"
    for condition, modes in study.targets.modes.items():
        if (label := f"{short(condition)} mm") in curves and records[label].at_solution:
            text = caption(Names(), "measured curves")
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
        text = caption(Names(), "energies", run=label)
        draw = partial(energies, details.energies)
        plots.append(Plot(f"energies-{name}", "runs", text, draw, on_page, detail=True))
    if details.shape:
        plots += _pictures(label, name, details, on_page, hollow)
    return plots


def _pictures(label: str, name: str, details: Details, on_page: bool, hollow: bool) -> list[Plot]:
    """Return the mesh, the cut stem, and, where the run kept a film, the way from one to the other."""

    def shape() -> Shape:
        return Shape.unpacked(details.shape)

    def plot(figure: str, part: str, draw: Callable[[], Figure], detail: bool = True) -> Plot:
        text = caption(Names(), part, run=label)
        return Plot(f"{figure}-{name}", "runs", text, draw, on_page, wide=True, detail=detail)

    cut = plot("fracture", "cut" if hollow else "cut solid", lambda: fracture(shape()), detail=False)
    plots = [plot("mesh", "mesh", lambda: mesh(shape())), cut]
    if details.film:
        plots.append(plot("frames", "film", lambda: fracture_frames(frames_of(shape(), details.film))))
        plots.append(plot("fields", "fields", lambda: fields(frames_of(shape(), details.film))))
    return plots
