"""The refinement as a stage: the closed loop run, and what it comes to."""

from stemcal.errors import RunsFailed
from stemcal.files.rows import Rows
from stemcal.naming import FIRST
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.loop import Loop
from stemcal.stages.refine.result import Iteration, Learnt, LearntOf, RefineResult
from stemcal.stages.result import Head
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage

__all__ = ["RefineResult", "refine"]


@a_stage(RefineResult)
def refine(work: Work, head: Head) -> RefineResult:
    """Simulate at the solution and correct it until the response is right, at every condition of a joint fit."""
    surface, solution = work.result(SurfaceResult), work.result(InvertResult)
    simulate = work.simulating("refine", pictured=True)
    loop = Loop(work.study, surface, solution, simulate)
    loop.run()
    return closed(head, loop)


def closed(head: Head, loop: Loop) -> RefineResult:
    """Return what a loop that has run comes to."""
    done = [entry for entry in loop.iterations if entry.misfit is not None]
    if not done:
        raise RunsFailed(_nothing_succeeded(loop))
    within = loop.stopped == "tolerance" and not loop.alone
    best = done[-1] if within else min(done, key=lambda entry: _merit(loop, entry))
    at = {d: row for d, row in zip(loop.conditions * len(loop.iterations), loop.rows, strict=True)
          if row.iteration == best.iteration}  # fmt: skip
    ours = at.get(loop.solution.condition)
    learnt = [Learnt(Rows(surface.coefficients), surface.r2) for surface in loop.surfaces]
    many = not loop.alone
    return RefineResult(
        head=head,
        target=loop.solution.target,
        condition=loop.solution.condition,
        at_conditions=tuple(loop.conditions) if many else (),
        tolerance_percent=loop.options.tolerance_percent,
        budget=loop.options.budget,
        converged=(best.max_abs_error_percent or 0.0) <= loop.options.tolerance_percent,
        stopped=loop.stopped if many else None,
        iteration=best.iteration,
        solution={name: best.levels[name] for name in loop.coding.names},
        coded=best.coded,
        coded_radius=best.coded_radius,
        simulated=ours.outcome.response if ours is not None else None,
        error_percent=best.error_percent or 0.0,
        max_abs_error_percent=best.max_abs_error_percent if many else None,
        parameters=best.levels,
        iterations=Rows(loop.iterations) if many else Rows(),
        rows=Rows(loop.rows),
        surface=None if many else learnt[0],
        surfaces=Rows(_learnt_of(loop, i, learnt[i]) for i in range(len(learnt))) if many else Rows(),
    )


def _merit(loop: Loop, entry: Iteration) -> float:
    """Return what the best iteration has least of: the error of one force, the misfit of many means."""
    return abs(entry.error_percent or 0.0) if loop.alone else entry.misfit or 0.0


def _learnt_of(loop: Loop, i: int, learnt: Learnt) -> LearntOf:
    mean, variance = loop.means[i], float(loop.misfit.whole_variance[i])
    return LearntOf(condition=mean.condition, response=mean.named.name, variance=variance, learnt=learnt)


def _nothing_succeeded(loop: Loop) -> str:
    failed = [row.outcome.reason for row in loop.rows if row.outcome.response is None]
    if loop.alone:
        return f"refine: none of {len(loop.rows)} runs succeeded ({failed[-1]}); see the log for each reason"
    further = dict.fromkeys(mean.named.name for mean in loop.means if mean.response != FIRST)
    reason = failed[0] if failed else f"the records hold no {' or '.join(further)}"
    return f"refine: in none of {len(loop.iterations)} iterations did every run succeed ({reason})"
