"""Studies with a known truth planted in them: the verdict, its advice, and the verdict after following it.

The forward models are analytic (`planting.Law`). The measured values are those of the truth.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from edits import merged
from fakes import TWO_FACTORS
from planting import Law, coded, judged

from stemcal.notes import Note, Remedy
from stemcal.report.terminal import final_tables
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict.result import Verdict
from stemcal.study.reading import load_study

TRUTHS = [(0.3, -0.2), (-0.4, 0.3), (0.1, 0.5), (-0.2, -0.4)]
EACH_TRUTH = [TRUTHS[0], *(pytest.param(truth, marks=pytest.mark.slow) for truth in TRUTHS[1:])]
RSM = "rsm: {factors: [yield_stress, failure_strain], centre_points: 4}\n"
NINE = """\
name: demo
factors:
  - {name: density, unit: kg/m3, low: 1000, high: 1200}
  - {name: elastic_modulus, unit: MPa, low: 800, high: 1200}
  - {name: poisson_ratio, low: 0.2, high: 0.4}
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
  - {name: tangent_modulus, unit: MPa, low: 0.4, high: 0.6}
  - {name: hardening_parameter, low: 0, high: 0.1}
  - {name: strain_rate_c, unit: 1/s, low: 80, high: 100}
  - {name: strain_rate_p, low: 4, high: 12}
  - {name: failure_strain, low: 0.01, high: 0.05}
"""


@dataclass(frozen=True)
class Plant:
    """Writes studies of a truth and takes them through their stages."""

    folder: Path
    monkeypatch: pytest.MonkeyPatch
    solver: Law
    truth: tuple[float, float]

    def measured(self, travel: bool = False) -> str:
        """Return the targets, exactly the truth's; each with a small standard deviation."""
        rows = []
        for diameter in (7.0, 8.0, 11.0):
            force, way = self.solver.at(*self.truth, diameter)
            more = f", travel: {way:.9g} mm, sd: {{force: 1 N, travel: 0.01 mm}}" if travel else ", sd: 1 N"
            rows.append(f"    - {{diameter: {diameter:g} mm, force: {force:.9g} N, n: 6{more}}}\n")
        return f"targets:\n{''.join(rows)}"

    def judged(
        self, name: str, more: str, follow: Remedy | None = None, change: tuple[str, str] = ("", "")
    ) -> tuple[Verdict, Results]:
        """Take a study as far as it comes, a text replaced in its spec or the edit of a remedy merged into it."""
        text = (TWO_FACTORS + more).replace(*change)
        text = text if follow is None else merged(text, follow.edit)
        return judged(self.folder / name, text, self.solver, self.monkeypatch)

    def away(self, results: Results) -> float:
        """Return how far the solution is from the truth, coded."""
        return float(np.linalg.norm(np.subtract(coded(results.parameters), self.truth)))


def not_identified(verdict: Verdict) -> Note | None:
    return next((reason for reason in verdict.reasons if reason.kind == "not_identified"), None)


@pytest.mark.parametrize("truth", EACH_TRUTH)
def test_one_force_knows_a_combination_and_a_second_response_each(tmp_path, monkeypatch, truth) -> None:
    """Nothing sees the direction along which ∂F/∂a·da + ∂F/∂b·db = 0; the travel was measured, so it is advised."""
    plant = Plant(tmp_path, monkeypatch, Law(), truth)
    targets = plant.measured(travel=True)
    before, results = plant.judged("one", targets + RSM)
    reason = not_identified(before)
    assert before.verdict == "with_reservations" and reason is not None
    known = results.of(InvertResult).certainty
    assert known.not_identified == ("yield_stress", "failure_strain")
    assert all(name in reason.text for name in known.not_identified)
    b = (results.parameters["failure_strain"] - 0.03) / 0.02
    da, db = known.loosest["yield_stress"] / 5.0, known.loosest["failure_strain"] / 0.02
    assert da / db == pytest.approx(-(8.0 + 6.0 * b) / 20.0, rel=0.02)
    after, again = plant.judged("two", targets + RSM, reason.remedy)
    assert reason.remedy.edit == "invert: {responses: all}"
    assert (after.verdict, after.reasons) == ("calibrated", ())
    assert plant.away(again) < 0.02 and plant.away(again) <= plant.away(results)


@pytest.mark.parametrize("truth", EACH_TRUTH)
def test_diameters_that_grow_apart_identify(tmp_path, monkeypatch, truth) -> None:
    """Where b changes the growth with the diameter, all diameters together fix both."""
    plant = Plant(tmp_path, monkeypatch, Law(growth=0.4), truth)
    before, results = plant.judged("one", plant.measured() + RSM)
    reason = not_identified(before)
    assert reason is not None and reason.remedy.edit == "invert: {diameters: all}"
    after, again = plant.judged("all", plant.measured() + RSM, reason.remedy)
    assert [reason.kind for reason in after.reasons] in ([], ["no_better_than_formula"])
    assert plant.away(again) < 0.1 and plant.away(again) <= plant.away(results) + 0.02


