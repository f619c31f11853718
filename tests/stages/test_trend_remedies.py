"""Advice on a trend with the diameter and on moduli along and across the axis: thresholds, sentences and edits."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from known_results import Known, known, spec_of
from planting import Law
from test_trend import DIAMETERS, fitted

from stemcal.by_hand.options import SheetSolver
from stemcal.notes import Remedy
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.verdict import direction_advice, trend_advice
from stemcal.stages.verdict.trend_advice import (
    Change,
    _as_text_and_edit,
    for_trend,
    remedies_of,
    trend_of,
    trend_reason,
)
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.vocabulary import CUTTING, Variable, Vocabulary

D = DIAMETERS.tolist()
OTHERS = " Compare with stems that do not grow: the exponent of the simulated force is {} too {}. Fibres "


# ---- a trend


def power(exponent: float, noise: float = 0.0) -> list[float]:
    """Return forces as d^(2 + exponent), with alternating errors."""
    return [d ** (2.0 + exponent) * (1.0 + noise * (-1) ** i) for i, d in enumerate(D)]


@pytest.mark.parametrize(
    ("exponent", "noise", "found"),
    [
        (0.0664, 0.0, True),  # 3 % from 7 to 11 mm: 0.03/ln(11/7) = 0.06637
        (0.0663, 0.0, False),
        (-0.0664, 0.0, True),
        (0.3, 0.02, True),
        (0.1, 0.02, False),  # ± t(0.975; 3)·s/‖ln d − mean‖ is about 0.2
    ],
)
def test_a_trend_must_be_worth_a_parameter_and_significant(exponent: float, noise: float, found: bool) -> None:
    law = trend_of(D, power(exponent, noise), power(0.0))
    assert (law is not None) is found
    if law is not None:
        assert law.exponent == pytest.approx(exponent, abs=0.03)


def test_three_diameters_are_the_fewest() -> None:
    assert trend_of(D[:3], power(0.5)[:3], power(0.0)[:3]) is not None
    assert trend_of(D[:2], power(0.5)[:2], power(0.0)[:2]) is None


ROWS = [(d, d**2.5, d**2.0, 1.0) for d in D]
TEXT = "The error depends on {}: the measured {} increases {} steeply than the simulated {}, by a factor of {}^0.50. "


def evidence(naming: Vocabulary = CUTTING, mostly_off: bool = False) -> Any:
    return SimpleNamespace(study=SimpleNamespace(naming=naming), mostly_off=mostly_off)


def test_the_reason_of_a_trend() -> None:
    remedy = Remedy("Do it.")
    (note,) = trend_reason(evidence(), ROWS, 12.345, lambda: remedy)
    assert (note.kind, note.severity, note.remedy) == ("trend", "warning", remedy)
    assert note.text == (
        TEXT.format("diameter d", "force", "more", "force", "d") + "The largest error of the simulation is 12.3 %."
    )
    (note,) = trend_reason(evidence(mostly_off=True), [(d, d**1.5, d**2.0, None) for d in D], 1.0, lambda: remedy)
    assert note.severity == "error" and "less steeply" in note.text
    assert not list(trend_reason(evidence(), ROWS[:2], 1.0, lambda: remedy))
    assert not list(trend_reason(evidence(), [(0.0, 1.0, 1.0, None), *ROWS], 1.0, lambda: remedy))
    assert not list(trend_reason(evidence(), [(d, d**2, d**2, 1.0) for d in D], 1.0, lambda: remedy))


@pytest.mark.parametrize(("unit", "reported"), [("mm", True), ("m", True), ("%", False), ("N", False)])
def test_a_condition_that_is_a_length(unit: str, reported: bool) -> None:
    span = Variable("span", "Span", "L", unit)
    angle = Variable("angle", "Angle of repose", "θ", "deg")
    found = list(trend_reason(evidence(Vocabulary(span, (angle,))), ROWS, 1.0, lambda: Remedy("")))
    assert len(found) == reported
    assert all(note.text.startswith(TEXT.format("the span L", angle.noun, "more", angle.noun, "L")) for note in found)
    assert not list(trend_reason(evidence(Vocabulary(None, (angle,))), ROWS, 1.0, lambda: Remedy("")))


def test_only_changes_that_help_enough_are_advised(monkeypatch: pytest.MonkeyPatch) -> None:
    """To 0.6 of the present largest error; the two best, the better one first."""
    case = fitted(np.array([100.0 * (d / 8.0) ** 2 for d in D]))
    now = trend_advice._worst(case.predicted, case.measured)
    assert now == pytest.approx(100.0 * np.max(np.abs(1.0 - case.predicted / case.measured)))
    errors = {"a": 0.61 * now, "b": 0.6 * now, "c": 0.2 * now, "d": 0.4 * now, "e": None}

    def change(_case: Any, name: str) -> Change | None:
        worst = errors[name]
        return None if worst is None else Change(name, 1.0, worst, 0.5)

    monkeypatch.setattr(trend_advice, "_growing", change)
    assert [found.factor for found in remedies_of(case, list(errors))] == ["c", "d"]
    assert [found.factor for found in remedies_of(case, ["a", "b"])] == ["b"]


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Known:
    law = Law(growth=0.3)
    measured = {d: law.at(0.2, 0.3, d)[0] for d in (7.0, 8.0, 10.0)}
    spec = spec_of(measured, "invert: {diameters: all}\n", ", sd: 3 N, n: 9")
    return known(tmp_path_factory.mktemp("joint"), spec, law)


@pytest.mark.parametrize(
    ("exponent", "low", "high"),
    [(0.3, "-0.2", "0.8"), (0.8, "0", "1.6"), (-0.7, "-1.4", "0"), (0.123, "-0.38", "0.62")],
)
def test_a_growing_parameter_in_words_and_yaml(joint: Known, exponent: float, low: str, high: str) -> None:
    """The range of the exponent is as wide as it is, at least ± 0.5."""
    change = Change("yield_stress", 15.0, 1.234, exponent)
    text, edit = _as_text_and_edit(joint.study, joint.of(RsmResult), change)
    lines = [
        f"factors: [{{name: yield_stress_growth, low: {low}, high: {high}}}]",
        "material: {yield_stress: {at: 8 mm, exponent: yield_stress_growth}}",
        "screen: {design: none}",
        "rsm: {factors: [yield_stress, failure_strain, yield_stress_growth]}",
    ]
    assert edit == "\n".join(lines)
    assert text == (
        f"Make yield_stress proportional to the diameter raised to the power {exponent:.2f} (predicted largest error: "
        f"1.2 %). Merge into the spec: `{{{', '.join(lines)}}}`."
    )


def with_forces(study: Study, power: float) -> Study:
    """Return the study with its measured forces times (d/8)^power."""
    means = [t.model_copy(update={"response": t.response * (t.condition / 8.0) ** power}) for t in study.targets.means]
    return study.model_copy(update={"targets": study.targets.model_copy(update={"means": tuple(means)})})


def test_the_remedy_of_a_trend(joint: Known, monkeypatch: pytest.MonkeyPatch) -> None:
    """Measured forces that grow as d^0.4 more than the surfaces."""
    study, surface, solution = with_forces(joint.study, 0.4), joint.of(RsmResult), joint.of(InvertResult).point.solution
    found = for_trend(study, surface, solution)
    assert found.edit is not None and found.edit.startswith("factors: [{name: yield_stress_growth, ")
    assert found.text.startswith("Make yield_stress proportional to the diameter raised to the power ")
    assert OTHERS.format("0.40", "low") in found.text
    changes = [Change("yield_stress", 15.0, 1.0, 0.5), Change("failure_strain", 0.03, 2.0, 0.8)]
    seen: list[Any] = []

    def two(fitted_: Any, may_grow: Any) -> list[Change]:
        seen.append((fitted_, may_grow))
        return changes

    monkeypatch.setattr(trend_advice, "remedies_of", two)
    found = for_trend(study, surface, solution)
    assert " Alternatively, make failure_strain proportional to the diameter raised to the power 0.80 " in found.text
    assert found.edit is not None and "failure_strain_growth" not in found.edit
    ((case, may_grow),) = seen
    assert may_grow == ["yield_stress", "failure_strain"] and case.at == 8.0
    assert case.diameters.tolist() == [7.0, 8.0, 10.0]
    assert case.measured == pytest.approx([target.response for target in study.targets.means])
    assert case.predicted == pytest.approx([t.response for t in joint.study.targets.means], rel=1e-4)
    assert case.region.radius is None
    changes.clear()
    none = for_trend(study, surface, solution)
    assert none.edit is None and none.text.startswith(
        "Check the wall thickness, the clearance of the supports and the "
    )
    assert "changing a single parameter of the response surface within its range. Compare with stems" in none.text


def test_another_program_is_asked_what_changes_with_the_diameter(joint: Known) -> None:
    other = joint.study.model_copy(update={"solver": SheetSolver()})
    found = for_trend(other, joint.of(RsmResult), joint.of(InvertResult).point.solution)
    assert found == Remedy(
        "Check which lengths and properties of the simulation change with the diameter, or add a factor whose effect "
        "depends on the diameter."
    )


# ---- moduli along and across the axis


ALONG, ACROSS = SimpleNamespace(name="bending", across_axis=False), SimpleNamespace(name="ring", across_axis=True)
for test in (ALONG, ACROSS):
    test.called = lambda response, test=test: f"{test.name}_{response}"  # type: ignore[attr-defined]


def required(
    monkeypatch: pytest.MonkeyPatch, across: bool, *means: tuple[str, float, float | None, int | None, float]
) -> Any:
    """Return the modulus that means (response, value, sd, n) require where the surfaces have the last number."""
    measured = [SimpleNamespace(response=r, value=v, sd=sd, n=n) for r, v, sd, n, _ in means]
    surfaces = [SimpleNamespace(predict=lambda _x, slope=slope: np.array([slope])) for *_, slope in means]
    monkeypatch.setattr(direction_advice, "measured_means", lambda _study: measured)
    monkeypatch.setattr(direction_advice, "fitted_surfaces", lambda _study, _surface: surfaces)
    study: Any = SimpleNamespace(tests=(ALONG, ACROSS))
    surface: Any = SimpleNamespace(names=("a",), scales=SimpleNamespace(to_coded=lambda levels: np.array(levels)))
    return direction_advice._required(study, surface, {"a": 1.0}, across)


def test_the_required_modulus_is_the_mean_ratio_of_the_slopes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slopes of 2 and 8 times the simulated ones need 4 times the modulus; 3 and 4 % are 2.5 % of the mean of two."""
    means = [
        ("bending_slope", 20.0, 1.2, 4, 10.0),  # 3 %
        ("bending_slope", 80.0, 9.6, 9, 10.0),  # 4 %
        ("ring_slope", 30.0, None, None, 10.0),
        ("force", 100.0, 1.0, 9, 100.0),
    ]
    names, ratio, error = required(monkeypatch, False, *means)
    assert names == ["bending"] and ratio == pytest.approx(4.0) and error == pytest.approx(0.025)
    names, ratio, error = required(monkeypatch, True, *means)
    assert names == ["ring"] and ratio == pytest.approx(3.0) and math.isnan(error)
    assert required(monkeypatch, True, *means[:2]) is None
    for value, slope in ((-1.0, 10.0), (0.0, 10.0), (20.0, 0.0), (20.0, -1.0)):
        assert required(monkeypatch, False, ("bending_slope", value, 1.0, 4, slope)) is None


