"""Stages by their entry points: the package's own, and those of other packages, which may be broken."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from stemcal.registry import Registry
from stemcal.stages.stage import STAGES, Stage

ROOT = Path(__file__).parents[2]
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
    found = registry(monkeypatch, tmp_path)
    assert [one.name for one in found.all if one.name in ("screen", "climb", "good_one")] == [
        *("screen", "climb", "good_one")
    ]
    assert found.named("screen") is found.built_in[0] and found.named("bad_one") is None
    assert found.broken["bad_one"].startswith("bad_package 1.0: ModuleNotFoundError")
    assert {"bad_one", "screen", "other_one"} <= set(found.broken)
    before = found.version_of("good_one")
    module.write_text(good + "# corrected\n", encoding="utf-8")
    assert before.startswith("good_package 1.0+") and found.version_of("good_one") != before
    assert found.version_of("screen") == found.version_of("bad_one") == ""


def test_a_member_that_nothing_calls_is_refused() -> None:
    with pytest.raises(TypeError, match=r"Wrong\.forsee is never used: did you mean foresee"):
        type("Wrong", (Stage,), {"forsee": lambda self: None})


def test_every_stage_says_who_it_is() -> None:
    for stage in STAGES.built_in:
        assert stage.name and stage.title and stage.help and stage.result().name == stage.name
        assert callable(stage.making()) and stage.showing() is not None


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
    assert "Force over positions of" in stemcal("repeatability", "study.yaml", "--out", "out", "--workers", "1")
    stemcal("run", "study.yaml", "--out", "out", "--workers", "2")
    assert "Repeatability" in (tmp_path / "out" / "report.html").read_text("utf-8")
    assert (tmp_path / "out" / "repeatability.csv").is_file()
    assert "repeatability" in stemcal("export", "figures", "study.yaml", "list", "--out", "out")
    module.write_text(module.read_text("utf-8") + "# corrected\n", encoding="utf-8")
    assert "repeatability.json is stale: package changed since" in stemcal("status", "study.yaml", "--out", "out")
