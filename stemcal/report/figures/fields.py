"""Stress and displacement of the stem in section, where the force is largest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stemcal.report.figures.fracture import colour_bar, draw_faces, near, section_faces
from stemcal.report.figures.style import INK, new_figure, styled
from stemcal.text.numbers import fixed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stemcal.solvers.film import Frame

STRESS, WAY = "YlGnBu", "BuPu"  # colours: their lightness falls steadily, so that grey prints tell as much


def fields(frames: Sequence[Frame]) -> Figure:
    """Return von Mises' stress and the displacement of the frame that knows its stress, each with its scale."""
    from matplotlib.colors import Normalize

    frame = next(frame for frame in frames if frame.von_mises is not None)
    shape, moved = frame.shape, np.linalg.norm(frame.shape.nodes - frame.shape.reference, axis=1)
    shown = (
        (frame.von_mises, "von Mises stress, MPa", STRESS),
        (moved[shape.hexes].mean(axis=1), "displacement, mm", WAY),
    )
    figure = new_figure(width=6.4, height=2.3)
    with styled():
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for axes, (values, label, colours) in zip(panels, shown, strict=True):
            scale = Normalize(0.0, max(float(np.max(values[shape.standing], initial=0.0)), 1e-9))
            draw_faces(axes, shape, section_faces(shape, values), scale, near(shape), colours)
            axes.set_xlabel("x, mm")
            axes.set_title(label, fontsize=9)  # beside its scale it stood before the next panel
            colour_bar(figure, scale, [axes], "", colours)
        panels[0].set_ylabel("z, mm")
        figure.suptitle(f"blade at {fixed(frame.travel)} mm, {fixed(frame.force, 0)} N", fontsize=9, color=INK)
    return figure