def reasoned(monkeypatch: pytest.MonkeyPatch, along: Any, across: Any, **more: Any) -> list[Any]:
    values = {False: along, True: across}
    seen: list[Any] = []
    monkeypatch.setattr(direction_advice, "_required", lambda *arguments: values[arguments[-1]])
    monkeypatch.setattr(
        direction_advice, "_to_transverse", lambda *arguments: seen.append(arguments[3:]) or Remedy("r")
    )
    study = SimpleNamespace(
        naming=CUTTING, tests=(ALONG, ACROSS), is_layered=False, calibration_target=SimpleNamespace(condition=8.0),
        parameters=lambda _levels, _at: {"elastic_modulus": 500.0},
    )  # fmt: skip
    vars(study).update(more)
    off: Any = SimpleNamespace(study=study, equivalent_percent=10.0, mostly_off=bool(more.get("off")))
    notes = list(direction_advice.direction_reason(off, SimpleNamespace(), {}))  # type: ignore[arg-type]
    return [*notes, *seen]


def test_different_moduli(monkeypatch: pytest.MonkeyPatch) -> None:
    note, moduli = reasoned(monkeypatch, (["bending", "pull"], 2.0, 0.01), (["ring"], 0.5, 0.01))
    assert (note.kind, note.severity) == ("anisotropy", "warning")
    assert note.text == (
        "The tests require different elastic moduli: 1000 MPa (bending and pull) and 250 MPa (ring). The model is "
        "isotropic, so no value of its elastic modulus reproduces both slopes."
    )
    assert moduli == (1000.0, 250.0)
    off, _ = reasoned(monkeypatch, (["bending"], 2.0, 0.01), (["ring"], 0.5, 0.01), off=True)
    assert off.severity == "error"


