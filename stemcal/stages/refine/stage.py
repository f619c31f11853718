"""The refinement as a stage: the closed loop run, and what it comes to."""

from __future__ import annotations

from collections.abc import Sequence

from stemcal.errors import RunsFailed
from stemcal.files.rows import Rows
from stemcal.remarks import Remark, Weight
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.loop import Loop
from stemcal.stages.refine.process import ProcessLoop, takes_process
from stemcal.stages.refine.result import Iteration, Learnt, LearntOf, RefineResult
from stemcal.stages.result import Head
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage

__all__ = ["RefineResult", "refine"]

_OUTSIDE = Remark(
    Weight.USE,
    "At the surface's solution the simulated {response}, {simulated}, lies outside the prediction interval: the "
    "surface misses more there than its residuals show.",
)
_JOINT_OUTSIDE = Remark(
    Weight.USE,
    "At the joint solution of the surfaces the simulated {response} lies outside the prediction interval{places}: the "
    "surfaces miss more there than their residuals show.",
)
_STILL = Remark(
    Weight.USE,
    "After {runs} runs the simulated {response} is still {error:.2f} % from the target; the best point is kept. Raise "
    "refine.budget{finer}: the {response} may jump between points.",
)
_FOUND = Remark(Weight.ASIDE, "The point is the one found by simulation, no longer the one the rule of `invert` names.")
_ENDS = {
    "tolerance": Remark(Weight.ASIDE, "After {runs} runs {error}, within the tolerance."),
    "budget": Remark(Weight.USE, "After {runs} runs {error}; refine.budget has no further run{every}."),
    "settled": Remark(
        Weight.USE,
        "After {runs} runs the joint fit no longer moves: {error}, and no parameters near by do better. What remains "
        "is the model's, or the measured scatter's, not the surfaces'.",
    ),
}


@a_stage
def refine(work: Work) -> RefineResult:
    """Simulate at the solution and correct it until the response is right, at every condition of a joint fit."""
    simulate = work.simulating("refine", pictured=True)
    surface, solution = work.fresh(SurfaceResult), work.fresh(InvertResult)
    head = work.head("refine")
    loop = (ProcessLoop if takes_process(work.study, surface) else Loop)(work.study, surface, solution, simulate)
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
        process=loop.learnt() if isinstance(loop, ProcessLoop) else None,
        surfaces=Rows(_learnt_of(loop, i, learnt[i]) for i in range(len(learnt))) if many else Rows(),
        notes=tuple(_notes_of_many(loop, best) if many else _notes_of_one(loop, best)),
    )


def _merit(loop: Loop, entry: Iteration) -> float:
    """Return what the best iteration has least of: the error of one force, the misfit of many means."""
    return abs(entry.error_percent or 0.0) if loop.alone else entry.misfit or 0.0


def _learnt_of(loop: Loop, i: int, learnt: Learnt) -> LearntOf:
    mean, variance = loop.means[i], float(loop.misfit.variance[i])
    return LearntOf(condition=mean.condition, response=mean.named.name, variance=variance, learnt=learnt)


def _nothing_succeeded(loop: Loop) -> str:
    failed = [row.outcome.reason for row in loop.rows if row.outcome.response is None]
    if loop.alone:
        return f"refine: none of {len(loop.rows)} runs succeeded ({failed[-1]}); see the log for each reason"
    naming = loop.study.naming
    reason = failed[0] if failed else f"the records tell no {' or '.join(named.noun for named in naming.further)}"
    at_every = "" if naming.condition is None else f" at every {naming.condition_noun}"
    return f"refine: no iteration of {len(loop.iterations)} succeeded{at_every} ({reason})"


def _notes_of_one(loop: Loop, best: Iteration) -> list[str]:
    first, error = loop.rows[0], abs(best.error_percent or 0.0)
    notes = [loop.learnt().sentence] if isinstance(loop, ProcessLoop) else []
    response, simulated = loop.study.naming.response, first.outcome.response
    if first.inside_interval is False and simulated is not None:
        notes.append(_OUTSIDE(response=response.noun, simulated=response.text(simulated, ".4g")))
    if error > loop.options.tolerance_percent:
        notes.append(_STILL(runs=len(loop.rows), response=response.noun, error=error, finer=_finer(loop)))
    if best.iteration > 1:
        notes.append(_FOUND())
    return notes


def _finer(loop: Loop) -> str:
    """Advise a finer mesh where the solver has one."""
    return ", or refine the mesh" if loop.study.naming.is_cutting else ", or compute more finely"


def _notes_of_many(loop: Loop, best: Iteration) -> Sequence[str]:
    naming = loop.study.naming
    first = [row for row in loop.rows if row.iteration == 1 and row.inside_interval is False]
    notes = []
    if first:
        places = naming.places(", ".join(f"{row.condition:g}" for row in first))
        notes.append(_JOINT_OUTSIDE(response=naming.response.noun, places=places))
    every = "" if naming.condition is None else f" for every {naming.condition_noun}"
    error = f"the largest error of the simulated {naming.response.noun} is {best.max_abs_error_percent:.2f} %"
    return [*notes, _ENDS[loop.stopped](runs=len(loop.rows), error=error, every=every)]
