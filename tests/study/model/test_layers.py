"""Layers, fibres and measured geometry of a spec: what a stem is made of at each diameter."""

from dataclasses import asdict
from itertools import pairwise
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.cutting.build import build, through_layers
from stemcal.errors import UsageError
from stemcal.fem.material import Layers
from stemcal.solvers.deck import Deck
from stemcal.solvers.embedded import Embedded, shear_test
from stemcal.solvers.embedded import test_of as made
from stemcal.solvers.protocol import Request
from stemcal.study.model.growth import Interpolated
from stemcal.study.model.layers import _across_from
from stemcal.study.model.shear_test import Relative, TransverseSection
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study, read_study
from stemcal.study.rules.factors import wrong_levels

CASES = Path(__file__).parents[2] / "cases" / "good"
LAYERS = CASES / "layers.yaml"


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(LAYERS)


def test_each_layer_has_its_own_values_and_the_others_of_the_material(study: Study) -> None:
    test = shear_test(study, {"skin_yield_stress": 30.0, "elastic_modulus": 450.0, "wood_density": 600.0}, 8.0)
    skin, wood = test.outer
    pith = test.material
    assert [law.yield_stress for law in (skin, wood, pith)] == [30.0, 9.0, 9.0]
    assert [law.elastic_modulus for law in (skin, wood, pith)] == [3000.0, 900.0, 450.0]
    assert [law.density for law in (skin, wood, pith)] == pytest.approx([1.1e-9, 0.6e-9, 1.1e-9])
    assert [law.internal_length for law in (skin, wood, pith)] == pytest.approx([1.0, 8 / 4.5, 8 / 4.5])
    assert wood.transverse is None  # written without keys: isotropic, though the material has fibres


def test_properties_across_are_stresses_or_ratios_of_their_layer(study: Study) -> None:
    """E_T of the skin by its own factor, a ratio, else of the material; G by a factor in MPa; stresses either way."""
    levels = {"skin_transverse_elastic_modulus": 0.2, "transverse_shear_modulus": 150.0, "elastic_modulus": 500.0}
    test = shear_test(study, levels, 8.0)
    skin, pith = test.outer[0].transverse, test.material.transverse
    assert skin is not None and pith is not None
    assert (skin.elastic_modulus, pith.elastic_modulus) == pytest.approx((600.0, 250.0))
    assert (skin.shear_modulus, pith.shear_modulus) == pytest.approx((150.0, 150.0))
    assert (skin.yield_stress, pith.yield_stress) == pytest.approx((8.0, 8.0))
    assert (skin.shear_yield_stress, pith.shear_yield_stress) == pytest.approx((8.0 / sqrt(3.0), 0.4 * 9.0))
    assert (skin.poisson_ratio, pith.poisson_ratio) == (0.4, 0.4)


def test_the_default_shear_modulus_makes_the_compliance_at_45_degrees_the_mean() -> None:
    """1/E₄₅ = (1/E + 1/E_T + 1/G − 2ν/E)/4, with ν for tension along the axis, is (1/E + 1/E_T)/2."""
    along = {"elastic_modulus": 800.0, "poisson_ratio": 0.3, "yield_stress": 14.0}
    G = _across_from({"elastic_modulus": Relative(0.1, is_ratio=True)}, along)["shear_modulus"]
    at_45_degrees = (1.0 / 800.0 + 1.0 / 80.0 + 1.0 / G - 0.6 / 800.0) / 4.0
    assert at_45_degrees == pytest.approx((1.0 / 800.0 + 1.0 / 80.0) / 2.0, rel=1e-12)


