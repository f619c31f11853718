"""The verdict: evaluate all rules, and sort their reasons.

A rule is a function that examines the evidence and yields reasons: notes with a remedy. A reason of severity ``error``
means not calibrated, one of severity ``warning`` a reservation. Each rule has a `Rank`. The rules about all runs are
here; those of a stage are in the module `verdict_rules` of its package.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

from stemcal.formats import counted
from stemcal.notes import Note, Remedy, Severity
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.result import Judged, R
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.stage import STAGES, stages_known, stages_of
from stemcal.stages.verdict.physics import LIMITS, MOST_DOUBTFUL, Doubt, DoubtKind, Physics, for_physics, physics_of
from stemcal.stages.verdict.result import Use, Verdict
from stemcal.stages.verdict.words import predicted, size_of
from stemcal.study.model.study import Study
from stemcal.vocabulary import Wording

BEYOND_DOUBT = 0.001  # p-value below which a contradiction makes the verdict `not_calibrated`


@dataclass(frozen=True)
class Evidence:
    """Study, results, physical checks and run records, which the rules examine."""

    study: Study
    results: Results
    physics: Physics
    folder: StudyFolder

    def of(self, kind: type[R]) -> R | None:
        """Return the result of a stage by its class, if it is done."""
        return self.results.of(kind)

    @property
    def names(self) -> Wording:
        return Wording(self.study.naming)

    @property
    def equivalent_percent(self) -> float:
        """The percentage within which measured and simulated values count as equal."""
        percentages = (stage.tolerance_percent(self.study) for stage in STAGES.built_in)
        return next(percent for percent in percentages if percent is not None)

    @property
    def judged(self) -> list[Judged]:
        """Errors of the simulated responses with the calibrated parameters."""
        return [comparison for result in self.results.done for comparison in result.judged(self.study)]

    @cached_property
    def mostly_off(self) -> bool:
        """Whether most errors exceed the tolerance, or most errors of one response exceed twice the tolerance."""
        rows = [(row.response, row.size) for row in self.judged if row.error_percent is not None]
        rows = rows or [("", abs(error)) for result in self.results.done for error in result.misses]
        each = [[size for name, size in rows if name == response] for response in {name for name, _ in rows}]
        tests = [(self.equivalent_percent, [size for _, size in rows])]
        tests += [(_FAR * self.equivalent_percent, sizes) for sizes in each]
        return any(2 * sum(size > limit for size in sizes) > len(sizes) for limit, sizes in tests)

    @property
    def records(self) -> Iterator[Mapping[str, Any]]:
        """Run records in the study folder, of all stages."""
        yield from (record for key in self.folder.keys() if (record := self.folder.peek(key)) is not None)  # noqa: SIM118


class Rank(IntEnum):
    """The subject of a rule. Reasons are sorted by rank, and within a rank by stage and rule."""

    DATA = 1
    UNFINISHED = 2
    TREND = 3
    PHYSICS = 4
    REACH = 5
    MODEL = 6
    VALIDATION = 7
    IDENTIFICATION = 8
    FORMULA = 9
    OTHER = 10


Rule = Callable[[Evidence], Iterator[Note]]
_RANKS: dict[Rule, Rank] = {}


def ranked(rank: Rank) -> Callable[[Rule], Rule]:
    """Set the rank of the reasons that a rule yields; it is `Rank.OTHER` by default."""

    def with_rank(rule: Rule) -> Rule:
        _RANKS[rule] = rank
        return rule

    return with_rank


_MAJORITY = 0.5
_FAR = 2.0  # multiple of its limit up to which a doubt, or the error of one response, is only a reservation


def verdict_of(study: Study, folder: StudyFolder, results: Results | None = None) -> Verdict:
    """Return the verdict on a study as far as it is finished; without `results` they are read from the folder."""
    results = results or fresh_results(study, folder)
    evidence = Evidence(study, results, physics_of(study, results, folder), folder)
    rules = [*RULES, *(rule for stage in stages_known(study) for rule in stage.reasons())]
    reasons = [(_RANKS.get(rule, Rank.OTHER), reason) for rule in rules for reason in rule(evidence)]
    # doubts about most runs are listed before a trend, because they may cause it
    doubted = {(Rank.PHYSICS, "error"): Rank.UNFINISHED}
    reasons = [(doubted.get((rank, reason.severity), rank), reason) for rank, reason in reasons]
    if any(reason.kind in ("probable_unit", "reversed_sign") for _, reason in reasons):
        # until units and signs are correct, reasons from comparing measured and simulated values are misleading
        reasons = [(rank, reason) for rank, reason in reasons if rank in (Rank.DATA, Rank.UNFINISHED, Rank.PHYSICS)]
    if any(rank in (Rank.DATA, Rank.REACH) and reason.severity == "error" for rank, reason in reasons):
        # the study cannot continue, so do not advise to run the other stages
        reasons = [(rank, reason) for rank, reason in reasons if reason.kind != "unfinished"]
    reasons.sort(key=lambda pair: pair[0])
    gains = tuple(sentence for result in results.done for sentence in result.gains)
    return Verdict.of([reason for _, reason in reasons], _use(evidence), study.goal is not None, gains)


def _use(evidence: Evidence) -> Use | None:
    """Return the conditions at which simulations agree, and the largest errors; None without valid runs to compare."""
    rows = [row for row in evidence.judged if row.error_percent is not None]
    if not rows or evidence.physics.share > _MAJORITY:
        return None
    off = [row for row in rows if row.size > evidence.equivalent_percent]
    apart = {row.condition for row in off}
    return Use(
        evidence.equivalent_percent,
        good=tuple(dict.fromkeys(row.condition for row in rows if row.condition not in apart)),
        worst=max(off, key=lambda row: row.size, default=None),
        largest_percent=max((row.size for row in rows if row.condition not in apart), default=0.0),
        held_out=max((row for row in rows if not row.fitted), key=lambda row: row.size, default=None),
        fitted=tuple(dict.fromkeys(row.condition for row in rows if row.fitted)),
        predictions=tuple(each for result in evidence.results.done if (each := result.prediction) is not None),
    )


@ranked(Rank.PHYSICS)
def physics(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the physical validity of many runs, or of runs with the calibrated parameters, is doubtful."""
    checks = evidence.physics
    severity: Severity = "error" if checks.share > _MAJORITY else "warning"
    every = (*checks.doubts, *checks.at_solution)
    for doubt in checks.doubts if checks.share >= MOST_DOUBTFUL else ():
        runs = f"{doubt.runs} of {counted(checks.checked, 'run')}"
        text = f"The physical validity of {runs} is doubtful: {_doubtful(doubt, 'up to ')}."
        yield Note("physics", severity, text, for_physics(evidence.study, doubt, every))
    worst: dict[DoubtKind, Doubt] = {}
    for at in checks.at_solution if checks.share <= _MAJORITY else ():
        before = worst.get(at.kind)
        if before is None or (at.fitted, at.worst or 0.0) > (before.fitted, before.worst or 0.0):
            worst[at.kind] = at
    for kind, at in worst.items():
        far = at.worst is None or at.worst > _FAR * LIMITS[kind]
        text = f"With the calibrated parameters, {_doubtful(at)}{evidence.names.at(at.condition)}."
        if kind == "hourglass":
            above = "above 10 % of the internal energy may change the force by a third, and above 20 % by half"
            text += f" Hourglass energy {above}."
        remedy = for_physics(evidence.study, at, every)
        yield Note("physics_of_solution", "error" if at.fitted and far else "warning", text, remedy)


