"""All figures of a study, for the page, the figures folder and `stemcal export figures`."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from stemcal.cutting.end_state import Shape
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import Setting
from stemcal.drawing.style import resize, save
from stemcal.formats import short, significant
from stemcal.report.curves import energies, force_travel, measured_band
from stemcal.report.fracture import fracture
from stemcal.report.outcome import showing_of
from stemcal.report.records import Details, Records
from stemcal.stages.results import Results
from stemcal.storage.atomic import make_folder, write_atomic
from stemcal.study.model.study import Study


def gallery(study: Study, results: Results, records: Records) -> list[Plot]:
    """Return the figures of the finished stages and of their runs; each is drawn on first use."""
    setting = Setting(study, results)
    plots = [plot for result in results.done for plot in showing_of(result).figures(result, setting)]
    return plots + _run_plots(study, records)


def write_figures(plots: list[Plot], folder: Path) -> None:
    """Write every figure to a folder, as SVG and PNG on a white background."""
    make_folder(folder)
    for plot in plots:
        # the first filled path of the SVG is the background
        write_atomic(folder / f"{plot.name}.svg", plot.document.replace("fill: none", "fill: #ffffff", 1))
        write_atomic(folder / f"{plot.name}.png", plot.pixels)


def write_as(plots: list[Plot], folder: Path, kinds: Sequence[str], dpi: float, width: float | None) -> list[Path]:
    """Write figures in the formats `kinds`, with a resolution (dots per inch) and width (mm); return the paths."""
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
    details, plots = {label: record.details for label, record in records.items()}, []
    curves = {label: replace(run.curve, broke=run.break_travel) for label, run in details.items() if run.curve}
    if curves:
        chosen = [label for label in curves if records[label].at_solution]
        which = "Validation runs" if study.goal is None else "Runs of the optimum, the present cutter and the front"
        text = f"Force versus blade travel. {which} are in colour; all other runs are grey."
        if any(curve.broke for curve in curves.values()):
            travels = [broke for label in chosen if (broke := curves[label].broke) is not None]
            ends = " to ".join(dict.fromkeys(significant(end(travels), 3) for end in (min, max) if travels))
            where = f" (at {ends} mm in the validation runs)" if ends else ""
            text += f" Curves are dotted beyond the first fracture{where}."
        plots.append(Plot("force-travel", "runs", text, partial(force_travel, curves, chosen)))
    calibrated = f"{short(study.targets.calibrate_at)} mm"
    for condition, modes in study.targets.modes.items():
        if (label := f"{short(condition)} mm") in curves and records[label].at_solution:
            text = (
                "Measured force and simulated force (calibrated parameters) versus relative travel up to the peak "
                "force. The lower panel shows the difference between the two forces in units of the between-specimen "
                "standard deviation."
            )
            name = "measured-curves" if label == calibrated else f"measured-curves-{short(condition)}mm"
            plots.append(Plot(name, "runs", text, partial(measured_band, modes, curves[label])))
    hollow = study.specimen.ratio_at(study.targets.calibrate_at) > 0.0
    for label, record in records.items():
        if record.at_solution:
            on_page = label in (calibrated, "optimum", "present")
            plots += _run(label, record.details, on_page, hollow, " cutter" if study.goal is not None else " stem")
    return plots


def _run(label: str, details: Details, on_page: bool, hollow: bool, what: str) -> list[Plot]:
    name, plots = label.replace(" ", ""), []
    if details.energies:
        text = f"Energies versus blade travel in the simulation of the {label}{what}."
        draw = partial(energies, details.energies)
        plots.append(Plot(f"energies-{name}", "runs", text, draw, on_page, detail=True))
    if details.shape:
        bore = " (the bore is between the walls)" if hollow else ""
        end = "The simulation stops after the peak force, before the stem is cut through."
        if details.severed is not None:
            end = "The stem is cut through." if details.severed else "The stem is not cut through within the stroke."
        text = (
            f"The {label}{what} at the end of the simulation: side view and section{bore}. {end} "
            "Colours show the plastic strain; failed elements are removed. The blade and the supports are grey."
        )
        name = f"fracture-{name}"
        plots.append(Plot(name, "runs", text, lambda: fracture(Shape.unpacked(details.shape)), on_page, wide=True))
    return plots
