"""The verdict by its rules, and that following its advice ends in a better one."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pytest
from fakes import TWO_FACTORS, FakeSolver, make_study

from stemcal import workflow
from stemcal.cutting import result as cutting_result
from stemcal.errors import TargetUnreachable
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.store import StudyFolder
from stemcal.solvers import SOLVERS
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.verdict.advice import for_physics
from stemcal.stages.verdict.physics import LIMITS, Doubt
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.rules import verdict_of
from stemcal.study.model import EmbeddedSolver, Study, TableSolver
from stemcal.study.reading import load_study

TARGETS = """\
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 7 mm, force: SEVEN N}
    - {diameter: 8 mm, force: EIGHT N}
    - {diameter: 11 mm, force: ELEVEN N}
"""
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 2}\n"
ORDER = ("not_calibrated", "with_reservations", "calibrated")


@dataclass(frozen=True)
class Doubtful(FakeSolver):
    """The known force with the checks of a solver."""

    hourglass: float = 1.0
    kinetic: float = 1.0
    low: float = 1.0

    def solve(self, request: Request) -> Answer:
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        force = (100.0 + 20.0 * a + 8.0 * b + 3.0 * b * b) * (request.condition / 8.0) ** 2
        checks = {
            "hourglass_ratio_percent": self.hourglass,
            "kinetic_ratio_percent": self.kinetic,
            "energy_drift_percent": 0.1,
            "stroke_was_enough": True,
        }
        return Answer("ok", response=force * (self.low if request.stage == "validate" else 1.0), details=checks)


def written(
    folder: Path, eight: float = 110.0, eleven: float = 1.0, extra: str = "", change: tuple[str, str] = ("", "")
) -> Study:
    """Write a study of two factors whose forces grow as d², but for `eleven`."""
    forces = {"SEVEN": eight * (7 / 8) ** 2, "EIGHT": eight, "ELEVEN": eleven * eight * (11 / 8) ** 2}
    text = TWO_FACTORS.replace(*change) + TARGETS + TWO + extra
    for word, force in forces.items():
        text = text.replace(f"{word} ", f"{force:.6f} ")
    folder.mkdir(exist_ok=True)
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


Judge = Callable[..., Verdict]


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> Judge:
    """Takes a study through its stages as far as it comes, and judges it."""

    def judge(study: Study, folder: Path, solver: Doubtful | None = None) -> Verdict:
        chosen = solver or Doubtful()
        monkeypatch.setitem(SOLVERS, "embedded", lambda _study: chosen)
        place = StudyFolder(folder / "out")
        with suppress(TargetUnreachable):
            workflow.calibrate(study, place, InlineExecutor())
        return verdict_of(study, place)

    return judge


def rules(verdict: Verdict) -> list[str]:
    return [reason.rule for reason in verdict.reasons]


def better(after: Verdict, before: Verdict) -> bool:
    return ORDER.index(after.verdict) > ORDER.index(before.verdict)


def test_a_good_study_is_calibrated(tmp_path: Path, judged: Judge) -> None:
    verdict = judged(written(tmp_path), tmp_path)
    assert (verdict.verdict, verdict.reasons) == ("calibrated", ())
    assert verdict.lines() == ["Calibrated.", "Good (within 10 %) at 7, 8 and 11 mm."]


def test_a_study_out_of_reach_and_after_the_advice(tmp_path: Path, judged: Judge) -> None:
    """F = 100 + 20a + 8b + …: 200 N need a yield stress of about 37 MPa, and more inside a design region."""
    study = written(tmp_path / "first", eight=200.0)
    before = judged(study, tmp_path / "first")
    assert before.verdict == "not_calibrated" and rules(before) == ["reach"]
    assert "the measured 200 N is above what the ranges reach" in before.lines()[0]
    advised = re.fullmatch(r"raise `high` of yield_stress to about ([0-9.]+) MPa", before.next_step)
    assert advised is not None and 37.0 < float(advised[1]) < 60.0
    change = ("yield_stress, unit: MPa, low: 10, high: 20", f"yield_stress, unit: MPa, low: 10, high: {advised[1]}")
    after = judged(written(tmp_path / "second", eight=200.0, change=change), tmp_path / "second")
    assert better(after, before) and after.verdict == "calibrated"


def test_a_study_on_the_edge_and_after_the_advice(tmp_path: Path, judged: Judge) -> None:
    """The greatest force of the region at 8 mm is near 121.9 N: a target just below lies on its edge."""
    study = written(tmp_path / "first", eight=124.0)
    found = judged(study, tmp_path / "first")
    assert "reach" in rules(found)
    top = float(found.reasons[0].sentence.split(" to ")[1].split()[0])
    study = written(tmp_path / "edge", eight=top * 0.9995)
    before = judged(study, tmp_path / "edge")
    assert before.verdict == "with_reservations" and rules(before) == ["edge"]
    advised = re.fullmatch(r"raise `high` of (\w+) to about ([0-9.]+)( MPa)?", before.next_step)
    assert advised is not None and advised[1] == "yield_stress" and float(advised[2]) == 25.0
    change = ("yield_stress, unit: MPa, low: 10, high: 20", "yield_stress, unit: MPa, low: 10, high: 25")
    after = judged(written(tmp_path / "second", eight=top * 0.9995, change=change), tmp_path / "second")
    assert better(after, before)


def solver_of(study: Study) -> Doubtful:
    """Hourglass energy of 16 % but for full integration; kinetic of 12.5 % at a mass scaling of 1e4."""
    options = study.solver
    assert isinstance(options, EmbeddedSolver)
    return Doubtful(
        hourglass=0.0 if options.element == "full" else 16.0,
        kinetic=12.5 * options.mass_scaling / 1e4,
    )


def test_a_study_of_bad_hourglass_and_after_the_advice(tmp_path: Path, judged: Judge) -> None:
    study = written(tmp_path / "first", extra="solver: {kind: embedded, element_size: d/16, mass_scaling: 1}\n")
    before = judged(study, tmp_path / "first", solver_of(study))
    assert before.verdict == "not_calibrated" and rules(before) == ["physics"]
    assert not before.holds and before.use == ""
    assert re.search(r"in (\d+) of \1 runs the physics is doubtful: hourglass energy up to 16 %", before.lines()[0])
    advised = re.match(r"`(element: \w+)` under `solver` .*; elements of d/26 or smaller", before.next_step)
    assert advised is not None
    mended = f"solver: {{kind: embedded, element_size: d/16, {advised[1]}, mass_scaling: 1}}\n"
    study = written(tmp_path / "second", extra=mended)
    after = judged(study, tmp_path / "second", solver_of(study))
    assert better(after, before) and after.verdict == "calibrated"


def test_kinetic_energy_and_after_the_advice(tmp_path: Path, judged: Judge) -> None:
    """12.5 % at 1e4: 2000 would make it 2.5 %; the time step's share of the mass goes with its square."""
    study = written(tmp_path / "first", extra="solver: {kind: embedded, element: full}\n")
    before = judged(study, tmp_path / "first", solver_of(study))
    assert before.verdict == "not_calibrated"
    advised = re.match(r"`mass_scaling: (\d+)` and `time_step: (\d+) us` under `solver`", before.next_step)
    assert advised is not None and (advised[1], advised[2]) == ("2000", "17")
    mended = f"solver: {{kind: embedded, element: full, mass_scaling: {advised[1]}, time_step: {advised[2]} us}}\n"
    study = written(tmp_path / "second", extra=mended)
    after = judged(study, tmp_path / "second", solver_of(study))
    assert better(after, before)


