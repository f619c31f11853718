"""A calibration and its verdict in words: every sentence, row and point of results whose numbers are known."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from known_results import Known, known, spec_of
from planting import Law

from stemcal.doe.coding import Coding
from stemcal.doe.comparison import Formula
from stemcal.drawing.table import Table
from stemcal.errors import UsageError
from stemcal.notes import Note, Remedy
from stemcal.stages.invert import words
from stemcal.stages.invert.analysis import _changes_along, _value
from stemcal.stages.invert.result import InvertResult, JointRow, Point, PriorRow
from stemcal.stages.invert.showing import InvertShowing, calibration_table, profiles
from stemcal.stages.result import Judged, Prediction
from stemcal.stages.verdict import words as verdict_words
from stemcal.stages.verdict.result import Use, Verdict
from stemcal.storage.rows import Rows
from stemcal.vocabulary import CUTTING, Variable, Vocabulary, Wording

LAW, NAMES = Law(growth=0.3), Wording()
MEASURED = {d: LAW.at(0.2, 0.3, d)[0] for d in (7.0, 8.0, 10.0)}
OWN = Vocabulary(None, (Variable("angle", "Angle of repose", "θ", "deg"), Variable("rise", "Rise", "h", "mm")))


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Known:
    spec = spec_of(MEASURED, "invert: {diameters: all}\n", ", sd: 3 N, n: 9")
    return known(tmp_path_factory.mktemp("joint"), spec, LAW)


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return known(tmp_path_factory.mktemp("single"), spec_of(MEASURED), LAW)


def known_point(result: InvertResult) -> InvertResult:
    """Return a result at round numbers."""
    point = Point(
        solution={"yield_stress": 16.0, "failure_strain": 0.025},
        coded={"yield_stress": 0.28284, "failure_strain": -0.35355},
        coded_radius=0.4528,
        predicted=106.7,
        mean_interval=(105.0, 108.0),
        prediction_interval=(100.0, 113.0),
    )
    certainty = replace(
        result.certainty,
        intervals={"yield_stress": (15.0, 17.5), "failure_strain": (0.01, 0.04)},
        bounded={"yield_stress": (True, True), "failure_strain": (False, True)},
        share={"yield_stress": 0.25, "failure_strain": 0.756},
        free=(),
        unseen_changes=(),
        surface_error_known=True,
        scatter="measured",
        known_sd=False,
    )
    ranges = {"yield_stress": (15.5, 16.5), "failure_strain": (0.02, 0.03)}
    return replace(result, point=point, certainty=certainty, ranges=ranges, target=106.67)


# ---- tables


def cells(table: Table) -> list[tuple[str, ...]]:
    return [tuple(cell.strip() for cell in row) for row in table.cells]


def test_the_parameters(single: Known) -> None:
    one = known_point(single.of(InvertResult))
    table = calibration_table(one, NAMES)
    assert table.title == "Calibrated parameters"
    assert table.heads == ("Factor", "Calibrated", "95 % confidence interval", "Coded")
    assert cells(table) == [
        ("yield_stress", "16.00", "15.00 to 17.50", "0.283"),
        ("failure_strain", "0.02500", "≤ 0.01000 to 0.04000", "−0.354"),
    ]
    assert table.foot == (
        "The calibration target is 106.67 N, and the predicted value at the calibrated point is 106.7 N. The "
        "calibrated point, determined by the smallest coded distance, is at a coded distance of 0.453 from the "
        "design centre.",
    )
    assert table.claimed[0] == (
        "The 95 % confidence interval of the mean maximum force is 105.0 to 108.0 N. The 95 % prediction interval for "
        "a single run is 100.0 to 113.0 N."
    )
    same = replace(one, point=replace(one.point, prediction_interval=one.point.mean_interval))
    assert (
        calibration_table(same, NAMES)
        .claimed[0]
        .endswith(" A single run has the same interval, because runs of a deterministic solver do not scatter.")
    )
    none = replace(one, point=replace(one.point, mean_interval=None, prediction_interval=None))
    assert calibration_table(none, NAMES).claimed[0] == "The 95 % confidence interval of the mean maximum force is –."
    refined = calibration_table(one, NAMES, {"yield_stress": 16.5, "failure_strain": 0.026})
    assert [row[1] for row in cells(refined)] == ["16.50", "0.02600"]
    valid = replace(one, depends_on={"element size": "1 mm"})
    assert calibration_table(valid, NAMES).foot[1].startswith("The parameters are valid only with element size 1 mm.")


def test_the_closing_table_has_units(single: Known) -> None:
    setting: Any = SimpleNamespace(study=single.study, results=SimpleNamespace(parameters={
        "yield_stress": 16.0, "failure_strain": 0.025}))  # fmt: skip
    (table,) = InvertShowing().closing(known_point(single.of(InvertResult)), setting)
    assert table.heads == ("Parameter", "Calibrated", "Unit", "95 % confidence interval")
    assert cells(table)[0] == ("yield_stress", "16.00", "MPa", "15.00 to 17.50")
    assert table.foot == () == table.claimed
    assert InvertShowing().cited(known_point(single.of(InvertResult))) == {
        "yield_stress": "15.00 to 17.50", "failure_strain": "≤ 0.01000 to 0.04000",
    }  # fmt: skip


def with_rows(result: InvertResult, *rows: JointRow, further: tuple[JointRow, ...] = (), **more: Any) -> InvertResult:
    assert result.joint is not None
    return replace(result, joint=replace(result.joint, rows=Rows(rows), further=Rows(further), **more))


def row(d: float, error: float, left_out: float | None = None, response: str = "force", **more: Any) -> JointRow:
    return JointRow(d, response, "N", 100.0, None, None, 100.0 - error, error, left_out, **more)


def test_the_fitted_values(joint: Known) -> None:
    two = with_rows(
        joint.of(InvertResult), row(7.0, 1.5, -2.25), row(8.0, -3.0, 4.0),
        max_abs_error_percent=3.0, max_abs_left_out_error_percent=4.0,
    )  # fmt: skip
    _, table = InvertShowing().tables(two, NAMES)
    assert table.title == "Fitted together"
    assert table.heads == ("Diameter, mm", "Measured, N", "Surface, N", "Error, %", "Cross-val., %")
    assert cells(table) == [
        ("7", "100", "98.50", "1.50 too low", "2.25 too high"),
        ("8", "100", "103.0", "3.00 too high", "4.00 too low"),
    ]
    assert table.foot == (
        "Largest error: 3.00 % for fitted values, 4.00 % in the cross-validation.",
        "Cross-validation (cross-val.): error of the value predicted from a fit to the other values.",
    )
    tests = with_rows(two, row(7.0, 1.5, -2.25, left_out_interval=(90.0, 99.0)))
    assert InvertShowing().tables(tests, NAMES)[1].foot[1].endswith("from a fit to the other tests.")
    plain = with_rows(two, row(7.0, 1.5), max_abs_error_percent=1.5, max_abs_left_out_error_percent=None)
    table = InvertShowing().tables(plain, NAMES)[1]
    assert table.heads[-1] == "Error, %" and table.foot == ("Largest absolute percentage error: 1.50 %.",)
    further = with_rows(two, row(7.0, 1.5), further=(row(7.0, 2.0, None, "work"),))
    assert InvertShowing().tables(further, NAMES)[1].heads[:2] == ("Response", "Diameter, mm")


def test_files(joint: Known, single: Known) -> None:
    tables = known_point(single.of(InvertResult)).tables()
    assert list(tables) == ["invert"]
    assert tables["invert"].heads == (
        "factor", "solution", "range_low", "range_high", "coded", "exact_low", "exact_high",
    )  # fmt: skip
    assert tables["invert"].rows[0] == ("yield_stress", 16.0, 15.0, 17.5, 0.28284, 15.5, 16.5)
    two = with_rows(joint.of(InvertResult), row(7.0, 1.5, -2.25), further=(row(7.0, 2.0, None, "work"),)).tables()
    assert two["invert_responses"].rows == (
        (7.0, "force", 100.0, 98.5, 1.5, -2.25), (7.0, "work", 100.0, 98.0, 2.0, None),
    )  # fmt: skip


def test_the_profiles(single: Known) -> None:
    result = single.of(InvertResult)
    figure = profiles(result, {"yield_stress": "Stress, MPa"})
    first, second = figure.axes
    assert (first.get_xlabel(), second.get_xlabel()) == ("Stress, MPa", "failure_strain")
    curve, limit, at = first.lines
    assert limit.get_ydata()[0] == 1.0 and at.get_xdata()[0] == result.point.solution["yield_stress"]
    assert first.get_ylim() == (0.0, 3.0) and len(curve.get_xdata()) >= len(
        result.certainty.profiles["yield_stress"].values
    )
    low, high = result.certainty.intervals["yield_stress"]
    (span,) = first.patches
    assert (span.get_x(), span.get_x() + span.get_width()) == (pytest.approx(low), pytest.approx(high))
    setting: Any = SimpleNamespace(study=single.study, labels={"yield_stress": "Stress"})
    (plot,) = InvertShowing().figures(result, setting)
    assert (plot.name, plot.section, plot.claims) == ("profiles", "invert", True)
    assert plot.make().axes[0].get_xlabel() == "Stress, MPa"


def test_the_likelihood_in_a_notebook(single: Known) -> None:
    setting: Any = SimpleNamespace(study=single.study, results=single.results)
    inversion: Any = InvertShowing().in_notebook(single.of(InvertResult), setting)
    solution = single.of(InvertResult).point.solution
    best, off, outside = (
        inversion.log_likelihood({**solution, "yield_stress": stress})
        for stress in (solution["yield_stress"], 12.0, 21.0)
    )
    assert isinstance(best, float) and best > off > -np.inf and outside == -np.inf
    many = inversion.log_likelihood({**solution, "yield_stress": np.array([[solution["yield_stress"], 21.0]])})
    assert many.shape == (1, 2) and many[0, 0] == pytest.approx(best) and many[0, 1] == -np.inf
    with pytest.raises(
        UsageError, match=r"log_likelihood: no level is given for failure_strain\. Pass a level for every"
    ):
        inversion.log_likelihood({"yield_stress": 15.0})


# ---- sentences


def test_the_outcome(single: Known, joint: Known) -> None:
    assert words.outcome(known_point(single.of(InvertResult)), NAMES) == [
        "At yield_stress = 16.00 MPa and failure_strain = 0.02500, the predicted maximum force equals the measured "
        "value of 106.67 N."
    ]
    both = known_point(joint.of(InvertResult))
    assert words.outcome(with_rows(both, row(7.0, 1.5), row(8.0, -3.04)), NAMES) == [
        "The joint fit to 2 measured values gives yield_stress = 16.00 MPa and failure_strain = 0.02500.",
        "The largest error of the response surfaces is 3.0 % (maximum force).",
    ]
    three = with_rows(both, row(7.0, 1.5), row(7.0, -2.0, None, "travel"), further=(row(7.0, 9.0, None, "work"),))
    assert words.outcome(three, NAMES)[0].startswith("The joint fit to 3 measured values gives ")
    assert words.outcome(three, NAMES)[1] == (
        f"The largest errors of the response surfaces are 1.5 % (maximum force) and 2.0 % "
        f"({CUTTING.named('travel').long})."
    )


def test_the_uncertainty_in_words(single: Known, joint: Known) -> None:
    one = known_point(single.of(InvertResult))
    force = "The maximum force at a diameter of 8 mm"
    assert words.uncertainty(one.certainty, one, NAMES) == [
        f"{force} constrains yield_stress to between 15.00 and 17.50 MPa (25 % of the factor range) and failure_strain "
        "to between ≤ 0.01000 and 0.04000 (76 % of the factor range)."
    ]
    loose = replace(
        one.certainty,
        free=("failure_strain",),
        unseen_changes=({"yield_stress": -1.5, "failure_strain": 0.0123},),
        scatter="surface",
        known_sd=True,
        surface_error_known=False,
        bounded={"yield_stress": (True, False), "failure_strain": (False, False)},
    )
    assert words.uncertainty(loose, one, NAMES) == [
        f"{force} constrains yield_stress to between 15.00 and ≥ 17.50 MPa (25 % of the factor range).",
        f"{force} does not determine failure_strain.",
        "To first order, the maximum force at a diameter of 8 mm hardly changes if yield_stress decreases by 1.5 MPa "
        "and failure_strain increases by 0.0123.",
        "If no standard deviation is given, the measured value is treated as exact.",
        "If the number of specimens is not given, the standard deviation is treated as exact.",
        "The error of the response surfaces cannot be estimated; the intervals assume an error between 0.01 and 10 % "
        "of the response.",
    ]  # fmt: skip
    nothing = replace(loose, free=("yield_stress", "failure_strain"), unseen_changes=())
    assert words.uncertainty(nothing, one, NAMES)[0] == f"{force} does not determine yield_stress or failure_strain."
    both = known_point(joint.of(InvertResult))
    assert words.uncertainty(both.certainty, both, NAMES)[0].startswith("The joint fit constrains yield_stress ")
    prior = PriorRow("yield_stress", 15.0, 0.5, "MPa", "a paper")
    assert words.uncertainty(both.certainty, replace(both, priors=Rows([prior])), NAMES)[0] == (
        "The prior for yield_stress is 15 MPa with a standard deviation of 0.5 MPa (a paper)."
    )


def test_what_to_cite(single: Known) -> None:
    one = known_point(single.of(InvertResult))
    assert words.range_to_cite(one, NAMES) == [
        "Report the 95 % confidence interval of each parameter, that is, all values consistent with the measurement.",
        "If the error of the response surface is neglected, all parameter values that reproduce the target are within "
        "these ranges: yield_stress 15.50 to 16.50 MPa and failure_strain 0.02000 to 0.03000.",
    ]
    assert words.valid_for(one) == [] and words.valid_for(replace(one, depends_on={})) == []
    assert words.valid_for(replace(one, depends_on={"a": "1", "b": "2 mm"})) == [
        "The parameters are valid only with a 1 and b 2 mm. Always report the parameters together with these settings."
    ]


def test_the_notes_of_a_calibration(single: Known, joint: Known) -> None:
    def found(result: InvertResult) -> dict[str, str]:
        return {note.kind: note.text for note in words.invert_notes(result)}

    one = known_point(single.of(InvertResult))
    assert found(one)["one_of_many"] == (
        "A single measured maximum force cannot determine 2 parameters. The `least_coded_distance` rule was used to "
        "select one of the parameter combinations that fit equally well."
    )
    alone = replace(one, point=replace(one.point, solution={"yield_stress": 16.0}, coded={"yield_stress": 0.28}))
    assert "one_of_many" not in found(alone) and "solution_outside" not in found(alone)
    outside = replace(one, point=replace(one.point, inside=False, coded_radius=2.0), radius=1.5)
    assert found(outside)["solution_outside"] == (
        "The solution is outside the experimental region, so the response surface is extrapolated (coded distance from "
        "the design centre: 2.00, limit: 1.50)."
    )
    both = known_point(joint.of(InvertResult))
    assert set(found(both)) == {"left_out", "known"}
    further = with_rows(both, row(7.0, 1.5), further=(row(7.0, 1.0, None, "travel"),), scatter="misfit")
    independent = "The means of different responses measured on the same specimens are treated as independent."
    assert found(further)["independent_means"] == independent
    assert found(further)["weights"].startswith(
        "Without standard deviations, the relative errors of all values are weighted"
    )
    with_work = with_rows(both, row(7.0, 1.5), further=(row(7.0, 1.0, None, "work"),))
    assert found(with_work)["independent_means"] == (
        f"{independent} Work depends on force and travel, so a joint fit to all three responses yields intervals that "
        "are too narrow."
    )
    assert words.prior_unused(("a", "b")).text.endswith("in the response surface design: a and b.")
    flat = words.flat_direction({"a": 1.5, "b": -0.02}, {"a": "MPa", "b": "1"})
    assert (flat.kind, flat.severity) == ("flat_direction", "warning")
    assert flat.text.startswith(
        "The measurements cannot separate the parameters: if a increases by 1.5 MPa and b decreases by 0.02, the fit"
    )


# ---- the result


def test_what_was_left_out_in_turn(joint: Known, single: Known) -> None:
    both = joint.of(InvertResult)
    formula = Formula(2.0, 5.0, 1.0)
    several = with_rows(both, row(7.0, 1.0, 2.0), row(8.0, 1.0, -3.0), further=(row(8.0, 1.0, 7.0, "work"),),
                        max_abs_left_out_error_percent=3.0, formula=formula)  # fmt: skip
    assert several.left_out == {7.0: 2.0, 8.0: -3.0} and several.misses == (1.0, 1.0)
    assert several.prediction == Prediction(3.0, formula, in_turn="stem diameter")
    here = with_rows(several, row(8.0, 1.0, 2.0), row(8.0, 1.0, 2.5, "travel"))
    assert here.prediction is not None and here.prediction.in_turn == "response"
    tests = with_rows(several, row(8.0, 1.0, 2.0, left_out_interval=(1.0, 2.0)))
    assert tests.prediction is not None and tests.prediction.in_turn == "test"
    none = with_rows(several, row(8.0, 1.0), max_abs_left_out_error_percent=None)
    assert none.prediction is None
    one = single.of(InvertResult)
    assert one.prediction is None and one.left_out == {} and one.misses == () and one.settles == one.parameters


def test_a_direction_in_the_units_of_the_factors() -> None:
    """(0.6, −0.3, 0) is scaled to a half step at most: 4, and half of 0.5 the other way."""
    coding = Coding(("a", "b", "c"), (10.0, 1.0, 0.0), (4.0, 0.5, 1.0))
    found = _changes_along(coding, np.array([0.6, -0.3, 0.0]))
    assert found == {"a": pytest.approx(4.0), "b": pytest.approx(-0.25)}
    assert _value(coding, 0, 0.5) == 12.0


# ---- the verdict in words


def use(**more: Any) -> Use:
    return replace(Use(10.0, (7.0, 8.0), Judged("force", 11.0, 21.2, False), 3.64), **more)


def used(shown: Use | None, names: Wording = NAMES, gains: tuple[str, ...] = ()) -> list[str]:
    return verdict_words.uses(Verdict.of([], shown, gains=gains), names)


AGREES = "The error of the simulation is at most 3.6 % (limit: 10 %) at diameters of 7 and 8 mm."
WORST = "The largest error is in the maximum force: 21 % too low at a diameter of 11 mm."


@pytest.mark.parametrize(
    ("shown", "text"),
    [
        (use(), f"{AGREES} {WORST}"),
        (use(worst=None), AGREES),
        (use(good=()), f"The error of the simulation exceeds 10 % at every diameter. {WORST}"),
        (use(good=(8.0,)), f"{AGREES.replace('diameters of 7 and', 'a diameter of')} {WORST}"),
        (
            use(held_out=Judged("force", 9.0, -4.56, False), fitted=(8.0,)),
            f"{AGREES} {WORST} The parameters were fitted to data at a diameter of 8 mm. The largest held-out error is "
            "in the maximum force: 4.6 % too high at a diameter of 9 mm.",
        ),
        (
            use(held_out=Judged("force", 11.0, 21.2, False), fitted=(8.0,)),  # named once
            f"{AGREES} The parameters were fitted to data at a diameter of 8 mm. The largest held-out error is in the "
            "maximum force: 21 % too low at a diameter of 11 mm.",
        ),
        (use(held_out=Judged("force", 9.0, -4.56, False)), f"{AGREES} {WORST}"),
        (
            use(
                held_out=Judged("force", 9.0, -4.56, False),
                fitted=(8.0,),
                predictions=(
                    Prediction(13.5, Formula(2.5, 12.8), in_turn="stem diameter"),
                    Prediction(4.56, None, (7.0, 9.0)),
                ),
            ),
            f"{AGREES} {WORST} The parameters were fitted to data at a diameter of 8 mm. At the held-out diameters of "
            "7 and 9 mm the error is at most 4.6 %, too high at a diameter of 9 mm. Cross-validation (one stem "
            "diameter predicted from the others): the error is at most 13.5 % (formula F = a·d^2.5: 12.8 %).",
        ),
    ],
)
def test_the_use_of_a_result(shown: Use, text: str) -> None:
    assert used(shown) == [text]


def test_the_use_without_a_place_or_a_comparison() -> None:
    angle = Wording(OWN)
    assert used(use(good=(), worst=None), angle) == ["The error of the simulation exceeds 10 %."]
    held_out = use(worst=None, held_out=Judged("angle", 0.0, 1.0, False), fitted=(0.0,))
    assert used(held_out, angle) == ["The error of the simulation is at most 3.6 % (limit: 10 %)."]
    assert used(None) == [] and used(None, gains=("force less.", "work more.")) == ["Force less. Work more."]


@pytest.mark.parametrize(
    ("prediction", "worst", "text"),
    [
        (Prediction(5.0, None, (7.0,)), Judged("force", 7.0, 5.0, False), "At the held-out diameter of 7 mm the error "
         "is at most 5.0 %."),
        (Prediction(5.0, None, (7.0, 9.0)), None,
         "At the held-out diameters of 7 and 9 mm the error is at most 5.0 %."),
        (Prediction(5.0, Formula(2.0, 4.0, 1.0), (7.0,)), None, "At the held-out diameter of 7 mm the error is at most "
         "5.0 % (formula F = a·d^2: 4.0 %; no significant difference: a measured mean has a 95 % interval of ± 2.0 "
         "%)."),
        (Prediction(5.0, Formula(2.0, 5.0), (7.0,)), None, "At the held-out diameter of 7 mm the error is at most 5.0 "
         "% (formula F = a·d^2: 5.0 %)."),
    ],
)  # fmt: skip
def test_a_prediction_in_words(prediction: Prediction, worst: Judged | None, text: str) -> None:
    assert verdict_words.predicted(prediction, NAMES, worst) == text
    note = verdict_words.predicted_note("held_out", prediction, NAMES)
    assert (note.kind, note.severity) == ("held_out", "info")
    better = replace(prediction, formula=Formula(2.0, 1.0))
    assert verdict_words.predicted_note("held_out", better, NAMES).severity == "warning"


def test_the_lines_of_a_verdict() -> None:
    first = Note("a", "warning", "First sentence. More of it.", Remedy("Do this.", "x: 1"))
    second = Note("b", "error", "Second sentence.")
    one, two = Verdict.of([first], use()), Verdict.of([second, first], use())
    assert verdict_words.lines(one, NAMES) == [
        "Calibrated, with reservations. First sentence. More of it.", f"{AGREES} {WORST}", "Next: Do this.",
    ]  # fmt: skip
    assert verdict_words.lines(two, NAMES) == [
        "Not calibrated.", "1. Second sentence.", "2. First sentence.", f"{AGREES} {WORST}",
    ]  # fmt: skip
    assert verdict_words.in_full(two, NAMES) == [
        "Not calibrated.", f"{AGREES} {WORST}", "1. Second sentence.", "2. First sentence. More of it. Next: Do this.",
    ]  # fmt: skip
    assert verdict_words.opening(two) == "Not calibrated. Second sentence."
    assert verdict_words.opening(Verdict.of([], None)) == "Calibrated."
    goal = [Verdict.of(reasons, None, goal=True) for reasons in ([], [first], [second])]
    assert [verdict_words.word(verdict) for verdict in goal] == [
        "The optimum is confirmed", "The optimum is confirmed, with reservations", "The optimum is not confirmed",
    ]  # fmt: skip
    found = verdict_words.verdict_json(one, NAMES)
    assert (found["verdict"], found["use"]) == ("with_reservations", f"{AGREES} {WORST}")
    assert found["reasons"] == [
        {"kind": "a", "severity": "warning", "text": first.text, "remedy": {"text": "Do this.", "edit": "x: 1"}}
    ]


@pytest.mark.parametrize(("percent", "text"), [(9.96, "10.0"), (10.0, "10"), (0.04, "0.0"), (99.5, "100")])
def test_digits_of_a_percentage(percent: float, text: str) -> None:
    assert verdict_words.size_of(percent) == text
