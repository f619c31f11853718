"""The stem on its way through the cut: moments in section, the mesh, and the animation as a GIF."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.end_state import Shape
from stemcal.files.durable import refuse_link
from stemcal.numbers import fixed
from stemcal.report.figures.fracture import (
    EDGE,
    WHOLE,
    colour_bar,
    draw_faces,
    end_faces,
    near,
    section_faces,
    side_faces,
    strain_scale,
)
from stemcal.report.figures.style import BLUE, INK, ORANGE, Axes, Figure, new_figure
from stemcal.solvers.film import Frame

Array = NDArray[np.float64]


def moments(frames: Sequence[Frame], count: int = 6) -> list[Frame]:
    """Return the main frames: start, half-way to the peak, peak, and evenly from there to the end."""
    forces = [frame.force for frame in frames]
    peak = forces.index(max(forces))
    after = np.linspace(peak, len(frames) - 1, count - 2)
    return [frames[k] for k in sorted({0, peak // 2, *(round(float(k)) for k in after)})]


def fracture_frames(frames: Sequence[Frame]) -> Figure:
    """Return the section at a few moments, all coloured on one scale."""
    chosen = moments(frames)
    scale = strain_scale([frame.shape for frame in chosen])
    rows = (len(chosen) + 1) // 2
    with new_figure(width=6.4, height=1.75 * rows + 0.3) as figure:
        panels = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, frame in zip(panels, chosen, strict=False):
            draw_faces(axes, frame.shape, section_faces(frame.shape), scale, near(frame.shape))
            axes.set_title(f"{fixed(frame.travel)} mm, {fixed(frame.force, 0)} N", color=INK)
        for axes in panels[len(chosen) :]:
            axes.set_visible(False)
        figure.supxlabel("x, mm", fontsize=9)
        figure.supylabel("z, mm", fontsize=9)
        colour_bar(figure, scale, list(panels))
    return figure


def mesh(shape: Shape) -> Figure:
    """Return the mesh before the test: from the side with blade and supports, and the stem's cross-section."""
    whole = replace(
        shape,
        nodes=shape.reference,
        standing=np.ones(len(shape.hexes), bool),
        plastic_strain=np.zeros(len(shape.hexes)),
        tools=_touching(shape),
    )
    scale = strain_scale([whole])
    with new_figure(width=6.4, height=1.9) as figure:
        side, across = figure.subplots(1, 2, width_ratios=(3.4, 1.0))
        draw_faces(side, whole, side_faces(whole), scale)
        side.set_xlabel("x, mm")
        side.set_ylabel("z, mm")
        _draw_across(across, whole)
    return figure


def _touching(shape: Shape) -> tuple[Array, ...]:
    """Return the tools with the blade where it touches the stem."""
    if not shape.tools:
        return ()
    up = shape.reference[:, 2].max() - shape.tools[0][:, 1].min()
    return (shape.tools[0] + [0.0, up], *shape.tools[1:])


def _draw_across(axes: Axes, shape: Shape) -> None:
    """Draw the stem's cross-section in y and z."""
    from matplotlib.collections import PolyCollection

    polygons = end_faces(shape)
    for sign in (1.0, -1.0) if shape.symmetry != "none" else (1.0,):
        axes.add_collection(
            PolyCollection(list(polygons * (sign, 1.0)), facecolors=WHOLE, edgecolors=EDGE, linewidths=0.3)
        )
    reach = 1.1 * float(np.abs(shape.reference[:, 2]).max())
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    axes.set_xlabel("y, mm")


Curve = tuple[Sequence[float], Sequence[float]]
FRAMES_PER_SECOND = 6
DOTS_PER_INCH = 110


def write_animation(frames: Sequence[Frame], path: Path, curve: Curve | None = None) -> Path:
    """Write the frames as a GIF; returns the path.

    `curve` has the travel (mm) and force (N) to be drawn below, by default those of the frames alone.
    """
    from matplotlib.animation import PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    refuse_link(path)
    writer = PillowWriter(fps=FRAMES_PER_SECOND)
    with new_figure(width=6.4, height=5.0) as figure:
        FigureCanvasAgg(figure)
        figure.set_facecolor("white")
        show = _stage(figure, frames, curve or ([f.travel for f in frames], [f.force for f in frames]))
        show(frames[0])
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # placed once, so that nothing trembles
        with writer.saving(figure, str(path), DOTS_PER_INCH):
            for frame in frames:
                show(frame)
                writer.grab_frame(facecolor="white")
    return path


def _stage(figure: Figure, frames: Sequence[Frame], along: Curve) -> Any:
    """Lay out the panels and return what shows a frame in them."""
    side, section, curve = figure.subplots(3, 1, height_ratios=(1.0, 1.0, 0.9))
    scale = strain_scale([frame.shape for frame in frames])
    colour_bar(figure, scale, [side, section])
    curve.plot(*along, color=BLUE)
    curve.set_xlabel("blade travel, mm")
    curve.set_ylabel("force, N")
    curve.set_ylim(bottom=0)
    (marker,) = curve.plot([], [], "o", color=ORANGE)
    shown: list[Any] = []

    def show(frame: Frame) -> None:
        while shown:
            shown.pop().remove()
        for axes, faces, label in ((side, side_faces, "side"), (section, section_faces, "section")):
            shown.extend(draw_faces(axes, frame.shape, faces(frame.shape), scale))
            axes.set_ylabel(f"{label}: z, mm")
        section.set_xlabel("x, mm")
        side.set_title(f"{fixed(frame.travel)} mm of travel, {fixed(frame.force, 0)} N", color=INK)
        marker.set_data([frame.travel], [frame.force])

    return show
