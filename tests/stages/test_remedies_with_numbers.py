"""Ranges, runs and fits that the verdict advises: each number computed by hand.

The force is F = 100 (σ/15 MPa)^0.6 (ε/0.03)^0.1 (d/8 mm)². Ranges of 10 to 20 MPa and 0.01 to 0.05 are coded ±√2, and
levels are placed within 0.85 of the radius, that is 0.85/√2 = 0.601 half ranges from the middle.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from fakes import SpecSolver
from known_results import Known, known, spec_of
from planting import NAMES

from stemcal.by_hand.options import SheetSolver
from stemcal.notes import Remedy
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.verdict import advice
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study


@dataclass(frozen=True)
class Power(SpecSolver):
    def solve(self, request: Request) -> Answer:
        stress, strain = (request.levels[name] for name in NAMES)
        force = 100.0 * (stress / 15.0) ** 0.6 * (strain / 0.03) ** 0.1 * (request.condition / 8.0) ** 2
        return Answer("ok", response=force)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return known(tmp_path_factory.mktemp("power"), spec_of(), Power(), until="rsm")


def aimed(study: Study, force: float) -> Study:
    means = tuple(t.model_copy(update={"response": force}) if t.condition == 8.0 else t for t in study.targets.means)
    return study.model_copy(update={"targets": study.targets.model_copy(update={"means": means})})


def ranged(study: Study, name: str, low: float, high: float) -> Study:
    """Return the study with another range of a factor."""
    factors = [f.model_copy(update={"low": low, "high": high}) if f.name == name else f for f in study.factors]
    return study.model_copy(update={"factors": tuple(factors)})


def edit_of(remedy: Remedy | None) -> str | None:
    return None if remedy is None else remedy.edit


def test_the_effects_are_the_powers(done: Known) -> None:
    effects, missing = advice._power_laws(aimed(done.study, 150.0), done.of(RsmResult), np.zeros(2))
    assert effects.ravel() == pytest.approx([0.6, 0.1], abs=0.02)
    assert missing == pytest.approx([math.log(1.5)], abs=0.002)


@pytest.mark.parametrize(
    ("level", "edit"),
    [
        (18.0, None),  # 0.6 half ranges above 15
        (18.1, "{name: yield_stress, high: 21}"),  # (2·18.1 − 10·0.399)/1.601 = 20.1
        (30.0, "{name: yield_stress, high: 35}"),  # 34.98
        (12.0, None),
        (11.9, "{name: yield_stress, low: 9.8}"),  # (2·11.9 − 20·0.399)/1.601 = 9.88
        (8.0, "{name: yield_stress, low: 5}"),  # 5.01
        (5.0, "{name: yield_stress, low: 2.5, high: 16}"),  # half of the level; (10 − 2.5·1.601)/0.399 = 15.03
    ],
)
def test_a_range_that_contains_a_level(done: Known, level: float, edit: str | None) -> None:
    """From the centre, 15 MPa, by the logarithm of the ratio."""
    steps = [math.log(level / 15.0), 0.0]
    found = advice._to_contain(done.study, done.of(RsmResult), np.zeros(2), steps)
    assert edit_of(found) == (None if edit is None else f"factors: [{edit}]")


def test_both_ends_in_words(done: Known) -> None:
    found = advice._to_contain(done.study, done.of(RsmResult), np.zeros(2), [math.log(5.0 / 15.0), math.log(2.0)])
    assert found is not None and found.edit is not None
    assert found.text == (
        "Lower `low` of yield_stress to 2.5 MPa, lower `high` of yield_stress to 16 MPa and raise `high` of "
        "failure_strain to 0.073."
    )
    assert found.edit == "factors: [{name: yield_stress, low: 2.5, high: 16}, {name: failure_strain, high: 0.073}]"


@pytest.mark.parametrize(
    ("name", "level", "shown"),
    [
        ("yield_stress", 1500.0, "yield_stress = 1.5e+03 MPa, which is not plausible (0.1 to 1000 MPa)"),
        ("yield_stress", 0.05, "yield_stress = 0.05 MPa, which is not plausible (0.1 to 1000 MPa)"),
        ("failure_strain", 4.0, "failure_strain = 4, which is not plausible (0.001 to 3)"),
    ],
)
def test_levels_that_no_stem_has(done: Known, name: str, level: float, shown: str) -> None:
    middle = {"yield_stress": 15.0, "failure_strain": 0.03}
    steps = [math.log(level / middle[n]) if n == name else 0.0 for n in NAMES]
    found = advice._to_contain(done.study, done.of(RsmResult), np.zeros(2), steps)
    assert found == Remedy(f"Check the units, the specimens and the loading: the measured values require {shown}.")


@pytest.mark.parametrize(
    ("target", "edit"),
    [
        (150.0, "{name: yield_stress, high: 33}"),  # 19.66·(150/120.4)^(1/0.6) = 28.4 MPa; (2·28.4 − 3.99)/1.601 = 32.9
        (125.0, "{name: yield_stress, high: 24}"),  # 20.9 MPa, 23.6
        (77.0, "{name: yield_stress, low: 7.6}"),  # 10.29·(77/77.65)^(1/0.6) = 10.1 MPa; (2·10.1 − 7.98)/1.601 = 7.68
        (60.0, "{name: yield_stress, low: 3.3}"),  # 6.7 MPa, 3.37
    ],
)
def test_the_range_of_the_strongest_factor_reaches_the_target(done: Known, target: float, edit: str) -> None:
    """The extremes of the region are 77.65 N at 10.29 MPa and 120.4 N at 19.66 MPa."""
    study, surface = aimed(done.study, target), done.of(RsmResult)
    assert advice.reach(surface) == (pytest.approx(77.65, abs=0.05), pytest.approx(120.4, abs=0.05))
    assert advice.to_reach(study, surface, target).edit == f"factors: [{edit}]"


@pytest.mark.parametrize(
    ("coded", "edit"),
    [
        ((1.4, 0.0), "{name: yield_stress, high: 25}"),
        ((-1.4, 0.3), "{name: yield_stress, low: 5}"),
        ((0.5, -0.9), "{name: failure_strain, low: 0.0055}"),  # half-way to the lowest plausible, 0.001
        ((0.5, 0.9), "{name: failure_strain, high: 0.07}"),
    ],
)
def test_from_the_edge_of_one_target(done: Known, coded: tuple[float, float], edit: str) -> None:
    """The factor nearest to the end of its range is widened by half of it."""
    assert advice.from_the_edge(done.study, done.of(RsmResult), coded, joint=False).edit == f"factors: [{edit}]"


def test_from_the_edge_of_a_joint_fit(done: Known) -> None:
    """The least step to 200 N is ln 2·(0.6, 0.1)/0.37: to about 46 MPa and 0.036; 101 N is inside already."""
    study, surface = aimed(done.study, 200.0), done.of(RsmResult)
    found = advice.from_the_edge(study, surface, [0.0, 0.0], joint=True).edit
    assert found is not None and found.startswith("factors: [{name: yield_stress, high: ") and "strain" not in found
    assert float(found.split("high: ")[1].removesuffix("}]")) == pytest.approx(55.2, abs=1.0)
    inside = advice.from_the_edge(aimed(study, 101.0), surface, [0.5, 0.4], joint=True)
    assert inside.edit == "factors: [{name: yield_stress, high: 25}]"


@pytest.mark.parametrize(
    ("width", "up", "name", "edit"),
    [
        (0.5, True, "yield_stress", "high: 25"),
        (1.0, True, "yield_stress", "high: 30"),
        (0.5, False, "yield_stress", "low: 5"),
        (2.0, False, "yield_stress", "low: 5"),  # −10 is beyond 0.1: half-way to it, 5.05, rounded down to two digits
        (0.5, True, "failure_strain", "high: 0.07"),
    ],
)
def test_wider_by_a_part_of_the_width(done: Known, width: float, up: bool, name: str, edit: str) -> None:
    found = advice.widened(done.study, done.study.factor(name), up, width)
    assert found.edit == f"factors: [{{name: {name}, {edit}}}]"
    verb, key = ("Raise", "high") if up else ("Lower", "low")
    unit = " MPa" if name == "yield_stress" else ""
    assert found.text == f"{verb} `{key}` of {name} to {edit.split(': ')[1]}{unit}."


def test_a_range_at_its_bound_cannot_be_widened(done: Known) -> None:
    study = ranged(done.study, "failure_strain", 0.001, 0.05)
    found = advice.widened(study, study.factor("failure_strain"), False, 0.5)
    assert found == Remedy("Add another factor because the range of failure_strain cannot be widened.")


def test_plausible_ranges(done: Known) -> None:
    """A parameter has its own; another program's factor up to twenty times wider, or twenty times less."""
    study = done.study
    assert advice._plausible(study, study.factor("yield_stress")) == (0.1, 1000.0)
    wide = ranged(study, "failure_strain", 0.0001, 5.0)
    assert advice._plausible(wide, wide.factor("failure_strain")) == (0.0001, 5.0)
    other = study.model_copy(update={"solver": SheetSolver()})
    assert advice._plausible(other, other.factor("yield_stress")) == (0.5, 220.0)
    signed = ranged(other, "yield_stress", -10.0, 20.0)
    assert advice._plausible(signed, signed.factor("yield_stress")) == (-610.0, 620.0)
    pascal = study.factor("yield_stress").model_copy(update={"unit": "kPa", "low": 1e4, "high": 2e4})
    assert advice._plausible(study, pascal) == (pytest.approx(100.0), pytest.approx(1e6))
    strange = study.factor("yield_stress").model_copy(update={"unit": "mm"})
    assert advice._plausible(study, strange) == (0.5, 220.0)