def test_a_few_doubtful_runs_are_a_reservation(tmp_path: Path, judged: Judge) -> None:
    @dataclass(frozen=True)
    class Some(Doubtful):
        def solve(self, request: Request) -> Answer:
            answer = super().solve(request)
            bad = request.stage == "screen" and request.row < 3
            return Answer("ok", answer.response, details={**answer.details, "stroke_was_enough": not bad})

    verdict = judged(written(tmp_path), tmp_path, Some())
    assert verdict.verdict == "with_reservations" and rules(verdict) == ["physics"]
    assert verdict.reasons[0].sentence.startswith("in 3 of ")
    assert verdict.reasons[0].sentence.endswith(
        "the physics is doubtful: the force was not clearly past its maximum when the stroke ended"
    )
    assert verdict.next_step == "`duration: 1 s` under `loading` doubles the blade's way"


def test_a_diameter_that_is_off_is_named_with_its_side(tmp_path: Path, judged: Judge) -> None:
    """At 11 mm the laboratory measured 1/0.58 of what the model gives: 42 % low."""
    verdict = judged(written(tmp_path, eleven=1.0 / 0.58), tmp_path)
    assert verdict.verdict == "with_reservations" and rules(verdict) == ["validation"]
    assert verdict.use == "Good (within 10 %) at 7 and 8 mm; 42 % low at 11 mm."
    assert verdict.next_step.startswith("`invert: {diameters: all}`")
    assert len(verdict.lines()) == 3