@pytest.mark.parametrize("truth", EACH_TRUTH)
def test_diameters_that_grow_alike_do_not_and_a_value_from_the_literature_does(tmp_path, monkeypatch, truth) -> None:
    plant = Plant(tmp_path, monkeypatch, Law(), truth)
    joint, _ = plant.judged("all", plant.measured() + RSM + "invert: {diameters: all}\n")
    reason = not_identified(joint)
    assert joint.verdict == "with_reservations" and reason is not None
    assert reason.remedy.edit is None and "add a prior for failure_strain" in reason.remedy.text
    known = f"failure_strain: {0.03 + 0.02 * truth[1]:.6g}, hardening_parameter"
    held = RSM.replace("[yield_stress, failure_strain]", "[yield_stress]").replace("centre_points: 4", "alpha: 1")
    drop = "  - {name: failure_strain, low: 0.01, high: 0.05}\n"
    text = plant.measured() + held
    monkeypatch.setattr(f"{__name__}.TWO_FACTORS", TWO_FACTORS.replace(drop, "").replace("hardening_parameter", known))
    plant = Plant(tmp_path, monkeypatch, Law(held=truth[1]), truth)
    after, again = plant.judged("held", text)
    assert [reason.kind for reason in after.reasons] == ["few_runs"]  # three points for three coefficients
    assert again.parameters["yield_stress"] == pytest.approx(15.0 + 5.0 * truth[0], abs=0.05)


@pytest.mark.parametrize("truth", EACH_TRUTH[:2])
def test_a_fold_over_finds_the_pair_and_a_second_response_each_of_it(tmp_path, monkeypatch, truth) -> None:
    """Of nine factors two act, and their product: in twelve runs that is aliased with seven mains, in 24 with none."""
    monkeypatch.setattr(f"{__name__}.TWO_FACTORS", NINE)
    plant = Plant(tmp_path, monkeypatch, Law(crossed=6.0), truth)
    spec = "screen: {fold_over: true}\n" + plant.measured(travel=True)
    before, results = plant.judged("one", spec)
    assert (
        results.of(ScreenResult) is not None
        and results.of(RsmResult) is not None
        and len(results.of(ScreenResult).design.runs) == 24
    )
    effects = {effect.factor: effect.effect for effect in results.of(ScreenResult).effects}
    assert effects == pytest.approx(
        dict.fromkeys(effects, 0.0) | {"yield_stress": 40.0, "failure_strain": 16.0}, abs=1e-9
    )
    assert results.of(RsmResult).names == ("yield_stress", "failure_strain")
    reason = not_identified(before)
    assert before.verdict == "with_reservations" and reason is not None
    assert results.of(InvertResult).certainty.not_identified == results.of(RsmResult).names
    assert reason.remedy.edit == "invert: {responses: all}"
    after, again = plant.judged("two", spec, reason.remedy)
    assert (after.verdict, after.reasons) == ("calibrated", ()) and plant.away(again) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize(("percent", "word"), [(40.0, "not_calibrated"), (12.0, "with_reservations")])
def test_the_physics_of_the_calibrated_run_alone_is_judged(tmp_path, monkeypatch, percent, word) -> None:
    doubtful = {("validate", 8.0): {"hourglass_ratio_percent": percent}}
    plant = Plant(tmp_path, monkeypatch, Law(checks=doubtful), TRUTHS[0])
    more = plant.measured(travel=True) + RSM + "invert: {responses: [force, travel]}\n"
    before, _ = plant.judged("one", more + "solver: {kind: embedded, element_size: d/16}\n")
    (reason,) = before.reasons
    assert (before.verdict, reason.kind) == (word, "physics_of_solution")
    assert f"{percent:g} % of the internal energy at a diameter of 8 mm" in reason.text
    finer = Plant(tmp_path, monkeypatch, Law(), TRUTHS[0])
    after, _ = finer.judged("finer", more + "solver: {kind: embedded, element_size: d/20}\n")
    assert after.verdict == "calibrated"


def test_the_physics_of_a_check_is_a_reservation(tmp_path, monkeypatch) -> None:
    doubtful = {("validate", 11.0): {"inertia_percent": 30.0}}
    plant = Plant(tmp_path, monkeypatch, Law(checks=doubtful), TRUTHS[0])
    more = plant.measured(travel=True) + RSM + "invert: {responses: [force, travel]}\n"
    found, _ = plant.judged("one", more)
    (reason,) = found.reasons
    assert (found.verdict, reason.kind) == ("with_reservations", "physics_of_solution")
    assert "inertia contributes 30 % of the force at a diameter of 11 mm" in reason.text


