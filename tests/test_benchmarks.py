"""The scripts in benchmarks/ start, and none hides a package by its name: a script's folder is searched first."""

import importlib.metadata
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from stemcal.cutting.simulate import shear

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def test_every_script_finds_what_it_imports(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [path.stem for path in sorted(BENCHMARKS.glob("*.py"))]
    assert not set(names) & {*sys.stdlib_module_names, *importlib.metadata.packages_distributions()}
    monkeypatch.syspath_prepend(BENCHMARKS)
    assert [importlib.import_module(name).__name__ for name in names] == names


@pytest.mark.slow
def test_published_cases_are_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    """In other processes, as `against_paper.py` does: the force is that of a simulation in this process."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    cases = importlib.import_module("cases")
    (test,) = cases.tests_of(cases.paper_cases()[-1:])
    coarse = replace(test, discretisation=replace(test.discretisation, element_size=1.0))
    (found,) = cases.simulate_all([coarse])
    assert found.peak_force == shear(coarse).peak_force > 100.0


OLD = {"schema_version": 2, "rows": [{"condition": 8.0, "response": 120.1, "reason": ""}], "slope": None}


def compared(folder: Path, old: dict[str, object], new: dict[str, object]) -> subprocess.CompletedProcess[str]:
    """Compare two folders with one stage file each."""
    for name, content in (("old", old), ("new", new)):
        (folder / name).mkdir()
        (folder / name / "validate.json").write_text(json.dumps(content), encoding="utf-8")
    command = [sys.executable, str(BENCHMARKS / "compare_stage_files.py"), str(folder / "old"), str(folder / "new")]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)


def test_texts_are_not_compared(tmp_path: Path) -> None:
    done = compared(tmp_path, OLD, {**OLD, "rows": [{"condition": 8.0, "response": 120.1, "reason": "other"}]})
    assert done.returncode == 0 and "3 numbers, 0 differ" in done.stdout


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ({"condition": 8.0, "response": 120.1 * (1 + 3e-12)}, "rows[0].response: 120.1 is now 120.1"),
        ({"condition": 8.0, "response": None}, "is now None"),
        ({"condition": 8.0}, "rows[0].response: only old, 120.1"),
    ],
)
def test_a_number_that_differs_is_named(tmp_path: Path, row: dict[str, object], said: str) -> None:
    done = compared(tmp_path, OLD, {**OLD, "rows": [row]})
    assert done.returncode == 1 and "1 differ" in done.stdout and said in done.stdout