def test_a_simulated_force_that_misses_its_target(tmp_path: Path, judged: Judge) -> None:
    verdict = judged(written(tmp_path), tmp_path, Doubtful(low=0.85))
    assert verdict.verdict == "not_calibrated" and rules(verdict) == ["target", "validation"]
    assert "15 % low at 8 mm" in verdict.reasons[0].sentence and "`refine: {}`" in verdict.next_step
    slightly = judged(written(tmp_path / "b"), tmp_path / "b", Doubtful(low=0.95))
    assert slightly.verdict == "with_reservations" and rules(slightly) == ["target"]


def test_an_unfinished_study_says_what_is_missing(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    verdict = verdict_of(study, StudyFolder(tmp_path / "none"))
    assert verdict.verdict == "not_calibrated" and rules(verdict) == ["unfinished"]
    assert "Screening, Response surface, Calibration, Validation" in verdict.lines()[0]
    json.dumps([reason.sentence for reason in verdict.reasons])


def test_limits_are_those_the_solver_warns_of() -> None:
    warned = (cutting_result._MOST_HOURGLASS, cutting_result._MOST_KINETIC, cutting_result._MOST_DRIFT)
    assert tuple(LIMITS.values()) == warned


def test_other_solvers_are_told_what_to_aim_at(tmp_path: Path) -> None:
    study = make_study(tmp_path).model_copy(update={"solver": TableSolver()})
    assert for_physics(study, Doubt("kinetic", 3, 8.0)).endswith("less mass scaling or a slower blade")


JOINT = "invert: {diameters: all}\n"


def test_a_joint_fit_that_no_parameters_reach(tmp_path: Path, judged: Judge) -> None:
    """Measured 11 mm is twice what d² makes of the others: the best compromise misses by a third, wherever it is."""
    verdict = judged(written(tmp_path, eight=85.0, eleven=2.0, extra=JOINT), tmp_path)
    assert verdict.verdict == "not_calibrated" and verdict.reasons[0].rule == "reach"
    assert "bring the largest error of 3 diameters below 33 %" in verdict.reasons[0].sentence
    assert verdict.next_step.startswith("calibrate at the diameter of use alone")


def test_a_misfit_beyond_the_measured_scatter(tmp_path: Path, judged: Judge) -> None:
    """11 mm is 12 % off what d² makes of the others, with sd of 1 % of six specimens: reachable, not by chance."""
    study = written(tmp_path, eleven=1.12, extra=JOINT)
    text = study.source.read_text(encoding="utf-8")
    forces = {target.condition: target.response for target in study.targets.means}
    for diameter, force in forces.items():
        text = text.replace(f"force: {force:.6f} N", f"force: {force:.6f} N, sd: {0.01 * force:.6f} N, n: 6")
        assert f"{diameter:g} mm" in text
    study.source.write_text(text, encoding="utf-8")
    verdict = judged(load_study(study.source), tmp_path)
    assert verdict.verdict == "with_reservations" and "misfit" in rules(verdict)
    assert any("times what the measured scatter explains (p = " in reason.sentence for reason in verdict.reasons)
