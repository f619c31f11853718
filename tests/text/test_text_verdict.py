"""What a verdict says: each reason and remedy once, in a stem's words and in others."""

from __future__ import annotations

from typing import Any

import pytest

from stemcal.files.typed import Tagged
from stemcal.naming import DIAMETER, FORCE, Named, Naming
from stemcal.stages.invert.result import Contradicted
from stemcal.stages.verdict import advice, rules
from stemcal.stages.verdict.physics import Doubt, DoubtAt, DoubtKind
from stemcal.stages.verdict.result import Judged, Reason, Remedy, Severity, Use, Verdict
from stemcal.text.names import Names
from stemcal.text.notes import sentence
from stemcal.text.verdict import in_full, lines, use, verdict_json

STEM = Names()
RESPONSES = (Named("angle", "Angle of repose", "θ", "deg"), Named("bulk", "Bulk density", "ρ", "kg/m3"))
HEAP = Names(Naming(None, RESPONSES))
MOIST = Names(Naming(Named("moisture", "Moisture", "w", "%"), RESPONSES))
LOW = Judged("force", 11.0, 42.3, fitted=False)
ON = advice.ContinueStudy()


def said(kind: type[Reason], names: Names = STEM, **facts: Any) -> str:
    return sentence(kind(weight="with_reservations", remedy=ON, **facts), names)


@pytest.mark.parametrize("base", [Reason, Remedy])
def test_every_reason_and_remedy_has_a_sentence(base: type[Tagged]) -> None:
    kinds = [kind for kind in Tagged.kinds.values() if issubclass(kind, base) and kind is not base]
    assert len(kinds) > 10
    assert all(sentence.dispatch(kind) is not sentence.dispatch(object) for kind in kinds)


def test_reasons() -> None:
    assert said(rules.Unfinished, stages=("screen", "validate")) == "Not done yet: Screening, Validation."
    above = said(rules.OutOfReach, target=200.0, low=78.81, high=122.12)
    assert above == "The measured 200 N is above what the ranges reach, 78.81 to 122.1 N."
    assert "70° is below what" in said(rules.OutOfReach, HEAP, target=70.0, low=78.81, high=122.12)
    assert said(rules.Conflict, least_error_percent=33.3) == (
        "No parameters within the ranges bring all errors below 33 %."
    )
    assert said(rules.TargetMissed, worst=LOW) == (
        "The simulated maximum force misses the value that it was fitted to: 42 % low at 11 mm."
    )
    assert said(rules.Misfit, times=3.21, p=0.0123) == (
        "The misfit is 3.2 times what the measured scatter explains (p = 0.0123)."
    )
    failed = [said(rules.ValidationFailed, names, conditions=(7.0, 9.0)) for names in (STEM, HEAP)]
    assert failed == [
        "The validation has no maximum force at 7 and 9 mm: the run failed.",
        "The validation has no angle of repose: the run failed.",
    ]


def test_a_score_that_contradicts_is_told_by_how_far_it_is_from_its_mean() -> None:
    """As tables tell it; by itself it is the mean force and what a mode adds."""
    scored = Names(Naming(DIAMETER, (FORCE, Named("curve_1", "Score of the first curve mode", "c1", "N", apart=True))))
    found = Contradicted("curve_1", 8.0, 180.0, 168.25, 177.5, 3.2, 0.001)
    assert said(rules.Conflict, scored, least_error_percent=5.0, contradiction=found) == (
        "The measured score of the first curve mode at 8 mm, 0 N, contradicts what else is fitted: that allows "
        "−11.75 N to −2.5 N, 3.2 standard errors off."
    )


def test_what_is_not_identified_names_the_combination() -> None:
    units = {"yield_stress": "MPa", "failure_strain": "1"}
    changes = {"yield_stress": -0.682, "failure_strain": 0.0141}
    both = said(rules.NotIdentified, factors=("yield_stress", "failure_strain"), changes=changes, units=units)
    assert both == (
        "Not identified: yield_stress and failure_strain. One combination is known, not each: yield_stress −0.682 MPa "
        "and failure_strain +0.0141 together change hardly anything that was fitted."
    )
    one = said(rules.NotIdentified, factors=("failure_strain",), changes={"failure_strain": 0.01}, units=units)
    assert one == "Not identified: failure_strain. What was fitted hardly changes with it."


