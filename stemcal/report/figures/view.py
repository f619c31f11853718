"""The cut stem in space: by pyvista in a process of its own where that works, by matplotlib everywhere."""

import importlib.util
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.end_state import Shape
from stemcal.files.encodings import lenient
from stemcal.outputs import write_output
from stemcal.report.figures.fracture import EDGE, PLASTIC, TOOL, colour_bar, exposed_faces, strain_scale
from stemcal.report.figures.style import Figure, new_figure, save

Array = NDArray[np.float64]

PATIENCE = 120.0  # seconds for a picture; a hung graphics driver is stopped
_SIGNS = {"none": ((1, 1),), "half": ((1, 1), (1, -1)), "quarter": ((1, 1), (1, -1), (-1, 1), (-1, -1))}


@dataclass(frozen=True)
class Scene:
    """The whole stem and the tools as quadrilaterals (F, 4, 3) in mm, with the plastic strain of the stem's."""

    body: Array
    strain: Array
    tools: Array


def write_view(shape: Shape, path: Path) -> str:
    """Write the cut stem as a PNG; returns who drew it, and if that is not pyvista, why."""
    scene = scene_of(shape)
    trouble = _by_pyvista(scene, path)
    if trouble is None:
        return "drawn by pyvista"
    save(view(shape, scene), path)
    return f"drawn by matplotlib, because {trouble}"


def scene_of(shape: Shape) -> Scene:
    """Return what is to be seen: the outer faces of all standing elements, mirrored to the whole stem."""
    corners, owner = exposed_faces(shape)
    quads, strain = shape.nodes[corners], shape.plastic_strain[owner]
    seen = ~_on_mirrors(shape, shape.reference[corners])
    signs = _SIGNS[shape.symmetry]
    wide = 1.4 * float(np.abs(shape.reference[:, 1]).max())
    tools = [_prism(outline, wide) for tool in shape.tools for outline in _whole(shape, _near(shape, tool))]
    return Scene(
        np.concatenate([quads[seen] * (sx, sy, 1) for sx, sy in signs]),
        np.tile(strain[seen], len(signs)),
        np.concatenate(tools) if tools else np.zeros((0, 4, 3)),
    )


def _on_mirrors(shape: Shape, quads: Array) -> NDArray[np.bool_]:
    """Tell which faces lie on a plane of symmetry, inside the whole stem."""
    flat = np.zeros(len(quads), bool)
    for axis in {"none": (), "half": (1,), "quarter": (0, 1)}[shape.symmetry]:
        flat |= quads[:, :, axis].max(axis=1) < 1e-6  # a model may reach past its mirror by half an element
    return flat


def _whole(shape: Shape, outline: Array) -> list[Array]:
    """Return a tool's outline, and its mirror image if a quarter model has but one of two such tools."""
    mirrored = shape.symmetry == "quarter" and outline[:, 0].min() > 0.0
    return [outline, outline * (-1.0, 1.0)] if mirrored else [outline]


def _near(shape: Shape, outline: Array) -> Array:
    """Return the part of a tool's outline that the picture shows; the tools' far ends are straight."""
    far, high = np.abs(shape.reference[:, 0]).max(), np.abs(shape.reference[:, 2]).max()
    return np.asarray(np.clip(outline, (-far, -1.8 * high), (far, 2.6 * high)))


def _prism(outline: Array, wide: float) -> Array:
    """Return the side faces of an outline (K, 2) in x and z, drawn out over |y| ≤ wide."""
    around = np.roll(outline, -1, axis=0)
    ends = [(outline, -wide), (around, -wide), (around, wide), (outline, wide)]
    return np.stack([np.column_stack([xz[:, 0], np.full(len(xz), y), xz[:, 1]]) for xz, y in ends], axis=1)


def _by_pyvista(scene: Scene, path: Path) -> str | None:
    """Let a process of its own draw; returns what went wrong, None if nothing did."""
    if importlib.util.find_spec("pyvista") is None:
        return 'pyvista is not installed (pip install "stemcal[view]")'
    reach = float(np.abs(scene.body[:, :, 0]).max())
    with tempfile.TemporaryDirectory() as folder:
        faces, picture = Path(folder) / "faces.npz", Path(folder) / "view.png"
        np.savez(faces, body=scene.body, strain=scene.strain, tools=scene.tools,
                 eye=[1.5 * reach, -3.6 * reach, 1.9 * reach], centre=[0.0, 0.0, 0.0])  # fmt: skip
        trouble = _run([sys.executable, "-m", "stemcal.report.figures.offscreen", str(faces), str(picture)])
        if trouble is None and picture.is_file():
            write_output(path, picture.read_bytes())
            return None
    return trouble or "pyvista left no picture"


def _run(command: list[str]) -> str | None:
    """Run a command; returns how it failed, None if it did not."""
    remedy = "without a display it needs OSMesa or EGL: Debian's libosmesa6 or libegl1, or run it under xvfb-run"
    try:
        done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return f"pyvista took longer than {PATIENCE:g} s; {remedy}"
    if done.returncode == 0:
        return None
    last = lenient(done.stderr).strip().splitlines()[-1:] or ["it said nothing"]
    return f"pyvista ended with code {done.returncode} ({last[0][:120]}); {remedy}"


def view(shape: Shape, scene: Scene) -> Figure:
    """Return the picture that matplotlib draws, stem and tools sorted by distance, face by face."""
    import matplotlib
    from matplotlib.colors import to_rgba
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    scale = strain_scale([shape])
    reach = float(np.abs(scene.body[:, :, 0]).max())
    with new_figure(width=6.4, height=4.0) as figure:
        axes = figure.add_subplot(projection="3d")
        colours = [
            matplotlib.colormaps[PLASTIC](scale(scene.strain)),
            np.tile(to_rgba(TOOL), (len(scene.tools), 1)),
        ]
        edges = [EDGE] * len(scene.body) + ["none"] * len(scene.tools)
        faces = [*scene.body, *scene.tools]
        axes.add_collection3d(
            Poly3DCollection(faces, facecolors=np.concatenate(colours), edgecolors=edges, linewidths=0.15)
        )
        high = 0.45 * reach
        axes.set(xlim=(-reach, reach), ylim=(-high, high), zlim=(-high, high))
        axes.set_box_aspect((reach, high, high), zoom=1.12)
        axes.set_axis_off()
        axes.view_init(elev=25, azim=-68)
        colour_bar(figure, scale, [axes])
    return figure
