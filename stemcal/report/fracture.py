"""Pictures and animations of the cut stem, side view and section, coloured by plastic strain, with the tools."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Ints, Mask
from stemcal.cutting.end_state import Shape
from stemcal.drawing.style import BLUE, FAINT, INK, ORANGE, Axes, Figure, new_figure
from stemcal.formats import fixed
from stemcal.responses import work_until
from stemcal.solvers.film import Frame
from stemcal.storage.atomic import refuse_link

# corners of each face of a hexahedron, counter-clockwise as seen from outside
FACES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])


# colours from light at zero strain, so that the mesh is visible, to dark, so that prints in grey are readable
_PLASTIC = "YlOrBr"
EDGE = "#6d6a66"
_TOOL = "#b4bac3"


def fracture(shape: Shape) -> Figure:
    """Draw side view and section of the stem near the blade; x along the stem, z upwards, the blade moves down."""
    scale = _strain_scale([shape])
    with new_figure(width=6.4, height=2.3) as figure:
        panels = list(figure.subplots(1, 2, sharex=True, sharey=True))
        _draw_views(panels, shape, scale, half_width(shape))
        _colour_bar(figure, scale, panels)
    return figure


def _draw_views(panels: Sequence[Axes], shape: Shape, scale: Any, reach: float) -> list[Any]:
    """Draw the side view and the section in two panels; return the artists added to them."""
    added: list[Any] = []
    views = (_side_faces(shape), "side view"), (_section_faces(shape), "section")
    for axes, (faces, label) in zip(panels, views, strict=True):
        added += _draw_faces(axes, shape, faces, scale, reach)
        axes.set_title(label, color=INK)
        axes.set_xlabel("x, mm")
    panels[0].set_ylabel("z, mm")
    return added


def half_width(shape: Shape) -> float:
    """Return half of the length of stem to be drawn, mm: beyond the supports, and at least one diameter."""
    edges = [float(np.abs(tool[:, 0]).min()) for tool in shape.tools[1:]]
    x, z = (shape.reference[:, i] for i in (0, 2))
    return min(max(1.35 * min(edges, default=np.inf), float(np.ptp(z))), float(np.abs(x).max()))


def _strain_scale(shapes: Sequence[Shape]) -> Any:
    """Return the colour scale, from zero to the largest plastic strain of remaining elements in all shapes."""
    from matplotlib.colors import Normalize

    largest = [float(np.max(shape.plastic_strain[shape.standing], initial=0.0)) for shape in shapes]
    return Normalize(0.0, max(*largest, 1e-6))


def _colour_bar(figure: Figure, scale: Any, panels: list[Axes]) -> None:
    import matplotlib

    mapped = matplotlib.cm.ScalarMappable(scale, _PLASTIC)
    figure.colorbar(mapped, ax=panels, label="plastic strain", aspect=30, panchor=False).outline.set_visible(False)


def _side_faces(shape: Shape) -> tuple[Array, Array]:
    """Return the visible faces in side view, the farthest first: corners (F, 4, 2) in x and z, and strain (F,)."""
    corners, owner = _faces(shape.hexes, shape.standing)
    points = shape.nodes[corners]
    visible = _normals(points)[:, 1] > 0.0
    order = np.argsort(points[visible][:, :, 1].mean(axis=1))
    return points[visible][order][:, :, (0, 2)], shape.plastic_strain[owner[visible]][order]


def _section_faces(shape: Shape) -> tuple[Array, Array]:
    """Return the faces of remaining elements on the plane y = 0: corners (F, 4, 2) in x and z, and strain (F,)."""
    corners, owner = _faces(shape.hexes, shape.reference[shape.hexes].mean(axis=1)[:, 1] > 0.0)
    before = shape.reference[corners]
    edges = np.linalg.norm(before - np.roll(before, 1, axis=1), axis=2)
    # faces whose centre is near y = 0, within about a third of an edge, and which point to −y
    close = np.abs(before[:, :, 1].mean(axis=1)) < 0.35 * (float(np.median(edges)) if len(before) else 0.0)
    normals = _normals(before)
    on_plane = close & (normals[:, 1] < -0.7 * np.linalg.norm(normals, axis=1)) & shape.standing[owner]
    return shape.nodes[corners[on_plane]][:, :, (0, 2)], shape.plastic_strain[owner[on_plane]]


def _faces(hexes: Ints, chosen: Mask) -> tuple[Ints, NDArray[np.intp]]:
    """Return the faces that only one of the chosen elements has, as corners (F, 4), and these elements (F,)."""
    owner = np.repeat(np.flatnonzero(chosen), 6)
    corners = hexes[chosen][:, FACES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(corners, axis=1), axis=0, return_index=True, return_counts=True)
    single = first[count == 1]
    return corners[single], owner[single]


def _normals(points: Array) -> Array:
    """Return the area vectors of quadrilaterals (F, 4, 3): half the product of their diagonals."""
    return np.asarray(0.5 * np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1]))


def _draw_faces(axes: Axes, shape: Shape, faces: tuple[Array, Array], scale: Any, reach: float) -> list[Any]:
    """Draw faces and tools up to a distance `reach` (mm) from the blade; return the artists added to the axes."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Polygon

    polygons, strain = faces
    added: list[Any] = []
    for sign in (1.0, -1.0) if shape.symmetry == "quarter" else (1.0,):
        body = PolyCollection(list(polygons * (sign, 1.0)), cmap=_PLASTIC, norm=scale, edgecolors=EDGE, linewidths=0.2)
        body.set_array(strain)
        added.append(axes.add_collection(body))
        for tool in shape.tools:
            patch = Polygon(tool * (sign, 1.0), facecolor=_TOOL, edgecolor=FAINT, linewidth=0.6)
            added.append(axes.add_patch(patch))
    z = shape.reference[:, 2]
    axes.set(xlim=(-reach, reach), ylim=(1.6 * z.min(), 2.0 * z.max()), aspect="equal")
    return added