@pytest.mark.parametrize(
    ("kind", "names", "text"),
    [
        (
            "hourglass",
            STEM,
            "With the calibrated parameters hourglass energy is 40 % at 8 mm: above 10 % the force may be a third off, "
            "above 20 % a half.",
        ),
        ("inertia", HEAP, "With the calibrated parameters inertia carries 40 % of the force."),
        (
            "stroke",
            STEM,
            "With the calibrated parameters the force was not clearly past its maximum when the stroke ended at 8 mm.",
        ),
    ],
)
def test_the_physics_of_the_solution(kind: DoubtKind, names: Names, text: str) -> None:
    at = DoubtAt(8.0, fitted=True, doubt=Doubt(kind, 1, None if kind == "stroke" else 40.0))
    assert said(rules.SolutionDoubtful, names, at=at) == text


def test_misses_have_a_side_and_a_place() -> None:
    high = Judged("bulk", 12.0, -4.23, fitted=False)
    assert said(rules.CheckMissed, worst=LOW) == "The simulated maximum force is 42 % low at 11 mm."
    assert said(rules.CheckMissed, HEAP, worst=high) == "The simulated bulk density is 4.2 % high."
    assert said(rules.CheckMissed, MOIST, worst=high) == "The simulated bulk density is 4.2 % high at moisture 12 %."


@pytest.mark.parametrize(
    ("kind", "end"),
    [
        ("hourglass", "hourglass energy up to 16 %."),
        ("inertia", "inertia carries up to 16 % of the force."),
        ("drift", "the energy balance drifts by up to 16 %."),
        ("stroke", "the force was not clearly past its maximum when the stroke ended."),
    ],
)
def test_doubts(kind: DoubtKind, end: str) -> None:
    told = said(rules.DoubtfulPhysics, doubt=Doubt(kind, 3, 16.2), checked=12)
    assert told == f"In 3 of 12 runs the physics is doubtful: {end}"


def test_remedies_have_their_numbers() -> None:
    told = {
        advice.WidenRange("yield_stress", "high", 46.0, "MPa"): "Raise `high` of yield_stress to about 46 MPa.",
        advice.WidenRange("failure_strain", "low", 0.01, "1"): "Lower `low` of failure_strain to about 0.01.",
        advice.AddRefinement(): "Add `refine: {}` to the spec: it simulates at the solution and corrects it.",
        advice.ScaleMassLess(2000.0, 17.0, 5.0, 2.4): "`mass_scaling: 2000` and `time_step: 17 us` under `solver` "
        "bring inertia under 5 % in most runs, at about 2.4 times the time.",
        advice.ScaleMassLess(2000.0, None, 5.0, 2.4): "`mass_scaling: 2000` under `solver` brings inertia under 5 % in "
        "most runs, at about 2.4 times the time.",
        advice.IntegrateFully(
            None, 10.0
        ): "`element: full` under `solver` has no hourglass energy, at about 20 times the time.",
        advice.IntegrateFully(advice.FinerElements("d/26", None, 6.6), 10.0): "`element: full` under `solver` has no "
        "hourglass energy, at about 20 times the time; `element_size: d/26` may bring it under 10 %, at about 6.6 "
        "times.",
        advice.IntegrateFully(advice.FinerElements("d/26", 25.0, 6.6), 10.0): "`element: full` under `solver` has no "
        "hourglass energy, at about 20 times the time; `element_size: d/26` and `time_step: 25 us` may bring it under "
        "10 %, at about 6.6 times.",
        advice.HalveTimeStep(0.45, 20.0): "`time_step_safety: 0.45` and `time_step: 20 us` under `solver` halve the "
        "time step.",
        advice.HalveTimeStep(0.45, None): "`time_step_safety: 0.45` under `solver` halves the time step.",
        advice.LengthenStroke(1.0): "`duration: 1 s` under `loading` doubles the stroke.",
        advice.MendInput("inertia"): "Mend it in the solver's own input: less mass scaling or a slower blade.",
    }
    assert {remedy: sentence(remedy, STEM) for remedy in told} == told


@pytest.mark.parametrize(
    ("unfitted", "names", "start"),
    [
        ("responses", STEM, "`invert: {responses: all}` fits what else was measured; if"),
        ("conditions", STEM, "`invert: {diameters: all}` fits all that was measured; if"),
        (None, HEAP, "Measure another response or another kind of test, or give b a prior from the literature."),
    ],
)
def test_what_identifies(unfitted: Any, names: Names, start: str) -> None:
    assert sentence(advice.Identify("b", unfitted), names).startswith(start)


