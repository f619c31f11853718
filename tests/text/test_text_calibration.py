"""What a calibration says: of the paper's one force, and of a joint fit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from stemcal.doe.calibration.inversion import FreeFactors
from stemcal.doe.validation.null_model import NullModel
from stemcal.files.rows import Rows
from stemcal.naming import DIAMETER, FORCE, Named, Naming
from stemcal.notes import Weight
from stemcal.report.notes import shown_notes
from stemcal.stages.invert.result import (
    InvertResult,
    JointFitted,
    JointRow,
    MachineContradicted,
    MachineFound,
)
from stemcal.text import calibration
from stemcal.text.names import Names
from stemcal.text.notes import sentence

LABELLED = Names(labels={"yield_stress": "Yield stress"})
ANGLE = Names(Naming(None, (Named("angle", "Angle of repose", "θ", "deg"),)))
NULL = NullModel(5, 2.6, 3.0, 5.0, 3.8, 4.7)


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
    best_worst_error_percent=4.2,
    best_worst_solution={},
    null=NULL,
)


@pytest.fixture
def joint(results: Any) -> InvertResult:
    one = results.inversion
    both = replace(one.certainty, source="joint", free=(), scatter="pooled", df=12.0)
    return replace(one, joint=JOINT, certainty=both, certainty_alone=one.certainty)


def test_what_the_curves_tell_of_the_machine() -> None:
    known = "by `machine` alone 1500 ± 60 N/mm."
    with_curves = "With the fit to the curves the stiffness of the testing machine is"
    check = "Check `machine` and the start of the sheets."
    told = {
        MachineFound("stiffness", 1500.0, 60.0, 1474.3, 1638.2): f"{with_curves} 1474 to 1638 N/mm (95 %), {known}",
        MachineFound("stiffness", 1500.0, 60.0, 1474.3, None): f"{with_curves} 1474 N/mm or more (95 %), {known}",
        MachineContradicted("stiffness", 1500.0, 60.0, None, None): "The curves want a testing machine stiffer than a "
        f"rigid one; `machine` allows 1500 ± 60 N/mm. {check}",
        MachineContradicted("toe", 0.0, 0.01, 0.0371, 0.0389): "The curves say that contact begins 0.0371 to 0.0389 mm "
        f"(95 %) later than the preload; `toe_sd` allows 0 ± 0.01 mm. {check}",
    }
    assert {note: sentence(note, Names()) for note in told} == told


def said(stage: InvertResult) -> dict[str, str]:
    return {note.kind: note.text for note in calibration.of_invert(stage)}


def test_the_outcome_of_one_force(results: Any) -> None:
    assert calibration.outcome(results.inversion, LABELLED) == [
        "The surface meets the measured 159.2 N at Yield stress = 18.37, failure_strain = 0.03184 and "
        "strain_rate_c = 90.05."
    ]


def test_the_outcome_of_a_joint_fit(joint: InvertResult) -> None:
    fitted, error = calibration.outcome(joint, LABELLED)
    assert fitted.startswith("The joint fit to 3 measured values gives Yield stress = 18.37, ")
    assert error == "Largest error of its surfaces: 4.6 % of the maximum force."


def test_one_force_leaves_two_factors_free(results: Any) -> None:
    stage = results.inversion
    kept, free, assumed = calibration.known(stage.certainty, stage, LABELLED)
    assert kept == (
        "The maximum force at 8 mm alone keeps Yield stress between 16.52 and 19.47 MPa (30 % of its range)."
    )
    assert free == "It leaves failure_strain and strain_rate_c free."
    assert assumed == "The measured value is treated as exact because no SD was given."
    assert calibration.unseen_changes(stage.certainty, stage, LABELLED)[0] == (
        "The maximum force at 8 mm does not see a change of Yield stress −0.483 MPa and failure_strain +0.01 (to first "
        "order)."
    )


def test_a_factor_that_nothing_sees(results: Any) -> None:
    unseen = replace(results.inversion.certainty, unseen_changes=({"strain_rate_c": 5.95},))
    assert calibration.unseen_changes(unseen, results.inversion, LABELLED) == [
        "The maximum force at 8 mm does not see a change of strain_rate_c +5.95 1/s (to first order)."
    ]


def test_what_fixes_nothing_leaves_all_free(results: Any) -> None:
    stage, names = results.inversion, ("yield_stress", "failure_strain", "strain_rate_c")
    nothing = replace(stage.certainty, free=names, scatter="measured", df=None)
    assert calibration.known(nothing, stage, ANGLE) == [
        "The angle of repose alone leaves yield_stress, failure_strain and strain_rate_c free.",
        "The SD is treated as known because the number of specimens was not given.",
    ]
    assert calibration.source(nothing, stage, ANGLE) == "angle of repose\nalone"


def test_certainty_begins_with_what_a_simulation_should_give(results: Any) -> None:
    first, one, rule, *_ = calibration.certainty(results.inversion, LABELLED)
    assert first == (
        "A simulation with the calibrated parameters should give 147.1 to 171.3 N (95 % prediction interval)."
    )
    assert one == "One measured maximum force cannot fix several parameters: other combinations meet it as well."
    assert rule == "The rule `least_coded_distance` chose this one."
    saturated = replace(results.inversion, point=replace(results.inversion.point, prediction_interval=None))
    assert calibration.certainty(saturated, LABELLED)[0].startswith("The surface has as many terms as runs")


def test_certainty_of_a_joint_fit_compares_with_formulas(joint: InvertResult) -> None:
    told = calibration.certainty(joint, LABELLED)
    assert told[0].startswith("The joint fit keeps Yield stress between 16.52 and 19.47 MPa (30 % of its range), ")
    assert "With each stem diameter left out in turn, the fit to the others misses it by at most 6.0 %." in told
    assert told[-1] == (
        "Without mechanics, F = a·d^2.60 through the same 5 forces misses by at most 3.0 % (left out in turn 5.0 %), "
        "F = a·d^2.5 by 3.8 % (4.7 %), the joint fit by 4.6 % (6.0 %). The joint fit predicts the diameters no better "
        "than a formula."
    )


@pytest.mark.parametrize(
    ("null", "left_out", "weight", "judged"),
    [
        (NULL, 6.0, Weight.USE, "no better than a formula."),
        (NULL, 4.0, Weight.ASIDE, "better than a formula."),
        (NullModel(2, None, None, None, 3.8, 4.7), None, Weight.TRUST, "Nothing is left out to compare them by."),
    ],
)
def test_formulas_weigh_by_who_predicts_better(
    joint: InvertResult, null: NullModel, left_out: float | None, weight: Weight, judged: str
) -> None:
    stage = replace(joint, joint=replace(JOINT, null=null, max_abs_left_out_error_percent=left_out))
    (found,) = (one for one in calibration.remarks(stage, Names()) if one.kind == "without_mechanics")
    assert found.weight is weight and found.sentence.endswith(judged)


def test_remarks_on_one_force(results: Any) -> None:
    told = said(results.inversion)
    assert told["one_of_many"].startswith("One measured maximum force cannot fix 3 factors: ")
    point = replace(results.inversion.point, inside=False, coded_radius=2.0)
    outside = said(replace(results.inversion, point=point))["solution_outside"]
    assert outside.startswith("The solution lies 2.00 coded units from the centre") and "(radius 1.68)" in outside


def test_remarks_on_a_joint_fit(joint: InvertResult) -> None:
    told = said(joint)
    assert told["surfaces_miss"] == (
        "The surfaces miss the 2 measured values by at most 4.6 %; no point of the region brings the largest error "
        "below 4.2 %."
    )
    assert told["also_fitted"] == (
        "Also fitted: work to the maximum force at 8 mm, measured 700 mJ, surface 689.5 mJ (+1.5 %)."
    )
    assert told["weights"].endswith("means without an SD take the coefficient of variation of the others.")
    assert told["misfit_too_large"].startswith("The misfit is 15.0 times what the known scatter explains (p = 0.0003)")
    assert "independent_means" in told and "dependent_work" in told and "one_of_many" not in told


def test_a_score_that_is_fitted_is_told_by_how_far_the_surface_is_from_it(joint: InvertResult) -> None:
    names = Names(Naming(DIAMETER, (FORCE, Named("curve_1", "Score of the first curve mode", "c1", "N", apart=True))))
    row = JointRow(8.0, "curve_1", "N", 180.0, 6.0, 10, 178.5, 0.83, None)
    stage = replace(joint, joint=replace(JOINT, further=Rows([row])))
    (told,) = (one.sentence for one in calibration.remarks(stage, names) if one.kind == "also_fitted")
    assert told == ("Also fitted: score of the first curve mode at 8 mm, measured 0 N, surface −1.5 N (+0.8 %).")


def test_intervals_are_withheld_where_nothing_is_calibrated(results: Any) -> None:
    kinds = {note.kind for note in shown_notes(results.inversion, holds=False)}
    assert calibration.KNOWN not in kinds and {"withheld", "one_of_many"} <= kinds


def test_what_values_hold_for_and_ranges_assume(results: Any) -> None:
    stage = replace(results.inversion, belongs_to={"element_size": "0.5 mm", "edge_spread": "1 mm"})
    assert calibration.valid_for(stage) == [
        "These values hold for element_size 0.5 mm and edge_spread 1 mm: cite them together."
    ]
    assert calibration.valid_for(results.inversion) == []
    exact, fixed_mesh = calibration.assumptions(stage)
    assert exact.startswith("The measured value is treated as exact") and "do not include the scatter" in fixed_mesh
    scattered = replace(stage, belongs_to={"element_size": "0.5 mm", "replicates": "5"})
    assert calibration.assumptions(scattered) == [exact]


def test_the_range_to_cite_is_explained_for_one_force_only(results: Any, joint: InvertResult) -> None:
    told = " ".join(calibration.range_to_cite(results.inversion, LABELLED))
    assert told.startswith("Cite the 95 % range: ") and "exactly at Yield stress 17.63 to 18.96, " in told
    assert calibration.range_to_cite(joint, LABELLED) == []


def test_free_factors() -> None:
    note = FreeFactors(("yield_stress", "b"))
    assert sentence(note, LABELLED) == "The target leaves Yield stress and b free over the whole region."
