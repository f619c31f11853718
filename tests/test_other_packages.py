"""Stages and designs by their entry points: the package's own, and those of other packages, which may be broken."""

import hashlib
import json
import math
import os
import shutil
import subprocess
import sys
from functools import partial
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes import FakeSolver, make_study

from stemcal.doe.coding import term_columns
from stemcal.doe.designs import SURFACES, SurfaceDesign, SurfaceOptions
from stemcal.errors import SpecError, UsageError
from stemcal.registry import Registry
from stemcal.stages.rsm.analysis import study_design
from stemcal.stages.stage import STAGES, Stage, stage_called, stages_of

ROOT = Path(__file__).parents[1]


def installed(folder: Path, name: str, entry_points: str, source: str) -> Path:
    """Put a package of one module where Python finds it; returns the module."""
    folder.mkdir(exist_ok=True)
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(f"[stemcal.stages]\n{entry_points}\n", encoding="utf-8")
    module = folder / f"{name}.py"
    module.write_text(source, encoding="utf-8")
    return module


def registry(monkeypatch: pytest.MonkeyPatch, folder: Path) -> Registry[Stage[Any]]:
    monkeypatch.syspath_prepend(folder)
    return Registry(Stage, "stemcal.stages", ("stemcal.stages.screen:Screen", "stemcal.stages.climb:Climb"))


def test_a_broken_package_is_left_out_and_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    good = "from stemcal.stages.stage import Stage\nclass Good(Stage):\n    name = 'good_one'\n"
    module = installed(tmp_path, "good_package", "good_one = good_package:Good", good)
    installed(tmp_path, "bad_package", "bad_one = bad_package:Bad", "import no_such_module\n")
    installed(tmp_path, "same_package", "screen = same_package:Same", good)
    installed(tmp_path, "wrong_package", "other_one = wrong_package:Good", good)
    installed(tmp_path, "second_package", "good_one = second_package:Good", good)
    found = registry(monkeypatch, tmp_path)
    assert [one.name for one in found.all if one.name in ("screen", "climb", "good_one")] == [
        *("screen", "climb", "good_one")
    ]
    assert found.named("screen") is found.built_in[0] and found.named("bad_one") is None
    assert found.broken["bad_one"].startswith("bad_package 1.0: cannot be loaded: ModuleNotFoundError")
    assert {"bad_one", "other_one", "screen of same_package 1.0", "good_one of second_package 1.0"} <= set(found.broken)
    before = found.version_of("good_one")
    module.write_text(good + "# corrected\n", encoding="utf-8")
    assert before.startswith("good_package 1.0+") and found.version_of("good_one") != before
    assert found.version_of("screen") == found.version_of("bad_one") == ""


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("import sys\nsys.exit(0)", "SystemExit: 0"),
        ("import os\nos._exit(0)", "SystemExit: 0"),
        ("raise GeneratorExit", "GeneratorExit"),
        ("def Bad(): raise ValueError('m' * 5_000_000)", "4,999,500 more characters"),
        (
            "import stemcal.stages.stage as stage\nclass Bad(stage.Stage):\n    @property\n    def name(self): exit(0)",
            "0",
        ),
    ],
)
def test_a_package_that_leaves_the_process_is_skipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, reason: str
) -> None:
    module = "leaving_" + hashlib.sha256(source.encode()).hexdigest()[:8]
    installed(tmp_path, module, f"leaving = {module}:Bad", source)
    found = registry(monkeypatch, tmp_path)
    assert found.named("leaving") is None and found.broken["leaving"].endswith(reason + ")" * ("5_000" in source))


def test_a_loading_package_prints_to_standard_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    good = "from stemcal.stages.stage import Stage\nclass Good(Stage):\n    name = 'noisy'\n"
    installed(tmp_path, "noisy_one", "noisy = noisy_one:Good", f"import os\nprint('p')\nos.system('echo s')\n{good}")
    assert registry(monkeypatch, tmp_path).named("noisy") is not None
    print("data")
    out, err = capfd.readouterr()
    assert out == "data\n" and {"p", "s"} <= set(err.split())


@pytest.mark.parametrize(
    "content", [b"\xff\xfegarbage", b"[stemcal.stages\nx", b"[stemcal.stages]\nno value\n", b"[a]\n="]
)
def test_damaged_metadata_of_another_package_do_no_harm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes
) -> None:
    good = "from stemcal.stages.stage import Stage\nclass Good(Stage):\n    name = 'sound'\n"
    installed(tmp_path, "sound_package", "sound = sound_package:Good", good)
    for number, damaged in enumerate(("entry_points.txt", "METADATA")):
        installed(tmp_path, f"aa_{number}", "sound_2 = sound_package:Good", good)
        (tmp_path / f"aa_{number}-1.0.dist-info" / damaged).write_bytes(content)
    assert registry(monkeypatch, tmp_path).named("sound") is not None


