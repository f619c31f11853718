"""Examples: each spec checks and has the files it names; their scripts against known answers; their programs."""

import importlib.util
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from typer.testing import CliRunner

from stemcal.cli.app import app
from stemcal.study.reading import load_study

ROOT = Path(__file__).parents[2] / "examples"
SPECS = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.glob("*/*.yaml"))
MANUAL = {"by-hand", "edem", "ls-dyna-window"}
FRICTION = {"grain_friction": 0.35, "grain_rolling": 0.08, "wall_friction": 0.5}


def needs(program: str) -> pytest.MarkDecorator:
    return pytest.mark.skipif(shutil.which(program) is None, reason=f"{program} is not installed")


def script(path: str) -> ModuleType:
    """Return a script of an example as a module."""
    found = importlib.util.spec_from_file_location(Path(path).stem, ROOT / path)
    assert found is not None and found.loader is not None
    module = importlib.util.module_from_spec(found)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / Path(path).parent)
        found.loader.exec_module(module)
    return module


@pytest.mark.parametrize("spec", SPECS)
def test_an_example_checks_and_has_the_files_that_it_names(spec: str, tmp_path: Path) -> None:
    folder, study = (ROOT / spec).parent, load_study(ROOT / spec)
    assert study.name == Path(spec).stem and study.solver.kind == ("sheet" if folder.name in MANUAL else "command")
    done = CliRunner().invoke(app, ["check", str(ROOT / spec)])
    assert done.exit_code == 0 and not study.warnings, done.output
    assert f"stemcal run examples/{folder.name}/" in (folder / "README.md").read_text("utf-8")
    texts = "".join(path.read_text("utf-8") for path in (*folder.glob("*.yaml"), folder / "README.md"))
    assert [path.name for path in folder.glob("*.*") if path.name not in texts] == ["README.md"]


# ---- scripts


@pytest.mark.parametrize("angle", [28.2, *(pytest.param(angle, marks=pytest.mark.slow) for angle in (12.0, 41.0))])
def test_a_picture_of_a_cone_has_its_angle(angle: float, tmp_path: Path) -> None:
    """A dark heap with grains of 12 pixels on its flanks, the right one 3 degrees steeper, before a light sky."""
    picture = np.full((600, 1200, 3), 0.9)
    columns = np.arange(1200)
    left, right = math.tan(math.radians(angle)), math.tan(math.radians(angle + 3.0))
    peak = 300.0 * left
    height = np.where(columns < 500, peak - (500 - columns) * left, peak - (columns - 500) * right)
    height = np.clip(height + 4.0 * np.sin(columns * 2.0 * math.pi / 12.0) * (height > 0), 0.0, None)
    rows = np.arange(600)[:, None]
    picture[(600 - rows) <= height + 40.0] = 0.35  # the floor is 40 pixels high
    import matplotlib.image

    matplotlib.image.imsave(tmp_path / "heap.png", picture)
    found = subprocess.run(
        [sys.executable, str(ROOT / "edem" / "angle.py"), "heap.png"], cwd=tmp_path, capture_output=True, text=True
    )
    words = found.stdout.replace(",", "").split()
    assert float(words[2]) == pytest.approx(angle, abs=0.4) and float(words[4]) == pytest.approx(angle + 3.0, abs=0.4)
    assert float(words[6]) == pytest.approx(angle + 1.5, abs=0.4)


def test_the_peak_of_a_contact_is_found() -> None:
    """Two contacts, two sides each; the first side of contact 1 peaks with (3, 0, -4) N at 0.2 s."""
    rows = [
        f" {side} {contact} time {t:.4E} x {f * x:.4E} y 0.0000E+00 z {f * z:.4E} mass 1.0\n"
        for t, x, z in ((0.1, 1.0, -1.0), (0.2, 3.0, -4.0), (0.3, 2.0, -4.2))
        for contact, side, f in ((1, "slave", 1.0), (1, "master", -9.0), (2, "slave", 10.0), (2, "master", -90.0))
    ]
    text = " {BEGIN LEGEND\n     1 blade\n{END LEGEND}\n" + "".join(rows)
    peak = script("ls-dyna-window/peak.py").peak
    assert peak(text) == pytest.approx((5.0, 0.2))
    assert peak(text, 2, "z") == pytest.approx((42.0, 0.3))


