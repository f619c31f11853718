"""Frames for ParaView, read back with readers that are not ours."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from stemcal.arrays import Array
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick, hollow_cylinder
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.fem.vtk_frames import FrameWriter, _von_mises, _write_vtu


def test_von_mises_of_known_states() -> None:
    """Uniaxial tension σ gives σ, pure shear τ gives √3 τ, pressure gives 0."""
    stress = np.array([[5.0, 0, 0, 0, 0, 0], [0, 0, 0, 2.0, 0, 0], [7.0, 7.0, 7.0, 0, 0, 0]])
    np.testing.assert_allclose(_von_mises(stress), [5.0, np.sqrt(3.0) * 2.0, 0.0], atol=1e-12)


def drawn_out(mesh: Mesh, along: Array) -> Model:
    """Return a model whose nodes keep their velocities `along` x."""
    return Model(
        mesh=mesh,
        material=Material(1.0e-9, 1000.0, 0.0),
        held=np.ones(mesh.nodes.shape, dtype=bool),
        velocity=np.column_stack([along, np.zeros((len(along), 2))]),
        integration=Integration(outputs=10),
    )


@pytest.fixture
def stretched(tmp_path: Path) -> Path:
    """Two elements drawn out at a uniform rate of 1/s along x for 1 ms, frames at every second of ten outputs."""
    mesh = brick((2.0, 1.0, 1.0), (2, 1, 1))
    model = drawn_out(mesh, mesh.nodes[:, 0])
    simulate(model, 1.0e-3, inspect=FrameWriter(tmp_path / "frames", every=2))
    return tmp_path / "frames"


def test_every_element_has_its_own_stress(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawn out the more the farther along x: the stress grows with x, wherever in the blocks an element lies."""
    written: list[tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]] = []
    monkeypatch.setattr(
        "stemcal.fem.vtk_frames._write_vtu", lambda _path, x, hexes, _points, data: written.append((x, data, hexes))
    )
    mesh = hollow_cylinder(1.6, 4.0, np.linspace(0.0, 9.0, 8), (7, 3), (-0.5 * np.pi, 0.5 * np.pi))
    model = drawn_out(mesh, mesh.nodes[:, 0] ** 2)
    simulate(model, 1.0e-3, inspect=FrameWriter(tmp_path / "frames"))
    nodes, data, hexes = written[-1]
    along = nodes[hexes].mean(axis=1)[:, 0]
    assert len(data["stress"]) == len(mesh.hexes) == 7 * 7 * 3
    np.testing.assert_allclose(data["stress"][:, 0], 2.0 * along, rtol=0.05)  # E times 2x·1/s·1 ms


def test_a_frame_list_names_every_frame(stretched: Path) -> None:
    entries = ElementTree.parse(stretched / "frames.pvd").findall(".//DataSet")
    assert [entry.get("file") for entry in entries] == [f"frame-{i:04d}.vtu" for i in range(6)]
    times = [float(entry.get("timestep", "nan")) for entry in entries]
    np.testing.assert_allclose(times, np.linspace(0.0, 1.0e-3, 6), atol=2e-6)


@pytest.mark.parametrize("reader", ["vtk", "meshio"])
def test_a_frame_read_back_by_other_readers(stretched: Path, reader: str) -> None:
    """1 ms at 1/s is a strain of 1e-3: displacement 1e-3 x, stress E ln(1.001) in both elements (1 %: half a step)."""
    module = pytest.importorskip(reader, reason=f"{reader} is not installed")
    path = stretched / "frame-0005.vtu"
    if reader == "meshio":
        mesh = module.read(path)
        points, hexes = mesh.points, mesh.cells_dict["hexahedron"]
        displacement, stress = mesh.point_data["displacement"], mesh.cell_data["stress"][0]
    else:
        from vtk.util.numpy_support import vtk_to_numpy

        source = module.vtkXMLUnstructuredGridReader()
        source.SetFileName(str(path))
        source.Update()
        grid = source.GetOutput()
        points = vtk_to_numpy(grid.GetPoints().GetData())
        hexes = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 8)
        displacement = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
        stress = vtk_to_numpy(grid.GetCellData().GetArray("stress"))
    assert points.shape == (12, 3) and hexes.shape == (2, 8)
    np.testing.assert_allclose(displacement[:, 0], points[:, 0] * 1e-3 / 1.001, rtol=1e-2)
    np.testing.assert_allclose(stress[:, 0], 1000.0 * np.log(1.001), rtol=1e-2)
    np.testing.assert_allclose(stress[:, 1:], 0.0, atol=1e-9)


def test_names_are_escaped(tmp_path: Path) -> None:
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    _write_vtu(tmp_path / "a.vtu", mesh.nodes, mesh.hexes, {}, {'<"&>': np.array([1.0])})
    arrays = ElementTree.parse(tmp_path / "a.vtu").findall(".//CellData/DataArray")
    assert [array.get("Name") for array in arrays] == ['<"&>']
