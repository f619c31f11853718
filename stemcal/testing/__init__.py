"""Checks for authors of stages, solver kinds, designs and laboratory tests; the built-in ones pass them, too.

Without pytest, ``check_design(Doehlert())`` runs all checks of a design and raises one `ChecksFailed`. With pytest::

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

_AnyStudy = Study | str | Path

KINDS: dict[type, tuple[Callable[..., Any], tuple[Callable[[Any], None], ...]]] = {
    SurfaceDesign: (checks.DesignAtWork, checks.OF_DESIGNS),
    SolverKind: (checks.SolverAtWork, checks.OF_SOLVERS),
    Stage: (stage_checks.StageAtWork, stage_checks.OF_STAGES),
    LaboratoryKind: (checks.LaboratoryAtWork, checks.OF_TESTS),
}


class ChecksFailed(AssertionError):
    """Raised if checks failed; the message has their names and reasons."""


@dataclass(frozen=True)
class Check:
    """One check of one object; a call raises an error if the object fails the check."""

    name: str
    of: str  # name of the object
    run: Callable[[Any], None]
    subject: Any  # the object with the study that uses it (`AtWork`)

    def __call__(self) -> None:
        self.run(self.subject)

    def __str__(self) -> str:
        return f"{self.of}-{self.name}"


def checks_of(thing: object, study: _AnyStudy | None = None) -> list[Check]:
    """Return the checks of an object: a `SurfaceDesign`, `SolverKind`, `Stage` or `LaboratoryKind`.

    `study` (or the path of its spec) must use the object, and be small, because it is run several times; a design
    needs none. For a stage, its solver should be fast. For a kind of laboratory test, it must have a test of this kind.
    """
    for kind, (at_work, functions) in KINDS.items():
        if isinstance(thing, kind):
            subject, of = at_work(thing, study), str(getattr(thing, "name", ""))
            return [Check(function.__name__.removeprefix("_"), of, function, subject) for function in functions]
    message = f"{thing!r:.60} is not one of {', '.join(kind.__name__ for kind in KINDS)}; pass an instance, not a class"
    raise UsageError(message)


def _check(thing: object, study: _AnyStudy | None = None) -> None:
    every, failed = checks_of(thing, study), []
    for check in every:
        try:
            check()
        except Exception as error:  # the checked object may raise any error
            failed.append(f"{check.name}: {type(error).__name__}: {error}")
    if failed:
        raise ChecksFailed("\n".join([f"{every[0].of}: {len(failed)} of {len(every)} checks failed", *failed]))


def check_design(design: SurfaceDesign) -> None:
    """Run all checks of a design for the response surface; raise `ChecksFailed` if any fails."""
    _check(design)


def check_solver(kind: SolverKind, study: _AnyStudy) -> None:
    """Run all checks of a solver kind on a study that uses it; raise `ChecksFailed` if any fails."""
    _check(kind, study)


def check_stage(stage: Stage[Any], study: _AnyStudy) -> None:
    """Run all checks of an installed stage on a study that uses it; raise `ChecksFailed` if any fails."""
    _check(stage, study)


def check_laboratory_test(kind: LaboratoryKind, study: _AnyStudy) -> None:
    """Run all checks of an installed kind of laboratory test on a study with it; `ChecksFailed` if any fails."""
    _check(kind, study)


def parametrize_with_checks(
    objects: Iterable[object], expected_failures: Mapping[str, str] | None = None, slow: Collection[str] = ()
) -> pytest.MarkDecorator:
    """Return a pytest decorator that calls a test function once for each check, with the argument `check`.

    objects             the objects to check, or pairs of an object and its study, as in `checks_of`
    expected_failures   reasons of checks that must fail, by the name of a check, by ``object-check``, or by object
    slow                checks to be marked `slow`, named in the same way
    """
    import pytest

    expected, parameters = expected_failures or {}, []
    for thing in objects:
        for check in checks_of(*thing) if isinstance(thing, tuple) else checks_of(thing):
            reason = expected.get(check.name) or expected.get(str(check)) or expected.get(check.of)
            marks = [pytest.mark.xfail(reason=reason, strict=True)] if reason else []
            marks += [pytest.mark.slow] if {check.name, check.of, str(check)}.intersection(slow) else []
            parameters.append(pytest.param(check, marks=marks, id=str(check)))
    return pytest.mark.parametrize("check", parameters)
