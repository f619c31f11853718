"""The rules of the verdict: each looks at the evidence and yields reasons, whose kinds are declared here.

The given percentage is `targets.equivalent_within_percent`; what a reason weighs, its rule decides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from stemcal.folder.store import StudyFolder
from stemcal.stages.base import stages_of
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.physics import Doubt, Physics, physics_of
from stemcal.stages.verdict.result import Judged, Reason, Severity, Use, Verdict
from stemcal.study.model import Study

MAJORITY, SOME = 0.5, 0.1
MISSED_PERCENT = 2.0
_NEAR_RADIUS, _NEAR_END = 0.98, 0.01


@dataclass(frozen=True, kw_only=True)
class Unfinished(Reason):
    """Stages that the study asks for are not there: not calibrated."""

    stages: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class OutOfReach(Reason):
    """The surface takes the target nowhere, only values from low to high: not calibrated."""

    target: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Conflict(Reason):
    """In a joint fit no parameters bring the largest error within the given percentage: not calibrated."""

    least_error_percent: float


@dataclass(frozen=True, kw_only=True)
class TargetMissed(Reason):
    """The simulated response at the solution misses what it was fitted to.

    Not calibrated: by more than the given percentage (in a joint fit at half of the conditions or more). A
    reservation: by more than 2 %, or more than the refinement's tolerance.
    """

    worst: Judged


class OnTheEdge(Reason):
    """|x| of the solution is within 2 % of the radius, or a factor within 1 % of its range from an end: reservation."""


@dataclass(frozen=True, kw_only=True)
class Misfit(Reason):
    """The misfit is so many times what the scatter of the measured means explains, p < 0.05: a reservation."""

    times: float
    p: float


class ValidationFromTable(Reason):
    """The validation is read from a table, not simulated with these parameters: a reservation."""


@dataclass(frozen=True, kw_only=True)
class ValidationFailed(Reason):
    """Runs of the validation that would check the result have failed: a reservation."""

    conditions: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class CheckMissed(Reason, kind="validation"):
    """What was not fitted misses by more than the given percentage: a reservation."""

    worst: Judged


class Unchecked(Reason):
    """Nothing checks the result independently: a reservation."""


@dataclass(frozen=True, kw_only=True)
class DoubtfulPhysics(Reason, kind="physics"):
    """So many of the runs have doubtful physics, for one of the reasons.

    Not calibrated: more than half of the runs, for whatever reasons. A reservation: a tenth of them or more.
    """

    doubt: Doubt
    checked: int


@dataclass(frozen=True)
class Evidence:
    """What the rules look at."""

    study: Study
    results: Results
    physics: Physics

    @property
    def equivalent_percent(self) -> float:
        """The percentage within which measured and simulated values count as equal."""
        return float(self.study.targets.equivalent_within_percent)

    @property
    def judged(self) -> list[Judged]:
        """Measured against simulated at every condition that was simulated with the parameters found here.

        Beside the force that is every response that the study declares itself; one that was not fitted is a check.
        """
        validation = self.results.validation
        if validation is None or self.study.solver.kind == "table":
            return []
        found = []
        for row in validation.rows:
            at, fitted = row.compared, row.compared.role == "calibration"
            found.append(Judged(self.study.naming.response.name, at.condition, at.error_percent, fitted))
            for further in row.further:
                if further.judged:
                    own = fitted and further.response in self.study.invert.responses
                    found.append(Judged(further.response, at.condition, further.error_percent, own))
        return found


Rule = Callable[[Evidence], Iterator[Reason]]


def verdict_of(study: Study, folder: StudyFolder, results: Results | None = None) -> Verdict:
    """Judge a study as far as it has come; `results` if they are read already."""
    results = results or fresh_results(study, folder)
    evidence = Evidence(study, results, physics_of(results, folder))
    return Verdict.of([reason for rule in RULES for reason in rule(evidence)], _use(evidence))


# ---- where it may be used


def _use(evidence: Evidence) -> Use | None:
    """Return at which conditions the simulated response agrees, and what is off most; None where nothing tells."""
    rows = [row for row in evidence.judged if row.error_percent is not None]
    if not rows or evidence.physics.share > MAJORITY:
        return None
    off = [row for row in rows if row.size > evidence.equivalent_percent]
    apart = {row.condition for row in off}
    good = tuple(dict.fromkeys(row.condition for row in rows if row.condition not in apart))
    return Use(evidence.equivalent_percent, good, max(off, key=lambda row: row.size, default=None))


# ---- the rules


def _unfinished(evidence: Evidence) -> Iterator[Reason]:
    done = {result.name for result in evidence.results.done()}
    missing = [stage for stage in stages_of(evidence.study) if stage.name not in done]
    if missing and not list(_reach(evidence)):
        stages = tuple(stage.name for stage in missing)
        yield Unfinished(weight="not_calibrated", remedy=advice.ContinueStudy(), stages=stages)


def _reach(evidence: Evidence) -> Iterator[Reason]:
    surface, found, study = evidence.results.surface, evidence.results.inversion, evidence.study
    if surface is None:
        return
    if study.joint_targets:
        if (
            found is not None
            and found.joint is not None
            and found.joint.best_worst_error_percent > evidence.equivalent_percent
        ):
            yield _conflict(evidence)
        return
    target = study.calibration_target.response
    low, high = advice.reach(surface) if found is None else (target, target)
    if not low <= target <= high:
        remedy = advice.to_reach(study, surface, target)
        yield OutOfReach(weight="not_calibrated", remedy=remedy, target=target, low=low, high=high)


def _conflict(evidence: Evidence) -> Conflict:
    surface, found = evidence.results.surface, evidence.results.inversion
    assert surface is not None and found is not None and found.joint is not None
    place = found.joint.best_worst_solution
    coded = [(place[name] - scale.center) / scale.half_step for name, scale in surface.coding.items()]
    edge = advice.from_the_edge(evidence.study, surface, coded) if _on_edge(evidence, coded) else advice.FitFewer()
    return Conflict(weight="not_calibrated", remedy=edge, least_error_percent=found.joint.best_worst_error_percent)


def _target(evidence: Evidence) -> Iterator[Reason]:
    fitted = [row for row in evidence.judged if row.fitted and row.error_percent is not None]
    if not fitted:
        return
    worst = max(fitted, key=lambda row: row.size)
    refine = evidence.study.refine
    tolerance = MISSED_PERCENT if refine is None else max(refine.tolerance_percent, MISSED_PERCENT)
    if worst.size <= (evidence.equivalent_percent if evidence.study.joint_targets else tolerance):
        return
    far = [row for row in fitted if row.size > evidence.equivalent_percent]
    weight: Severity = "not_calibrated" if 2 * len(far) >= len(fitted) else "with_reservations"
    remedy = advice.AddRefinement() if refine is None else advice.RaiseBudget(2 * refine.budget)
    yield TargetMissed(weight=weight, remedy=remedy, worst=worst)


def _physics(evidence: Evidence) -> Iterator[Reason]:
    found = evidence.physics
    if found.share < SOME:
        return
    weight: Severity = "not_calibrated" if found.share > MAJORITY else "with_reservations"
    for doubt in found.doubts:
        remedy = advice.for_physics(evidence.study, doubt)
        yield DoubtfulPhysics(weight=weight, remedy=remedy, doubt=doubt, checked=found.checked)


def _edge(evidence: Evidence) -> Iterator[Reason]:
    surface = evidence.results.surface
    if surface is None or evidence.results.inversion is None:
        return
    place = evidence.results.parameters
    coded = surface.scales.to_coded([place[name] for name in surface.names]).tolist()
    if _on_edge(evidence, coded):
        remedy = advice.from_the_edge(evidence.study, surface, coded)
        yield OnTheEdge(weight="with_reservations", remedy=remedy)


def _on_edge(evidence: Evidence, coded: Sequence[float]) -> bool:
    surface = evidence.results.surface
    assert surface is not None
    radius = sum(value**2 for value in coded) ** 0.5
    region = advice.region_of(surface)
    ends = zip(coded, region.low.tolist(), region.high.tolist(), strict=True)
    at_end = any(min(value - a, b - value) <= _NEAR_END * (b - a) for value, a, b in ends)
    return at_end or radius >= _NEAR_RADIUS * surface.radius


def _misfit(evidence: Evidence) -> Iterator[Reason]:
    found = evidence.results.inversion
    joint = found.joint if found is not None else None
    if joint is None or joint.p is None or joint.misfit is None or joint.p >= 0.05:
        return
    times = joint.misfit / joint.df
    yield Misfit(weight="with_reservations", remedy=advice.FitFewer(), times=times, p=joint.p)


def _validation(evidence: Evidence) -> Iterator[Reason]:
    study = evidence.study
    if evidence.results.validation is None:
        return
    if study.solver.kind == "table":
        yield ValidationFromTable(weight="with_reservations", remedy=advice.SimulateValidation())
        return
    independent = [row for row in evidence.judged if not row.fitted]
    failed = tuple(row.condition for row in independent if row.error_percent is None)
    if failed:
        remedy = advice.RetryValidation()
        yield ValidationFailed(weight="with_reservations", remedy=remedy, conditions=failed)
    off = [row for row in independent if row.size > evidence.equivalent_percent]
    if off:
        worst = max(off, key=lambda row: row.size)
        left_out = worst.response not in (study.naming.response.name, *study.invert.responses)
        fit = advice.FitAll("responses" if left_out else "conditions")
        yield CheckMissed(weight="with_reservations", remedy=fit, worst=worst)
    if not independent and not _left_out(evidence):
        yield Unchecked(weight="with_reservations", remedy=advice.MeasureMore())


def _left_out(evidence: Evidence) -> bool:
    """Whether what is left out of a joint fit in turn is predicted within the percentage, and is a check at all."""
    if evidence.study.invert.ranges_chosen == "after":
        return False
    found = evidence.results.inversion
    error = found.joint.max_abs_left_out_error_percent if found is not None and found.joint is not None else None
    return error is not None and error <= evidence.equivalent_percent


RULES: tuple[Rule, ...] = (_reach, _target, _edge, _misfit, _validation, _physics, _unfinished)
