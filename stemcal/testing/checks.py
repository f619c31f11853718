"""The checks of designs, solver kinds and laboratory tests.

A check is a function of an `AtWork`: an object and a study that uses it. It raises an error if the object fails.
"""

import json
import math
import os
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from stemcal.arrays import Array
from stemcal.cutting.build import build as build_cut
from stemcal.cutting.parts import ShearTest
from stemcal.doe.coding import term_columns
from stemcal.doe.designs import SurfaceDesign, SurfaceOptions
from stemcal.errors import UsageError
from stemcal.laboratory.build import build_piece, rounded
from stemcal.runs.answer import answer_all
from stemcal.runs.record import Outcome, Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.embedded import test_of
from stemcal.solvers.laboratory_runs import identity, perform_or_fail
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.work import HERE
from stemcal.study.model.laboratory_kind import LaboratoryKind, LaboratorySection, PieceSection
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.field_types import Length
from stemcal.study.types.solver_kind import SolverKind

_MOST, _FEW = 10, 4  # largest number of factors in the checks of designs, and in those that compute a design twice
_ROUNDING = 1e-9
_COARSE = 3.0  # ratio of the element size in the checked laboratory test to the usual one


def require(holds: bool, message: str) -> None:
    """Raise `AssertionError` with the message unless `holds`, even if Python skips assertions (option ``-O``)."""
    if not holds:
        raise AssertionError(message)


@contextmanager
def apart(study: Study) -> Iterator[Path]:
    """Yield an empty study folder; raise if the block leaves other files in the working folder or next to the spec."""
    before, spec_folder = Path.cwd(), study.source.resolve().parent
    with TemporaryDirectory() as there, TemporaryDirectory() as place:
        files = set(spec_folder.rglob("*")) if study.source.is_file() else None
        os.chdir(there)
        try:
            yield Path(place)
            left = [*Path(there).iterdir(), *(set(spec_folder.rglob("*")) - files if files is not None else ())]
        finally:
            os.chdir(before)
        left = [path for path in left if "__pycache__" not in path.parts]
        require(not left, f"files were left outside the study folder: {', '.join(path.name for path in left)}")


class AtWork:
    """An object to check, and a study that uses it."""

    def __init__(self, thing: Any, study: Study | str | Path | None = None) -> None:
        self.thing, self._study = thing, study

    @cached_property
    def study(self) -> Study:
        """The study, read from its spec on first use."""
        if self._study is None:
            raise UsageError(f"{type(self.thing).__name__}: no study was passed; pass a study that uses this object")
        return self._study if isinstance(self._study, Study) else load_study(self._study)


# ---- designs


class DesignAtWork(AtWork):
    """A design, with its points for each number of factors that it supports."""

    thing: SurfaceDesign

    def points(self, k: int, centre_points: int = 3) -> Array:
        """Return the coded points for k factors, (runs, k)."""
        return self.thing.runs(k, SurfaceOptions(self.thing.name, centre_points))

    @cached_property
    def each(self) -> dict[int, Array]:
        """The coded points by number of factors, for all numbers that the design supports up to ten."""
        low, high = self.thing.factors
        return {k: self.points(k) for k in range(low, min(high, _MOST) + 1)}

    @property
    def few(self) -> dict[int, Array]:
        """The points by number of factors, for small numbers only: these designs are quick to compute twice."""
        return {k: points for k, points in self.each.items() if k <= _FEW}


def _points_are_finite_for_each_number_of_factors(at: DesignAtWork) -> None:
    for k in range(1, _MOST + 1):
        with suppress(*([] if k in at.each else [UsageError])):
            points = at.each[k] if k in at.each else at.points(k)
            message = f"the design points for {k} factors have shape {points.shape}, but {k} columns are required"
            require(points.ndim == 2 and points.shape[1] == k, message)
            require(bool(np.isfinite(points).all()), f"the design points for {k} factors are not finite")


def _same_points_again(at: DesignAtWork) -> None:
    for k, points in at.few.items():
        message = f"the design points for {k} factors differ when they are computed a second time"
        require(np.array_equal(points, at.points(k)), message)


