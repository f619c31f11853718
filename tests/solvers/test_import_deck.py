"""Decks read as studies: there and back gives the same model, a foreign deck what of it fits, the rest told."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.cutting import Blade, Stem, Supports
from stemcal.cutting.build import through_wall
from stemcal.errors import UsageError
from stemcal.solvers.deck import Deck, DeckForm, deck_text
from stemcal.solvers.deck.tools import blade_mesh, supports_mesh
from stemcal.solvers.deck_import.importing import imported
from stemcal.solvers.deck_import.shapes import blade_of, stem_of, supports_of
from stemcal.solvers.deck_import.spec_text import spec_text
from stemcal.solvers.embedded import shear_test
from stemcal.study.model import Study
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
SMOKE = load_study(CONFIGS / "smoke.yaml")


def exported(study: Study) -> str:
    return deck_text(Deck.of(study, study.midlevels(), study.specimen.outer_diameter))


TEXT = exported(SMOKE)


def reread(text: str, folder: Path, units: str = "mm-t-s") -> Study:
    path = folder / "back.yaml"
    path.write_text(spec_text(imported(text, units), "back", "run.k"), encoding="utf-8")
    return load_study(path)


def cards_of(text: str) -> list[str]:
    return [line for line in text.splitlines() if not line.startswith("$")]


def test_of(study: Study) -> dict[str, Any]:
    """Return the shear test as plain values, the elements through the wall counted."""
    test = shear_test(study, study.midlevels(), study.specimen.outer_diameter)
    plain = asdict(test)
    plain["discretisation"]["through_wall"] = through_wall(test.stem, test.discretisation)
    return plain


test_of.__test__ = False  # type: ignore[attr-defined]


def assert_same(found: Any, expected: Any, rel: float, name: str = "") -> None:
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for key, value in expected.items():
            assert_same(found[key], value, rel, f"{name}.{key}")
    else:
        number = isinstance(expected, float)
        assert found == (pytest.approx(expected, rel=rel, abs=1e-6 * rel) if number else expected), name


# ---- there and back


def variant(**sections: dict[str, object]) -> Study:
    changed = {name: getattr(SMOKE, name).model_copy(update=values) for name, values in sections.items()}
    return SMOKE.model_copy(update=changed)


VARIANTS = {
    "smoke": SMOKE,
    "one bevel, sharp": variant(blade={"bevel": "one", "edge_radius": 0.0}, solver={"symmetry": "none"}),
    "full elements, usual rate law": variant(
        blade={"bevel": "one"},
        solver={"element": "full", "rate_law": "cowper_symonds", "edge_over": "elements", "symmetry": "half"},
    ),
    "square supports, viscous": variant(
        supports={"fillet_radius": 0.0, "clearance": 15.0},
        solver={"hourglass": SMOKE.solver.hourglass.model_copy(update={"form": "viscous"}), "time_step": None},  # type: ignore[union-attr]
        contact={"penalty": 0.1, "static_friction": 0.3, "decay": 0.01},
    ),
}


@pytest.mark.parametrize("study", VARIANTS.values(), ids=VARIANTS.keys())
def test_spec_deck_spec_gives_the_same_model(study: Study, tmp_path: Path) -> None:
    text = exported(study)
    back = reread(text, tmp_path)
    assert_same(test_of(back), test_of(study), 1e-9)
    assert cards_of(exported(back)) == cards_of(text)


def test_plastic_kinematic_in_long_format_comes_back(tmp_path: Path) -> None:
    levels = {**SMOKE.midlevels(), "yield_stress": 14.204482103412}
    text = deck_text(Deck.of(SMOKE, levels, 8.0, DeckForm("mat003", long=True)))
    assert "*MAT_PLASTIC_KINEMATIC+" in text
    back = reread(text, tmp_path)
    assert back.midlevels()["yield_stress"] == pytest.approx(14.204482103412, rel=1e-11)
    assert back.material.hardening_parameter == 0.05


def test_force_that_holds_the_place_of_the_measured_one_is_of_its_size(tmp_path: Path) -> None:
    """A σy/√3 of the tube of 8 mm and 0.41, 15 MPa: 362.1 N."""
    assert reread(TEXT, tmp_path).targets.means[0].response == 360.0


def test_changed_cards_prevail_over_what_the_comments_keep(tmp_path: Path) -> None:
    changed = TEXT.replace("-6.6191e-5", "   -2.0e-5").replace("         4      0.01\n", "         4       0.1\n")
    back = reread(changed, tmp_path)
    assert back.solver.time_step == pytest.approx(1.8e-5)  # type: ignore[union-attr]
    assert back.solver.mass_scaling == 1.0  # type: ignore[union-attr]
    assert back.solver.hourglass.coefficient == 0.1  # type: ignore[union-attr]


# ---- parts of a test


def part_of(text: str, axes: tuple[int, ...], parts: str = "123") -> str:
    """Return a deck without elements of these parts whose middle lies below 0 of these axes, nor settings."""
    lines = [line for line in text.splitlines() if not line.startswith("$> ")]
    first = lines.index("*ELEMENT_SOLID")
    at: dict[str, list[float]] = {}
    for line in lines[lines.index("*NODE") + 2 : first]:
        at[line[:8].strip()] = [float(line[8 + 16 * i : 24 + 16 * i]) for i in range(3)]

    def stays(line: str) -> bool:
        if line[0] in "*$" or line[15] not in parts:
            return True
        corners = np.array([at[line[16 + 8 * i : 24 + 8 * i].strip()] for i in range(8)])
        return bool((corners.mean(axis=0)[list(axes)] > 0.0).all())

    return "\n".join([*lines[: first + 1], *(line for line in lines[first + 1 :] if stays(line))]) + "\n"


@pytest.mark.parametrize(("axes", "symmetry"), [((), "none"), ((1,), "half"), ((0, 1), "quarter")])
def test_parts_of_a_model_are_the_whole_one(axes: tuple[int, ...], symmetry: str, tmp_path: Path) -> None:
    text = part_of(exported(variant(blade={"edge_radius": 0.0})), axes)
    back = test_of(reread(text, tmp_path))
    expected = test_of(variant(blade={"edge_radius": 0.0}))
    for part in ("stem", "supports"):
        assert_same(back[part], expected[part], 1e-6, part)
    assert back["blade"]["thickness"] == pytest.approx(2.3)
    assert back["discretisation"]["symmetry"] == ("quarter" if symmetry == "none" else symmetry)
    told = [sentence for sentence in imported(text).leaves if f"a {symmetry} model" in sentence]
    assert len(told) == (symmetry != "none")


def test_a_stem_that_is_neither_whole_nor_halved_is_refused() -> None:
    with pytest.raises(UsageError, match=r"section is 8 by 4\.14 mm across and along the blade's way"):
        imported(part_of(TEXT, (2,), parts="1"))
    with pytest.raises(UsageError, match="cut off under the blade, but not halved lengthwise"):
        imported(part_of(exported(variant(blade={"edge_radius": 0.0})), (0,)))


def test_blade_moved_by_a_displacement(tmp_path: Path) -> None:
    begin = TEXT.index("*BOUNDARY_PRESCRIBED_MOTION_RIGID")
    end = TEXT.index("*CONTACT", begin)
    moved = TEXT[begin:end].replace("         3         0         1", "         3         2         1")
    lines = moved.rstrip().splitlines()
    speed, duration = SMOKE.loading.speed, 2.0 * SMOKE.loading.duration
    moved = "\n".join([*lines[:-2], f"{0.0!r:>20}{0.0!r:>20}", f"{duration!r:>20}{duration * speed!r:>20}", ""])
    back = reread(TEXT[:begin] + moved + TEXT[end:], tmp_path)
    assert back.loading.speed == pytest.approx(speed, rel=1e-9)


# ---- foreign decks


def foreign(text: str) -> str:
    """Return a deck as another hand writes it: free format, kg, mm, ms, stem along y, up along −x, more keywords."""
    lines = []
    keyword, card = "", 0
    for line in cards_of(text):
        if line.startswith("*"):
            keyword, card = line[1:].removesuffix("_ID"), 0
            line = line.replace("PIECEWISE_LINEAR_PLASTICITY", "024").replace("_ID", "")
        elif line.endswith(" and stem"):
            continue  # its heading
        else:
            card += 1
            line = _foreign_card(keyword, card, line)
        lines.append(line)
    lines[1:1] = ["*TITLE", "somebody's stem", "*LOAD_BODY_Z", "1,9.81e-3", "*HOURGLASS", "1,5,0.1"]
    return "\r\n".join(lines) + "\r\n"


_TENS = lambda line: [line[at : at + 10].strip() for at in range(0, len(line), 10)]  # noqa: E731


def _foreign_card(keyword: str, card: int, line: str) -> str:
    if keyword == "NODE":
        node, x, y, z = line[:8], *(float(line[8 + 16 * i : 24 + 16 * i]) for i in range(3))
        return f"{node.strip()},{-z + 7.0!r},{x - 3.0!r},{-y!r}"  # stem along y, up is −x
    if keyword in ("ELEMENT_SOLID", "PART"):
        return line
    fields = _TENS(line) if keyword != "DEFINE_CURVE" or card == 1 else [line[:20].strip(), line[20:].strip()]
    scales = {
        ("MAT_PIECEWISE_LINEAR_PLASTICITY", 1): {1: 1e3, 2: 1e-3, 4: 1e-3, 5: 1e-3},  # t → kg, MPa → GPa
        ("MAT_RIGID", 1): {1: 1e3, 2: 1e-3},
        ("CONTROL_TERMINATION", 1): {0: 1e3},
        ("CONTROL_TIMESTEP", 1): {4: 1e3},
        ("DATABASE_RCFORC", 1): {0: 1e3},
    }.get((keyword, card), {})
    if keyword == "DEFINE_CURVE" and card > 1:
        scales = {0: 1e3, 1: 1e-3}
    if keyword == "BOUNDARY_PRESCRIBED_MOTION_RIGID":
        fields[1], fields[4] = "1", "1.0"
    return ",".join(repr(float(f) * scales[i]) if i in scales else f for i, f in enumerate(fields))


def test_foreign_deck_becomes_a_study_and_the_rest_is_told(tmp_path: Path) -> None:
    text = foreign(TEXT)
    found = imported(text, "mm-kg-ms")
    assert [sentence for sentence in found.leaves if "LOAD_BODY_Z" in sentence] == ["*LOAD_BODY_Z at line 4 (1 cards)"]
    assert any("*HOURGLASS" in sentence for sentence in found.leaves)
    assert any("edge spread" in sentence for sentence in found.leaves)
    back, expected = reread(text, tmp_path, "mm-kg-ms"), test_of(SMOKE)
    got = test_of(back)
    for part in ("stem", "supports", "loading"):
        assert_same(got[part], expected[part], 1e-6, part)
    for name in ("thickness", "width", "edge_angle", "edge_radius"):
        assert got["blade"][name] == pytest.approx(expected["blade"][name], rel=1e-5), name
    for name in ("density", "elastic_modulus", "poisson_ratio", "yield_stress", "tangent_modulus", "failure_strain"):
        assert got["material"][name] == pytest.approx(expected["material"][name], rel=1e-9), name
    assert got["material"]["hardening_parameter"] == 1.0
    assert got["blade"]["edge_spread"] == got["material"]["internal_length"] == 0.0
    assert got["discretisation"]["coarsening"] == expected["discretisation"]["coarsening"]
    assert back.solver.time_step == pytest.approx(6.6191e-5 * 0.9, rel=1e-3)  # type: ignore[union-attr]


def test_mesh_of_another_kind_is_told(tmp_path: Path) -> None:
    text = TEXT
    node = text.index("*NODE\n")
    moved = re.sub(r"(\n {7}5).{16}", rf"\g<1>{-14.9:16.4f}", text[node:], count=1)
    leaves = imported(text[:node] + moved).leaves
    assert leaves == ["*NODE, *ELEMENT_SOLID: the stem is meshed otherwise than the embedded solver does"]


def test_fields_without_counterpart_are_told() -> None:
    none, curve = (f"       0.0       0.0{lcss:10d}         0       0.0\n" for lcss in (0, 7))
    text = TEXT.replace(none, curve, 1)
    (sentence,) = imported(text).leaves
    assert re.fullmatch(r"\*MAT_PIECEWISE_LINEAR_PLASTICITY at line \d+: lcss = 7", sentence)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("*MAT_PIECEWISE_LINEAR_PLASTICITY", "*MAT_WOOD"),
            "0 parts of *MAT_003 or *MAT_024 where the stem is one (found: none)",
        ),
        (("*BOUNDARY_PRESCRIBED_MOTION_RIGID", "*BOUNDARY_SPC"), "there are 0 blades (found: none)"),
        (("*DEFINE_CURVE", "*DEFINE_TABLE"), "*DEFINE_CURVE 1"),
        (("*ELEMENT_SOLID", "*ELEMENT_SHELL"), "no solid elements of stem"),
        (("*NODE\n", "*NODE_FAR\n"), "nodes that are not there, such as 1"),
        (("    1000.0       0.3      ", "       0.0       0.3      "), "none that can be computed with"),
        (("      15.0", "    &sigma"), "&sigma"),
        (('$> {"edge', '$> "edge'), "are damaged"),
    ],
)
def test_what_is_missing_is_told(change: tuple[str, str], said: str) -> None:
    with pytest.raises(UsageError, match=re.escape(said)):
        imported(TEXT.replace(*change))


def test_parts_and_sections_in_one_keyword(tmp_path: Path) -> None:
    apart = re.sub(r"\*(PART|SECTION_SOLID)\n", "", TEXT)
    for name, first in (("SECTION_SOLID", "$#   secid    elform"), ("PART", "stem\n$#     pid")):
        apart = apart.replace(first, f"*{name}\n{first}", 1)
    assert apart.count("*PART") == apart.count("*SECTION_SOLID") == 1
    assert imported(apart) == imported(TEXT)


# ---- shapes


@pytest.mark.parametrize("bevel", ["both", "one"])
@pytest.mark.parametrize(("angle", "radius"), [(37.5, 0.1), (20.0, 0.0), (60.0, 0.35)])
def test_blade_is_found_from_its_nodes(bevel: Any, angle: float, radius: float) -> None:
    blade = Blade(2.3, 28.0, angle, radius, bevel)
    found = blade_of(blade_mesh(blade, 90.0, 4.001, 0.7).nodes)
    assert_same(asdict(found), asdict(blade), 1e-5)


def test_stem_and_supports_are_found_from_their_nodes() -> None:
    stem = Stem(7.3, 0.52, 44.0)
    nodes = np.concatenate([supports_mesh(s, stem, 1.0).nodes for s in (Supports(18.0, 0.8),)])
    assert supports_of(nodes) == Supports(18.0, 0.8)
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = np.array([[x, r * np.cos(a), r * np.sin(a)] for x in (-22.0, 22.0) for r in (3.65, 1.898) for a in turn])
    assert asdict(stem_of(ring)) == pytest.approx(asdict(stem), rel=1e-9)