def test_an_empty_section_is_the_isotropic_law(tmp_path: Path) -> None:
    """With all defaults E_T = E, G = E/2(1 + ν), yield stresses σ and σ/√3."""
    spec = LAYERS.read_text(encoding="utf-8")
    one = spec[: spec.index("layers:")] + spec[spec.index("specimen:") :]
    one = one.replace("transverse: {elastic_modulus: 0.5, poisson_ratio: 0.4, yield_stress: 8 MPa}", "transverse: {}")
    lines = [line for line in one.splitlines() if not any(name in line for name in ("skin_", "wood_", "transverse_"))]
    (tmp_path / "one.yaml").write_text("\n".join(lines).replace("name: layers", "name: one"), encoding="utf-8")
    across = shear_test(load_study(tmp_path / "one.yaml"), {"elastic_modulus": 520.0}, 8.0).material.transverse
    assert across is not None
    assert tuple(asdict(across).values()) == pytest.approx((520.0, 520.0 / 2.6, 0.3, 9.0, 9.0 / sqrt(3.0)))


@pytest.mark.parametrize(
    ("diameter", "bore", "skin", "wood"),
    [
        (7.0, 2.0, 0.5 * (7 / 8) ** 2, 0.41),
        (8.0, 2.375, 0.5, 0.5),
        (9.5, 2.9375, 0.705078125, 0.5 + 0.5 * (11 / 12 - 0.5)),
    ],
)
def test_geometry_follows_the_diameter(study: Study, diameter: float, bore: float, skin: float, wood: float) -> None:
    """A power of a factor's level, d/12 and lengths with values between them, a bore between two measured ones."""
    stem = shear_test(study, {"skin_thickness": 0.5}, diameter).stem
    assert stem.diameter_ratio * diameter == pytest.approx(bore)
    assert stem.layers == pytest.approx((skin, wood))


def test_interfaces_are_on_layers_of_nodes_with_three_elements_between(study: Study) -> None:
    """Hollow and solid: nodes on each interface, elements on one side of it, each material in its layer."""
    for ratio in (None, 0.0):
        test = shear_test(study if ratio is None else solid(study), {}, 8.0)
        radii = np.array(test.stem.radii)
        model = build(test)
        node_radii = np.linalg.norm(model.mesh.nodes[model.mesh.hexes][..., 1:], axis=2)
        layers = model.material
        assert isinstance(layers, Layers)
        for i, (low, high) in enumerate(pairwise(radii)):
            mine = node_radii[layers.of == i]
            assert mine.max() == pytest.approx(high, abs=1e-9)
            if low > 0.0:
                assert mine.min() == pytest.approx(low, abs=1e-9)
        assert min(through_layers(test.stem, test.discretisation)[1:]) >= 3
        assert [layers.materials[0], *layers.materials[:0:-1]] == [test.material, *test.outer]
        volumes = model.mesh.volumes()
        share = volumes[layers.of == 2].sum() / volumes.sum()
        exact = (radii[3] ** 2 - radii[2] ** 2) / (radii[3] ** 2 - radii[0] ** 2)
        assert share == pytest.approx(exact, rel=0.02)


def solid(study: Study) -> Study:
    specimen = study.specimen.model_copy(update={"bore": None, "diameter_ratio": 0.0})
    return study.model_copy(update={"specimen": specimen})


def test_a_measured_value_is_interpolated_and_never_extrapolated() -> None:
    measured = Interpolated(((7.0, 0.4), (8.0, 0.5), (11.0, 1.1)))
    assert [measured.at(d) for d in (7.0, 7.25, 8.0, 9.5, 11.0)] == pytest.approx([0.4, 0.425, 0.5, 0.8, 1.1])
    for beyond in (6.9, 11.1):
        assert not measured.covers(beyond)
        with pytest.raises(UsageError, match="7 to 11 mm"):
            measured.at(beyond)


def test_levels_and_diameters_outside_the_spec_are_checked(study: Study) -> None:
    levels = study.midlevels()
    assert list(wrong_levels(study, levels, 8.0)) == []
    assert len(list(wrong_levels(study, {**levels, "skin_thickness": 2.5}, 8.0))) == 1
    assert len(list(wrong_levels(study, {**levels, "skin_transverse_elastic_modulus": 5.0}, 8.0))) == 1
    with pytest.raises(UsageError, match="7 to 11 mm"):
        list(wrong_levels(study, levels, 12.0))


