"""The cut as a short film: side and section frame by frame, and the force on the blade below them.

Written by matplotlib's own Pillow as a GIF.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stemcal.numbers import fixed
from stemcal.outputs import refuse_link
from stemcal.report.figures.fracture import colour_bar, draw_faces, section_faces, side_faces, strain_scale
from stemcal.report.figures.style import BLUE, INK, ORANGE, Figure, new_figure
from stemcal.solvers.film import Frame

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
