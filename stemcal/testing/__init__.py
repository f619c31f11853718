"""Checks for stages, kinds of solvers, designs and laboratory tests of any package; built-in ones pass them too.

Without pytest ``check_design(Doehlert())`` runs all checks and raises one `ChecksFailed`. With pytest::

    @parametrize_with_checks([Doehlert(), (Spring(), "spring.yaml")])
    def test_checks(check):
        check()
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stemcal.doe.designs import SurfaceDesign
from stemcal.errors import UsageError
from stemcal.stages.stage import Stage
from stemcal.study.model.laboratory_kind import LaboratoryKind
from stemcal.study.model.study import Study
from stemcal.study.types.solver_kind import SolverKind
from stemcal.testing import checks, stage_checks

if TYPE_CHECKING:
    import pytest

__all__ = [
    "Check", "ChecksFailed", "check_design", "check_laboratory_test", "check_solver", "check_stage", "checks_of",
    "parametrize_with_checks",
]  # fmt: skip

AnyStudy = Study | str | Path

KINDS: dict[type, tuple[Callable[..., Any], tuple[Callable[[Any], None], ...]]] = {
    SurfaceDesign: (checks.DesignAtWork, checks.OF_DESIGNS),
    SolverKind: (checks.SolverAtWork, checks.OF_SOLVERS),
    Stage: (stage_checks.StageAtWork, stage_checks.OF_STAGES),
    LaboratoryKind: (checks.LaboratoryAtWork, checks.OF_TESTS),
}


class ChecksFailed(AssertionError):
    """Raised with the names of the failed checks and their reasons."""


@dataclass(frozen=True)
class Check:
    """One check of one object: calling it raises an error if the object fails."""

    name: str
    of: str
    run: Callable[[Any], None]
    subject: Any

    def __call__(self) -> None:
        """Run the check."""
        self.run(self.subject)

    def __str__(self) -> str:
        return f"{self.of}-{self.name}"


def checks_of(thing: object, study: AnyStudy | None = None) -> list[Check]:
    """Return the checks of an object: a `SurfaceDesign`, `SolverKind`, `Stage` or `LaboratoryKind`.

    The study, or the path of its spec, uses the object and is small enough to run several times; designs need none. For
    a stage, its solver should be fast; for a laboratory test, it should contain a test of that kind.
    """
    for kind, (at_work, functions) in KINDS.items():
        if isinstance(thing, kind):
            subject, of = at_work(thing, study), str(getattr(thing, "name", ""))
            return [Check(one.__name__.removeprefix("_"), of, one, subject) for one in functions]
    message = f"{thing!r:.60} is not one of {', '.join(kind.__name__ for kind in KINDS)}; pass an instance, not a class"
    raise UsageError(message)


def _check(thing: object, study: AnyStudy | None = None) -> None:
    every, failed = checks_of(thing, study), []
    for check in every:
        try:
            check()
        except Exception as error:  # any error of the object
            failed.append(f"{check.name}: {type(error).__name__}: {error}")
    if failed:
        raise ChecksFailed("\n".join([f"{every[0].of}: {len(failed)} of {len(every)} checks failed", *failed]))


def check_design(design: SurfaceDesign) -> None:
    """Run all checks of a design for the response surface; raise `ChecksFailed` if any fails."""
    _check(design)


def check_solver(kind: SolverKind, study: AnyStudy) -> None:
    """Run all checks of a kind of solver on a study that uses it."""
    _check(kind, study)


def check_stage(stage: Stage[Any], study: AnyStudy) -> None:
    """Run all checks of an installed stage on a study that uses it."""
    _check(stage, study)


def check_laboratory_test(kind: LaboratoryKind, study: AnyStudy) -> None:
    """Run all checks of an installed laboratory test on a study that contains one of its kind."""
    _check(kind, study)


def parametrize_with_checks(
    objects: Iterable[object], expected_failures: Mapping[str, str] | None = None, slow: Collection[str] = ()
) -> pytest.MarkDecorator:
    """Return a decorator that calls a test function with each check of each object as `check`.

    objects             objects, or pairs of an object and its study, as in `checks_of`
    expected_failures   reasons by name of a check, as ``object-check``, or ``object`` for all its checks
    slow                checks, named in the same way, that are marked `slow`
    """
    import pytest

    expected, given = expected_failures or {}, []
    for one in objects:
        for check in checks_of(*one) if isinstance(one, tuple) else checks_of(one):
            reason = expected.get(check.name) or expected.get(str(check)) or expected.get(check.of)
            marks = [pytest.mark.xfail(reason=reason, strict=True)] if reason else []
            marks += [pytest.mark.slow] if {check.name, check.of, str(check)}.intersection(slow) else []
            given.append(pytest.param(check, marks=marks, id=str(check)))
    return pytest.mark.parametrize("check", given)
