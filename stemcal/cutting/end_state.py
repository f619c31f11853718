"""The shape of stem and tools at the end of a test, for figures, compressed for the record of a run."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Ints, Mask
from stemcal.fem.model import Model
from stemcal.fem.stepper import History

LARGEST = 40_000  # a body with more nodes is not kept in records
# Arrays of a shape: type in the record, number of columns (0 for a vector), type in memory.
_ARRAYS: dict[str, tuple[str, int, type]] = {
    "reference": ("<f4", 3, float), "nodes": ("<f4", 3, float), "hexes": ("<i4", 8, np.int32),
    "standing": ("|u1", 0, bool), "plastic_strain": ("<f4", 0, float),
}  # fmt: skip


@dataclass(frozen=True)
class Shape:
    """Body and tools at the end of a test.

    reference, nodes   initial and final positions of the nodes, mm, (N, 3)
    hexes              corners of the elements, (E, 8)
    standing           elements that are not deleted, (E,)
    plastic_strain     effective plastic strain, (E,)
    tools              outlines (K, 2) of blade and supports in x and z
    symmetry           modelled part of the stem: ``none`` (all), ``half`` (y ≥ 0), ``quarter`` (x, y ≥ 0)
    """

    reference: Array
    nodes: Array
    hexes: Ints
    standing: Mask
    plastic_strain: Array
    tools: tuple[Array, ...]
    symmetry: str

    def packed(self) -> dict[str, Any]:
        """Return the shape as JSON values: single precision, compressed, base 64."""
        arrays = {name: packed_text(getattr(self, name), packed) for name, (packed, _, _) in _ARRAYS.items()}
        return {**arrays, "tools": [np.round(tool, 4).tolist() for tool in self.tools], "symmetry": self.symmetry}

    @classmethod
    def unpacked(cls, packed: Mapping[str, Any]) -> Shape:
        arrays: dict[str, Any] = {
            name: unpacked_text(packed[name], kind, columns).astype(own)
            for name, (kind, columns, own) in _ARRAYS.items()
        }
        tools = tuple(np.array(tool) for tool in packed["tools"])
        return cls(**arrays, tools=tools, symmetry=str(packed["symmetry"]))


def shape_of(model: Model, history: History, symmetry: str) -> Shape:
    """Return the body and the tools at the end of a simulation."""
    heights = zip(model.tools, history.height[-1], strict=True)
    return Shape(
        reference=model.mesh.nodes,
        nodes=history.x,
        hexes=model.mesh.hexes,
        standing=history.standing,
        plastic_strain=history.row("PLASTIC_STRAIN"),
        tools=tuple(_offset(np.array(tool.corners), tool.radius) + np.array([0.0, z]) for tool, z in heights),
        symmetry=symmetry,
    )


def _offset(corners: Array, radius: float) -> Array:
    """Return a convex polygon (K, 2) offset outwards by a radius, as the farthest points in 64 directions (65, 2)."""
    angles = np.linspace(0.0, 2.0 * np.pi, 65)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    farthest = corners[np.argmax(directions @ corners.T, axis=1)]
    return np.asarray(farthest + radius * directions)


def packed_text(array: NDArray[Any], kind: str) -> str:
    """Return an array as text, converted to the dtype `kind`, compressed and base-64 encoded."""
    return base64.b64encode(zlib.compress(array.astype(kind).tobytes(), 9)).decode("ascii")


def unpacked_text(text: str, kind: str, columns: int = 0) -> NDArray[Any]:
    """Return the array (N,) or (N, columns) that is contained in the text from `packed_text`."""
    flat = np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype=kind)
    return flat.reshape(-1, columns) if columns else flat
