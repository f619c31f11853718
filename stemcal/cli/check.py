"""`stemcal check`: is the spec right?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

from stemcal.cli.options import AsJson, Spec

if TYPE_CHECKING:
    from stemcal.errors import SpecError
    from stemcal.study.model import Study


def check(spec: Spec, as_json: AsJson = False) -> None:
    """Read a spec and report every problem in it; compute and write nothing.

    Example: [bold]stemcal check my-study.yaml[/bold]
    """
    from stemcal.cli.console import say, say_json
    from stemcal.cli.session import read_study
    from stemcal.errors import SpecError

    try:
        study = read_study(spec)
    except SpecError as error:
        if as_json:
            say_json(_problems(error))
        raise
    if as_json:
        say_json(_summary(study))
    else:
        say(
            f"{spec}: right. Study {study.name}: {len(study.factors)} factors, "
            f"{len(study.targets.forces)} measured forces, solver {study.solver.kind}."
        )


def _problems(error: SpecError) -> Mapping[str, object]:
    problems = [asdict(problem) for problem in error.problems]
    return {"schema_version": 1, "stage": "check", "ok": False, "problems": problems}


def _summary(study: Study) -> Mapping[str, object]:
    return {
        "schema_version": 1,
        "stage": "check",
        "ok": True,
        "problems": [],
        "warnings": list(study.warnings),
        "name": study.name,
        "factors": [factor.name for factor in study.factors],
        "diameters": [target.diameter for target in study.targets.forces],
        "solver": study.solver.kind,
    }
