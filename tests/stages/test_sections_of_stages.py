"""Values of the sections rsm, invert, screen and climb: accepted at their limit, refused just beyond it."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fakes import SPEC, TWO_FACTORS

from stemcal.errors import SpecError
from stemcal.notes import Note
from stemcal.stages.invert import options as invert_options
from stemcal.stages.invert.options import InvertOptions, chose_conditions, fitted_together
from stemcal.stages.rsm import options as rsm_options
from stemcal.stages.rsm.options import RsmOptions, dimensions, growing_with, surface_factors
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

NINE = SPEC.split("targets:")[0]
ROWS = "targets: [{diameter: 7 mm, force: 84 N}, {diameter: 8 mm, force: 110 N}, {diameter: 10 mm, force: 171 N}]\n"
NAMES = ("density", "elastic_modulus", "poisson_ratio", "yield_stress", "tangent_modulus", "hardening_parameter",
         "strain_rate_c", "strain_rate_p", "failure_strain")  # fmt: skip
GROWING = TWO_FACTORS.replace("factors:\n", "factors:\n  - {name: growth, low: -0.5, high: 1.5}\n").replace(
    "material: {", "material: {yield_stress: {at: 8 mm, exponent: growth}, "
)


def study_of(folder: Path, text: str, base: str = NINE, rows: str = ROWS) -> Study:
    (folder / "study.yaml").write_text(f"{base}{rows}{text}", encoding="utf-8")
    return load_study(folder / "study.yaml")


def mistakes(folder: Path, text: str, base: str = NINE, rows: str = ROWS) -> list[str]:
    """Return the mistakes without the place in the file."""
    try:
        study_of(folder, text, base, rows)
    except SpecError as error:
        return [" ".join(str(problem).split(": ", 1)[1].split()) for problem in error.problems]
    return []


def listed(count: int) -> str:
    return f"[{', '.join(NAMES[:count])}]"


TOO_MANY = "rsm.factors: 9 factors require too many corner runs; list at most 8 factors"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("rsm: {factors: []}\n", ["rsm.factors: a response surface requires at least one factor; list a factor"]),
        ("rsm: {factors: [density]}\n", []),
        (f"rsm: {{factors: {listed(8)}}}\n", []),
        (f"rsm: {{factors: {listed(9)}}}\n", [TOO_MANY]),
        ("rsm: {factors: [density, density]}\n", ["rsm.factors[2]: density is listed twice; remove one"]),
        (
            "rsm: {factors: [densty]}\n",
            ["rsm.factors[1]: 'densty' is not a factor of this study; did you mean density?"],
        ),
        ("rsm: {factors: strongest 3}\n", []),
        (
            "rsm: {factors: strongest 0}\n",
            ["rsm.factors: the value must be `significant`, `strongest 3` or a list of factor names; write "
             "`factors: significant`"],
        ),
        ("rsm: {design: box-behnken, factors: strongest 3}\n", []),
        (
            "rsm: {design: box-behnken, factors: strongest 2}\n",
            ["rsm.factors: the `box-behnken` design requires 3 to 7 factors, not 2; write `strongest 3`"],
        ),
        (f"rsm: {{design: box-behnken, factors: {listed(3)}}}\n", []),
        (f"rsm: {{design: box-behnken, factors: {listed(7)}}}\n", []),
        (
            f"rsm: {{design: box-behnken, factors: {listed(2)}}}\n",
            ["rsm.design: the `box-behnken` design requires 3 to 7 factors, not 2; write `central-composite`"],
        ),
        (
            f"rsm: {{design: box-behnken, factors: {listed(8)}}}\n",
            ["rsm.design: the `box-behnken` design requires 3 to 7 factors, not 8; write `central-composite`"],
        ),
        ("rsm: {design: box-behnken}\n", []),
        (f"rsm: {{design: latin-hypercube, runs: 10, factors: {listed(3)}}}\n", []),
        (
            f"rsm: {{design: latin-hypercube, runs: 9, factors: {listed(3)}}}\n",
            ["rsm.runs: 9 runs cannot determine the 10 coefficients of a response surface in 3 factors; write 20"],
        ),
        (
            f"rsm: {{runs: 30, factors: {listed(2)}}}\n",
            ["rsm.runs: the number of runs of the `central-composite` design is determined by the number of factors; "
             "omit `runs` or write `design: latin-hypercube`"],
        ),
        ("rsm: {alpha: 1.5}\n", []),
        ("rsm: {alpha: face}\n", []),
        (
            "rsm: {alpha: 0}\n",
            ["rsm.alpha: 0 is not a valid axial distance; write `rotatable`, `face` or a number above 0"],
        ),
        (
            "rsm: {alpha: faces}\n",
            ["rsm.alpha: 'faces' is not a valid axial distance; write `rotatable`, `face` or a number above 0"],
        ),
        (
            "screen: {design: none}\n",
            ["rsm: `factors: significant` requires a screening, which this study does not have; list the factors, "
             "as in `factors: [density, elastic_modulus, poisson_ratio]`, or remove `screen.design: none`"],
        ),
        ("screen: {design: none}\nrsm: {design: none}\n", []),
        (
            "screen: {design: none}\nrsm: {factors: [density]}\nclimb: {}\n",
            ["climb: steepest ascent requires a screening, which this study does not have; remove `screen.design: "
             "none`"],
        ),
        ("climb: {}\n", []),
    ],
)  # fmt: skip
def test_designs_and_factors(tmp_path: Path, text: str, expected: list[str]) -> None:
    assert mistakes(tmp_path, text) == expected


AXIAL = "rsm: {{factors: [yield_stress, failure_strain], coding: {{{}}}}}\n"


@pytest.mark.parametrize(
    ("coding", "expected"),
    [
        ("yield_stress: [12, 18]", []),
        (
            "yield_stress: [18, 12]",
            ["rsm.coding.yield_stress: the value at coded −1 (18) is not below the value at coded +1 (12); swap "
             "the two values"],
        ),
        (
            "yield_stress: [12, 12]",
            ["rsm.coding.yield_stress: the value at coded −1 (12) is not below the value at coded +1 (12); write a "
             "smaller and a larger value than 12"],
        ),
        ("yield_stress: [19, 21]", []),
        (
            "yield_stress: [20, 21]",
            ["rsm.coding.yield_stress: the centre 20.5 is outside the range of the factor (10 to 20); choose a centre "
             "near 15"],
        ),
        (
            "yield_stress: [8, 11]",
            ["rsm.coding.yield_stress: the centre 9.5 is outside the range of the factor (10 to 20); choose a centre "
             "near 15"],
        ),
        # ±√2 about 15: the lowest axial run is at 15 − √2·10.6 = 0.009 MPa, or with 10.7 below 0
        ("yield_stress: [4.4, 25.6]", []),
        (
            "yield_stress: [4.3, 25.7]",
            ["rsm.coding.yield_stress[1]: the value at coded −1.41 (-0.132 MPa) must be above 0 MPa; write a value "
             "closer to 25.7"],
        ),
        (
            "yield_strss: [12, 18]",
            ["rsm.coding.yield_strss: 'yield_strss' is not a factor of this study; did you mean yield_stress?"],
        ),
    ],
)  # fmt: skip
def test_coded_levels(tmp_path: Path, coding: str, expected: list[str]) -> None:
    found = mistakes(tmp_path, AXIAL.format(coding), TWO_FACTORS)
    assert len(found) == len(expected)
    assert [message.split(" (-")[0] for message in found] == [message.split(" (-")[0] for message in expected]


def test_a_factor_without_a_range_has_no_second_mistake(tmp_path: Path) -> None:
    """Its coding is not compared with a range that is wrong itself."""
    fixed = TWO_FACTORS.replace("low: 10, high: 20", "low: 12, high: 12")
    (message,) = mistakes(tmp_path, AXIAL.format("yield_stress: [12, 18]"), fixed)
    assert message.startswith("factors.yield_stress") and "coding" not in message


def test_corners_alone_count_while_the_factors_are_unknown(tmp_path: Path) -> None:
    """4.3 to 25.7 MPa is possible at the corners; −1 MPa is not."""
    assert mistakes(tmp_path, "rsm: {coding: {yield_stress: [4.3, 25.7]}}\n") == []
    (message,) = mistakes(tmp_path, "rsm: {coding: {yield_stress: [-1, 31]}}\n")
    assert message.startswith("rsm.coding.yield_stress[1]: the value at coded −1 (-1 MPa)")
    others = "rsm: {factors: [density, failure_strain], coding: {yield_stress: [4.3, 25.7]}}\n"
    assert mistakes(tmp_path, others) == []
    options = RsmOptions(coding={"a": (12.0, 18.5)})
    assert options.coded("a") == (15.25, 3.25)


# ---- the invert section


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("invert: {diameters: [8 mm, 10 mm]}\n", []),
        (
            "invert: {diameters: [8 mm, 9 mm]}\n",
            ["invert.diameters[2]: no force is given for 9 mm; values are given only for 7, 8, 10 mm; add the force to "
             "`targets`, or remove this value"],
        ),
        (
            "invert: {diameters: [8 mm, 10 mm, 8 mm]}\n",
            ["invert.diameters[3]: 8 mm is listed twice; remove one"],
        ),
        (
            "invert: {responses: [force, travel]}\n",
            ["targets[1]: no `sd` is given for force at any diameter, so its weight in the fit is unknown; add sd: …",
             "invert.responses: `targets` contains no value for travel; add the response to `targets`, or remove the "
             "response from this list"],
        ),
        (
            "rsm: {factors: [yield_stress, failure_strain], over: conditions}\n",
            ["invert.diameters: `rsm.over` requires several fitted values of the diameter; write `diameters: all`, or "
             "remove `rsm.over`"],
        ),
        ("rsm: {factors: [yield_stress, failure_strain], over: conditions}\ninvert: {diameters: all}\n", []),
        (
            "rsm: {factors: [yield_stress, failure_strain], over: conditions}\ninvert: {diameters: [8 mm]}\n",
            ["invert.diameters: `rsm.over` requires several fitted values of the diameter; write `diameters: all`, or "
             "remove `rsm.over`"],
        ),
    ],
)  # fmt: skip
def test_fitted_values(tmp_path: Path, text: str, expected: list[str]) -> None:
    assert mistakes(tmp_path, text) == expected


TRAVEL = "targets: [{{diameter: 8 mm, force: 110 N, travel: 2 mm{}}}]\n"


@pytest.mark.parametrize(
    ("responses", "sds", "expected"),
    [
        ("all", ", sd: {force: 3 N, travel: 0.1 mm}", []),
        ("[force, travel]", ", sd: {force: 3 N, travel: 0.1 mm}", []),
        (
            "[travel]",
            ", sd: {force: 3 N, travel: 0.1 mm}",
            ["the list must contain the force and must not repeat a response; write [force, travel]"],
        ),
        (
            "[force, travel, force]",
            ", sd: {force: 3 N, travel: 0.1 mm}",
            ["the list must contain the force and must not repeat a response; write [force, travel]"],
        ),
        (
            "[force, travel]",
            ", sd: {force: 3 N}",
            ["no `sd` is given for travel at any diameter, so its"],
        ),
        (
            "[force, travel]",
            ", sd: {travel: 0.1 mm}",
            ["no `sd` is given for force at any diameter, so its"],
        ),
    ],
)
def test_fitted_responses(tmp_path: Path, responses: str, sds: str, expected: list[str]) -> None:
    found = mistakes(tmp_path, f"invert: {{responses: {responses}}}\n", rows=TRAVEL.format(sds))
    assert len(found) == len(expected)
    assert all(text in message for text, message in zip(expected, found, strict=True)), found


def test_a_prior_excludes_the_other_rule(tmp_path: Path) -> None:
    prior = TWO_FACTORS.replace("high: 20}", "high: 20, prior: {mean: 15, sd: 1, source: a paper}}")
    (message,) = mistakes(tmp_path, "rsm: {factors: [yield_stress]}\ninvert: {rule: others_at_centre}\n", prior)
    assert message == (
        "invert.rule: the `others_at_centre` rule ignores the priors; remove this key: with priors, the solution "
        "is the best fit to measurements and priors"
    )
    assert mistakes(tmp_path, "rsm: {factors: [yield_stress]}\ninvert: {rule: least_coded_distance}\n", prior) == []


@pytest.mark.parametrize(
    ("extra", "expected"),
    [
        ("", ["growth has no effect because 8 mm is the only diameter in the fit"]),
        ("invert: {diameters: all}\n", []),
        ("invert: {diameters: [10 mm]}\n", []),
        ("invert: {diameters: [8 mm]}\n", ["growth has no effect because 8 mm is the only diameter in the fit"]),
    ],
)
def test_an_exponent_needs_another_diameter(tmp_path: Path, extra: str, expected: list[str]) -> None:
    base = GROWING.replace("  - {name: yield_stress, unit: MPa, low: 10, high: 20}\n", "").replace(
        "yield_stress: {at: 8 mm, exponent: growth}", "yield_stress: {value: 15 MPa, at: 8 mm, exponent: growth}"
    )
    found = mistakes(tmp_path, f"rsm: {{factors: [growth, failure_strain]}}\n{extra}", base)
    assert len(found) == len(expected) and all(text in found[0] for text in expected)


def test_what_is_fitted_together(tmp_path: Path) -> None:
    def fitted(extra: str, base: str = NINE, rows: str = ROWS) -> list[float]:
        study = study_of(tmp_path, f"rsm: {{factors: [yield_stress]}}\n{extra}", base, rows)
        return [target.condition for target in fitted_together(study)]

    assert fitted("") == [] and fitted("invert: {diameters: [10 mm]}\n") == []
    assert fitted("invert: {diameters: all}\n") == [7.0, 8.0, 10.0]
    assert fitted("invert: {diameters: [10 mm, 7 mm]}\n") == [7.0, 10.0]
    prior = TWO_FACTORS.replace("high: 20}", "high: 20, prior: {mean: 15, sd: 1, source: a paper}}")
    assert fitted("", prior) == [8.0] and fitted("invert: {diameters: [10 mm]}\n", prior) == [10.0]
    both = TRAVEL.format(", sd: {force: 3 N, travel: 0.1 mm}")
    assert fitted("invert: {responses: all}\n", rows=both) == [8.0]


def test_conditions_that_the_spec_chose() -> None:
    def chose(conditions: Any) -> bool:
        study: Any = SimpleNamespace(of=lambda _kind: SimpleNamespace(conditions=conditions))
        return chose_conditions(study)

    assert [chose(conditions) for conditions in (None, "all", (8.0,))] == [False, False, True]


# ---- doubts


def doubts(options: Any, study: Study) -> list[tuple[str, str, str]]:
    return [(".".join(map(str, one.path)), one.message, one.remedy) for one in options.doubts(study)]


def test_factors_that_no_run_varies(tmp_path: Path) -> None:
    not_varied = "not screened, not listed in `rsm.factors` and therefore not varied in any run: {}"
    remedy = "list each factor, or replace its range with a fixed value"
    some = study_of(tmp_path, "screen: {design: none}\nrsm: {factors: [yield_stress]}\n", TWO_FACTORS)
    assert doubts(RsmOptions, some) == [("rsm.factors", not_varied.format("failure_strain"), remedy)]
    screened = study_of(tmp_path, "rsm: {factors: [yield_stress]}\n", TWO_FACTORS)
    assert doubts(RsmOptions, screened) == []
    quick = study_of(tmp_path, "screen: {design: none}\nrsm: {design: none}\n", TWO_FACTORS)
    assert doubts(RsmOptions, quick) == []


def test_an_exponent_that_the_screening_cannot_see(tmp_path: Path) -> None:
    """It has no effect at its own reference diameter."""
    screened = study_of(tmp_path, "", GROWING)
    (found,) = doubts(RsmOptions, screened)
    assert found[:2] == (
        "material.yield_stress.at", "growth has no effect at 8 mm, the diameter of the screening runs",
    )  # fmt: skip
    other = study_of(tmp_path, "", GROWING.replace("at: 8 mm", "at: 9 mm"))
    assert doubts(RsmOptions, other) == []
    listed_others = study_of(tmp_path, "rsm: {factors: [yield_stress, failure_strain]}\n", GROWING)
    (found,) = doubts(RsmOptions, listed_others)
    assert found[1].endswith("not varied in any run: growth")


def test_very_many_means_and_responses_of_the_mesh(tmp_path: Path) -> None:
    """101 means: 5·10⁻⁴·101² s = 5 s, 7.5·10⁻⁶·101² GB = 0.1 GB."""

    def rows(count: int) -> str:
        each = ", ".join(f"{{diameter: {7 + 0.01 * n:.2f} mm, force: {80 + n} N}}" for n in range(count))
        return f"targets: [{each}]\n"

    extra = "rsm: {factors: [yield_stress]}\ninvert: {diameters: all}\n"
    assert doubts(InvertOptions, study_of(tmp_path, extra, rows=rows(100))) == []
    (found,) = doubts(InvertOptions, study_of(tmp_path, extra, rows=rows(101)))
    assert found == (
        "invert.diameters",
        "the fit of 101 means, also without each condition, takes about 5 s and 0.1 GB in each stage that fits",
        "list fewer conditions",
    )
    mesh = study_of(tmp_path, "invert: {responses: all}\n", rows=TRAVEL.format(", sd: {force: 3 N, travel: 0.1 mm}"))
    (found,) = doubts(InvertOptions, mesh)
    assert found[0] == "invert.responses" and found[1].startswith("travel depends on the mesh: ")
    work = TRAVEL.format(", work: 100 mJ, sd: {force: 3 N, travel: 0.1 mm, work: 5 mJ}")
    (found,) = doubts(InvertOptions, study_of(tmp_path, "invert: {responses: all}\n", rows=work))
    assert found[1].startswith("travel and work depend on the mesh: ")


# ---- growing factors and the selection


def test_factors_that_grow_with_another_factor(tmp_path: Path) -> None:
    study = study_of(tmp_path, "", GROWING)
    both = ("yield_stress", "growth", "failure_strain")
    assert growing_with(study, both) == {"yield_stress": ("growth", 8.0)}
    assert growing_with(study, ("yield_stress", "failure_strain")) == {} == growing_with(study, ("growth",))
    shared = GROWING.replace(
        "tangent_modulus: 0.5 MPa", "tangent_modulus: {value: 0.5 MPa, at: 8 mm, exponent: growth}"
    )
    assert growing_with(study_of(tmp_path, "", shared), both) == {}
    assert dimensions(study, both) == 3
    over = "rsm: {factors: [yield_stress, growth, failure_strain], over: conditions}\ninvert: {diameters: all}\n"
    assert dimensions(study_of(tmp_path, over, GROWING), both) == 3  # the exponent is no coordinate, the diameter is
    assert dimensions(study_of(tmp_path, over, GROWING), ("yield_stress", "failure_strain")) == 3


SHARES = {"a": 50.0, "b": 30.0, "c": 15.0, "d": 5.0}


def selected(
    factors: Any, active: str, design: str = "central-composite", table: Any = None
) -> tuple[list[str], list[Note]]:
    """Return the factors of a surface; `active` are significant, of the shares 50, 30, 15 and 5 %."""
    options = RsmOptions(factors=factors, design=design)
    study: Any = SimpleNamespace(of=lambda _kind: options, names=tuple(SHARES))
    solver: Any = SimpleNamespace(given_design=lambda _stage: table)
    screened: Any = SimpleNamespace(shares=SHARES, active_factors=tuple(active))
    return surface_factors(study, solver, screened)


LARGEST = "The response surface uses the factors with the largest contributions: {}."


@pytest.mark.parametrize(
    ("factors", "active", "design", "names", "text"),
    [
        (("d", "a"), "b", "central-composite", "da", None),
        ("significant", "ca", "central-composite", "ac", None),
        ("significant", "a", "central-composite", "ab", LARGEST.format("a and b") + " b is not significant."),
        ("significant", "", "box-behnken", "abc", LARGEST.format("a, b and c") + " a, b and c are not significant."),
        ("strongest 2", "ab", "central-composite", "ab", LARGEST.format("a and b")),
        (
            "strongest 1",
            "ab",
            "central-composite",
            "a",
            LARGEST.format("a") + " The response surface omits the significant factor b.",
        ),
        (
            "strongest 1",
            "bcd",
            "central-composite",
            "a",
            LARGEST.format("a")
            + " a is not significant. The response surface omits the significant factors b, c and d.",
        ),
    ],
)
def test_the_factors_of_the_surface(factors: Any, active: str, design: str, names: str, text: str | None) -> None:
    found, notes = selected(factors, active, design)
    assert found == list(names)
    assert [(note.kind, note.severity, note.text) for note in notes] == (
        [] if text is None else [("strongest_factors", "caution", text)]
    )


def test_a_table_that_varies_other_factors() -> None:
    table = [{"b": 1.0, "a": 2.0, "force": 3.0}]
    assert selected("significant", "ab", table=table) == (["b", "a"], [])
    names, (note,) = selected("significant", "ac", table=table)
    assert names == ["b", "a"] and (note.kind, note.severity) == ("table_varies", "warning")
    assert note.text == "In the solver table, the factors are b and a, but the screening selected a and c."


def test_names_of_designs() -> None:
    assert rsm_options._factor_limits("box-behnken") == (3, 7)
    assert rsm_options._factor_limits("unknown")[0] == 2
    assert invert_options._MANY_MEANS == 100
