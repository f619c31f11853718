"""Every figure of a study by name: for the page, the figures folder and `stemcal export figures`."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from stemcal.cutting.end_state import Shape
from stemcal.files.durable import make_folder
from stemcal.numbers import short
from stemcal.report.figures.curves import energies, force_travel, measured_band
from stemcal.report.figures.fracture import fracture, fracture_frames, mesh
from stemcal.report.figures.plot import Plot
from stemcal.report.figures.style import Figure, resize, save, write_both
from stemcal.report.records import Details, Records, curves_of
from stemcal.report.showing import Setting, showing_of
from stemcal.solvers.film import frames_of
from stemcal.stages.results import Results
from stemcal.study.model import Study


def gallery(study: Study, results: Results, records: Records) -> list[Plot]:
    """Return the figures that the finished stages and their records allow, none of them drawn yet."""
    setting = Setting(study, results)
    plots = [plot for result in results.done for plot in showing_of(result).figures(result, setting)]
    return plots + _run_plots(study, records)


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


def _run_plots(study: Study, records: Records) -> list[Plot]:
    """Return the figures of the runs themselves."""
    curves, plots = curves_of(records), []
    if curves:
        chosen = [label for label in curves if records[label].at_solution]
        text = "Force versus blade travel: validation runs in colour, all other runs in grey."
        text += " Dotted: after failure." if any(curve.broke for curve in curves.values()) else ""
        plots.append(Plot("force-travel", "runs", text, partial(force_travel, curves, chosen)))
    calibrated = f"{short(study.targets.calibrate_at)} mm"
    for condition, modes in study.targets.modes.items():
        if (label := f"{short(condition)} mm") in curves and records[label].at_solution:
            text = (
                "Measured curves and the curve simulated with the calibrated parameters, up to the peak, versus "
                "relative travel. Below: difference of the forces in standard deviations of the specimens."
            )
            name = "measured-curves" if label == calibrated else f"measured-curves-{short(condition)}mm"
            plots.append(Plot(name, "runs", text, partial(measured_band, modes, curves[label])))
    hollow = study.specimen.diameter_ratio > 0.0 or "wall_thickness" in study.names
    for label, record in records.items():
        if record.at_solution:
            plots += _run(label, record.details, label == calibrated, hollow)
    return plots


def _run(label: str, details: Details, on_page: bool, hollow: bool) -> list[Plot]:
    """Return the pictures of one run: energies, mesh, cut stem, and, where it kept a film, the way there.

    The page shows those of the calibration diameter.
    """
    name, plots = label.replace(" ", ""), []
    if details.energies:
        text, draw = f"Energies versus blade travel for the {label} stem.", partial(energies, details.energies)
        plots.append(Plot(f"energies-{name}", "runs", text, draw, on_page, detail=True))
    if not details.shape:
        return plots

    def shape() -> Shape:
        return Shape.unpacked(details.shape)

    def plot(figure: str, text: str, draw: Callable[[], Figure], detail: bool = True) -> Plot:
        return Plot(f"{figure}-{name}", "runs", text, draw, on_page, wide=True, detail=detail)

    meshed = f"Mesh of the {label} stem: side view with blade and supports (grey), and cross-section."
    bore = " (the bore between the walls)" if hollow else ""
    cut = (
        f"The {label} stem at the end of the simulation, which stops after the peak force, before complete cutting: "
        f"side view and section{bore}. Colours: plastic strain; failed elements are removed. Grey: the blade and, "
        "separated by their clearance, the supports."
    )
    plots.append(plot("mesh", meshed, lambda: mesh(shape())))
    plots.append(plot("fracture", cut, lambda: fracture(shape()), detail=False))
    if details.film:
        film = f"Cutting of the {label} stem, in section. Above each picture: blade travel and force."
        plots.append(plot("frames", film, lambda: fracture_frames(frames_of(shape(), details.film))))
    return plots
