"""Draws faces in space with pyvista, as a program of its own: what its graphics library does harms nobody else.

python -m stemcal.report.figures.offscreen FACES.npz PICTURE.png
"""

import sys
from typing import Any

import numpy as np

SIZE = (1600, 1000)


def main(faces: str, picture: str) -> None:
    """Draw the quadrilaterals of a file, coloured by strain, and the tools in grey."""
    import pyvista

    with np.load(faces) as data:
        plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(SIZE))
        plotter.background_color = "white"
        bar = {"title": "plastic strain\n", "color": "black", "fmt": "%.3f", "n_labels": 5, "vertical": True,
               "position_x": 0.88, "position_y": 0.15, "height": 0.6, "width": 0.06}  # fmt: skip
        body = _surface(pyvista, data["body"])
        body.cell_data["plastic strain"] = data["strain"]
        plotter.add_mesh(body, cmap="YlOrBr", show_edges=True, edge_color="#6d6a66", scalar_bar_args=bar, ambient=0.35,
                         clim=[0.0, max(float(data["strain"].max()), 1e-6)])  # fmt: skip
        plotter.add_mesh(_surface(pyvista, data["tools"]), color="#9aa3af", ambient=0.25, diffuse=0.6,
                         specular=0.0, smooth_shading=False)  # fmt: skip
        plotter.camera_position = [tuple(data["eye"]), tuple(data["centre"]), (0.0, 0.0, 1.0)]
        plotter.camera.view_angle = 24.0
        plotter.screenshot(picture)
        plotter.close()


def _surface(pyvista: Any, quads: Any) -> Any:
    """Return quadrilaterals (F, 4, 3) as a surface."""
    count = len(quads)
    cells = np.hstack([np.full((count, 1), 4), np.arange(4 * count).reshape(count, 4)])
    return pyvista.PolyData(quads.reshape(-1, 3), cells.ravel())


if __name__ == "__main__":
    main(*sys.argv[1:3])