class _Wrong(SurfaceDesign):
    name = "wrong"

    def __init__(self, points: Any) -> None:
        self.returned = points

    def points(self, k: int, options: SurfaceOptions) -> Any:
        if callable(self.returned):
            self.returned()
        return self.returned


@pytest.mark.parametrize(
    ("returned", "reason"),
    [
        (np.array([[0.0, math.nan]]), "not finite"),
        ([["low", "high"]], "could not convert"),
        (np.zeros((4, 3)), r"shape \(4, 3\)"),
        (np.zeros(4), r"shape \(4,\)"),
        (np.zeros((0, 2)), r"shape \(0, 2\)"),
        (None, "not finite|failed"),
        ([[1.0, 2.0], [3.0]], "failed for 2 factors: ValueError"),
        (sys.exit, "failed for 2 factors: SystemExit"),
    ],
)
def test_a_design_that_returns_no_points_is_named(returned: Any, reason: str) -> None:
    with pytest.raises(UsageError, match=rf"the `wrong` design cannot be used: .*({reason})"):
        _Wrong(returned).runs(2, SurfaceOptions())


def test_stages_that_need_each_other_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = make_study(tmp_path)
    assert [stage.name for stage in stages_of(study)] == ["screen", "rsm", "invert", "validate"]
    monkeypatch.setattr(type(stage_called("screen")), "needs", lambda _self, _study: "validate")
    with pytest.raises(UsageError, match="depend on each other"):
        stages_of(study)


def test_a_member_that_nothing_calls_is_refused() -> None:
    with pytest.raises(TypeError, match=r"Wrong\.foreseee is never used: did you mean foresee"):
        type("Wrong", (Stage,), {"foreseee": lambda self: None})
    with pytest.raises(TypeError, match=r"Wrong\.needs must be a method"):
        type("Wrong", (Stage,), {"needs": ("rsm",)})


def test_every_folder_of_a_stage_is_in_the_list() -> None:
    folders = {path.parent.name for path in (ROOT / "stemcal" / "stages").glob("*/__init__.py")} - {"verdict"}
    assert sorted(type(stage).__module__ for stage in STAGES.built_in) == sorted(f"stemcal.stages.{n}" for n in folders)
    for stage in STAGES.built_in:
        assert stage.name and stage.title and stage.help and stage.result().name == stage.name
        assert callable(stage.making()) and stage.showing() is not None


def test_the_example_of_a_design_is_a_choice_where_it_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Doehlert's shell of k(k + 1) points, all at a distance of 1 from the centre and at least 1 from each other."""
    extra = "rsm: {design: doehlert, factors: [density, yield_stress, failure_strain], centre_points: 1}\n"
    with pytest.raises(SpecError, match="'doehlert' is not an allowed value"):
        make_study(tmp_path, extra)
    monkeypatch.syspath_prepend(ROOT / "examples" / "plugins" / "doehlert")
    entry = EntryPoint("doehlert", "stemcal_doehlert:Doehlert", "stemcal.designs")
    monkeypatch.setitem(SURFACES.__dict__, "_entries", {"doehlert": entry})
    study = make_study(tmp_path, extra)
    coded = study_design(study, FakeSolver(), study.rsm.factors).coded
    assert coded.shape == (13, 3) and np.linalg.matrix_rank(term_columns(coded)) == 10
    between = np.linalg.norm(coded[:, None] - coded[None], axis=2)[~np.eye(13, dtype=bool)]
    assert between.min() == pytest.approx(1.0) and np.linalg.norm(coded, axis=1)[:-1] == pytest.approx(1.0)
    assert str(stage_called("rsm").inputs(study)["package"]).startswith("stemcal_doehlert:Doehlert+")
    with pytest.raises(SpecError, match="the `doehlert` design requires 2 to 8 factors, not 9"):
        make_study(tmp_path, extra.replace("[density, yield_stress, failure_strain]", str(list(study.names))))


# ---- the examples, installed

