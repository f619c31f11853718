"""The rules of the verdict.

    unfinished   a stage that the study asks for is not there                                     not calibrated
    reach        the surface takes the target nowhere; in a joint fit no parameters bring the
                 largest error within the given percentage                                        not calibrated
    target       the simulated response at the solution misses what it was fitted to by more than
                 the given percentage (in a joint fit: at half of the diameters or more)          not calibrated
                 by more than 2 %, or more than the refinement's tolerance                        reservation
    edge         the solution is on the edge of the region: |x| within 2 % of the radius, a
                 factor within 1 % of its range from an end                                       reservation
    misfit       it is larger than the scatter of the measured means explains, p < 0.05           reservation
    validation   an independent diameter misses by more than the given percentage, its run has
                 failed, or nothing checks the result                                             reservation
    physics      more than half of the runs have doubtful physics, for whatever reasons           not calibrated
                 a tenth of them or more; each kind of doubt is told with its own remedy          reservation

The given percentage is `targets.equivalent_within_percent`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from stemcal.folder.store import StudyFolder
from stemcal.naming import CUTTING, Named, Naming
from stemcal.stages.base import stages_of
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.physics import Doubt, Physics, physics_of
from stemcal.stages.verdict.result import Reason, Verdict, Weight
from stemcal.study.model import Study
from stemcal.words import joined

MAJORITY, SOME = 0.5, 0.1
MISSED_PERCENT = 2.0
_NEAR_RADIUS, _NEAR_END = 0.98, 0.01


@dataclass(frozen=True)
class Judged:
    """A response at a condition: how far simulated is from measured, None where the run failed; fitted, or a check."""

    named: Named
    condition: float
    error_percent: float | None
    fitted: bool

    @property
    def size(self) -> float:
        """The error without its sign."""
        return abs(self.error_percent or 0.0)


@dataclass(frozen=True)
class Evidence:
    """What the rules look at."""

    study: Study
    results: Results
    physics: Physics

    @property
    def within(self) -> float:
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
            found.append(Judged(self.naming.response, at.condition, at.error_percent, fitted))
            for further in row.further:
                if further.judged:
                    own = fitted and further.response in self.study.invert.responses
                    named = self.naming.named(further.response)
                    found.append(Judged(named, at.condition, further.error_percent, own))
        return found

    @property
    def naming(self) -> Naming:
        """What response and condition are called."""
        return self.study.naming


Rule = Callable[[Evidence], Iterator[Reason]]


def verdict_of(study: Study, folder: StudyFolder, results: Results | None = None) -> Verdict:
    """Judge a study as far as it has come; `results` if they are read already."""
    results = results or fresh_results(study, folder)
    evidence = Evidence(study, results, physics_of(results, folder))
    return Verdict.of([reason for rule in RULES for reason in rule(evidence)], _use(evidence))


# ---- where it may be used


def _use(evidence: Evidence) -> str:
    """Say at which conditions the simulated response agrees, and how far it is off where it is off most."""
    rows = [row for row in evidence.judged if row.error_percent is not None]
    off = [row for row in rows if row.size > evidence.within]
    apart = {row.condition for row in off}
    good = [f"{condition:g}" for condition in dict.fromkeys(row.condition for row in rows) if condition not in apart]
    if not rows or evidence.physics.share > MAJORITY:
        return ""
    worst = max(off, key=lambda row: row.size, default=None)
    told = f"Good (within {evidence.within:g} %){evidence.naming.places(joined(good))}" if good else _nowhere(evidence)
    return f"{told}{'' if worst is None else f'; {_whose(worst, evidence.naming)}{_miss(worst, evidence.naming)}'}."


def _whose(row: Judged, naming: Naming) -> str:
    """Name the response where a study has several."""
    return f"the {row.named.noun} is " if naming.others else ""


def _nowhere(evidence: Evidence) -> str:
    """Say that nothing that was simulated agrees."""
    if evidence.naming.condition is None:
        return f"Not within {evidence.within:g} %"
    return f"Good at no measured {evidence.naming.condition_noun}"


def _miss(row: Judged, naming: Naming = CUTTING) -> str:
    """Say how far a simulated response is off, and to which side.

    >>> _miss(Judged(CUTTING.response, 11.0, 42.0, fitted=False))
    '42 % low at 11 mm'
    """
    error = row.error_percent or 0.0
    return f"{_size(error)} % {'low' if error > 0.0 else 'high'}{naming.at(row.condition)}"


def _size(percent: float) -> str:
    """Write a size in percent, with a decimal below 10.

    >>> _size(-42.3), _size(4.23)
    ('42', '4.2')
    """
    return f"{abs(percent):.{0 if abs(percent) >= 10.0 else 1}f}"


# ---- the rules


def _unfinished(evidence: Evidence) -> Iterator[Reason]:
    done = {result.name for result in evidence.results.done()}
    missing = [stage for stage in stages_of(evidence.study) if stage.name not in done]
    if missing and not list(_reach(evidence)):
        named = ", ".join(stage.title for stage in missing)
        yield Reason("unfinished", "not_calibrated", f"not done yet: {named}", "`stemcal run SPEC` goes on")


def _reach(evidence: Evidence) -> Iterator[Reason]:
    surface, found, study = evidence.results.surface, evidence.results.inversion, evidence.study
    if surface is None:
        return
    if study.joint_targets:
        if found is not None and found.joint is not None and found.joint.best_worst_error_percent > evidence.within:
            yield _no_joint_fit(evidence)
        return
    target = study.calibration_target.response
    low, high = advice.reach(surface) if found is None else (target, target)
    if not low <= target <= high:
        side = "above" if target > high else "below"
        response = evidence.naming.response
        ends = f"{low:.4g} to {response.text(high, '.4g')}"
        sentence = f"the measured {response.text(target)} is {side} what the ranges reach, {ends}"
        yield Reason("reach", "not_calibrated", sentence, advice.to_reach(study, surface, target))


def _no_joint_fit(evidence: Evidence) -> Reason:
    surface, found = evidence.results.surface, evidence.results.inversion
    assert surface is not None and found is not None and found.joint is not None
    place = found.joint.best_worst_solution
    coded = [(place[name] - scale.center) / scale.half_step for name, scale in surface.coding.items()]
    naming, least = evidence.naming, f"{found.joint.best_worst_error_percent:.0f} %"
    of = "" if naming.condition is None else f" of {naming.counted(len(found.joint.rows))}"
    return Reason(
        "reach",
        "not_calibrated",
        f"no parameters within the ranges bring the largest error{of} below {least}",
        advice.from_the_edge(evidence.study, surface, coded) if _on_edge(evidence, coded) else _fit_less(naming),
    )


def _fit_less(naming: Naming) -> str:
    """Say what to fit where no parameters within the ranges do for everything."""
    if naming.condition is None:
        return "vary a further factor, or fit fewer responses (`invert.responses`)"
    noun, verb = naming.condition_noun, "grows" if naming.is_force_on_stems else "changes"
    held = f"within the ranges the {naming.response.noun} {verb} otherwise with the {noun}"
    return f"calibrate at the {noun} of use alone: {held}"


def _target(evidence: Evidence) -> Iterator[Reason]:
    fitted = [row for row in evidence.judged if row.fitted and row.error_percent is not None]
    if not fitted:
        return
    worst = max(fitted, key=lambda row: row.size)
    size, refine, noun = worst.size, evidence.study.refine, worst.named.noun
    tolerance = MISSED_PERCENT if refine is None else max(refine.tolerance_percent, MISSED_PERCENT)
    if size <= (evidence.within if evidence.study.joint_targets else tolerance):
        return
    far = [row for row in fitted if row.size > evidence.within]
    weight: Weight = "not_calibrated" if 2 * len(far) >= len(fitted) else "with_reservations"
    remedy = (
        "add `refine: {}` to the spec: it simulates at the solution and corrects it"
        if refine is None
        else f"raise `budget` under `refine` to {2 * refine.budget}, or look whether the {noun} jumps between points"
    )
    sentence = f"the simulated {noun} misses the one it was fitted to: {_miss(worst, evidence.naming)}"
    yield Reason("target", weight, sentence, remedy)


def _physics(evidence: Evidence) -> Iterator[Reason]:
    found = evidence.physics
    if found.share < SOME:
        return
    weight: Weight = "not_calibrated" if found.share > MAJORITY else "with_reservations"
    for doubt in found.doubts:
        sentence = f"in {doubt.runs} of {found.checked} runs the physics is doubtful: {_doubtful(doubt)}"
        yield Reason("physics", weight, sentence, advice.for_physics(evidence.study, doubt))


def _doubtful(doubt: Doubt) -> str:
    words = {
        "hourglass": "hourglass energy",
        "kinetic": "kinetic energy",
        "drift": "drift of the energy balance",
        "stroke": "the force was not clearly past its maximum when the stroke ended",
    }[doubt.kind]
    return words if doubt.worst is None else f"{words} up to {_size(doubt.worst)} %"


def _edge(evidence: Evidence) -> Iterator[Reason]:
    surface = evidence.results.surface
    if surface is None or evidence.results.inversion is None:
        return
    place = evidence.results.parameters
    coded = surface.scales.to_coded([place[name] for name in surface.names]).tolist()
    if _on_edge(evidence, coded):
        remedy = advice.from_the_edge(evidence.study, surface, coded)
        yield Reason("edge", "with_reservations", "the solution lies on the edge of the region searched", remedy)


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
    times = f"{joint.misfit / joint.df:.1f} times what the measured scatter explains"
    sentence = f"the misfit is {times} (p = {joint.p:.2g})"
    naming = evidence.naming
    fewer = f"{naming.condition_plural} (`{naming.fitted_at}`)"
    if naming.condition is None:
        fewer = "responses (`invert.responses`)"
    remedy = f"vary a further factor, or fit fewer {fewer}: the model is wrong somewhere"
    yield Reason("misfit", "with_reservations", sentence, remedy)


def _validation(evidence: Evidence) -> Iterator[Reason]:
    if evidence.results.validation is None:
        return
    naming, response = evidence.naming, evidence.naming.response
    if evidence.study.solver.kind == "table":
        sentence = f"the validation {response.plural} are read from a table, not simulated with these parameters"
        yield Reason("validation", "with_reservations", sentence, "validate with a solver that simulates")
        return
    independent = [row for row in evidence.judged if not row.fitted]
    failed = [f"{row.condition:g}" for row in independent if row.error_percent is None]
    if failed:
        sentence = f"the validation has no {response.noun}{naming.places(joined(failed))}: the run failed"
        yield Reason("validation", "with_reservations", sentence, "`stemcal retry SPEC`, then `stemcal validate SPEC`")
    off = [row for row in independent if row.size > evidence.within]
    if off:
        worst = max(off, key=lambda row: row.size)
        left_out = worst.named != response and worst.named.name not in evidence.study.invert.responses
        key, what = (
            ("responses", "responses") if left_out else (naming.fitted_at.split(".")[1], naming.condition_plural)
        )
        remedy = f"`invert: {{{key}: all}}` fits all {what} together; until then use it where it is good"
        sentence = f"the simulated {worst.named.noun} is {_miss(worst, naming)}"
        yield Reason("validation", "with_reservations", sentence, remedy)
    if not independent and not _left_out(evidence):
        yield Reason("validation", "with_reservations", *_unchecked(naming))


def _unchecked(naming: Naming) -> tuple[str, str]:
    """Say that nothing checks the result independently, and what would."""
    if naming.condition is None:
        remedy = "measure it under another condition too, or a further response that `invert.responses` leaves out"
        return "nothing checks the result independently", remedy
    noun = naming.condition_noun
    remedy = f"measure another {noun}, or leave one out of `{naming.fitted_at}`"
    return f"no {noun} checks the result independently", remedy


def _left_out(evidence: Evidence) -> bool:
    """Whether what is left out of a joint fit in turn is predicted within the percentage, and is a check at all."""
    if evidence.study.invert.ranges_chosen == "after":
        return False
    found = evidence.results.inversion
    error = found.joint.max_abs_left_out_error_percent if found is not None and found.joint is not None else None
    return error is not None and error <= evidence.within


RULES: tuple[Rule, ...] = (_unfinished, _reach, _target, _edge, _misfit, _validation, _physics)