def test_remedies_name_the_keys_of_the_study() -> None:
    assert sentence(advice.FitAll("conditions"), STEM).startswith("`invert: {diameters: all}` fits all of them")
    assert sentence(advice.FitAll("conditions"), MOIST).startswith("`invert: {conditions: all}` fits all of them")
    assert sentence(advice.FitAll("responses"), HEAP).startswith("`invert: {responses: all}` fits all responses")
    assert sentence(advice.FitFewer(), STEM).startswith(
        "Vary a further factor, or fit only the stem diameter of use (`invert.diameters`)"
    )
    assert "fewer responses (`invert.responses`)" in sentence(advice.FitFewer(), HEAP)
    assert sentence(advice.MeasureMore(2), STEM) == (
        "Measure at another stem diameter, or leave one out of `invert.diameters`."
    )
    assert sentence(advice.MeasureMore(1), STEM) == "Measure at another stem diameter."
    nothing = [sentence(advice.NoRangeReaches(("a", "b")), names) for names in (STEM, HEAP)]
    assert nothing[0].endswith("check units, loading and specimen.")
    assert nothing[1].startswith("The range of a and b alone does not reach it")


@pytest.mark.parametrize(
    ("names", "where", "text"),
    [
        (
            STEM,
            Use(10.0, (7.0, 8.0), LOW),
            "Good (within 10 %) at 7 and 8 mm. Worst: maximum force, 42 % low at 11 mm.",
        ),
        (STEM, Use(10.0, (7.0,), None), "Good (within 10 %) at 7 mm."),
        (HEAP, Use(10.0, (0.0,), None), "Good (within 10 %)."),
        (HEAP, Use(5.0, (), Judged("bulk", 0.0, 33.0, False)), "Not within 5 %. Worst: bulk density, 33 % low."),
        (MOIST, Use(5.0, (), None), "Good (within 5 %) at no measured value of the moisture."),
    ],
)
def test_where_it_may_be_used(names: Names, where: Use, text: str) -> None:
    assert use(where, names) == text


def unchecked(weight: Severity = "with_reservations") -> Reason:
    return rules.Unchecked(weight=weight, remedy=advice.MeasureMore(1))


def test_a_rough_response_is_averaged_by_the_keys_of_its_solver() -> None:
    runs = "or add runs: `rsm: {extra_runs: 4}`."
    assert sentence(advice.SmoothResponse(phases=5), STEM) == (
        f"`phases: 5` under `solver` averages over places of the mesh; {runs}"
    )
    assert sentence(advice.SmoothResponse(replicates=6), STEM) == (
        f"`replicates: 6` under `solver` averages over chance; {runs}"
    )
    assert sentence(advice.SmoothResponse(), HEAP).startswith("Add runs: `rsm: {extra_runs: 4}`")


def test_three_lines_at_most() -> None:
    assert lines(Verdict.of([], None), STEM) == ["Calibrated."]
    heavy = rules.Unfinished(weight="not_calibrated", remedy=ON, stages=("validate",))
    two = Verdict.of([unchecked(), heavy], Use(10.0, (8.0,), None))
    assert lines(two, STEM) == [
        "Not calibrated. Not done yet: Validation. (1 more reason: `stemcal status SPEC`.)",
        "Good (within 10 %) at 8 mm.",
        "Next: `stemcal run SPEC` goes on.",
    ]
    three = Verdict.of([unchecked()] * 3, None)
    assert lines(three, STEM)[0].endswith(
        "with reservations. Nothing checks the result independently. (2 more reasons: `stemcal status SPEC`.)"
    )


def test_every_reason_with_its_remedy() -> None:
    heavy = rules.Unfinished(weight="not_calibrated", remedy=ON, stages=("validate",))
    assert in_full(Verdict.of([unchecked(), heavy], Use(10.0, (8.0,), None)), STEM) == [
        "Not calibrated.",
        "Good (within 10 %) at 8 mm.",
        "1. Not done yet: Validation. Next: `stemcal run SPEC` goes on.",
        "2. Nothing checks the result independently. Next: Measure at another stem diameter.",
    ]
    assert in_full(Verdict.of([], None), STEM) == ["Calibrated."]


def test_json_has_facts_and_their_sentences() -> None:
    remedy = advice.WidenRange("yield_stress", "high", 46.0, "MPa")
    reason = rules.OutOfReach(weight="not_calibrated", remedy=remedy, target=200.0, low=79.0, high=122.0)
    assert verdict_json(Verdict.of([reason], None), STEM) == {
        "verdict": "not_calibrated",
        "verdict_use": None,
        "reasons": [
            {
                "kind": "out_of_reach",
                "weight": "not_calibrated",
                "remedy": {
                    "kind": "widen_range",
                    "factor": "yield_stress",
                    "end": "high",
                    "value": 46.0,
                    "unit": "MPa",
                    "text": "Raise `high` of yield_stress to about 46 MPa.",
                },
                "target": 200.0,
                "low": 79.0,
                "high": 122.0,
                "text": "The measured 200 N is above what the ranges reach, 79 to 122 N.",
            }
        ],
    }