def _doubtful(doubt: Doubt, up_to: str = "") -> str:
    worst = f"{up_to}{size_of(doubt.worst or 0.0)} %"
    return {
        "hourglass": f"the hourglass energy is {worst} of the internal energy",
        "inertia": f"inertia contributes {worst} of the force",
        "drift": f"the error in the energy balance is {worst}",
        "stroke": "the stroke is too short to capture the peak force",
    }[doubt.kind]


@ranked(Rank.UNFINISHED)
def unfinished(evidence: Evidence) -> Iterator[Note]:
    """Yield a note with the titles of all stages that are not finished."""
    done = {result.name for result in evidence.results.done}
    missing = [stage for stage in stages_of(evidence.study) if stage.name not in done]
    if missing:
        by_hand = "Fill in the run sheet in the study folder. " if evidence.study.kind.answers == "asks_people" else ""
        remedy = Remedy(f"{by_hand}Continue with `stemcal run SPEC`.")
        there_alone = all(stage.seen(evidence.study) is not evidence.study for stage in missing)
        severity: Severity = "warning" if there_alone else "error"
        titles = ", ".join(stage.title for stage in missing)
        yield Note("unfinished", severity, f"Unfinished stages: {titles}.", remedy)


@ranked(Rank.FORMULA)
def no_better_than_formula(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if a formula F = a·dᵇ predicts held-out (or else left-out) values better than the model."""
    every = (prediction for result in evidence.results.done if (prediction := result.prediction) is not None)
    prediction = min(every, key=lambda each: each.in_turn, default=None)  # held-out values first
    if prediction is not None and prediction.better == "formula" and evidence.judged:
        within = "Use the parameters only within the range of the measured diameters"
        remedy = Remedy(f"{within}, or add another kind of test (the `tests` section).")
        yield Note("no_better_than_formula", "warning", predicted(prediction, evidence.names), remedy)


RULES = (physics, unfinished, no_better_than_formula)