def test_an_effect_of_the_wrong_sign_reaches_the_verdict(tmp_path, monkeypatch) -> None:
    plant = Plant(tmp_path, monkeypatch, Law(), TRUTHS[0])
    more = plant.measured(travel=True) + RSM + "invert: {responses: [force, travel]}\n"
    found, _ = plant.judged(
        "minus", more, change=("low: 0.01, high: 0.05", 'low: 0.01, high: 0.05, expected_sign: "-"')
    )
    (reason,) = (reason for reason in found.reasons if reason.kind == "sign_against_expectation")
    assert "failure_strain" in reason.text and "failure_strain" in reason.remedy.text


def test_rough_but_repeatable_answers_show_in_the_misfit_of_the_surface(tmp_path, monkeypatch) -> None:
    """Roughness of 5 % at nine runs, 3 residual df: above 3 % of the mean in 78 % of studies, χ²(3) > 1.08."""
    plant = Plant(tmp_path, monkeypatch, Law(rough=0.05), TRUTHS[0])
    seen = []
    for number in range(4):
        change = ("low: 10, high: 20", f"low: 10, high: {20.0 + 0.01 * number}")
        found, results = plant.judged(str(number), plant.measured() + RSM, change=change)
        assert results.of(RsmResult) is not None and results.of(RsmResult).fitted.df == 3
        seen += [reason for reason in found.reasons if reason.kind == "rough_response"]
    assert len(seen) >= 2 and all(reason.remedy.edit for reason in seen)
    smooth, _ = Plant(tmp_path, monkeypatch, Law(), TRUTHS[0]).judged("smooth", plant.measured() + RSM)
    assert not smooth.has("rough_response")


@pytest.mark.parametrize("known", [("force", "travel"), ("force",), ()])
def test_the_advice_to_fit_all_responses_is_accepted(tmp_path, monkeypatch, known) -> None:
    """Where a scatter is unknown, a joint fit is refused: the remedy asks for it first and has no edit."""
    plant = Plant(tmp_path, monkeypatch, Law(), TRUTHS[0])
    sd = {"force": "force: 1 N", "travel": "travel: 0.01 mm"}
    written = f"sd: {{{', '.join(sd[name] for name in known)}}}" if known else ""
    targets = plant.measured(travel=True).replace(
        ", sd: {force: 1 N, travel: 0.01 mm}", f", {written}" if known else ""
    )
    before, _ = plant.judged("one", targets + RSM)
    remedy = not_identified(before).remedy
    assert (remedy.edit is None) == (len(known) < 2)
    assert remedy.edit or all(name in remedy.text.partition(" to ")[0] for name in {"force", "travel"} - set(known))
    followed = targets if remedy.edit else plant.measured(travel=True)  # as the text says
    after, again = plant.judged("two", followed + RSM, replace(remedy, edit="invert: {responses: all}"))
    assert (after.verdict, after.reasons) == ("calibrated", ()) and plant.away(again) < 0.02


def test_a_travel_out_of_reach_is_shown_and_not_advised(tmp_path, monkeypatch) -> None:
    """Measured with a machine that gives way, the travel is five times that of any run: fitting it would fail."""
    plant = Plant(tmp_path, monkeypatch, Law(), TRUTHS[0])
    targets = plant.measured(travel=True)
    ways = {d: 5.0 * plant.solver.at(*TRUTHS[0], d)[1] for d in (7.0, 8.0, 11.0)}
    far = re.sub(r"travel: (\S+) mm,", lambda found: f"travel: {5.0 * float(found[1]):.9g} mm,", targets)
    found, results = plant.judged("far", far + RSM)
    assert not_identified(found).remedy.edit == "invert: {diameters: all}"
    (note,) = (note for note in results.of(ValidateResult).notes if note.kind == "travel_differs")
    a, b = coded(results.parameters)
    simulated = [plant.solver.at(a, b, d)[1] for d in ways]
    assert f"is {min(ways.values()):.3g} to {max(ways.values()):.3g} mm, and" in note.text
    assert f"is {min(simulated):.3g} to {max(simulated):.3g} mm. " in note.text
    study = load_study(tmp_path / "far" / "study.yaml")
    shown = final_tables(study, results, holds=True)[-1]
    assert [row[0] for row in shown.cells] == ["travel"] * 3
    assert [row[2] for row in shown.rows] == pytest.approx(list(ways.values()))
    _, results = plant.judged("near", targets + RSM)
    assert "travel_differs" not in [note.kind for note in results.of(ValidateResult).notes]
