"""The rules of the verdict: each looks at the evidence and yields reasons, whose kinds are declared here.

The given percentage is `targets.equivalent_within_percent`; what a reason weighs, its rule decides.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from stemcal.doe.regression.surface import ROUGH_PERCENT
from stemcal.folder.study_folder import StudyFolder
from stemcal.stages.base import stages_of
from stemcal.stages.invert.result import Contradicted, InvertResult, JointFitted
from stemcal.stages.result import AimsAt
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.surface.runs import EqualRepeats
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.physics import LIMITS, Doubt, DoubtAt, DoubtKind, Physics, physics_of
from stemcal.stages.verdict.result import Judged, Reason, Remedy, Severity, Use, UseThere, Verdict
from stemcal.study.model import Study

MAJORITY, SOME = 0.5, 0.1
MISSED_PERCENT = 2.0
FAR = 2.0
"""Times its limit from which a doubt of the one calibrated run decides: below, it may be that run's own chance."""
_NEAR_RADIUS, _NEAR_END = 0.98, 0.01
_BEYOND_DOUBT = 0.001  # p of a contradiction that no parameters may be told from


class Unfinished(Reason):
    """Stages that the study asks for are not there: not calibrated; a reservation where it is the transfer alone."""

    stages: tuple[str, ...]


class OutOfReach(Reason):
    """The surface takes the target nowhere, only values from low to high: not calibrated."""

    target: float
    low: float
    high: float


class Conflict(Reason):
    """In a joint fit no parameters bring the largest error within the given percentage: not calibrated.

    Or a measured mean contradicts the others, where no degree of freedom is left for a test of the misfit: not
    calibrated beyond p = 0.001, else a reservation.
    """

    least_error_percent: float
    contradiction: Contradicted | None = None


class TargetMissed(Reason):
    """The simulated response at the solution misses what it was fitted to.

    Not calibrated: by more than the given percentage (in a joint fit at half of the conditions or more). A
    reservation: by more than 2 %, or more than the refinement's tolerance.
    """

    worst: Judged


class OnTheEdge(Reason):
    """|x| of the solution is within 2 % of the radius, or a factor within 1 % of its range from an end: reservation.

    A range is to be widened only where the data ask for it: the point nearest to the centre of a flat valley, or one
    that scatter has put on the edge, asks for measurements that tell the parameters apart.
    """


class Misfit(Reason):
    """The misfit is so many times what the scatter of the measured means explains, p < 0.05: a reservation.

    Where priors are fitted too and p < 0.001, measurements and priors contradict each other: not calibrated.
    """

    times: float
    p: float


class ValidationFromTable(Reason):
    """The validation is read from a table, not simulated with these parameters: a reservation."""


class ValidationFailed(Reason):
    """Runs of the validation that would check the result have failed: a reservation."""

    conditions: tuple[float, ...]


class CheckMissed(Reason, kind="validation"):
    """What was not fitted misses by more than the given percentage: a reservation."""

    worst: Judged


class Unchecked(Reason):
    """Nothing checks the result independently: a reservation."""


class DoubtfulPhysics(Reason, kind="physics"):
    """So many of the runs have doubtful physics, for one of the reasons.

    Not calibrated: more than half of the runs, for whatever reasons. A reservation: a tenth of them or more.
    """

    doubt: Doubt
    checked: int


class SolutionDoubtful(Reason, kind="physics_of_solution"):
    """The run with the calibrated parameters at a condition has doubtful physics.

    Not calibrated: where the parameters were fitted, and the doubt is twice its limit or a force that still rose. Else
    a reservation.
    """

    at: DoubtAt


class NotIdentified(Reason):
    """What was fitted does not fix these factors each by itself: a reservation.

    Their intervals hold most of their ranges, or they move along `changes` (in the factors' `units`), which change
    nothing that was fitted.
    """

    factors: tuple[str, ...]
    changes: dict[str, float]
    units: dict[str, str]


class SignAgainstExpectation(Reason):
    """Significant effects have the other sign than the study expects of its mechanics: a reservation."""

    factors: tuple[str, ...]


class RoughResponse(Reason):
    """Equal inputs give equal answers, yet the surface misses its runs by so much, percent of the mean: reservation."""

    cv_percent: float


class TransferMissed(Reason):
    """In the program that the parameters are for the response is so far from its aim, percent: a reservation.

    The aim is the measured response, or after a joint fit what the study's own solver gives.
    """

    solver: str
    missed_percent: float
    aims_at: AimsAt = "measured"


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
    return Verdict.of([reason for rule in RULES for reason in rule(evidence)], _use(evidence), _use_there(evidence))


# ---- where it may be used


