"""The transfer as a stage: the calibrated point run by another program, corrected there, and run at every condition."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf

from stemcal.doe.calibration.transfer import Mover, Step, Tried, Way, best_of, ends_of, learnt_of, next_step
from stemcal.doe.validation.comparison import error_percent
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.folder.study_folder import StudyFolder
from stemcal.naming import FIRST
from stemcal.notes import Note
from stemcal.runs.outcome import Outcome
from stemcal.solvers.protocol import Belonging, Solver
from stemcal.stages.result import Head, Interval
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.transfer.result import (
    AdjustedFactor,
    BeyondRange,
    FailedThere,
    NotReached,
    NotRunThere,
    Role,
    StillRose,
    Stopped,
    TargetSolver,
    TransferResult,
    TransferRow,
    TransferRun,
)
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.work import SimulateAt, Work, a_stage
from stemcal.study.model import EmbeddedSolver, OwnRange, Study, Target, TransferOptions, program_of
from stemcal.study.types.units import from_internal
from stemcal.version import __version__
from stemcal.words import listed

__all__ = ["TransferResult", "transfer"]

# The parameter that belongs to mesh and lengths: how far it may go where these are others.
_OF_MESH, _LOWEST_SHARE, _HIGHEST = "failure_strain", 0.1, 1.0


def _is_asked(_stage: str, study: Study, _solver: Solver) -> None:
    if study.transfer is None:
        raise UsageError("transfer: the spec has no section transfer; `stemcal explain transfer` tells what it is")


@a_stage(TransferResult, _is_asked)
def transfer(work: Work, head: Head) -> TransferResult:
    """Run the calibrated point in the program or on the mesh that the parameters are for, and correct it there."""
    study = work.study
    assert study.transfer is not None
    surface, calibrated = work.result(SurfaceResult), work.result(ValidateResult)
    at_target = work.seeing("transfer")
    there, solver = at_target.study, at_target.solver
    way = way_of(study, study.transfer, surface, calibrated.parameters, _belong_alike(work.solver, solver, study))
    search = Search(study, study.transfer, way, calibrated, at_target.simulating("transfer"), max(1, there.replicates))
    search.run()
    if search.stopped == "tolerance":
        search.look_elsewhere()
    found = search.found
    rows = list(search.rows())
    errors = [abs(row.error_percent) for row in rows if row.error_percent is not None]
    return TransferResult(
        head=head,
        solver=_told_of(there, solver, study.targets.calibrate_at, _version_said(work.folder, search.asked)),
        condition=search.target.condition,
        aim=search.aim,
        tolerance_percent=search.options.tolerance_percent,
        budget=search.options.budget,
        converged=search.stopped == "tolerance",
        stopped=search.stopped,
        parameters=search.levels(found.place),
        adjusted=Rows(_adjusted(study, search, calibrated.parameters)),
        rows=Rows(rows),
        max_abs_error_percent=max(errors, default=None),
        learnt=learnt_of(search.tried, search.expected),
        asked=Rows(search.asked),
        notes=tuple(_notes(study, search)),
    )


# ---- what may move


def way_of(
    study: Study, options: TransferOptions, surface: SurfaceResult, start: Mapping[str, float], alike: bool
) -> Way:
    """Return the way along the factors that may move, from the calibrated point.

    `alike` tells that mesh and lengths are the study's own, so that the failure strain keeps its range.

    Raises
    ------
    UsageError
        If the surface has not all of them.
    """
    unknown = [name for name in options.adjust if name not in surface.names]
    if unknown:
        has = f"the surface has {listed(surface.names)}"
        raise UsageError(f"transfer.adjust: the surface does not tell the effect of {', '.join(unknown)}; {has}")
    point = surface.scales.to_coded([start[name] for name in surface.names])
    relative = surface.fitted.gradient(point) / float(surface.fitted.predict(point)[0])
    slopes = dict(zip(surface.names, relative.tolist(), strict=True))
    names = tuple(options.adjust) or _default(slopes)
    slopes = {name: slope / surface.coding[name].half_step for name, slope in slopes.items()}
    return Way(tuple(Mover(name, start[name], *_range(study, options, name, alike), slopes[name]) for name in names))


def _default(slopes: Mapping[str, float]) -> tuple[str, ...]:
    """Return the failure strain, which belongs to the mesh, or else the strongest factor."""
    return (_OF_MESH if _OF_MESH in slopes else max(slopes, key=lambda name: abs(slopes[name])),)


def _range(study: Study, options: TransferOptions, name: str, alike: bool) -> Interval:
    factor, own = study.factor(name), options.adjust.get(name)
    low, high = factor.low, factor.high
    if name == _OF_MESH and not alike:
        low, high = _LOWEST_SHARE * low, max(high, from_internal(_HIGHEST, factor.unit))
    given = (None, None) if own is None else (own.low, own.high)
    return low if given[0] is None else given[0], high if given[1] is None else given[1]


def _belong_alike(here: Solver, there: Solver, study: Study) -> bool:
    """Whether mesh and lengths there are known to be the study's own."""
    at = study.targets.calibrate_at
    if not isinstance(here, Belonging) or not isinstance(there, Belonging):
        return False
    return here.belongings(at) == there.belongings(at)


