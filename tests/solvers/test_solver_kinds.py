"""Kinds of solvers: what each declares, that nothing else asks for a class or a name, and kinds of other packages."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from stemcal.errors import SpecError
from stemcal.registry import code_of
from stemcal.runs.record import Run
from stemcal.solvers import make_solver
from stemcal.solvers.options import CommandSolver, DeckSolver, PythonSolver
from stemcal.solvers.protocol import Request, Solver
from stemcal.study.model.study import Study
from stemcal.study.reading import json_schema, load_study
from stemcal.study.types.solver_kind import SOLVERS

PACKAGE = Path(__file__).parents[2] / "stemcal"
NAMES = {kind.name for kind in SOLVERS.built_in}
CLASSES = {
    node.name
    for path in (PACKAGE / "solvers").rglob("*.py")
    for node in ast.parse(path.read_text(encoding="utf-8")).body
    if isinstance(node, ast.ClassDef) and {ast.unparse(base) for base in node.bases} & {"Solver", "SolverOptions"}
} | {"Solver", "SolverOptions", "ProgramOptions", "CommandSolver", "DeckSolver", "Command", "DeckProgram", "Program"}


def checks(path: Path) -> Iterator[str]:
    """Yield what asks for a solver's class, or compares its kind with a name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Call(func=ast.Name("isinstance" | "issubclass"), args=[_, kinds]):
                asked = {one.id for one in ast.walk(kinds) if isinstance(one, ast.Name)}
                asked |= {one.attr for one in ast.walk(kinds) if isinstance(one, ast.Attribute)}
                found = bool(asked & CLASSES)
            case ast.Compare(left=left, comparators=others):
                sides = [left, *others]
                kind = any(isinstance(one, ast.Attribute | ast.Name) and "kind" in ast.unparse(one) for one in sides)
                found = kind and any(c.value in NAMES for one in sides for c in ast.walk(one) if _is_text(c))
            case _:
                found = False
        if found:
            yield f"{path.relative_to(PACKAGE)}:{node.lineno}: {ast.unparse(node)}"


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def test_nothing_outside_asks_for_a_solvers_class_or_name() -> None:
    outside = [path for path in PACKAGE.rglob("*.py") if not path.is_relative_to(PACKAGE / "solvers")]
    assert [found for path in outside for found in checks(path)] == []
    assert len([found for path in (PACKAGE / "solvers").rglob("*.py") for found in checks(path)]) > 10


def test_what_the_kinds_declare() -> None:
    told = {
        kind.name: (kind.answers, kind.simulates_stems, kind.own_responses, kind.replicates) for kind in SOLVERS.all
    }
    assert told == {
        "embedded": ("computes", True, False, "mesh"),
        "command": ("computes", False, True, "seed"),
        "sheet": ("asks_people", False, True, "seed"),
        "deck": ("computes", False, False, None),
        "python": ("computes", False, True, "seed"),
    }
    assert all(kind.options.model_fields["kind"].default == kind.name for kind in SOLVERS.all)


# ---- kinds of other packages

OUTSIDE = """
from typing import Literal
from stemcal.solvers.protocol import Answer, Solver
from stemcal.study.types.solver_kind import SolverKind, SolverOptions

class SpringOptions(SolverOptions):
    kind: Literal["spring"] = "spring"
    stiffness: float = 10.0

class Spring(SolverKind):
    name = "spring"
    options = SpringOptions

    def make(self, study):
        return Answering(study.solver.stiffness)

class Answering(Solver):
    def __init__(self, stiffness):
        self.stiffness = stiffness

    def identity(self, request):
        return {"spring": self.stiffness, "levels": dict(request.levels)}

    def solve(self, request):
        return Answer("ok", self.stiffness * request.levels["stretch"])

class Broken:
    def __init__(self):
        raise RuntimeError("no licence")
"""
SPEC = """
name: spring
factors: [{name: stretch, low: 1, high: 2}, {name: play, low: 0, high: 1}]
targets: [{diameter: 8 mm, force: 15 N}]
solver: {kind: KIND}
"""


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package that brings a kind `spring`, one that breaks, and one whose name exists."""
    (tmp_path / "springs.py").write_text(OUTSIDE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    told = tmp_path / "springs-1.0.dist-info"
    told.mkdir()
    (told / "METADATA").write_text("Metadata-Version: 2.1\nName: springs\nVersion: 1.0\n", encoding="utf-8")
    (told / "entry_points.txt").write_text(
        "[stemcal.solvers]\nspring = springs:Spring\nbroken = springs:Broken\nsheet = springs:Spring\n",
        encoding="utf-8",
    )
    for name, value in (("_loaded", {}), ("broken", {})):
        monkeypatch.setitem(vars(SOLVERS), name, value)
    known = vars(SOLVERS).pop("_entries", None)
    json_schema.json_schema.cache_clear()
    json_schema._classes.cache_clear()
    yield tmp_path
    vars(SOLVERS).pop("_entries", None)
    if known is not None:
        vars(SOLVERS)["_entries"] = known
    sys.modules.pop("springs", None)
    code_of.cache_clear()
    json_schema.json_schema.cache_clear()
    json_schema._classes.cache_clear()


def study_of(folder: Path, kind: str) -> Study:
    spec = folder / "spring.yaml"
    spec.write_text(SPEC.replace("KIND", kind), encoding="utf-8")
    return load_study(spec)


def test_a_kind_of_another_package_answers_and_its_code_counts(packages: Path) -> None:
    study, request = study_of(packages, "spring, stiffness: 7"), Request("rsm", 0, {"stretch": 2.0, "play": 0.0}, 8.0)
    solver = make_solver(study)
    assert isinstance(solver, Solver) and solver.solve(request).response == 14.0
    before = Run.of(solver, request).key
    (packages / "springs.py").write_text(OUTSIDE + "# corrected\n", encoding="utf-8")
    code_of.cache_clear()
    assert Run.of(solver, request).key != before
    with pytest.raises(SpecError, match="unknown key 'stifness'; did you mean stiffness"):
        study_of(packages, "spring, stifness: 7")  # codespell:ignore stifness


@pytest.mark.parametrize("kind", ["broken", "nowhere"])
def test_a_kind_that_breaks_or_is_not_there_is_refused_with_its_line(packages: Path, kind: str) -> None:
    with pytest.raises(SpecError, match=f"5.* '{kind}' is not a known kind of solver"):
        study_of(packages, kind)
    taken = "sheet of springs 1.0"
    assert set(SOLVERS.broken) == {"broken", taken}  # also of an unknown kind: the message lists those that load
    assert SOLVERS.broken[taken] == "springs 1.0: sheet already exists"


def test_usual_time_limits_are_an_hour_and_of_a_deck_a_day() -> None:
    limits = [kind.model_fields["time_limit"].default for kind in (CommandSolver, PythonSolver, DeckSolver)]
    assert limits == [3600.0, 3600.0, 86400.0]


def test_a_record_has_the_number_of_a_replicate() -> None:
    request = Request("rsm", 3, {"a": 1.0}, 8.0)
    assert request.as_record() == {"stage": "rsm", "row": 3, "levels": {"a": 1.0}, "condition": 8.0, "pictured": False}
    assert replace(request, replicate=2).as_record() == {**request.as_record(), "replicate": 2}