@pytest.mark.parametrize(
    ("ratio", "errors", "found"),
    [
        (1.22, (0.0, 0.0), True),  # 1.1² = 1.21
        (1.20, (0.0, 0.0), False),
        (0.82, (0.0, 0.0), True),
        (2.0, (0.25, 0.25), True),  # ln 2 = 0.693 and 1.96·0.354 = 0.693
        (1.99, (0.25, 0.25), False),
        (2.0, (math.nan, 0.0), True),
    ],
)
def test_moduli_apart_by_size_and_by_error(
    monkeypatch: pytest.MonkeyPatch, ratio: float, errors: tuple[float, float], found: bool
) -> None:
    assert bool(reasoned(monkeypatch, (["bending"], ratio, errors[0]), (["ring"], 1.0, errors[1]))) is found


@pytest.mark.parametrize("more", [{"naming": Vocabulary(None, CUTTING.responses)}, {"tests": ()}, {"is_layered": True}])
def test_studies_without_both_moduli(monkeypatch: pytest.MonkeyPatch, more: dict[str, Any]) -> None:
    along = (["bending"], 2.0, 0.01)
    assert not reasoned(monkeypatch, along, (["ring"], 0.5, 0.01), **more)
    assert not reasoned(monkeypatch, along, None) and not reasoned(monkeypatch, None, along)