def test_laboratory_pieces_are_of_the_same_layers(study: Study) -> None:
    section = load_study(CASES.parents[2] / "configs" / "three-tests.yaml").tests[0]
    cut, piece = shear_test(study, {}, 8.0), made(study, section, {}, 8.0)
    assert piece.stem.layers == cut.stem.layers
    assert [law.transverse for law in piece.outer] == [law.transverse for law in cut.outer]


def test_runs_of_an_isotropic_study_keep_their_identity() -> None:
    """The keys of layers and fibres are not in the records of stems without them."""
    isotropic = load_study(CASES.parents[2] / "configs" / "smoke.yaml")
    (test,) = Embedded(isotropic).identity(Request("rsm", 0, isotropic.midlevels(), 8.0))["tests"]
    assert "outer" not in test and "layers" not in test["stem"] and "transverse" not in test["material"]


def test_each_layer_is_in_the_identity_of_a_run(study: Study) -> None:
    levels = study.midlevels()
    keys = [
        str(Embedded(study).identity(Request("rsm", 0, {**levels, **change}, 8.0)))
        for change in ({}, {"skin_thickness": 0.41}, {"skin_transverse_elastic_modulus": 0.21}, {"wood_density": 601.0})
    ]
    assert len(set(keys)) == len(keys)


def test_a_deck_with_fibres_is_refused(study: Study) -> None:
    with pytest.raises(UsageError, match=r"MAT_157.*remove `transverse`"):
        Deck.of(study, study.midlevels(), 8.0)


def test_a_span_with_much_shear_is_questioned(tmp_path: Path) -> None:
    """Hemp, solid: shear over bending is 12 · 54.5 · (d/4)² / (6/7 · L²), 25 % of both; the span named has 5 %."""
    spec = LAYERS.read_text(encoding="utf-8")
    spec = spec[: spec.index("factors:")] + (
        "factors:\n  - {name: yield_stress, unit: MPa, low: 8, high: 12}\n"
        + spec[spec.index("material:") : spec.index("layers:\n")]
    ).replace("  yield_stress: 9 MPa\n", "  elastic_modulus: 1743.5 MPa\n").replace(
        "elastic_modulus: 0.5,", "shear_modulus: 31.99 MPa,"
    )
    bending = "  - {name: bending, kind: three-point-bending, stroke: 1 mm, span: SPAN mm}\n"
    rest = "specimen: {diameter_ratio: 0}\ntests:\n" + bending + "targets: [{diameter: 8 mm, force: 150 N}]\n"
    rest += "solver: {kind: embedded, rate_law: none}\n"
    path = tmp_path / "hemp.yaml"

    def asked(span: float) -> list[str]:
        path.write_text(
            (spec + rest).replace("SPAN", f"{span:g}").replace("name: layers\n", "name: hemp\n"), encoding="utf-8"
        )
        return [line for line in load_study(path).warnings if "shear" in line]

    (line,) = asked(96.0)
    assert "25 %" in line
    enough = float(line.rpartition("span of ")[2].partition(" mm")[0])
    assert asked(0.98 * enough) and not asked(1.01 * enough)


@pytest.mark.parametrize("written", [0.2, "20 %", "200 MPa", "0.2 GPa"])
def test_a_ratio_may_be_a_percentage(written: Any) -> None:
    section = TransverseSection.model_validate({"elastic_modulus": written}, context={"spec": Path()})
    assert section.elastic_modulus is not None and section.elastic_modulus.of(1000.0) == pytest.approx(200.0, rel=1e-12)


def test_a_ratio_far_from_that_of_stems_is_questioned(tmp_path: Path) -> None:
    """A shear modulus of 80 without its unit would be 80 times the elastic modulus."""
    for written, doubts in (("80", 1), ("0.1", 0)):
        spec = (CASES / "thin-layer-at-speed.yaml").read_text("utf-8")
        spec = spec.replace("{yield_stress: 40 %}", f"{{shear_modulus: {written}}}")
        warnings = [text for text in read_study(spec.encode(), tmp_path / "s.yaml").warnings if "shear_modulus" in text]
        assert len(warnings) == doubts and all("80 is outside" in warning for warning in warnings)