def _every_term_can_be_estimated(at: DesignAtWork) -> None:
    for k, points in at.each.items():
        terms, rank = (k + 1) * (k + 2) // 2, int(np.linalg.matrix_rank(term_columns(points)))
        require(rank == terms, f"only {rank} of {terms} terms can be estimated from {len(points)} runs of {k} factors")


def _levels_are_balanced(at: DesignAtWork) -> None:
    for k, points in at.each.items() if at.thing.balanced else ():
        off = float(np.abs(points.mean(axis=0)).max())
        message = f"in the design for {k} factors, the mean coded level of a factor is {off:.3g} instead of 0"
        require(off < _ROUNDING, message)


def _points_are_within_reach(at: DesignAtWork) -> None:
    """Check that no coded level exceeds `reach`, and no distance from the centre exceeds both `radius` and √k."""
    for k, points in at.each.items():
        options = SurfaceOptions(at.thing.name, 3)
        reach, radius = at.thing.reach(k, options), max(at.thing.radius(k, options), k**0.5)
        message = f"in the design for {k} factors, a coded level exceeds `reach` ({reach:g})"
        require(np.abs(points).max() <= reach + _ROUNDING, message)
        far = np.linalg.norm(points, axis=1).max()
        message = f"in the design for {k} factors, the coded radius of a point exceeds `radius` ({radius:g})"
        require(far <= radius + _ROUNDING, message)


OF_DESIGNS: tuple[Callable[[DesignAtWork], None], ...] = (
    _points_are_finite_for_each_number_of_factors, _same_points_again, _every_term_can_be_estimated,
    _levels_are_balanced, _points_are_within_reach,
)  # fmt: skip


# ---- solvers


class SolverAtWork(AtWork):
    """A solver kind, its solver for a study, two requests for runs, and the outcomes of these runs."""

    thing: SolverKind

    @cached_property
    def solver(self) -> Solver:
        solver: Solver = self.thing.make(self.study)
        return solver

    @cached_property
    def requests(self) -> list[Request]:
        """Two runs: all factors at mid-range, and the same except that the first factor is at its low level."""
        middle = Request("rsm", 0, self.study.midlevels(), self.study.targets.calibrate_at)
        first = self.study.factors[0]
        return [middle, replace(middle, row=1, levels={**middle.levels, first.name: first.low})]

    def key(self, request: Request) -> str:
        return Run.of(self.solver, request).key

    def answers(self, place: Path, requests: list[Request]) -> list[Outcome]:
        """Perform the requested runs in a folder; return their outcomes, including failures."""
        with StudyFolder(place) as folder:
            return answer_all(requests, self.solver, folder, HERE, quorum=0.0)

    @cached_property
    def answered(self) -> list[Outcome]:
        """The outcomes of both requests, performed together."""
        with apart(self.study) as place:
            return self.answers(place, self.requests)


def _kind_is_declared(at: AtWork) -> None:
    default = at.thing.options.model_fields["kind"].default
    message = f"the name is {at.thing.name!r}, but the default of the `kind` key is {default!r}"
    require(default == at.thing.name, message)


def _solver_is_picklable(at: SolverAtWork) -> None:
    solvers = (at.solver, pickle.loads(pickle.dumps(at.solver)))
    here, there = (json.dumps(solver.identity(at.requests[0]), sort_keys=True, allow_nan=False) for solver in solvers)
    require(here == there, "the identity of the solver changes when the solver is pickled")


def _identity_changes_with_each_factor(at: SolverAtWork) -> None:
    middle = at.requests[0]
    for factor in at.study.factors:
        other = replace(middle, levels={**middle.levels, factor.name: factor.low})
        require(at.key(middle) != at.key(other), f"runs with different values of {factor.name} have the same identity")
    if at.study.naming.condition is None:
        return
    other = replace(middle, condition=1.25 * middle.condition)
    require(at.key(middle) != at.key(other), "runs at different conditions have the same identity")


def _every_response_is_answered(at: SolverAtWork) -> None:
    for answer in () if at.solver.asks_people else at.answered:
        require(answer.ok, f"the run with all factors at mid-range failed: {answer.reason}: {answer.message}")
        values = [answer.response, *(answer.of(named.name) for named in at.solver.naming.others)]
        message = f"some responses are not finite numbers: {values}"
        require(all(value is not None and math.isfinite(value) for value in values), message)


