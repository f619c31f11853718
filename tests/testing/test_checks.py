"""Each check finds what it is for: an object with that one fault fails it, by its name."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from stemcal.doe.designs import SURFACES, SurfaceDesign, SurfaceOptions
from stemcal.drawing.plot import Plot
from stemcal.drawing.table import Column, Table
from stemcal.errors import UsageError
from stemcal.laboratory.axial import Axial, Tension
from stemcal.solvers.kinds import PythonKind
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.climb import Climb
from stemcal.stages.climb.showing import ClimbShowing
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.testing import Check, ChecksFailed, check_design, check_solver, checks_of, parametrize_with_checks

SPECS = Path(__file__).parent / "specs"
Points = Callable[[int, SurfaceOptions], np.ndarray]


def failing(thing: object, spec: str = "") -> set[str]:
    """Return the names of the checks that an object fails."""
    found = set()
    for check in checks_of(thing, SPECS / spec):
        try:
            check()
        except Exception:
            found.add(check.name)
    return found


# ---- designs


def three_levels(k: int, options: SurfaceOptions) -> np.ndarray:
    runs = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=k)))
    return np.vstack([runs, np.zeros((options.centre_points, k))])


def refusing(k: int, options: SurfaceOptions) -> np.ndarray:
    if k == 3:
        raise ZeroDivisionError
    return three_levels(k, options)


def corners(k: int, options: SurfaceOptions) -> np.ndarray:
    found = three_levels(k, options)
    return found[np.isin(np.abs(found).sum(axis=1), (0, k))]


DESIGNS: dict[str, Points] = {
    "points_are_finite_for_each_number_of_factors": refusing,
    "same_points_again": lambda k, options: np.random.default_rng().permutation(three_levels(k, options)),
    "every_term_can_be_estimated": corners,
    "levels_are_balanced": lambda k, options: np.vstack([three_levels(k, options), np.ones((1, k))]),
    "points_are_within_reach": lambda k, options: 1.5 * three_levels(k, options),
}


@pytest.mark.parametrize("name", ["", *DESIGNS])
def test_the_fault_of_a_design_is_found(name: str) -> None:
    points = DESIGNS.get(name, three_levels)
    faulty = type("Faulty", (SurfaceDesign,), {"name": "faulty", "factors": (2, 3), "points": staticmethod(points)})
    assert failing(faulty()) == (set(DESIGNS) if points is refusing else {name} - {""})


# ---- solvers


class Known(Solver):
    """A law of its levels without a fault; the subclasses have one each."""

    def identity(self, request: Request) -> dict[str, Any]:
        return {"levels": dict(request.levels), "condition": request.condition}

    def solve(self, request: Request) -> Answer:
        return Answer("ok", sum(request.levels.values()))


class Unpicklable(Known):
    def __init__(self) -> None:
        self.law = lambda levels: 1.0


class Random(Known):
    def identity(self, request: Request) -> dict[str, Any]:
        return {**super().identity(request), "drawn": np.random.default_rng().random()}


class Forgetful(Known):
    def identity(self, request: Request) -> dict[str, Any]:
        return {"yield_stress": request.levels["yield_stress"], "condition": request.condition}


class Counting(Known):
    count = 0

    def solve(self, request: Request) -> Answer:
        Counting.count += 1
        return Answer("ok", float(Counting.count))


class Deaf(Known):
    def solve(self, request: Request) -> Answer:
        return Answer("ok", 1.0)


class Littering(Known):
    def solve(self, request: Request) -> Answer:
        Path("left.txt").touch()
        return super().solve(request)


class Failing(Known):
    def solve(self, request: Request) -> Answer:
        return Answer("failed", reason="no_licence")


LEAVES = {"every_response_is_answered", "interrupted_runs_equal_uninterrupted_ones", "nan_is_a_failed_run"}


@pytest.mark.parametrize(
    ("solver", "found"),
    [
        (Known, set()),
        (Unpicklable, {"solver_is_picklable"}),
        (Random, {"solver_is_picklable"}),
        (Forgetful, {"identity_changes_with_each_factor"}),
        (Counting, {"interrupted_runs_equal_uninterrupted_ones", "nan_is_a_failed_run"}),
        (Deaf, {"nan_is_a_failed_run"}),
        (Littering, LEAVES),
        (Failing, {"every_response_is_answered"}),
    ],
)
def test_the_fault_of_a_solver_is_found(solver: type[Solver], found: set[str]) -> None:
    kind = type("Kind", (PythonKind,), {"make": lambda self, study: solver()})
    assert failing(kind(), "python.yaml") == found


def test_one_error_names_all_that_failed() -> None:
    kind = type("Kind", (PythonKind,), {"name": "other", "make": lambda self, study: Deaf()})
    with pytest.raises(ChecksFailed, match=r"(?s)other: 2 of 6 .*kind_is_declared: .*'python'.*nan_is_a_failed_run: "):
        check_solver(kind(), SPECS / "python.yaml")
    check_design(SURFACES.built_in[1])
    with pytest.raises(UsageError, match="pass an instance, not a class"):
        checks_of(PythonKind)
    with pytest.raises(ChecksFailed, match="pass a study"):
        check_solver(SOLVERS.built_in[0], None)  # type: ignore[arg-type]


# ---- stages


class Untitled(ClimbShowing):
    def tables(self, result: Any, names: Any) -> list[Table]:
        return [replace(table, title="") for table in super().tables(result, names)]


class Unitless(ClimbShowing):
    def tables(self, result: Any, names: Any) -> list[Table]:
        return [Table((Column("mass", "Mass", form=str),), ((1.5,),), "Mass of the stem")]


class Undrawn(ClimbShowing):
    def figures(self, result: Any, setting: Any) -> list[Plot]:
        return [Plot("path", "climb", "The path.", lambda: setting.labels.figure)]


class Unwritten(ClimbShowing):
    def tables(self, result: Any, names: Any) -> list[Table]:
        return [Table((Column("force", "Force", "N", "{:.1f}".format),), ((None,),), "Force of a failed run")]


class Misplaced(ClimbShowing):
    def figures(self, result: Any, setting: Any) -> list[Plot]:
        return [Plot("path", "middle", "The path.", Figure)]


STAGES: list[tuple[Mapping[str, Any], str]] = [
    ({}, ""),
    ({"title": ""}, "stage_is_declared"),
    ({"showing": lambda self: Untitled()}, "tables_have_titles_and_units"),
    ({"showing": lambda self: Unitless()}, "tables_have_titles_and_units"),
    ({"showing": lambda self: Undrawn()}, "stage_is_shown"),
    ({"showing": lambda self: Misplaced()}, "stage_is_shown"),
    ({"showing": lambda self: Unwritten()}, "stage_is_shown"),
]


@pytest.mark.parametrize(("members", "found"), STAGES)
def test_the_fault_of_a_stage_is_found(members: Mapping[str, Any], found: str) -> None:
    # the parts of a stage are in the package of its class
    stage = type("Stage", (Climb,), {"__module__": Climb.__module__, **members})
    assert failing(stage(), "python.yaml") == {found} - {""}


# ---- laboratory tests


class Resting(Axial):
    def driven(self, mesh: Any, stem: Any) -> Any:
        return np.zeros(mesh.nodes.shape, dtype=bool)


def test_a_laboratory_test_that_moves_nothing_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Tension, "make", lambda self, section, diameter: Resting("tension"))
    check = next(one for one in checks_of(Tension(), SPECS / "embedded.yaml") if one.name == "model_is_sound")
    with pytest.raises(AssertionError, match="no tool or driven node moves"):
        check()


# ---- pytest


def test_expected_failures_and_slow_checks_are_marked() -> None:
    faulty = type("Faulty", (SurfaceDesign,), {"name": "faulty", "factors": (2, 3)})
    mark = parametrize_with_checks(
        [faulty()], expected_failures={"same_points_again": "drawn anew"}, slow=["faulty-levels_are_balanced"]
    ).mark
    names, given = mark.args
    marks = {one.values[0].name: [(m.name, m.kwargs.get("reason")) for m in one.marks] for one in given if one.marks}
    assert names == "check" and isinstance(given[0].values[0], Check)
    assert marks == {"same_points_again": [("xfail", "drawn anew")], "levels_are_balanced": [("slow", None)]}
