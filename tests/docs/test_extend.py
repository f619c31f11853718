"""The classes on the page about extensions work as printed: known answers."""

import re
import shutil
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shown import DOCS

from stemcal.doe.coding import term_columns
from stemcal.doe.designs import SurfaceOptions
from stemcal.laboratory import Kind
from stemcal.responses import CUT, ForceTravel
from stemcal.solvers.protocol import Request
from stemcal.stages.stage import STAGES
from stemcal.study.model.laboratory_kind import TESTS
from stemcal.study.reading import json_schema, load_study
from stemcal.testing import check_design, check_laboratory_test, check_stage

SPECS = Path(__file__).parents[1] / "testing" / "specs"


@pytest.fixture(scope="module")
def printed() -> dict[str, Any]:
    names: dict[str, Any] = {}
    page = (DOCS / "howto" / "extend.md").read_text("utf-8")
    included = (DOCS / "howto" / "extending" / "solver.py").read_text("utf-8")
    for block in (*re.findall(r"```{code-block} python\n(.*?)```", page, re.DOTALL), included):
        exec(compile(block, "extend.md", "exec"), names)
    return names


def test_a_class_returns_its_responses(printed: dict[str, Any]) -> None:
    assert printed["MySolver"]().solve({"shear_strength": 2.0}, 8.0) == {"force": 128.0}


def test_a_kind_of_solver_makes_one_from_its_keys(printed: dict[str, Any]) -> None:
    study = SimpleNamespace(solver=printed["SpringOptions"](stiffness=4.0))
    answer = printed["Spring"]().make(study).solve(Request("rsm", 0, {"stretch": 2.5}, 8.0))
    assert (answer.status, answer.response) == ("ok", 10.0)


@pytest.mark.parametrize("k", [2, 3, 6])
def test_a_design_estimates_a_quadratic(printed: dict[str, Any], k: int) -> None:
    """2^k corners, 2 k points on the axes and the centre, as many as a quadratic has terms or more."""
    coded = printed["Star"]().points(k, SurfaceOptions(centre_points=1))
    assert coded.shape == (2**k + 2 * k + 1, k) and np.linalg.norm(coded[2**k : -1], axis=1) == pytest.approx(1.0)
    assert np.linalg.matrix_rank(term_columns(coded)) == (k + 1) * (k + 2) // 2
    check_design(printed["Star"]())


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The stage and the laboratory test of the page, as if their packages were installed."""
    monkeypatch.syspath_prepend(DOCS / "howto" / "extending")
    for registry, name, place in ((STAGES, "middle", "stage:Middle"), (TESTS, "stretch", "laboratory_test:Stretch")):
        monkeypatch.setitem(vars(registry), "_entries", {name: EntryPoint(name, place, registry.group)})
        monkeypatch.setitem(vars(registry), "_loaded", {})
    json_schema.json_schema.cache_clear()
    json_schema._classes.cache_clear()
    yield
    monkeypatch.undo()
    json_schema.json_schema.cache_clear()
    json_schema._classes.cache_clear()


@pytest.mark.usefixtures("installed")
def test_a_stage_passes_the_checks(tmp_path: Path) -> None:
    shutil.copy(SPECS / "law.py", tmp_path)
    spec = (SPECS / "python.yaml").read_text("utf-8") + "middle: {condition: 10.0}\n"
    (tmp_path / "study.yaml").write_text(spec, encoding="utf-8")
    stage = STAGES.named("middle")
    assert stage is not None
    check_stage(stage, tmp_path / "study.yaml")


@pytest.mark.usefixtures("installed")
def test_a_sentence_and_a_figure() -> None:
    """Of a finished stage, and of one whose run failed."""
    import figure

    for force, written in ((12.34, "12.3"), (None, "–")):
        result = SimpleNamespace(force=force)
        assert figure.outcome(None, result, None) == [f"In the middle of the ranges, the maximum force is {written} N."]
    (plot,) = figure.figures(None, SimpleNamespace(force=12.34), None)
    (bar,) = plot.figure.axes[0].patches
    assert (plot.section, bar.get_height()) == ("middle", 12.34)


def test_a_response(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the diameter, in the unit that the response declares."""
    monkeypatch.syspath_prepend(DOCS / "howto" / "extending")
    import response

    curve = ForceTravel.until_break(np.array([0.0, 2.0, 2.1]), np.array([0.0, 40.0, 1.0]), 8.0, CUT)
    assert (response.RELATIVE_TRAVEL.value(curve), response.RELATIVE_TRAVEL.unit) == (25.0, "%")


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_a_laboratory_test_passes_the_checks(tmp_path: Path) -> None:
    spec = re.sub(r"tests:\n(  - .*\n)+", "tests: [{name: pull, kind: stretch, stroke: 0.4 mm}]\n",
                  (SPECS / "embedded.yaml").read_text("utf-8"))  # fmt: skip
    (tmp_path / "study.yaml").write_text(spec, encoding="utf-8")
    study = load_study(tmp_path / "study.yaml")
    kind = TESTS.named("stretch")
    assert kind is not None and isinstance(kind.make(study.tests[0], 8.0), Kind)
    check_laboratory_test(kind, study)
