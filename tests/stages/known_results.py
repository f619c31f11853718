"""A calibrated study whose force is known, and evidence with changed results for the rules of the verdict."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from fakes import TWO_FACTORS
from planting import Law

from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Solver
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.physics import Physics
from stemcal.stages.verdict.verdict_rules import Evidence
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS

RSM = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"
FORCES = {7.0: 84.21875, 8.0: 110.0, 10.0: 171.875}


def spec_of(forces: Mapping[float, float] = FORCES, extra: str = "", more: str = "") -> str:
    """Return the spec of two factors with these forces (N) at diameters (mm); `more` are further keys of each row."""
    rows = "".join(f"  - {{diameter: {d:g} mm, force: {force:.9g} N{more}}}\n" for d, force in forces.items())
    return f"{TWO_FACTORS}{RSM}targets:\n{rows}{extra}"


@dataclass(frozen=True)
class Known:
    """A study, its folder and its results."""

    study: Study
    folder: StudyFolder
    results: Results

    def of(self, kind: Any) -> Any:
        """Return a result by its class."""
        return self.results.of(kind)

    def evidence(self, *changed: StageResult, study: Study | None = None, done: Sequence[str] = ()) -> Evidence:
        """Return evidence with some results replaced; with `done`, only the stages of these names."""
        new = {result.name: result for result in changed}
        kept = (new.pop(result.name, result) for result in self.results.done if not done or result.name in done)
        return evidence(study or self.study, (*kept, *new.values()), self.folder)


def evidence(study: Study, done: Sequence[StageResult], folder: Any = None, physics: Physics | None = None) -> Evidence:
    """Return evidence of these results."""
    return Evidence(study, Results(tuple(done)), physics or Physics(0, 0, ()), folder)


@contextmanager
def solved_by(solver: Solver) -> Iterator[None]:
    """Put a solver in the place of the embedded one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SOLVERS.named("embedded"), "make", lambda _study: solver)
        yield


def known(folder: Path, text: str, solver: Solver = Law(), until: str | None = None) -> Known:
    """Take a study through its stages, or up to one of them."""
    from stemcal.stages.fresh import make_all

    folder.mkdir(exist_ok=True)
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    study, place = load_study(folder / "study.yaml"), StudyFolder(folder / "out")
    with solved_by(solver):
        make_all(study, place, InlineExecutor(), until=until)
        return Known(study, place, fresh_results(study, place))