PLUGINS = ROOT / "examples" / "plugins"
CHECKED = """
from stemcal.doe.designs import SURFACES, SurfaceDesign, SurfaceOptions
from stemcal.stages.stage import STAGES
from stemcal.study.model.laboratory_kind import TESTS
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.testing import check_design, check_laboratory_test, check_solver, check_stage

check_design(SURFACES.named("doehlert"))
check_solver(SOLVERS.named("beam"), "beam.yaml")
check_stage(STAGES.named("repeatability"), "piece.yaml")
check_laboratory_test(TESTS.named("four-point-bending"), "piece.yaml")
"""
PIECE = """
name: piece
factors:
  - {name: elastic_modulus, unit: MPa, low: 800, high: 1200}
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
material: {density: 1100 kg/m3, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa, hardening_parameter: 0.05,
  failure_strain: 0.03, internal_length: d/5}
blade: {edge_spread: d/5}
specimen: {outer_diameter: 8 mm, diameter_ratio: 0.41, length: 30 mm}
loading: {duration: 0.8 s}
solver: {kind: embedded, element_size: d/4, rate_law: none, coarsening: 2, outputs: 200}
tests: [{name: four, kind: four-point-bending, span: 96 mm, inner: 32 mm, stroke: 0.5 mm, element_size: d/3}]
targets:
  - {diameter: 8 mm, force: 160 N, sd: 8 N, n: 5}
  - {test: four, diameter: 8 mm, slope: 14 N/mm, sd: 0.7 N/mm, n: 5}
screen: {design: none}
rsm: {design: doehlert, factors: [elastic_modulus, yield_stress], centre_points: 1}
repeatability: {positions: 2}
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the four example packages, installed by pip; the spec of the solver beside it."""
    folder = tmp_path_factory.mktemp("plugins")
    copies = [str(shutil.copytree(path, folder / path.name)) for path in PLUGINS.iterdir() if path.is_dir()]
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", str(folder / "site"), *copies]
    subprocess.run(pip, check=True, timeout=600)
    shutil.copy(PLUGINS / "beam" / "beam.yaml", folder)
    (folder / "piece.yaml").write_text(PIECE, encoding="utf-8")
    return folder / "site"


def python(site: Path, *args: str) -> str:
    """Run Python beside the specs, with the packages on its path."""
    path = os.pathsep.join([str(ROOT), str(site)])
    done = subprocess.run(
        [sys.executable, *args],
        cwd=site.parent,
        env={**os.environ, "PYTHONPATH": path, "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=500,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_examples_pass_the_checks(site: Path) -> None:
    python(site, "-c", CHECKED)


@pytest.mark.slow
def test_the_example_of_a_solver_is_calibrated(site: Path) -> None:
    """Two responses of a beam: 12 π E R⁴ (1 − ρ⁴)/L³ gives E, 16/3 σ R³ (1 − ρ³)/L the yield stress."""
    stemcal = partial(python, site, "-m", "stemcal")
    stemcal("run", "beam.yaml", "--out", "beam", "--workers", "1")
    found = json.loads((site.parent / "beam" / "invert.json").read_text("utf-8"))["solution"]
    assert found == pytest.approx({"elastic_modulus": 1000.0, "yield_stress": 15.0}, rel=1e-3)
    assert "Force of the plastic hinge" in (site.parent / "beam" / "report.html").read_text("utf-8")
    stemcal("export", "tables", "beam.yaml", "--out", "beam", "--format", "md")
    assert "plastic hinge" in "".join(path.read_text("utf-8") for path in (site.parent / "beam").rglob("*.md"))
    assert "Distance between the supports" in stemcal("explain", "solver.span")


@pytest.mark.slow
def test_the_other_examples_are_in_commands_page_files_and_python(site: Path) -> None:
    """Design, stage and laboratory test in one study; they have known numbers, and go stale when their code changes."""
    stemcal, out = partial(python, site, "-m", "stemcal"), site.parent / "piece"
    assert "repeatability" in stemcal("--help")
    packages = ("stage repeatability", "solver beam", "design doehlert", "laboratory test four-point-bending")
    looked_at = stemcal("doctor", "--json")
    assert all(name in looked_at for name in packages)
    schema = stemcal("explain", "--schema")
    assert all(text in schema for text in ("The number of positions", "between the axes of the noses", "doehlert"))
    four = json.loads(stemcal("simulate", "piece.yaml", "--test", "four", "--json"))["result"]["responses"]
    # two supports 96 mm apart, noses c = 32 mm from them: F = 12 E I w/(c² (3L − 4c)), I = π d⁴ (1 − 0.41⁴)/64
    beam = 12.0 * 1000.0 * math.pi * 8.0**4 * (1.0 - 0.41**4) / 64.0 / (32.0**2 * (3.0 * 96.0 - 4.0 * 32.0))
    assert four["slope"] == pytest.approx(beam, rel=0.03)
    stemcal("run", "piece.yaml", "--out", "piece", "--workers", "2")
    assert "four_slope,14.0" in (out / "invert_responses.csv").read_text("utf-8")
    page = (out / "report.html").read_text("utf-8")
    assert "Four slope" in page and "Force over positions of the mesh" in page
    assert "repeatability" in stemcal("export", "figures", "piece.yaml", "list", "--out", "piece")
    code = """
import stemcal
results = stemcal.open_results("piece")
print(len(results.repeatability.forces), len(results.surface.tables()["rsm_runs"].rows))
"""
    assert python(site, "-c", code).split() == ["2", "7"]
    with (site / "stemcal_four_point.py").open("a", encoding="utf-8") as file:
        file.write("# corrected\n")
    assert "rsm.json is out of date: package of four-point-bending changed" in stemcal(
        "status", "piece.yaml", "--out", "piece"
    )