def _told_of(there: Study, solver: Solver, condition: float, said: str) -> TargetSolver:
    """Return what answers there; its version as the spec names it, or else as the program `said` of itself."""
    version = __version__ if isinstance(there.solver, EmbeddedSolver) else getattr(there.solver, "version", "") or said
    belongs = solver.belongings(condition) if isinstance(solver, Belonging) else None
    return TargetSolver(program_of(there.solver), version or None, belongs)


def _version_said(folder: StudyFolder, asked: Sequence[TransferRun]) -> str:
    """Return what the program said of its version in the first run that it said it in."""
    records = (folder.peek(run.outcome.key) for run in asked)
    return next((str(v) for r in records if r and (v := r["details"].get("program_version"))), "")


# ---- the search


@dataclass(eq=False)
class Search:
    """All that was run there so far; `run` comes to the aim, `look_elsewhere` spends what is left of the budget."""

    study: Study
    options: TransferOptions
    way: Way
    calibrated: ValidateResult
    simulate: SimulateAt
    each: int
    tried: list[Tried] = field(default_factory=list)
    asked: list[TransferRun] = field(default_factory=list)
    stopped: Stopped = "budget"

    def __post_init__(self) -> None:
        self.target: Target = self.study.calibration_target
        self.here = {row.condition: row.simulated for row in self.calibrated.compared}
        own = self.here.get(self.target.condition)
        self.expected = own or self.target.response
        # a joint fit is a compromise over the conditions, which stays as it is
        self.aim = self.expected if self.study.joint_targets else self.target.response

    def levels(self, place: float) -> dict[str, float]:
        """Return the level of every factor at a place."""
        return {**self.calibrated.parameters, **(self.way.at(place) if place else {})}

    @property
    def left(self) -> int:
        """How many points the budget still allows at one condition."""
        return (self.options.budget - len(self.asked) * self.each) // self.each

    @property
    def found(self) -> Tried:
        """The best run of the search."""
        best = best_of(self.tried, self.aim)
        if best is None:
            failed = self.asked[-1].outcome
            raise RunsFailed(f"transfer: none of {len(self.asked)} runs succeeded ({failed.reason}): {failed.message}")
        return best

    def run(self) -> None:
        """Go on until the response is right, the budget spent, or nothing left to be tried."""
        step: Step | None = Step(0.0, self.expected)
        while step is not None:
            outcome = self._ask("search", step.place, [self.target.condition], step.expected)[0]
            self.tried.append(Tried(step.place, outcome.number(FIRST)))
            if abs(self.tried[-1].response / self.aim - 1.0) <= self.options.tolerance_percent / 100.0:
                self.stopped = "tolerance"
                return
            if self.left < 1:
                return
            step = next_step(self.tried, self.aim, self.way)
        self.stopped = "out_of_reach" if self.found.place in self.way.ends else "settled"

    def look_elsewhere(self) -> None:
        """Run the result at the other conditions, the nearest first, then what was calibrated, while runs are left."""
        if self.options.conditions != "all":
            return
        at = self.target.condition
        others = sorted((c for c in self.here if c != at), key=lambda condition: abs(condition - at))
        self._ask("after", self.found.place, others[: self.left])
        if self.found.place != 0.0:
            self._ask("before", 0.0, others[: self.left])

    def _ask(
        self, role: Role, place: float, conditions: Sequence[float], expected: float | None = None
    ) -> list[Outcome]:
        levels = self.levels(place)
        outcomes = self.simulate(len(self.asked), [levels], conditions) if conditions else []
        for condition, outcome in zip(conditions, outcomes, strict=True):
            self.asked.append(
                TransferRun(
                    run=len(self.asked) + 1,
                    role=role,
                    condition=condition,
                    levels=levels,
                    predicted=expected,
                    outcome=outcome,
                )
            )
        return outcomes

    # ---- what came of it

    def rows(self) -> Iterator[TransferRow]:
        """Yield what was measured and simulated, here and there, at each condition."""
        before, after = self._responses(self.levels(0.0)), self._responses(self.levels(self.found.place))
        for row in self.calibrated.compared:
            at = row.condition
            if self.options.conditions == "all" or at == self.target.condition:
                there = after.get(at)
                error = error_percent(row.measured, there)
                yield TransferRow(at, row.measured, row.simulated, before.get(at), there, error, row.role)

    def _responses(self, levels: Mapping[str, float]) -> dict[float, float | None]:
        """Return the response there at each condition that was run with these levels."""
        return {run.condition: run.outcome.response for run in self.asked if run.levels == levels}


