"""Stages and designs by their entry points: the package's own, and those of other packages, which may be broken."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes import FakeSolver, make_study

from stemcal.doe.designs.catalogue import SURFACES
from stemcal.doe.regression.terms import term_columns
from stemcal.errors import SpecError, UsageError
from stemcal.registry import Registry
from stemcal.stages.stage import STAGES, Stage, stage_called, stages_of
from stemcal.stages.surface.design import surface_design

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "plugins" / "repeatability" / "stemcal_repeatability.py"


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
    return Registry(Stage, "stemcal.stages", ("stemcal.stages.screen:Screening", "stemcal.stages.climb:Climbing"))


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
    assert found.broken["bad_one"].startswith("bad_package 1.0: ModuleNotFoundError")
    assert {"bad_one", "other_one", "screen of same_package 1.0", "good_one of second_package 1.0"} <= set(found.broken)
    before = found.version_of("good_one")
    module.write_text(good + "# corrected\n", encoding="utf-8")
    assert before.startswith("good_package 1.0+") and found.version_of("good_one") != before
    assert found.version_of("screen") == found.version_of("bad_one") == ""


def test_stages_that_need_each_other_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = make_study(tmp_path)
    assert [stage.name for stage in stages_of(study)] == ["screen", "rsm", "invert", "validate"]
    monkeypatch.setattr(type(stage_called("screen")), "needs", lambda _self, _study: "validate")
    with pytest.raises(UsageError, match="need each other"):
        stages_of(study)


def test_a_member_that_nothing_calls_is_refused() -> None:
    with pytest.raises(TypeError, match=r"Wrong\.forsee is never used: did you mean foresee"):
        type("Wrong", (Stage,), {"forsee": lambda self: None})


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
    with pytest.raises(SpecError, match="'doehlert' is not one of the choices"):
        make_study(tmp_path, extra)
    monkeypatch.syspath_prepend(ROOT / "examples" / "plugins" / "doehlert")
    entry = EntryPoint("doehlert", "stemcal_doehlert:Doehlert", "stemcal.designs")
    monkeypatch.setitem(SURFACES.__dict__, "_entries", {"doehlert": entry})
    study = make_study(tmp_path, extra)
    coded = surface_design(study, FakeSolver(), study.rsm.factors).coded
    assert coded.shape == (13, 3) and np.linalg.matrix_rank(term_columns(coded)) == 10
    between = np.linalg.norm(coded[:, None] - coded[None], axis=2)[~np.eye(13, dtype=bool)]
    assert between.min() == pytest.approx(1.0) and np.linalg.norm(coded, axis=1)[:-1] == pytest.approx(1.0)
    assert stage_called("rsm").inputs(study)["package"].startswith("stemcal_doehlert:Doehlert+")
    with pytest.raises(SpecError, match="doehlert exists for 2 to 8 factors, not 9"):
        make_study(tmp_path, extra.replace("[density, yield_stress, failure_strain]", str(list(study.names))))


@pytest.mark.slow
def test_the_example_of_a_stage_runs_installed(tmp_path: Path) -> None:
    """Nothing in stemcal names it; it has a command, runs, page, figure, Python object, and goes stale when changed."""
    entry = "repeatability = stemcal_repeatability:Repeatability"
    module = installed(tmp_path / "site", "stemcal_repeatability", entry, EXAMPLE.read_text("utf-8"))
    smoke = (ROOT / "configs" / "smoke.yaml").read_text("utf-8")
    spec = "screen: {design: none}\nrepeatability: {positions: 2}\n"
    (tmp_path / "study.yaml").write_text(f"{smoke}\n{spec}", encoding="utf-8")
    shutil.copytree(ROOT / "configs" / "data", tmp_path / "data")

    def stemcal(*args: str) -> str:
        path = os.pathsep.join([str(ROOT), str(tmp_path / "site")])
        done = subprocess.run(
            [sys.executable, "-m", "stemcal", *args],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": path, "PYTHONUTF8": "1"},
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=300,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "repeatability" in stemcal("--help")
    assert "The number of positions of the mesh." in stemcal("explain", "--schema")
    assert "Force over positions of" in stemcal("repeatability", "study.yaml", "--out", "out", "--workers", "1")
    stemcal("run", "study.yaml", "--out", "out", "--workers", "2")
    assert "Repeatability" in (tmp_path / "out" / "report.html").read_text("utf-8")
    assert (tmp_path / "out" / "repeatability.csv").is_file()
    assert "repeatability" in stemcal("export", "figures", "study.yaml", "list", "--out", "out")
    module.write_text(module.read_text("utf-8") + "# corrected\n", encoding="utf-8")
    assert "repeatability.json is stale: package changed since" in stemcal("status", "study.yaml", "--out", "out")
