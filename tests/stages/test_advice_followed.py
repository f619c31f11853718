"""Twenty-four kinds of planted trouble: the first advice names it, and following it ends within five steps.

A step merges the edit of the first remedy into the spec; where there is none, the planted trouble is corrected, as the
person would who was told of it. No edit comes twice, and no kind of trouble that was corrected comes back.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any

import pytest
import workflow
import yaml
from edits import accepted, merged
from fakes import TWO_FACTORS, SpecSolver

from stemcal.errors import StemcalError
from stemcal.notes import Note
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS

PROGRAM = """\
solver: {kind: command, command: [none, "{{yield_stress}}", "{{failure_strain}}"],
  result: {file: out.json, path: force}}
"""
ALL = "invert: {diameters: all}\n"
RSM = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"
_calls = count()


@dataclass(frozen=True)
class Law(SpecSolver):
    """F = (100 + 20a + 8b + 3b² + bend)·(d/8)²·(1 + 0.05·b·(d − 8) + 0.03·(d − 9)²); failures by place or number."""

    bend: float = 0.0
    noise: float = 0.0
    above: float = 9.0
    rows: frozenset[int] = frozenset()
    without: float = 0.0
    sign: float = 1.0
    inertia: float = 0.0

    def force(self, a: float, b: float, d: float) -> float:
        size = (d / 8.0) ** 2 * (1.0 + 0.05 * b * (d - 8.0) + 0.03 * (d - 9.0) ** 2)
        return (100.0 + 20.0 * a + 8.0 * b + 3.0 * b * b + self.bend * a**3 * (1.5 - a)) * size

    def identity(self, request: Request) -> dict[str, Any]:
        own = {"replicate": request.replicate} if self.noise and request.replicate else {}
        return {**super().identity(request), **own}

    def solve(self, request: Request) -> Answer:
        a, b = (request.levels["yield_stress"] - 15.0) / 5.0, (request.levels.get("failure_strain", 0.03) - 0.03) / 0.02
        if a > self.above or request.condition == self.without or (request.stage == "rsm" and request.row in self.rows):
            return Answer("failed", reason="unstable", message="diverged")
        force = self.force(a, b, request.condition)
        if self.noise:
            force *= 1.0 + self.noise * (-1.0) ** next(_calls)
        details = {"inertia_percent": self.inertia, "stroke_was_enough": True} if self.inertia else {}
        return Answer("ok", response=self.sign * force, details=details)


@dataclass
class Plant:
    """A law, a truth, and what is wrong: the measured forces are times `times`, at one diameter times `odd`."""

    first: str
    law: Law = field(default_factory=Law)
    truth: tuple[float, float] = (0.3, -0.2)
    extra: str = RSM + ALL
    times: float = 1.0
    odd: tuple[float, float] = (0.0, 1.0)
    growth: float = 0.0
    spec: str = TWO_FACTORS

    def text(self) -> str:
        rows = []
        for d in (7.0, 8.0, 9.0, 11.0):
            measured = self.law.force(*self.truth, d) * self.times * (d / 8.0) ** self.growth
            measured *= self.odd[1] if d == self.odd[0] else 1.0
            rows.append(f"  - {{diameter: {d:g} mm, force: {measured:.5g} N, sd: {0.01 * measured:.3g} N, n: 8}}\n")
        return self.spec + PROGRAM + "targets:\n" + "".join(rows) + self.extra

    def corrected(self) -> "Plant":
        """Return it without its trouble."""
        sound = replace(self.law, above=9.0, rows=frozenset(), without=0.0, inertia=0.0)
        return replace(self, law=sound, times=1.0, odd=(0.0, 1.0), growth=0.0, spec=TWO_FACTORS)


SIGN = TWO_FACTORS.replace("high: 0.05}", 'high: 0.05, expected_sign: "-"}')
PRIOR = TWO_FACTORS.replace("high: 20}", "high: 20, prior: {mean: 12, sd: 0.2, source: a book}}")
KINDS = {
    "good": Plant(""),
    "out of reach, high": Plant("out_of_reach", truth=(1.9, 0.0)),
    "out of reach, low": Plant("out_of_reach", truth=(-2.2, 0.0)),
    "one force out of reach": Plant("out_of_reach", truth=(1.9, 0.6), extra=RSM),
    "edge": Plant("on_the_edge", truth=(1.02, 0.1)),
    "not identified": Plant("not_identified", extra=RSM),
    "trend": Plant("trend", growth=0.9),
    "reversed sign": Plant("reversed_sign", law=Law(sign=-1.0)),
    "contradiction": Plant("conflict", odd=(9.0, 1.22)),
    "noise": Plant("undeclared_scatter", law=Law(noise=0.02)),
    "few runs": Plant("few_runs", extra=RSM.replace("centre_points: 1", "design: latin-hypercube, runs: 6") + ALL),
    "unit, kN": Plant("probable_unit", times=1e3),
    "unit, kgf": Plant("probable_unit", times=1 / 9.80665),
    "unit, g": Plant("probable_unit", times=1e3 / 9.80665),
    "wrong sign": Plant("sign_against_expectation", spec=SIGN),
    "curved": Plant("rough_response", law=Law(bend=60.0)),
    "failed at one end": Plant("failed_runs", law=Law(above=0.9)),
    "failed here and there": Plant("failed_runs", law=Law(rows=frozenset({0, 6}))),
    "failed at one diameter": Plant("failed_runs", law=Law(without=11.0)),
    "shrinks": Plant("trend", growth=-0.9),
    "edge, low": Plant("on_the_edge", truth=(-1.02, 0.1)),
    "unit, MN": Plant("probable_unit", times=1e-3),
    "fitted at one diameter": Plant("validation", growth=0.9, extra=RSM),
    "prior of another crop": Plant("misfit", spec=PRIOR),
    "trend, sound prior": Plant("trend", growth=0.9, spec=PRIOR.replace("mean: 12", "mean: 16.4")),
    "fast blade": Plant("physics", law=Law(inertia=12.0)),
}  # fmt: skip


def judged(plant: Plant, spec: str, folder: Path) -> Verdict:
    folder.mkdir()
    (folder / "study.yaml").write_text(spec, encoding="utf-8")
    study, place = load_study(folder / "study.yaml"), StudyFolder(folder / "out")
    with suppress(StemcalError):
        workflow.calibrate(study, place, InlineExecutor())
    verdict = verdict_of(study, place)
    accepted(spec, verdict, study.source)
    return verdict


def followed(kind: str, folder: Path) -> Iterator[Verdict]:
    """Yield the verdict of each step; merges edits, or corrects what was planted."""
    plant = KINDS[kind]
    spec, edits = plant.text(), []
    for step in range(5):
        vars(SOLVERS.named("command"))["make"] = lambda _study, law=plant.law: law
        verdict = judged(plant, spec, folder / str(step))
        yield verdict
        remedy = verdict.reasons[0].remedy if verdict.reasons else None
        if remedy is None:
            return
        if remedy.edit is not None:
            assert remedy.edit not in edits, f"the same advice twice: {remedy.edit}"
            edits.append(remedy.edit)
            spec = merged(spec, remedy.edit)
            scale = yaml.safe_load(spec)["solver"]["result"].get("scale", 1.0)
            plant = replace(plant, law=replace(plant.law, sign=scale * KINDS[kind].law.sign))
        elif plant.corrected() != plant:
            plant = plant.corrected()
            kept = {key: value for key, value in yaml.safe_load(spec).items() if key in ("rsm", "invert", "solver")}
            spec = yaml.safe_dump(yaml.safe_load(plant.text()) | kept)
        else:
            return


def told_what_to_measure(reason: Note) -> bool:
    return reason.remedy is not None and any(word in reason.remedy.text for word in ("easure", "factor", "only"))


FEW = ("contradiction",)


@pytest.mark.parametrize(
    "kind",
    [pytest.param(k, marks=[] if k in FEW else [pytest.mark.slow]) for k in KINDS],
)
def test_the_first_advice_is_right_and_leads_to_an_end(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SOLVERS.named("command"), "make", None)
    plant, steps = KINDS[kind], []
    for verdict in followed(kind, tmp_path):
        steps.append(verdict)
    kinds = [[reason.kind for reason in verdict.reasons] for verdict in steps]
    assert (kinds[0][0] if kinds[0] else "") == plant.first, kinds
    last = steps[-1]
    assert last.verdict == "calibrated" or (
        last.verdict != "not_calibrated" and told_what_to_measure(last.reasons[0])
    ), kinds