def _interrupted_runs_equal_uninterrupted_ones(at: SolverAtWork) -> None:
    if not at.solver.asks_people:
        with apart(at.study) as place:
            at.answers(place, at.requests[:1])
            second = at.answers(place, at.requests)
        both = [[(run.response, run.responses) for run in outcomes] for outcomes in (at.answered, second)]
        differing = f"an uninterrupted and an interrupted run: {both[0]} and {both[1]}"
        require(both[0] == both[1], f"the responses differ between {differing}")


def _nan_is_a_failed_run(at: SolverAtWork) -> None:
    middle = at.requests[0]
    if not at.solver.asks_people:
        with apart(at.study) as place:
            (answer,) = at.answers(place, [replace(middle, levels=dict.fromkeys(middle.levels, math.nan))])
        require(
            not answer.ok and bool(answer.reason),
            f"a run with NaN levels must fail and give a reason (status {answer.status!r}, response {answer.response})",
        )


OF_SOLVERS: tuple[Callable[[SolverAtWork], None], ...] = (
    _kind_is_declared, _solver_is_picklable, _identity_changes_with_each_factor, _every_response_is_answered,
    _interrupted_runs_equal_uninterrupted_ones, _nan_is_a_failed_run,
)  # fmt: skip


# ---- laboratory tests


class LaboratoryAtWork(AtWork):
    """A kind of laboratory test, and a test of this kind with a coarse mesh."""

    thing: LaboratoryKind

    @cached_property
    def section(self) -> LaboratorySection:
        """The section of the first test of this kind in the spec; if it has no element size, a coarse one is set."""
        section = next((test for test in self.study.tests if test.kind == self.thing.name), None)
        if section is None:
            raise UsageError(f"{self.study.name}: the study has no test of kind {self.thing.name}")
        if not isinstance(section, PieceSection) or section.element_size is not None:
            return section
        coarse = Length(divisor=(section.usual_size.divisor or _COARSE) / _COARSE)
        return section.model_copy(update={"element_size": coarse})

    def test(self, **levels: float) -> Any:
        """Return the test with all factors at mid-range, except those in `levels`."""
        return test_of(self.study, self.section, {**self.study.midlevels(), **levels}, self.study.targets.calibrate_at)


def _identity_of_test_changes_with_each_factor(at: LaboratoryAtWork) -> None:
    """Check that the identity of a test has JSON values, is the same after pickling, and changes with each factor."""
    test = at.test()
    identities = [json.dumps(identity(at.section, copy)) for copy in (test, pickle.loads(pickle.dumps(test)))]
    require(identities[0] == identities[1], "the identity of the test changes when the test is pickled")
    for factor in at.study.factors:
        other = json.dumps(identity(at.section, at.test(**{factor.name: factor.low})))
        require(other != identities[0], f"runs with different values of {factor.name} have the same identity")


def _model_is_sound(at: LaboratoryAtWork) -> None:
    """Check that elements have positive volumes, initial velocities are finite, and a tool or a driven node moves."""
    test = at.test()
    model = build_cut(test) if isinstance(test, ShearTest) else build_piece(rounded(test))
    require(bool((model.mesh.volumes() > 0.0).all()), "an element has zero volume")
    velocity = np.zeros(model.mesh.nodes.shape) if model.velocity is None else model.velocity
    require(bool(np.isfinite(velocity).all()), "the initial velocities are not finite")
    moved = any(tool.speed != 0.0 for tool in model.tools) or bool(np.abs(velocity[model.held]).max(initial=0.0) > 0.0)
    require(moved, "no tool or driven node moves")


def _responses_are_positive_and_repeatable(at: LaboratoryAtWork) -> None:
    """Check that each default response is positive and bit-identical in a second run, and that no file is left."""
    with apart(at.study):
        responses, again = (perform_or_fail(at.test()).responses for _ in range(2))
    for name in at.section.usual:
        value = responses.get(name, math.nan)
        require(0.0 < value < math.inf, f"the response {name} must be positive and finite, not {value}")
    require(again == responses, f"the responses differ between two identical runs: {responses} and {again}")


OF_TESTS: tuple[Callable[[LaboratoryAtWork], None], ...] = (
    _kind_is_declared, _identity_of_test_changes_with_each_factor, _model_is_sound,
    _responses_are_positive_and_repeatable,
)  # fmt: skip
