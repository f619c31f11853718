"""The shipped study of a granular heap: its script against known answers, and LIGGGHTS where it is installed."""

import importlib.util
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
import workflow

from stemcal.doe.calibration.confidence_intervals import profiles_of
from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Request
from stemcal.solvers.replicates import values_of
from stemcal.stages.fitting import fit_over, fitted_surfaces, measured_means
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import fresh_results
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.screen.result import ScreenResult
from stemcal.study.reading import load_study
from stemcal.study.types.named import fill

GRAINS = Path(__file__).parents[2] / "examples" / "liggghts"
HIDDEN = {"grain_friction": 0.35, "grain_rolling": 0.08, "wall_friction": 0.5, "wall_rolling": 0.08, "restitution": 0.5}
needs_program = pytest.mark.skipif(shutil.which("liggghts") is None, reason="LIGGGHTS (liggghts) is not installed")


@pytest.fixture(scope="module")
def heap() -> ModuleType:
    """Return the example's script as a module, whatever else is called heap."""
    found = importlib.util.spec_from_file_location("heap_of_the_example", GRAINS / "heap.py")
    assert found is not None and found.loader is not None
    module = importlib.util.module_from_spec(found)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(GRAINS)
        found.loader.exec_module(module)
    return module


def poured(folder: Path, seed: int, step: float = 1.2e-4, **levels: float) -> dict[str, float]:
    """Make one heap."""
    folder.mkdir(parents=True)
    values = values_of(Request("screen", 0, {**HIDDEN, **levels}, 1.0))
    (folder / "heap.in").write_bytes(fill((GRAINS / "heap.in").read_bytes(), values))
    for script in ("heap.py", "grains.py"):
        shutil.copy(GRAINS / script, folder)
    subprocess.run([sys.executable, "heap.py", str(seed), str(step)], cwd=folder, check=True, capture_output=True)
    found: dict[str, float] = json.loads((folder / "out.json").read_text("utf-8"))
    return found


@pytest.mark.parametrize("angle", [0.0, 17.0, 33.0])
def test_the_angle_of_a_plane_of_grains_is_its_own(heap: ModuleType, angle: float) -> None:
    """Grains of 1 mm, half a millimetre apart, with their tops on a plane."""
    slope, radius, across, deep = math.tan(math.radians(angle)), 5e-4, 280, 80
    grains = []
    for i in range(across):
        for j in range(deep):
            x, y = (i + 0.5) * heap.WIDTH / across, (j + 0.5) * heap.DEPTH / deep
            grains.append((x, y, (heap.WIDTH - x) * slope - radius, radius))
    # between the grains the surface is 0.1 mm lower, and on a slope their sides are 0.1 mm higher
    assert heap.angle_of(grains) == pytest.approx(angle, abs=0.2)


def test_a_full_box_has_its_density(heap: ModuleType) -> None:
    """Its mass over its volume up to the tops of the uppermost grains, which lie close at a height of 80 mm."""
    radius, across, deep = 5e-4, 280, 80
    grains = [
        ((i + 0.5) * heap.WIDTH / across, (j + 0.5) * heap.DEPTH / deep, 0.08 - radius, radius)
        for i in range(across)
        for j in range(deep)
    ]
    mass = len(grains) * heap.DENSITY * 4.0 / 3.0 * math.pi * radius**3
    assert heap.bulk_density(grains, heap.DENSITY, heap.WIDTH, heap.DEPTH) == pytest.approx(
        mass / (heap.WIDTH * heap.DEPTH * 0.08), rel=0.002
    )


def test_a_packing_is_loose_its_own_and_the_same_again(heap: ModuleType) -> None:
    size = heap.GRAINS, heap.WIDTH, heap.DEPTH
    grains = heap.pack(*size, 7)
    assert grains == heap.pack(*size, 7) != heap.pack(*size, 8)
    for n, (x, y, z, r) in enumerate(grains[:200]):
        for a, b, c, s in grains[:n]:
            dy = (b - y + 0.5 * heap.DEPTH) % heap.DEPTH - 0.5 * heap.DEPTH
            assert math.hypot(a - x, dy, c - z) > r + s
        assert r <= x <= heap.WIDTH - r


@needs_program
def test_without_friction_nothing_stays_and_friction_makes_a_heap(tmp_path: Path) -> None:
    smooth = poured(tmp_path / "smooth", 1, **{name: 0.0 for name in HIDDEN if name != "restitution"})
    rough = poured(tmp_path / "rough", 1)
    assert abs(smooth["angle"]) < 3.0 and smooth["grains"] < 20
    assert rough["angle"] > 18.0 and rough["grains"] > 180
    assert rough["energy"] < 1e-5
    assert poured(tmp_path / "again", 1) == rough


@needs_program
@pytest.mark.slow
def test_the_shipped_study_finds_the_hidden_friction(tmp_path: Path) -> None:
    """The measured heaps were made at `HIDDEN`: the profile likelihood holds each of the three that were varied.

    Two responses and three factors: a curve of solutions. The truth lies on it within what the scatter allows.
    """
    study = load_study(GRAINS / "repose-heap.yaml")
    store = StudyFolder(tmp_path / "out")
    with LocalExecutor(2) as executor:
        workflow.calibrate(study, store, executor)
    results = fresh_results(study, store)
    surface, inversion, screen = results.of(RsmResult), results.of(InvertResult), results.of(ScreenResult)
    assert surface is not None and inversion is not None and screen is not None
    assert len(list(store.runs.glob("*.json"))) == 30 + 30 + 2
    assert screen.residual.df >= 3 and not screen.by_lenth
    assert surface.lack_of_fit_testable
    region = surface.region
    found = fit_over(measured_means(study), fitted_surfaces(study, surface), region)
    point = surface.scales.to_coded([HIDDEN[name] for name in surface.names])
    assert all(one.low <= value <= one.high for one, value in zip(profiles_of(found), point, strict=True))
    assert found.value(point) <= 2.0 * max(found.tangents.allowed(slope) for slope in found.tangents.slopes)
