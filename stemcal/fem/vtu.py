"""Write the body for ParaView and other VTK readers: one .vtu file per frame and a .pvd file that lists them."""

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from stemcal.outputs import write_output

Array = NDArray[np.generic]

_VTK_HEXAHEDRON = 12
_TYPES = {"float64": "Float64", "int32": "Int32", "int64": "Int64", "uint8": "UInt8"}


def write_vtu(
    path: Path, nodes: Array, hexes: Array, point_data: Mapping[str, Array], cell_data: Mapping[str, Array]
) -> None:
    """Write hexahedra with data at nodes and in cells.

    Parameters
    ----------
    nodes : array (N, 3)
        mm.
    hexes : array (E, 8)
        In VTK's order, which is that of `fem.mesh`.
    point_data, cell_data : mapping
        Arrays (N,) or (N, c), and (E,) or (E, c), by name.
    """
    count = len(hexes)
    cells = [
        _data_array("connectivity", hexes.astype(np.int64).ravel()),
        _data_array("offsets", np.arange(8, 8 * count + 1, 8, dtype=np.int64)),
        _data_array("types", np.full(count, _VTK_HEXAHEDRON, dtype=np.uint8)),
    ]
    body = "\n".join(
        [
            "<Points>",
            _data_array("Points", np.asarray(nodes, dtype=np.float64)),
            "</Points>",
            "<Cells>",
            *cells,
            "</Cells>",
            "<PointData>",
            *(_data_array(name, values) for name, values in point_data.items()),
            "</PointData>",
            "<CellData>",
            *(_data_array(name, values) for name, values in cell_data.items()),
            "</CellData>",
        ]
    )
    piece = f'<Piece NumberOfPoints="{len(nodes)}" NumberOfCells="{count}">\n{body}\n</Piece>'
    _write(path, "UnstructuredGrid", f"<UnstructuredGrid>\n{piece}\n</UnstructuredGrid>")


def write_pvd(path: Path, frames: Sequence[tuple[float, str]]) -> None:
    """Write the list of frames: time in s and the file's name beside the .pvd file."""
    entries = "\n".join(f'<DataSet timestep="{time:.9g}" part="0" file={quoteattr(name)}/>' for time, name in frames)
    _write(path, "Collection", f"<Collection>\n{entries}\n</Collection>")


def _write(path: Path, kind: str, content: str) -> None:
    opening = f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
    write_output(path, f'<?xml version="1.0"?>\n{opening}\n{content}\n</VTKFile>\n')


def _data_array(name: str, values: Array) -> str:
    """Return one array as base64 behind its length in bytes."""
    values = np.ascontiguousarray(values)
    if values.dtype.name not in _TYPES:
        values = values.astype(np.float64)
    raw = values.astype(values.dtype.newbyteorder("<")).tobytes()
    text = base64.b64encode(np.uint64(len(raw)).astype("<u8").tobytes() + raw).decode("ascii")
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    kind = _TYPES[values.dtype.name]
    return f'<DataArray type="{kind}" Name={quoteattr(name)}{components} format="binary">{text}</DataArray>'
