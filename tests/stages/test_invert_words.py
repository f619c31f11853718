"""The sentences of a calibration: of the paper's one force, and of a joint fit."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from stemcal.doe.comparison import Formula
from stemcal.stages.invert import words
from stemcal.stages.invert.result import InvertResult, JointFitted, JointRow
from stemcal.stages.invert.showing import profile_points
from stemcal.stages.result import Judged, Prediction
from stemcal.stages.verdict.verdict_rules import no_better_than_formula
from stemcal.storage.rows import Rows
from stemcal.vocabulary import Wording

LABELLED = Wording(labels={"yield_stress": "Yield stress"})


def row(condition: float, response: str, measured: float, error: float) -> JointRow:
    return JointRow(condition, response, "N", measured, None, None, measured * (1 - error / 100), error, None)


JOINT = JointFitted(
    rows=Rows([row(8.0, "force", 159.2, 4.6), row(10.0, "force", 300.0, -2.0)]),
    further=Rows([row(8.0, "work", 700.0, 1.5)]),
    scatter="pooled",
    misfit=30.0,
    df=2,
    p=3e-4,
    max_abs_error_percent=4.6,
    max_abs_left_out_error_percent=6.0,
    formula=Formula(2.6, 5.0),
)


@pytest.fixture
def joint(results: Any) -> InvertResult:
    one = results.of(InvertResult)
    both = replace(one.certainty, source="joint", free=(), scatter="pooled")
    return replace(one, joint=JOINT, certainty=both)


def kinds(stage: InvertResult) -> dict[str, str]:
    return {note.kind: note.severity for note in words.invert_notes(stage)}


def test_one_force_does_not_determine_two_factors(results: Any) -> None:
    stage = results.of(InvertResult)
    assert words.outcome(stage, LABELLED)[0].startswith("At yield stress = 18.37 MPa, ")
    kept, free, *unseen, assumed = words.uncertainty(stage.certainty, stage, LABELLED)
    assert kept.startswith("The maximum force at a diameter of 8 mm constrains yield stress to between ≤ 15.")
    assert free.endswith(" does not determine failure_strain or strain_rate_c.")
    assert len(unseen) == 2 and all(text.startswith("To first order, the maximum force") for text in unseen)
    assert assumed == "If no standard deviation is given, the measured value is treated as exact."
    assert kinds(stage)["one_of_many"] == "caution"
    point = replace(stage.point, inside=False, coded_radius=2.0)
    assert kinds(replace(stage, point=point))["solution_outside"] == "warning"


def test_a_joint_fit_is_compared_with_formulas(joint: InvertResult) -> None:
    found = kinds(joint)
    assert found["left_out"] == "warning" and "one_of_many" not in found
    better = replace(joint, joint=replace(JOINT, max_abs_left_out_error_percent=4.0))
    assert kinds(better)["left_out"] == "info"
    alike = replace(joint, joint=replace(JOINT, formula=Formula(2.6, 5.0, 0.6)))  # 1.0 % of 1.96 · 0.6 %
    assert kinds(alike)["left_out"] == "info"


def test_an_unknown_error_of_the_surface_is_an_assumption_of_the_intervals(joint: InvertResult) -> None:
    assert words.assumption(joint.certainty) == []
    (said,) = words.assumption(replace(joint.certainty, surface_error_known=False))
    assert "cannot be estimated" in said and "10 %" in said


def test_the_range_to_cite_is_of_several_factors_and_one_target(results: Any, joint: InvertResult) -> None:
    one = results.of(InvertResult)
    _, *_, exact = words.range_to_cite(one, LABELLED)
    low, high = one.ranges["yield_stress"]
    assert f"yield stress {low:.2f} to {high:.2f} MPa" in exact and "failure_strain" in exact
    assert words.range_to_cite(joint, LABELLED) == []
    alone = replace(one.point, solution={"yield_stress": 18.37})
    assert words.range_to_cite(replace(one, point=alone), LABELLED) == []


def test_a_profile_is_relative_to_the_allowed_rise() -> None:
    """A rise of 3.84 is the limit, so 7.68 is drawn at 2; an end of the range is no limit."""
    curve = SimpleNamespace(values=(1.0, 2.0, 3.0), rise=(7.68, 0.0, 1.92), allowed=3.84)
    part: Any = SimpleNamespace(profiles={"a": curve}, intervals={"a": (1.4, 3.0)}, bounded={"a": (True, False)})
    assert profile_points(part, "a") == [(1.0, 2.0), (1.4, 1.0), (2.0, 0.0), (3.0, 0.5)]


@pytest.mark.parametrize(("held_out", "count"), [(False, 1), (True, 0)])
def test_a_formula_is_as_good_only_where_no_first_response_was_held_out(
    joint: InvertResult, held_out: bool, count: int
) -> None:
    """Left out, the fit misses by 6 %, the formula by 5 %; the held-out force agrees."""
    checked = SimpleNamespace(prediction=Prediction(1.0, None, (8.0,)) if held_out else None)
    judged = [Judged("force", 8.0, 1.0, not held_out), Judged("travel", 8.0, 30.0, False)]
    results = SimpleNamespace(done=[joint, checked])
    evidence: Any = SimpleNamespace(results=results, names=Wording(joint.naming), judged=judged)
    assert len(list(no_better_than_formula(evidence))) == count
    evidence.judged = []  # no run of the validation
    assert not list(no_better_than_formula(evidence))