def _use(evidence: Evidence) -> Use | None:
    """Return at which conditions the simulated response agrees, and what is off most; None where nothing tells."""
    rows = [row for row in evidence.judged if row.error_percent is not None]
    return _use_of(evidence, rows) if rows and evidence.physics.share <= MAJORITY else None


def _use_there(evidence: Evidence) -> UseThere | None:
    """Return where the result of a transfer agrees."""
    found = evidence.results.transfer
    if found is None:
        return None
    name = evidence.study.naming.response.name
    rows = [
        Judged(name, row.condition, row.error_percent, row.role == "calibration")
        for row in found.rows
        if row.error_percent is not None
    ]
    return UseThere(found.solver.kind, _use_of(evidence, rows)) if rows else None


def _use_of(evidence: Evidence, rows: Sequence[Judged]) -> Use:
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
        remedy = advice.EnterResults() if evidence.study.solver.kind == "manual" else advice.ContinueStudy()
        weight: Severity = "with_reservations" if stages == ("transfer",) else "not_calibrated"
        yield Unfinished(weight=weight, remedy=remedy, stages=stages)


def _reach(evidence: Evidence) -> Iterator[Reason]:
    surface, found, study = evidence.results.surface, evidence.results.inversion, evidence.study
    if surface is None:
        return
    if study.joint_targets:
        yield from _conflict(evidence)
        return
    target = study.calibration_target.response
    low, high = advice.reach(surface, study) if found is None else (target, target)
    if not low <= target <= high:
        remedy = advice.to_reach(study, surface, target)
        yield OutOfReach(weight="not_calibrated", remedy=remedy, target=target, low=low, high=high)


def _conflict(evidence: Evidence) -> Iterator[Reason]:
    found = evidence.results.inversion
    joint = found.joint if found is not None else None
    if joint is None:
        return
    apart = joint.contradiction
    if joint.best_worst_error_percent <= evidence.equivalent_percent and apart is None:
        return
    beyond = joint.best_worst_error_percent > evidence.equivalent_percent or (
        apart is not None and apart.p < _BEYOND_DOUBT
    )
    yield Conflict(
        weight="not_calibrated" if beyond else "with_reservations",
        remedy=_of_conflict(evidence, joint),
        least_error_percent=joint.best_worst_error_percent,
        contradiction=apart,
    )


def _of_conflict(evidence: Evidence, joint: JointFitted) -> Remedy:
    """Widen a range where a mean is out of reach by itself; where each is reached, no range mends it."""
    surface, place = evidence.results.surface, joint.best_worst_solution
    assert surface is not None
    coded = [(place[name] - scale.center) / scale.half_step for name, scale in surface.coding.items()]
    if joint.out_of_reach and joint.contradiction is None and _on_edge(evidence, coded):
        return advice.from_the_edge(evidence.study, surface, coded)
    return _fit_fewer(joint)


def _fit_fewer(joint: JointFitted) -> Remedy:
    conditions = {row.condition for row in (*joint.rows, *joint.further)}
    return advice.FitFewer("conditions" if len(conditions) > 1 else "responses")


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
    remedy: Remedy = advice.AddRefinement() if refine is None else advice.RaiseBudget(2 * refine.budget)
    if evidence.study.joint_targets:  # no further run reconciles what contradicts itself
        remedy = next((conflict.remedy for conflict in _conflict(evidence)), remedy)
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
    joint = evidence.results.inversion.joint
    if joint is not None and any(_conflict(evidence)):
        return  # the conflict says what to do, at a place of its own
    place = evidence.results.parameters
    coded = surface.scales.to_coded([place[name] for name in surface.names]).tolist()
    if _on_edge(evidence, coded):
        remedy = _from_the_edge(evidence, coded)
        yield OnTheEdge(weight="with_reservations", remedy=remedy)


def _from_the_edge(evidence: Evidence, coded: Sequence[float]) -> Remedy:
    """Widen a range, unless a joint fit lies there by the scatter of its data or in a flat valley."""
    surface, found = evidence.results.surface, evidence.results.inversion
    assert surface is not None and found is not None
    joint, known = found.joint, found.certainty
    if joint is None or known is None or (joint.separated and joint.presses_outwards):
        return advice.from_the_edge(evidence.study, surface, coded)
    return advice.to_identify(evidence.study, known)


def _on_edge(evidence: Evidence, coded: Sequence[float]) -> bool:
    surface = evidence.results.surface
    assert surface is not None
    radius = sum(value**2 for value in coded) ** 0.5
    region = surface.region(evidence.study)
    ends = zip(coded, region.low.tolist(), region.high.tolist(), strict=True)
    at_end = any(min(value - a, b - value) <= _NEAR_END * (b - a) for value, a, b in ends)
    return at_end or radius >= _NEAR_RADIUS * surface.radius


