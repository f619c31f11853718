"""Frames of a simulation for ParaView and other VTK readers: .vtu files at intervals, listed in a .pvd file."""

import base64
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array
from stemcal.fem.kernels.block import PLASTIC_STRAIN, STRESS
from stemcal.fem.state import State
from stemcal.storage.atomic import write_atomic

Values = NDArray[np.generic]

_VTK_HEXAHEDRON = 12
_TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}


class FrameWriter:
    """Callable for `simulate(inspect=…)` that writes every `every`-th output to `folder`, without eroded elements.

    Points have a displacement (mm) and a velocity (mm/s), cells a stress (xx, yy, zz, xy, yz, zx in MPa), a von Mises
    stress, a plastic strain and the number of their element.
    """

    def __init__(self, folder: Path, every: int = 1) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.every = every
        self._seen = 0
        self._start: Array | None = None
        self._frames: list[tuple[float, str]] = []

    def __call__(self, time: float, state: State) -> None:
        if self._start is None:
            self._start = state.body.x.copy()
        if self._seen % self.every == 0:
            name = f"frame-{len(self._frames):04d}.vtu"
            self._write(self.folder / name, state, self._start)
            self._frames.append((time, name))
            entries = [f'<DataSet timestep="{at:.9g}" part="0" file="{name}"/>' for at, name in self._frames]
            _write(self.folder / "frames.pvd", "Collection", "\n".join(["<Collection>", *entries, "</Collection>"]))
        self._seen += 1

    def _write(self, path: Path, state: State, start: Array) -> None:
        standing = np.flatnonzero(state.topology.standing)
        rows = state.lanes.gathered(state.body.state)[standing]
        stress = rows[:, STRESS : STRESS + 6]
        _write_vtu(
            path,
            state.body.x,
            state.topology.hexes[standing],
            {"displacement": state.body.x - start, "velocity": state.body.v},
            {
                "stress": stress,
                "von_mises": _von_mises(stress),
                "plastic_strain": rows[:, PLASTIC_STRAIN],
                "element": standing,
            },
        )


def _von_mises(stress: Array) -> Array:
    """Return √(3/2 s:s) with the deviator s of symmetric tensors (…, 6) in the order xx, yy, zz, xy, yz, zx."""
    normal = np.sum((stress[..., :3] - stress[..., :3].mean(axis=-1, keepdims=True)) ** 2, axis=-1)
    return np.asarray(np.sqrt(1.5 * (normal + 2.0 * np.sum(stress[..., 3:] ** 2, axis=-1))))


def _write_vtu(
    path: Path, nodes: Values, hexes: Values, point_data: Mapping[str, Values], cell_data: Mapping[str, Values]
) -> None:
    """Write hexahedra (mm, corners ordered as in VTK) with data of nodes (N,) or (N, components), and of cells."""
    count = len(hexes)
    cells: dict[str, Values] = {
        "connectivity": hexes.astype(np.int64).ravel(),
        "offsets": np.arange(8, 8 * count + 1, 8, dtype=np.int64),
        "types": np.full(count, _VTK_HEXAHEDRON, dtype=np.uint8),
    }
    points: dict[str, Values] = {"Points": np.asarray(nodes, dtype=np.float64)}
    parts = {"Points": points, "Cells": cells, "PointData": point_data, "CellData": cell_data}
    arrays = {name: map(_data_array, each.keys(), each.values()) for name, each in parts.items()}
    body = "\n".join("\n".join([f"<{name}>", *each, f"</{name}>"]) for name, each in arrays.items())
    piece = f'<Piece NumberOfPoints="{len(nodes)}" NumberOfCells="{count}">\n{body}\n</Piece>'
    _write(path, "UnstructuredGrid", f"<UnstructuredGrid>\n{piece}\n</UnstructuredGrid>")


def _write(path: Path, kind: str, content: str) -> None:
    opening = f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
    write_atomic(path, f'<?xml version="1.0"?>\n{opening}\n{content}\n</VTKFile>\n')


def _data_array(name: str, values: Values) -> str:
    """Return the XML element of an array, which contains its length in bytes and its values in base 64."""
    values = np.ascontiguousarray(values)
    raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
    text = base64.b64encode(np.uint64(len(raw)).astype("<u8").tobytes() + raw).decode("ascii")
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    kind = _TYPES[values.dtype.name]
    return f'<DataArray type="{kind}" Name={quoteattr(name)}{components} format="binary">{text}</DataArray>'
