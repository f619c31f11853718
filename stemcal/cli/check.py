"""`stemcal check`: is the spec right?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING

from stemcal.cli.console import say, say_json, warn
from stemcal.cli.options import AsJson, Spec
from stemcal.cli.session import read_study
from stemcal.errors import SpecError, UsageError

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model import Study

_MANY, _MUCH = 1e6, 1e11  # elements, and steps of elements, of a run that any machine can do


def check(spec: Spec, as_json: AsJson = False) -> None:
    """Read a spec and report every problem in it; compute and write nothing.

    Example: [bold]stemcal check my-study.yaml[/bold]
    """
    try:
        study = read_study(spec)
    except SpecError as error:
        if as_json:
            say_json(_problems(error))
        raise
    from stemcal.text.beforehand import remarks as beforehand

    demanding, remarks = [*_demanding(study), *not_ready(study)], beforehand(study)
    for sentence in demanding:
        warn(sentence)
    if as_json:
        say_json(_summary(study, demanding, remarks))
    else:
        say(f"{spec}: OK. {study}.")
        for sentence in remarks:
            say(sentence)


def _problems(error: SpecError) -> Mapping[str, object]:
    problems = [asdict(problem) for problem in error.problems]
    return {"schema_version": 1, "stage": "check", "ok": False, "problems": problems}


def not_ready(study: Study) -> list[str]:
    """Say why programs that a spec names cannot be started here: the spec is right, but no run can begin."""
    from stemcal.study.model import ProgramOptions

    owned, said = [test for test in study.tests if test.solver], list[str]()
    if not owned and not isinstance(study.solver, ProgramOptions):
        return said
    from stemcal.solvers import make_solver
    from stemcal.solvers.laboratory_programs import program_of

    makers: list[Callable[[], Solver]] = [partial(program_of, study, test) for test in owned]
    for make in makers or [partial(make_solver, study)]:
        try:
            make().prepare()
        except UsageError as error:
            said += [f"no run can begin on this machine: {line}" for line in str(error).splitlines()]
    return said


def _demanding(study: Study) -> list[str]:
    """Say what of a single run is more than this machine has, or takes days; loads little where the mesh is small."""
    if study.solver.kind != "embedded" or _is_small(study):
        return []
    from stemcal.overview.foresight import demand_of_one
    from stemcal.text.plan import objections

    too_much, _ = objections(demand_of_one(study, _diameters(study)), 1)
    return too_much


def _is_small(study: Study) -> bool:
    """Tell whether a run is far from too much, by cubes of the element's size and the step that all can take."""
    solver, largest = study.solver, max(_diameters(study))
    if solver.kind != "embedded" or solver.time_step is None:
        return False
    size = solver.element_size.at(largest)
    elements = study.specimen.length / size * largest / size * 4.0 * max(largest / size, 50.0)
    return elements < _MANY and elements * study.loading.duration / solver.time_step < _MUCH


def _diameters(study: Study) -> list[float]:
    return [study.targets.calibrate_at, *(target.condition for target in study.targets.means)]


def _summary(study: Study, demanding: list[str], remarks: list[str]) -> Mapping[str, object]:
    naming = study.naming
    places = {} if naming.condition is None else {"conditions": [target.condition for target in study.targets.means]}
    return {
        "schema_version": 1,
        "stage": "check",
        "ok": True,
        "problems": [],
        "warnings": [*study.warnings, *demanding],
        "remarks": remarks,
        "name": study.name,
        "factors": [factor.name for factor in study.factors],
        **places,
        "solver": study.solver.kind,
    }