def test_the_rate_of_a_hopper_is_taken_where_it_flows() -> None:
    """100 grains of 2 g, 40 a second, after a second in which nothing moves and before the last that trickle."""
    counts = [(0.0, 100), (1.0, 100), *((1.0 + 0.1 * n, 100 - 4 * n) for n in range(1, 24)), (5.0, 7)]
    assert script("liggghts/hopper.py").rate_of(counts, 2.0) == pytest.approx(80.0)


# ---- programs


def done(place: Path, example: str, command: list[str], **levels: float) -> dict[str, float]:
    """Run the program of an example once, in a folder of `place`."""
    folder = place / "-".join(f"{value:g}" for value in levels.values())
    shutil.copytree(ROOT / example, folder, ignore=shutil.ignore_patterns("__pycache__"))
    for path in folder.iterdir():
        text = path.read_text("utf-8")
        for name, value in levels.items():
            text = text.replace("{{" + name + "}}", f"{value:.12g}")
        path.write_text(text, encoding="utf-8")
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=600)
    found: dict[str, float] = json.loads((folder / "out.json").read_text("utf-8"))
    return found


@needs("lmp")
def test_a_bonded_stalk_bends_as_a_cantilever(tmp_path: Path) -> None:
    """F/w = 3 E I/L³, and the break where F·L·d/2 = σ·I as long as the stalk is hardly bent."""
    inertia = math.pi * 8.0**4 / 64.0
    for modulus in (300.0, 1000.0, 6000.0):
        strength = 0.004 * modulus  # a strain of 0.4 %: the tip moves 13 mm
        command = [sys.executable, "stalk.py", str(strength)]
        found = done(tmp_path, "lammps", command, bond_modulus=modulus)
        assert found["stiffness"] == pytest.approx(3.0 * modulus * inertia / 200.0**3, rel=0.002)
        assert found["break_force"] == pytest.approx(strength * inertia / 4.0 / 200.0, rel=0.01)


@needs("liggghts")
def test_bulk_density_is_that_of_the_grains_times_how_they_lie(tmp_path: Path) -> None:
    """Heavier grains lie alike; without friction they lie close, as spheres poured at random do (0.61 to 0.64)."""

    def share(density: float, friction: float) -> float:
        levels = {"grain_density": density, "grain_friction": friction, "grain_rolling": 0.2 * friction}
        command = [sys.executable, "box.py", "1", str(density)]
        return done(tmp_path, "liggghts", command, **levels)["bulk_density"] / density

    light, heavy, smooth = share(1000.0, 0.4), share(1400.0, 0.4), share(1200.0, 0.0)
    assert light == pytest.approx(heavy, rel=0.02) and 0.52 < light < 0.6
    assert smooth > light + 0.03


@needs("liggghts")
@pytest.mark.slow
def test_grains_with_less_friction_run_out_faster(tmp_path: Path) -> None:
    rates = []
    for friction in (0.2, 0.6):
        levels = FRICTION | {"grain_friction": friction, "wall_friction": friction}
        found = done(tmp_path, "liggghts", [sys.executable, "hopper.py", "1"], **levels)
        assert found["left"] < 20
        rates.append(found["rate"])
    assert rates[0] > 1.1 * rates[1]


@needs("yade")
@pytest.mark.slow
def test_friction_raises_a_heap_of_yade_s(tmp_path: Path) -> None:
    command = ["yade", "-j1", "-n", "-x", "heap.py"]
    smooth = {"grain_friction": 0.2, "grain_rolling": 0.02, "wall_friction": 0.2, "seed": 1}
    rough = {"grain_friction": 0.6, "grain_rolling": 0.2, "wall_friction": 0.8, "seed": 1}
    low, high = (done(tmp_path, "yade", command, **levels) for levels in (smooth, rough))
    assert 15.0 < low["angle"] < high["angle"] - 5.0 < 45.0
    assert low["grains"] < high["grains"] < 420