def _adjusted(study: Study, search: Search, calibrated: Mapping[str, float]) -> Iterator[AdjustedFactor]:
    values, target = search.levels(search.found.place), search.target
    known = ends_of(search.tried, search.found, search.way, *scatter) if (scatter := _scatter(target)) else {}
    for mover in search.way.movers:
        name, factor = mover.name, study.factor(mover.name)
        beyond = not factor.low <= values[name] <= factor.high
        yield AdjustedFactor(name, calibrated[name], values[name], known.get(name), mover.low, mover.high, beyond)


def _scatter(target: Target) -> tuple[float, float] | None:
    """Return the relative standard error of the measured mean and its degrees of freedom; None where it is exact."""
    if not target.sd or target.n == 1:
        return None
    n = target.n
    relative = target.sd / target.response
    return (relative, inf) if n is None else (relative / n**0.5, n - 1.0)


def _notes(study: Study, search: Search) -> Iterator[Note]:
    """Find what the numbers do not say by themselves."""
    found, names = search.found, tuple(mover.name for mover in search.way.movers)
    if search.stopped != "tolerance":
        missed = 100.0 * abs(found.response / search.aim - 1.0)
        yield NotReached(search.stopped, missed, search.aim, names)
    values = search.levels(found.place)
    for name in names:
        factor = study.factor(name)
        if not factor.low <= values[name] <= factor.high:
            allowed = search.options.adjust.get(name, OwnRange()) != OwnRange()
            yield BeyondRange(name, values[name], factor.low, factor.high, allowed)
    if censored := sum(run.outcome.censored for run in search.asked):
        yield StillRose(censored)
    after = {run.condition: run.outcome for run in search.asked if run.levels == values}
    rows = [row.condition for row in search.rows()]
    if left := tuple(condition for condition in rows if condition not in after):
        yield NotRunThere(left, search.stopped == "tolerance")
    if failed := tuple(condition for condition in rows if condition in after and not after[condition].ok):
        yield FailedThere(failed, after[failed[0]].reason)
