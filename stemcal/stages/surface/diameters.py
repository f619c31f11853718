"""The design of the surface run at the other diameters of a joint fit."""

from __future__ import annotations

from collections.abc import Sequence

from stemcal.errors import RunsFailed
from stemcal.files.rows import Rows
from stemcal.stages.design import Design
from stemcal.stages.result import reasons_given
from stemcal.stages.surface.result import AtDiameter, FitSummary, SurfaceResult
from stemcal.stages.surface.runs import DiameterRun, weighed
from stemcal.stages.work import Work
from stemcal.study.model import Study


def run_diameters(work: Work, result: SurfaceResult, design: Design) -> list[AtDiameter]:
    """Run the design at every diameter of the joint fit and fit the surfaces there, of the same terms as `result`."""
    return [_at_diameter(work, target.diameter, result, design) for target in work.study.joint_targets]


def _at_diameter(work: Work, diameter: float, result: SurfaceResult, design: Design) -> AtDiameter:
    requests = design.requests(diameter)
    answers = work.answers(requests)
    outcomes = zip(requests, work.outcomes(requests, answers), strict=True)
    told_of = [DiameterRun(run=request.row + 1, outcome=outcome) for request, outcome in outcomes]
    runs = weighed(work.study, told_of)
    with reasons_given(requests, answers):
        told = {name: _summary(work.study, result, runs, name, diameter) for name in work.study.invert.responses}
    further: dict[str, FitSummary] = {name: fit for name, fit in told.items() if name != "force"}
    return AtDiameter(diameter=diameter, runs=Rows(runs), fit=told["force"], responses=further or None)


def _summary(
    study: Study, result: SurfaceResult, runs: Sequence[DiameterRun], response: str, diameter: float
) -> FitSummary:
    """Return what is kept of the fit to one response."""
    silent = [run.run for run in runs if run.outcome.ok and run.outcome.response(response) is None]
    if silent:
        place = f"{study.naming.place(diameter)}: ".removeprefix(": ")
        name = study.naming.named(response).name
        raise RunsFailed(
            f"{place}the record of run {silent[0]} tells no {name}: it was made by another version or "
            "solver; take another study folder (--out), or leave the response out of invert.responses"
        )
    return FitSummary.of(result.refitted(runs, response=response), whole=not study.naming.is_cutting)