Curve = tuple[Sequence[float], Sequence[float]]
_FRAMES_PER_SECOND = 6
_DOTS_PER_INCH = 110


def write_animation(frames: Sequence[Frame], path: Path, curve: Curve | None = None) -> Path:
    """Write an animated GIF of the cut and its force `curve` (mm, N; default: of the frames); return `path`."""
    from matplotlib.animation import PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    refuse_link(path)
    writer = PillowWriter(fps=_FRAMES_PER_SECOND)
    with new_figure(width=6.4, height=5.0) as figure:
        FigureCanvasAgg(figure)
        figure.set_facecolor("white")
        show = _stage(figure, frames, curve or ([f.travel for f in frames], [f.force for f in frames]))
        show(frames[0])
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # a fixed layout, otherwise the panels would move between frames
        with writer.saving(figure, str(path), _DOTS_PER_INCH):
            for frame in frames:
                show(frame)
                writer.grab_frame(facecolor="white")
    return path


def _stage(figure: Figure, frames: Sequence[Frame], along: Curve) -> Any:
    """Create the panels and return a function that draws a frame in them."""
    panels = figure.subplot_mosaic([["side", "section"], ["curve", "curve"]], height_ratios=(1.6, 1.0))
    side, section, curve = panels.values()
    reach = half_width(frames[-1].shape)
    scale = _strain_scale([frame.shape for frame in frames])
    _colour_bar(figure, scale, [side, section])
    curve.plot(*along, color=BLUE)
    curve.set(xlabel="blade travel, mm", ylabel="force, N", ylim=(0, None))
    (marker,) = curve.plot([], [], "o", color=ORANGE)
    shown: list[Any] = []

    def show(frame: Frame) -> None:
        while shown:
            shown.pop().remove()
        shown.extend(_draw_views((side, section), frame.shape, scale, reach))
        work = f"work {fixed(work_until(*along, frame.travel), 0)} mJ"
        curve.set_title(f"travel {fixed(frame.travel)} mm, force {fixed(frame.force, 0)} N, {work}", color=INK)
        marker.set_data([frame.travel], [frame.force])

    return show
