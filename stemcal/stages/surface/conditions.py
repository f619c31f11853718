"""The design of the surface run at the other diameters of a joint fit."""

from collections.abc import Sequence

from stemcal.errors import RunsFailed
from stemcal.files.rows import Rows
from stemcal.naming import FIRST
from stemcal.runs.answer import reasons_given
from stemcal.stages.design import Design
from stemcal.stages.surface.result import AtCondition, FitSummary, SurfaceResult
from stemcal.stages.surface.runs import ConditionRun, weighed
from stemcal.stages.work import Work
from stemcal.study.model import Study


def run_conditions(work: Work, result: SurfaceResult, design: Design) -> list[AtCondition]:
    """Run the design at every diameter of the joint fit and fit the surfaces there, of the same terms as `result`."""
    return [_at_condition(work, target.condition, result, design) for target in work.study.joint_targets]


def _at_condition(work: Work, condition: float, result: SurfaceResult, design: Design) -> AtCondition:
    requests = design.requests(condition)
    answers = work.answers(requests)
    outcomes = zip(requests, work.outcomes(requests, answers), strict=True)
    told_of = [ConditionRun(run=request.row + 1, outcome=outcome) for request, outcome in outcomes]
    runs, fine = weighed(work.study, told_of), fine_runs(work, design, condition)
    with reasons_given(requests, answers):
        fits = {name: _summary(work.study, result, runs, name, condition, fine) for name in work.study.invert.responses}
    further: dict[str, FitSummary] = {name: fit for name, fit in fits.items() if name != FIRST}
    return AtCondition(
        condition=condition, runs=Rows(runs), fine_runs=Rows(fine), fit=fits[FIRST], responses=further or None
    )


def fine_runs(work: Work, design: Design, condition: float) -> list[ConditionRun]:
    """Return what came of the runs of a coarse design that are made with the study's own elements too."""
    requests = design.fine_requests(condition)
    return [
        ConditionRun(run=request.row + 1, outcome=outcome)
        for request, outcome in zip(requests, work.outcomes(requests) if requests else [], strict=True)
    ]


def _summary(
    study: Study,
    result: SurfaceResult,
    runs: Sequence[ConditionRun],
    response: str,
    condition: float,
    fine: Sequence[ConditionRun],
) -> FitSummary:
    """Return what is kept of the fit to one response."""
    silent = [run.run for run in runs if run.outcome.ok and run.outcome.of(response) is None]
    if silent:
        place = f"{study.naming.place(condition)}: ".removeprefix(": ")
        name = study.naming.named(response).name
        raise RunsFailed(
            f"{place}the record of run {silent[0]} tells no {name}: it was made by another version or "
            "solver; take another study folder (--out), or leave the response out of invert.responses"
        )
    return FitSummary.of(result.refitted(runs, response=response, fine=fine), whole=not study.naming.is_cutting)