def _misfit(evidence: Evidence) -> Iterator[Reason]:
    found = evidence.results.inversion
    joint = found.joint if found is not None else None
    if found is None or joint is None or joint.p is None or joint.misfit is None or joint.p >= 0.05:
        return
    beyond = bool(found.priors) and joint.p < _BEYOND_DOUBT
    yield Misfit(
        weight="not_calibrated" if beyond else "with_reservations",
        remedy=_check_prior(found) or _fit_fewer(joint),
        times=joint.misfit / joint.df,
        p=joint.p,
    )


def _check_prior(found: InvertResult) -> Remedy | None:
    """Return the remedy for the prior that is farthest from the solution, in its standard deviations."""
    solution = found.point.solution
    worst = max(found.priors, key=lambda prior: abs(solution[prior.factor] - prior.mean) / prior.sd, default=None)
    return None if worst is None else advice.CheckPrior(worst.factor, worst.source)


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
        yield Unchecked(weight="with_reservations", remedy=advice.MeasureMore(len(study.joint_targets)))


def _left_out(evidence: Evidence) -> bool:
    """Whether what is left out of a joint fit in turn is predicted within the percentage."""
    found = evidence.results.inversion
    error = found.joint.max_abs_left_out_error_percent if found is not None and found.joint is not None else None
    return error is not None and error <= evidence.equivalent_percent


def _solution_physics(evidence: Evidence) -> Iterator[Reason]:
    if evidence.physics.share > MAJORITY:
        return  # said of all runs
    worst: dict[DoubtKind, DoubtAt] = {}
    for at in evidence.physics.at_solution:
        before = worst.get(at.doubt.kind)
        if before is None or (at.fitted, at.doubt.worst or 0.0) > (before.fitted, before.doubt.worst or 0.0):
            worst[at.doubt.kind] = at
    for kind, at in worst.items():
        far = at.doubt.worst is None or at.doubt.worst > FAR * LIMITS[kind]
        weight: Severity = "not_calibrated" if at.fitted and far else "with_reservations"
        yield SolutionDoubtful(weight=weight, remedy=advice.for_physics(evidence.study, at.doubt), at=at)


def _identified(evidence: Evidence) -> Iterator[Reason]:
    found = evidence.results.inversion
    known = None if found is None else found.certainty
    if known is None or not known.not_identified:
        return
    remedy = advice.to_identify(evidence.study, known)
    yield NotIdentified(
        weight="with_reservations",
        remedy=remedy,
        factors=known.not_identified,
        changes=known.loosest,
        units=known.units,
    )


def _signs(evidence: Evidence) -> Iterator[Reason]:
    against = tuple(
        factor.name
        for factor in evidence.study.factors
        if factor.expected_sign and _sign_found(evidence, factor.name) == {"+": "-", "-": "+"}[factor.expected_sign]
    )
    if against:
        remedy = advice.CheckModel(against)
        yield SignAgainstExpectation(weight="with_reservations", remedy=remedy, factors=against)


def _sign_found(evidence: Evidence, factor: str) -> str | None:
    """Return the sign of an effect that is sure: by the interval of the surface's slope, else by the screening."""
    surface, screen = evidence.results.surface, evidence.results.screen
    slope = None if surface is None else surface.coefficient(factor)
    if slope is not None and slope.low is not None and slope.high is not None and slope.low * slope.high > 0.0:
        return "+" if slope.value > 0.0 else "-"
    if screen is not None and factor in screen.significant:
        return "+" if screen.effect(factor).effect > 0.0 else "-"
    return None


def _transfer(evidence: Evidence) -> Iterator[Reason]:
    found = evidence.results.transfer
    if found is None or found.converged:
        return
    remedy = advice.MendTransfer(found.stopped, found.moving, 2 * found.budget)
    yield TransferMissed(
        weight="with_reservations",
        remedy=remedy,
        solver=found.solver.kind,
        missed_percent=found.missed_percent,
        aims_at=found.aims_at,
    )


def _rough(evidence: Evidence) -> Iterator[Reason]:
    surface = evidence.results.surface
    if surface is None:
        return
    repeats = surface.pure_error
    if not isinstance(repeats, EqualRepeats) and not (repeats is None and surface.deterministic):
        return
    if (cv := surface.cv_percent) is not None and abs(cv) > ROUGH_PERCENT:
        yield RoughResponse(weight="with_reservations", remedy=advice.to_smooth(evidence.study), cv_percent=abs(cv))


RULES: tuple[Rule, ...] = (
    _reach,
    _target,
    _solution_physics,
    _identified,
    _edge,
    _misfit,
    _validation,
    _signs,
    _rough,
    _transfer,
    _physics,
    _unfinished,
)
