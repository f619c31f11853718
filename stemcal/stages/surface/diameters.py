"""The design of the surface run at the other diameters of a joint fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from stemcal.errors import RunsFailed
from stemcal.files.rows import Rows
from stemcal.runs.outcome import outcome_of
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.design import Design
from stemcal.stages.result import (
    reasons_given,
)
from stemcal.stages.surface.result import AtDiameter, FitSummary, SurfaceResult
from stemcal.stages.surface.runs import DiameterRun, weighed
from stemcal.study.model import Study

AnswerAll = Callable[[Sequence[Request]], list[Answer]]


def run_diameters(
    study: Study, result: SurfaceResult, design: Design, solver: Solver, answer: AnswerAll
) -> list[AtDiameter]:
    """Run the design at every diameter of the joint fit and fit the surfaces there, of the same terms as `result`."""
    return [_at_diameter(study, target.diameter, result, design, solver, answer) for target in study.joint_targets]


def _at_diameter(
    study: Study, diameter: float, result: SurfaceResult, design: Design, solver: Solver, answer: AnswerAll
) -> AtDiameter:
    requests = design.requests(diameter)
    answers = answer(requests)
    runs = weighed(
        study,
        [
            DiameterRun(run=request.row + 1, outcome=outcome_of(request, given, solver))
            for request, given in zip(requests, answers, strict=True)
        ],
    )
    with reasons_given(requests, answers):
        told = {name: _summary(result, runs, name, diameter) for name in study.invert.responses}
    further: dict[str, FitSummary] = {name: fit for name, fit in told.items() if name != "force"}
    return AtDiameter(diameter=diameter, runs=Rows(runs), fit=told["force"], responses=further or None)


def _summary(result: SurfaceResult, runs: Sequence[DiameterRun], response: str, diameter: float) -> FitSummary:
    """Return what is kept of the fit to one response."""
    silent = [run.run for run in runs if run.outcome.ok and run.outcome.response(response) is None]
    if silent:
        raise RunsFailed(
            f"{diameter:g} mm: the record of run {silent[0]} tells no {response}: it was made by another version or "
            "solver; take another study folder (--out), or leave the response out of invert.responses"
        )
    fit = result.refitted(runs, response=response)
    return FitSummary(
        Rows(fit.coefficients),
        fit.r2,
        fit.adjusted_r2,
        fit.predicted_r2,
        fit.press,
        fit.cv_percent,
        fit.runs_failed,
    )