# ---- fits of more values


def test_all_diameters_or_responses(done: Known) -> None:
    study = done.study
    assert advice.fit_all(study, "conditions") == Remedy(
        "Fit the responses at all measured diameters jointly (`invert: {diameters: all}`).", "invert: {diameters: all}"
    )
    assert advice.fit_all(study, "conditions", "Then stop.").text.endswith(
        "jointly (`invert: {diameters: all}`). Then stop."
    )
    unknown = "Add the standard deviation (`sd`) of the force to `targets`. Then fit all measured responses jointly "
    assert advice.fit_all(study, "responses", "And on.") == Remedy(f"{unknown}(`invert: {{responses: all}}`). And on.")
    means = tuple(t.model_copy(update={"sd": 3.0 if t.condition == 8.0 else None, "n": 9}) for t in study.targets.means)
    known_ = study.model_copy(update={"targets": study.targets.model_copy(update={"means": means})})
    assert advice.fit_all(known_, "responses").edit == "invert: {responses: all}"


def test_where_to_measure_more(tmp_path: Any, done: Known) -> None:
    assert advice.measure_more(done.study).text == "Measure at another stem diameter."
    (tmp_path / "joint.yaml").write_text(spec_of(extra="invert: {diameters: all}\n"), encoding="utf-8")
    joint = load_study(tmp_path / "joint.yaml")
    assert advice.measure_more(joint).text == (
        "Measure at another stem diameter, or remove one value from `invert.diameters`."
    )


def test_halved_ranges_name_every_factor(done: Known) -> None:
    """With four runs a coefficient or more; otherwise, or without a solution, more runs."""
    surface, at = done.of(RsmResult), {"yield_stress": 16.0, "failure_strain": 0.03}
    many = replace(surface, design=replace(surface.design, runs=type(surface.design.runs)([*surface.design.runs] * 3)))
    found = advice.to_smooth(done.study, many, at)
    assert found == Remedy(
        "Halve the factor ranges around the solution (yield_stress 13.5 to 18.5 and failure_strain 0.02 to 0.04), or "
        "add `refine: {}`. If the response is not smooth, average over mesh positions with `replicates: 5`.",
        "factors: [{name: yield_stress, low: 13.5, high: 18.5}, {name: failure_strain, low: 0.02, high: 0.04}]",
    )
    for runs, levels in ((many, None), (surface, at)):
        assert "Use more runs" in advice.to_smooth(done.study, runs, levels).text
