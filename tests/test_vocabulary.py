"""How sentences name responses, conditions and factors."""

from stemcal.vocabulary import CUTTING, FORCE, TRAVEL, Variable, Vocabulary, Wording, small

ANGLE, RESTITUTION = Variable("a", "Angle of repose", "θ", "deg"), Variable("e", "COR", "e", "1")
DENSITY, SCORE = Variable("rho", "", "", "kg/m3"), Variable("curve_1", "", "", "N", apart=True)
LABELLED = Wording(labels={"yield_stress": "Yield stress"})


def test_labels_inside_a_sentence() -> None:
    kept = ("Poisson's ratio", "CO2 content", "E")
    labels = {"Yield stress": "yield stress", **dict(zip(kept, kept, strict=True))}
    assert {label: small(label) for label in labels} == labels
    assert (FORCE.noun, ANGLE.noun) == ("force", "angle of repose")
    assert (FORCE.long, RESTITUTION.long) == ("maximum force", "COR")
    assert (FORCE.capital, TRAVEL.capital) == ("Force", "Travel")


def test_units_of_a_variable() -> None:
    assert (FORCE.written, DENSITY.written, RESTITUTION.written) == ("N", "kg/m³", "")
    assert (FORCE.unit_suffix, ANGLE.unit_suffix) == (" N", "°")
    assert FORCE.headed("Measured") == "Measured, N"
    assert (FORCE.text(100.1), ANGLE.text(32.6)) == ("100.1 N", "32.6°")


def test_a_score_is_shown_as_its_difference_from_the_mean() -> None:
    assert (FORCE.table_value(178.5, 180.0), SCORE.table_value(178.5, 180.0)) == (178.5, -1.5)


def test_other_responses() -> None:
    assert CUTTING.measuring(["work", "slope"]) == CUTTING
    assert CUTTING.with_primary("work").response.unit == "mJ"
    assert CUTTING.of_logarithm.response.symbol == "ln F"
    assert CUTTING.headings == {"condition": "diameter", "response": "force"}


def test_factors_in_sentences() -> None:
    assert LABELLED.factor("yield_stress:failure_strain") == "Yield stress:failure_strain"
    assert (LABELLED.in_text("yield_stress"), Wording().in_text("Dose")) == ("yield stress", "Dose")
    assert Wording().factors(["a", "b", "c"]) == "a, b and c"


def test_values_in_sentences() -> None:
    assert (Wording().quantity(-74.69), Wording().quantity(74.69, "+.3g")) == ("−74.69 N", "+74.7 N")
    assert Wording().quantities((153.2, 160.0)) == "153.2 to 160.0 N"
    assert Wording().conditions([7.0, 8.0, 11.0]) == "7, 8 and 11 mm"
    assert Wording().conditions(range(1, 501)) == "500 values from 1 to 500 mm"
    assert Wording().at(7.0, 8.0) == " at diameters of 7 and 8 mm"
    assert Wording(Vocabulary(condition=None)).at(0.0) == ""