@pytest.mark.parametrize(
    ("value", "most", "keys"),
    [
        (250.0, math.inf, "low: 120, high: 500"),
        (251.0, math.inf, "low: 120, high: 510"),
        (250.0, 333.33, "low: 120, high: 333.3"),
    ],
)
def test_a_range_from_half_to_twice(value: float, most: float, keys: str) -> None:
    assert direction_advice._range(value, most) == keys


VINE = """\
name: vine
factors:
  - {name: elastic_modulus, unit: MPa, low: 100, high: 1000}
  - {name: yield_stress, unit: MPa, low: 11, high: 19}
material: {density: 1100 kg/m3, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa, hardening_parameter: 0.05,
  failure_strain: 0.03}
specimen: {diameter_ratio: 0, length: 30 mm}
solver: {rate_law: none}
screen: {design: none}
rsm: {factors: [elastic_modulus, yield_stress]}
targets: [{diameter: 8 mm, force: 110 N}]
"""


def vine(folder: Path, change: tuple[str, str] = ("", "")) -> Study:
    (folder / "vine.yaml").write_text(VINE.replace(*change), encoding="utf-8")
    return load_study(folder / "vine.yaml")


def transverse(study: Study, along: float, across: float, names: tuple[str, ...]) -> Remedy:
    surface: Any = SimpleNamespace(names=names)
    return direction_advice._to_transverse(study, surface, {"elastic_modulus": 500.0}, along, across)


def test_the_modulus_across_becomes_a_factor(tmp_path: Path) -> None:
    found = transverse(vine(tmp_path), 1000.0, 250.0, ("elastic_modulus", "yield_stress"))
    lines = [
        "material: {transverse: {}}",
        "factors: [{name: transverse_elastic_modulus, unit: MPa, low: 120, high: 500}, "
        "{name: elastic_modulus, low: 500, high: 2000}]",
        "screen: {design: none}",
        "rsm: {factors: [elastic_modulus, yield_stress, transverse_elastic_modulus]}",
    ]
    assert found.edit == "\n".join(lines)
    assert found.text == (
        f"Calibrate the modulus across the axis as well. Merge into the spec: `{{{', '.join(lines)}}}`."
    )
    screened = transverse(vine(tmp_path), 1000.0, 250.0, ("yield_stress",))
    assert str(screened.edit).endswith("rsm: {factors: [yield_stress, elastic_modulus, transverse_elastic_modulus]}")


def test_the_stiffness_stays_positive_definite(tmp_path: Path) -> None:
    """With ν = 0.4: 0.95·0.6/(2·0.16)·E/2 = 0.89 E. A larger modulus across is a mistake of the measurements."""
    nu = ("poisson_ratio: 0.3", "poisson_ratio: 0.4")
    names = ("elastic_modulus", "yield_stress")
    below, above = (transverse(vine(tmp_path, nu), 1000.0, across, names) for across in (890.0, 891.0))
    assert yaml.safe_load(str(below.edit))["factors"][0]["high"] == pytest.approx(890.6, abs=0.1)
    assert above == Remedy("Check the units of both slopes, and the specimens of both tests.")
    other = vine(tmp_path).model_copy(update={"solver": SheetSolver()})
    assert transverse(other, 1000.0, 250.0, names).edit is None


def test_a_modulus_that_is_no_factor_gets_its_value(tmp_path: Path) -> None:
    fixed = VINE.replace("  - {name: elastic_modulus, unit: MPa, low: 100, high: 1000}\n", "").replace(
        "material: {", "material: {elastic_modulus: 500 MPa, "
    )
    (tmp_path / "fixed.yaml").write_text(fixed.replace("[elastic_modulus, yield_stress]", "[yield_stress]"), "utf-8")
    found = transverse(load_study(tmp_path / "fixed.yaml"), 1234.5, 250.0, ("yield_stress",))
    assert str(found.edit).splitlines()[:2] == [
        "material: {transverse: {}, elastic_modulus: 1.23e+03 MPa}",
        "factors: [{name: transverse_elastic_modulus, unit: MPa, low: 120, high: 500}]",
    ]
