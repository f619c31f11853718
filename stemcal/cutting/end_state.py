"""How a test ends: the force curve, whether its maximum is reliable, and the body.

    broken     the stem has broken: the maximum is passed
    fallen     the force ends below nine tenths of its maximum
    rising     the end is the maximum, within the noise: the true maximum is larger
    regained   a maximum was passed, the force fell and has come up again: a larger one may follow
    falling    a maximum was passed, but the force has fallen by less than a tenth of it

The noise is that of the filtered force: the standard deviation of what the filter took away over the last tenth of the
stroke, over the root of the filter's window. Differences of up to five times that, the range of some twenty such
values, are none, nor are those of up to a hundredth of the maximum.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.model import Model
from stemcal.fem.stepper import History
from stemcal.note import Note, stroke_too_short

Array = NDArray[np.float64]
End = Literal["broken", "fallen", "rising", "regained", "falling"]
# The stroke was long enough if the force ends below this share of its peak.
FALLEN = 0.9
_RANGE, _LEAST = 5.0, 0.01


@dataclass(frozen=True)
class StrokeEnd:
    """How the curve ends: forces in N at the peak, at the lowest point after it and at the end; travel in mm."""

    kind: End
    peak: float
    peak_travel: float
    valley: float
    end: float
    stroke: float

    @property
    def was_enough(self) -> bool:
        """Whether the maximum is known to be passed."""
        return self.kind in ("broken", "fallen")

    @property
    def warnings(self) -> list[Note]:
        """What keeps the maximum in doubt."""
        forces = self.peak, self.peak_travel, self.valley, self.end
        return [] if self.was_enough else [stroke_too_short(self.kind, *forces, self.stroke)]


def stroke_end(travel: Array, raw: Array, filtered: Array, window: int, broken: int | None = None) -> StrokeEnd:
    """Return how a curve ends.

    Parameters
    ----------
    raw, filtered : (R,)
        Force before and after the filter, N.
    window : int
        Rows that the filter takes the mean of.
    broken : int, optional
        Row at which the stem has broken.
    """
    peak = int(np.argmax(filtered[:broken]))
    top, end, valley = float(filtered[peak]), float(filtered[-1]), float(filtered[peak:].min())
    last = slice(-max(len(raw) // 10, 2), None)
    noise = float(np.std(raw[last] - filtered[last])) / window**0.5
    return StrokeEnd(
        _kind(top, valley, end, max(_RANGE * noise, _LEAST * top), broken is not None),
        top,
        float(travel[peak]),
        valley,
        end,
        float(travel[-1]),
    )


def _kind(top: float, valley: float, end: float, none: float, broken: bool) -> End:
    if broken:
        return "broken"
    if end < FALLEN * top:
        return "fallen"
    if valley >= top - none:
        return "rising"
    return "regained" if end > valley + none else "falling"


# ---- the body as it ended, in a form that pictures are made from and that fits into a run's record


LARGEST = 40_000  # nodes; a finer body is not kept in records


@dataclass(frozen=True)
class Shape:
    """Body and tools at the end of a test.

    Attributes
    ----------
    reference, nodes : array (N, 3)
        Where the nodes began and ended, mm.
    hexes : array (E, 8)
        Corners of the elements.
    standing : array (E,)
        Which elements are left.
    plastic_strain : array (E,)
        Effective plastic strain.
    tools : tuple of array (K, 2)
        Outlines of blade and supports in x and z.
    symmetry : str
        Which part of the stem this is: ``none`` (all), ``half`` (y ≥ 0), ``quarter`` (x, y ≥ 0).
    """

    reference: Array
    nodes: Array
    hexes: NDArray[np.int32]
    standing: NDArray[np.bool_]
    plastic_strain: Array
    tools: tuple[Array, ...]
    symmetry: str

    def packed(self) -> dict[str, Any]:
        """Return the shape as JSON values: single precision, compressed, base 64."""
        return {
            "reference": packed_text(self.reference, "<f4"),
            "nodes": packed_text(self.nodes, "<f4"),
            "hexes": packed_text(self.hexes, "<i4"),
            "standing": packed_text(self.standing, "|u1"),
            "plastic_strain": packed_text(self.plastic_strain, "<f4"),
            "tools": [np.round(tool, 4).tolist() for tool in self.tools],
            "symmetry": self.symmetry,
        }

    @classmethod
    def unpacked(cls, packed: Mapping[str, Any]) -> Shape:
        """Return the shape that `packed` made."""
        return cls(
            reference=unpacked_text(packed["reference"], "<f4", 3).astype(float),
            nodes=unpacked_text(packed["nodes"], "<f4", 3).astype(float),
            hexes=unpacked_text(packed["hexes"], "<i4", 8).astype(np.int32),
            standing=unpacked_text(packed["standing"], "|u1").astype(bool),
            plastic_strain=unpacked_text(packed["plastic_strain"], "<f4").astype(float),
            tools=tuple(np.array(tool) for tool in packed["tools"]),
            symmetry=str(packed["symmetry"]),
        )


def shape_of(model: Model, history: History, symmetry: str) -> Shape:
    """Return body and tools at the end of a simulation."""
    lifted = np.array([[0.0, height] for height in history.height[-1]])
    tools = [
        swollen(np.array(tool.corners), tool.radius) + lift for tool, lift in zip(model.tools, lifted, strict=True)
    ]
    return Shape(
        reference=model.mesh.nodes,
        nodes=history.x,
        hexes=model.mesh.hexes,
        standing=history.standing,
        plastic_strain=history.row("PLASTIC_STRAIN"),
        tools=tuple(tools),
        symmetry=symmetry,
    )


def swollen(corners: Array, radius: float) -> Array:
    """Return the outline of a convex polygon (K, 2) swollen by a radius: the farthest point in 64 directions."""
    angles = np.linspace(0.0, 2.0 * np.pi, 65)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    farthest = corners[np.argmax(directions @ corners.T, axis=1)]
    return np.asarray(farthest + radius * directions)


def packed_text(array: NDArray[Any], kind: str) -> str:
    """Return an array of a kind as text: compressed, base 64."""
    return base64.b64encode(zlib.compress(array.astype(kind).tobytes(), 9)).decode("ascii")


def unpacked_text(text: str, kind: str, columns: int = 0) -> NDArray[Any]:
    """Return the array that `packed_text` packed, (N,) or (N, columns)."""
    flat = np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype=kind)
    return flat.reshape(-1, columns) if columns else flat
