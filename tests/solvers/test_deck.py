"""The keyword deck, read back by readers that are not ours."""

import re
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from deck_as_embedded import as_embedded

from stemcal.cutting.build import build
from stemcal.cutting.parts import Blade, Stem, Supports
from stemcal.errors import UsageError
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.solvers.deck import Deck, DeckForm, deck_text
from stemcal.solvers.deck.equivalents import (
    contact_scale,
    nonlocal_length,
    nose_radius,
    share_in_openradioss,
    shortest,
    wanted_step,
)
from stemcal.solvers.deck.keywords import fitted, keyword
from stemcal.solvers.deck.tools import _even, _rounding, blade_mesh, supports_mesh
from stemcal.solvers.deck.writer import engine_text, starter_around, stem_material
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study
from stemcal.study.types.field_types import Length

CONFIGS = Path(__file__).parents[2] / "configs"
STUDY = load_study(CONFIGS / "wild-chrysanthemum-as-published.yaml")
# Table 12 of the published study.
CALIBRATED = {**STUDY.midlevels(), "yield_stress": 17.96, "strain_rate_c": 87.27, "failure_strain": 0.0387}
MATERIAL = {"ro": 1.1e-09, "e": 1000.0, "pr": 0.3, "sigy": 17.96, "etan": 0.5, "beta": 0.05}
MATERIAL |= {"src": 87.27, "srp": 8.0, "fs": 0.0387}
# the same on the card of isotropic hardening with failure; the printed rate law has no effect at this speed
FAILING = {"ro": 1.1e-09, "e": 1000.0, "pr": 0.3, "sigy": 17.96, "etan": 0.5, "fail": 0.0387, "c": 0.0, "p": 0.0}
KEYWORDS = [
    *("CONTROL_TERMINATION", "CONTROL_TIMESTEP", "CONTROL_HOURGLASS", "CONTROL_ENERGY", "CONTROL_CONTACT"),
    *("DATABASE_GLSTAT", "DATABASE_RCFORC", "DATABASE_BINARY_D3PLOT"),
    *("MAT_PIECEWISE_LINEAR_PLASTICITY", "MAT_RIGID", "MAT_RIGID", "SECTION_SOLID", "SECTION_SOLID"),
    *("PART", "PART", "PART", "BOUNDARY_PRESCRIBED_MOTION_RIGID", "DEFINE_CURVE"),
    *("CONTACT_ERODING_SURFACE_TO_SURFACE_ID", "CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID", "NODE", "ELEMENT_SOLID"),
]
# Of the keywords that OpenRadioss's reader lists (data_hierarchy.cfg of Keyword971_R14.1) those in use here.
OPENRADIOSS = {
    *("CONTROL_TERMINATION", "CONTROL_TIMESTEP", "CONTROL_HOURGLASS", "CONTROL_ENERGY"),
    *("CONTROL_CONTACT", "DATABASE_GLSTAT", "DATABASE_RCFORC", "DATABASE_BINARY_D3PLOT", "MAT_RIGID"),
    *("MAT_PIECEWISE_LINEAR_PLASTICITY", "MAT_PLASTIC_KINEMATIC"),
    *("SECTION_SOLID", "PART", "BOUNDARY_PRESCRIBED_MOTION_RIGID", "DEFINE_CURVE", "NODE", "ELEMENT_SOLID"),
    *("CONTACT_ERODING_SURFACE_TO_SURFACE_ID", "CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID"),
}
# every value but those of the mesh and the material, as each reader calls it
VALUES = {
    "CONTROL_TERMINATION": {"endtim": 0.5},
    "CONTROL_TIMESTEP": {"tssfac": STUDY.solver.time_step_safety, "isdo": 0},  # type: ignore[union-attr]
    "CONTROL_HOURGLASS": {"ihq": 4, "qh": 0.01},
    "CONTROL_CONTACT": {"slsfac": 1.0},
    "CONTROL_ENERGY": {"hgen": 2, "rwen": 2, "slnten": 2, "rylen": 1},
    "DATABASE_GLSTAT": {"dt": 0.001, "binary": 1},
    "DATABASE_RCFORC": {"dt": 0.001, "binary": 1},
    "DATABASE_BINARY_D3PLOT": {"dt": 0.01},
    "BOUNDARY_PRESCRIBED_MOTION_RIGID": {"pid": 2, "dof": 3, "vad": 0, "lcid": 1, "sf": -1.0},
    "CONTACT_ERODING_SURFACE_TO_SURFACE_ID": {
        "fs": 0.15,
        "fd": 0.1,
        "dc": 0.0,
        "vdc": 50.0,
        "isym": 0,
        "erosop": 1,
        "iadj": 1,
    },
    "CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID": {"fs": 0.15, "fd": 0.1, "vdc": 50.0},
}


MANY_DIGITS = {**CALIBRATED, "yield_stress": 14.204482103412, "failure_strain": 0.1 + 0.2}


def written(folder: Path, **given: Any) -> Path:
    deck = Deck.of(**{"study": STUDY, "levels": CALIBRATED, "diameter": 8.0, **given})
    path = folder / "run.k"
    path.write_text(deck_text(deck), encoding="utf-8", newline="\n")
    return path


@pytest.fixture(scope="module")
def deck(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("deck"))


@pytest.fixture(scope="module")
def mat003(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("deck"), form=DeckForm("lsdyna"))


def dynars() -> Any:
    reason = 'dynars is missing (it has no wheels for macOS): pip install "stemcal[deck-test]"'
    return pytest.importorskip("dynars", reason=reason)


def by_dynars(path: Path) -> Any:
    """Read a deck without the contacts' numbers and headings: dynars takes these for the first card."""
    text = re.sub(r"(\*CONTACT_\w+)_ID\n.*\n", r"\1\n", path.read_text(encoding="utf-8"))
    plain = path.with_name("plain.k")
    plain.write_text(text, encoding="utf-8", newline="\n")
    return dynars().parse_deck(str(plain))


def mesh_reader() -> Any:
    reason = 'lsdyna-mesh-reader is missing: pip install "stemcal[deck-test]"'
    return pytest.importorskip("lsdyna_mesh_reader", reason=reason)


# ---- what stands in it


def test_keywords_in_order(deck: Path) -> None:
    lines = deck.read_text(encoding="utf-8").splitlines()
    assert [line[1:] for line in lines if line.startswith("*")] == ["KEYWORD", *KEYWORDS, "END"]
    assert max(len(line) for line in lines if not line.startswith("$")) == 80
    assert set(KEYWORDS) <= OPENRADIOSS


def test_dynars_reads_every_value(deck: Path) -> None:
    read = by_dynars(deck)
    for name, values in VALUES.items():
        found = read.keywords(name.removesuffix("_ID"))[0]
        assert {key: found.field(key) for key in values} == values, name
    assert {key: read.material(1).field(key) for key in FAILING} == FAILING
    for number, held in ((2, 4), (3, 7)):
        rigid = {"ro": 7.8e-09, "e": 1000.0, "pr": 0.3, "cmo": 1.0, "con1": held, "con2": 7}
        assert {key: read.material(number).field(key) for key in rigid} == rigid
    assert [read.part(n).field("mid") for n in (1, 2, 3)] == [1, 2, 3]


# What newer manuals, and dynars with them, call fields of contacts and of *MAT_RIGID.
OLDER = "ssid msid sstyp mstyp sboxid mboxid spr mpr sfs sfm sst mst sfst sfmt lco"
NEWER = "surfa surfb surfatyp surfbtyp saboxid sbboxid sapr sbpr sfsa sfsb sast sbst sfsat sfsbt lco_or_a1"
NAMES = dict(zip(OLDER.split(), NEWER.split(), strict=True))


def named_values(path: Path) -> Iterator[tuple[str, int, str, float]]:
    """Yield keyword, its count, field and value of every card but those of mesh, curve and titles."""
    counts: Counter[str] = Counter()
    for line, card in pairwise(path.read_text(encoding="utf-8").splitlines()):
        if line.startswith("*"):
            name, width = line[1:].removesuffix("+"), 20 if line.endswith("+") else 10
            counts[name] += 1
        elif line.startswith("$#") and name not in ("NODE", "ELEMENT_SOLID"):
            for at in range(0, len(line), width):
                field = line[at : at + width].removeprefix("$#").strip()
                yield name, counts[name] - 1, field, float(card[at : at + width])


def test_dynars_finds_every_value_under_its_name(deck: Path) -> None:
    read, compared = by_dynars(deck), 0
    for name, count, field, value in named_values(deck):
        card = read.keywords(name.removesuffix("_ID"))[count]
        found = card.field(field)
        assert (card.field(NAMES.get(field, field)) if found is None else found) == value, (name, count, field)
        compared += 1
    assert compared == 156


def test_plastic_kinematic_has_the_nine_parameters(mat003: Path) -> None:
    material = by_dynars(mat003).material(1)
    given = {**MATERIAL, "src": 0.0, "srp": 0.0}  # the printed rate law has no effect at this speed
    assert {key: material.field(key) for key in given} == given


def test_ten_columns_round(tmp_path: Path) -> None:
    rounded = Deck.of(STUDY, MANY_DIGITS, 8.0)
    assert rounded.material["sigy"] == 14.2044821
    assert by_dynars(written(tmp_path, levels=MANY_DIGITS)).material(1).field("sigy") == 14.2044821


def test_two_readers_find_the_mesh(deck: Path) -> None:
    parts = Deck.of(STUDY, CALIBRATED, 8.0).parts
    nodes = np.concatenate([mesh.nodes for mesh in (parts.stem, parts.blade, parts.supports)])
    offsets = np.cumsum([1, len(parts.stem.nodes), len(parts.blade.nodes)])
    meshes = (parts.stem, parts.blade, parts.supports)
    hexes = np.concatenate([mesh.hexes + offset for mesh, offset in zip(meshes, offsets, strict=True)])

    read = mesh_reader().Deck(str(deck))
    section = read.element_solid_sections[0]
    assert np.abs(read.node_sections[0].coordinates - nodes).max() < 1e-11
    assert np.array_equal(section.node_ids.reshape(-1, 8), hexes)
    assert np.bincount(section.pid).tolist() == [0, *(len(mesh.hexes) for mesh in meshes)]

    table = by_dynars(deck).table("ELEMENT_SOLID")
    assert np.array_equal(np.stack([table[f"N{i}"] for i in range(1, 9)], axis=1), hexes)


# ---- the tools


@pytest.mark.parametrize("bevel", ["both", "one"])
@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_blade_has_its_size_and_its_angle(bevel: Any, radius: float) -> None:
    blade = Blade(thickness=2.3, width=28.0, edge_angle=37.5, edge_radius=radius, bevel=bevel)
    mesh = blade_mesh(blade, length=90.0, lowest=4.001, size=1.0)
    size = np.ptp(mesh.nodes, axis=0)
    assert size == pytest.approx([2.3, 90.0, 28.0], rel=1e-12)
    assert mesh.nodes[:, 2].min() == pytest.approx(4.001 + 0.0, abs=1e-12)
    assert mesh.volumes().min() > 0.0
    # body less the wedge's two (or one) triangles: half the thickness over tan of half the angle, or one over tan
    lean = np.radians(37.5 / 2 if bevel == "both" else 37.5)
    triangles = 2.3**2 / 4 / np.tan(lean) if bevel == "both" else 2.3**2 / 2 / np.tan(lean)
    if radius == 0.0:
        assert mesh.volumes().sum() == pytest.approx(90.0 * (2.3 * 28.0 - triangles), rel=1e-9)
    flank = mesh.nodes[np.isclose(mesh.nodes[:, 1], -45.0)]
    right = flank[flank[:, 2] < 4.001 + 2.0]
    ends = right[np.argsort(right[:, 0])][-1], right[np.argsort(right[:, 2])][0]
    assert ends[0][0] > ends[1][0]


def test_elements_of_the_body_of_a_blade_are_four_times_longer() -> None:
    """Elements of 0.5 mm at the edge; above the shoulder at 2.3/2/tan 18.75° = 3.39 mm, 13 of 24.61/13 = 1.89 mm."""
    mesh = blade_mesh(Blade(thickness=2.3, width=28.0, edge_angle=37.5, edge_radius=0.0), 90.0, 0.0, size=0.5)
    heights = np.unique(np.round(mesh.nodes[:, 2], 9))
    above = np.diff(heights[heights > 3.38])
    assert len(above) == 13 and above == pytest.approx(24.612 / 13, rel=1e-3)


def test_a_blade_that_is_thinner_than_its_rounding_is_widened() -> None:
    """A rounding of 0.1 mm between flanks of 10° is 2·0.1·cos 10° wide."""
    blade = Blade(thickness=0.1, width=28.0, edge_angle=20.0, edge_radius=0.1)
    assert np.ptp(blade_mesh(blade, 90.0, 0.0, size=0.5).nodes[:, 0]) == pytest.approx(0.19696, rel=1e-4)


def test_supports_leave_the_clearance_and_touch_the_stem() -> None:
    stem, supports = Stem(8.0, 0.41, 50.0), Supports(20.0, 1.0)
    mesh = supports_mesh(supports, stem, 1.0)
    x, z = mesh.nodes[:, 0], mesh.nodes[:, 2]
    assert z.max() == -4.0
    assert np.abs(x).min() == 10.0
    assert np.abs(x[z == z.max()]).min() == pytest.approx(11.0, abs=1e-12)  # the fillet's end
    assert np.abs(x).max() >= 25.0
    assert np.array_equal(np.unique(np.round(x, 9)), np.unique(np.round(-x, 9)))
    assert mesh.volumes().min() > 0.0


# ---- the embedded solver's numbers in LS-DYNA's words

CUBE = brick((2.0, 2.0, 2.0), (2, 2, 2))
LAW = Material(1e-9, 1000.0, 0.3)


def test_time_step_of_a_cube_is_its_side_over_the_speed_of_sound() -> None:
    assert shortest(CUBE) == pytest.approx(1.0, rel=1e-12)
    scaled = STUDY.solver.model_copy(update={"mass_scaling": 100.0, "time_step": None})
    speed = (LAW.p_wave_modulus / LAW.density) ** 0.5
    assert wanted_step(scaled, CUBE, LAW) == pytest.approx(10.0 / speed, rel=1e-12)
    assert wanted_step(scaled.model_copy(update={"time_step": 1e-3}), CUBE, LAW) == pytest.approx(1e-3 / 0.9, rel=1e-12)


def test_penalty_of_a_cube_is_the_same_in_both_definitions() -> None:
    """A corner of 8 unit cubes bears an eighth of one: p m/Δt² over K A²/V with A = V = 1."""
    solver = STUDY.solver.model_copy(update={"mass_scaling": 1.0, "time_step": 1e-3})
    mass = 1e-9 * (1e-3 / (0.9 * 2.0 / (8.0 * _bound(LAW) / 1e-9) ** 0.5)) ** 2
    nodes = np.array([1.0, 2.0, 2.0, 4.0]) / 8.0  # cubes at the nodes of a face that meets a corner of the block
    expected = 0.25 * mass * nodes.mean() / 1e-6 / LAW.bulk_modulus
    found = contact_scale(solver, CUBE, LAW, 0.25, (0.0, 0.0, 0.0))
    assert found == pytest.approx(expected, rel=1e-9)


def _bound(law: Material) -> float:
    """λ tr G + 2μ ‖G‖ of a unit cube, whose G is a half of the identity."""
    return 1.5 * law.lame_modulus + 2.0 * law.shear_modulus * 0.5


# ---- every shipped study

KINDS = ("embedded", "deck")
IN_RUNS = "chrysanthemum-cutter"  # its material is that of a study in `runs`, if there is one
STUDIES = {path: load_study(path) for path in sorted(CONFIGS.glob("*.yaml")) if path.stem != IN_RUNS}
SHIPPED = [path for path, one in STUDIES.items() if one.solver.kind in KINDS and one.material.transverse is None]
"""Fibres have no deck."""


@pytest.mark.parametrize("spec", SHIPPED, ids=lambda path: path.stem)
def test_deck_of_every_shipped_study_is_read_by_two_readers(spec: Path, tmp_path: Path) -> None:
    study = load_study(spec)
    deck = Deck.of(study, study.midlevels(), study.specimen.outer_diameter)
    path = written(tmp_path, study=study, levels=deck.levels, diameter=deck.diameter)
    read = by_dynars(path)
    fields = {"src": "c", "srp": "p", "fs": "fail"} if deck.form.for_ls_dyna else {}
    names = [*("ro", "e", "pr", "sigy", "etan"), *(fields or ("c", "p", "fail"))]
    assert {n: read.material(1).field(n) for n in names} == {n: deck.material[fields.get(n, n)] for n in names}
    parts = deck.parts.stem, deck.parts.blade, deck.parts.supports
    meshes = mesh_reader().Deck(str(path))
    assert meshes.element_solid_sections[0].node_ids.size == 8 * sum(len(part.hexes) for part in parts)
    assert len(meshes.node_sections[0].coordinates) == sum(len(part.nodes) for part in parts)


# ---- cards


def test_fitted_keeps_what_fits() -> None:
    for value in (17.96, 1.1e-09, -1.23456789012e-105, 123456789.0, 1e22, 0.1 + 0.2, -0.0):
        text = fitted(value, 10)
        assert len(text) <= 10
        assert float(text) == pytest.approx(value, rel=2e-3)
        assert "." in text or "e" in text


def test_card_that_cannot_hold_a_value_is_refused() -> None:
    with pytest.raises(ValueError, match="10 characters"):
        list(keyword("PART", {"pid": 12345678901}))


def test_study_without_a_stem_has_no_deck() -> None:
    replay = load_study(CONFIGS / "paper-replay.yaml")
    with pytest.raises(UsageError, match="uses kind `sheet`"):
        Deck.of(replay, replay.midlevels(), 8.0)


# ---- the study's lengths


def carrying(program: Any, **given: Any) -> Deck:
    form = DeckForm() if program is None else DeckForm(program, lengths=True)
    return Deck.of(**{"study": STUDY, "levels": CALIBRATED, "diameter": 8.0, **given}, form=form)


def test_lengths_stand_in_each_programs_own_words() -> None:
    plain, dyna, radioss = (carrying(program) for program in (None, "lsdyna", "openradioss"))
    spread, length = 8.0 / 9.5, 8.0 / 4.5
    assert (plain.nose, plain.nonlocal_length) == (0.1, 0.0)
    assert dyna.nonlocal_length == pytest.approx(2.5**0.5 * length, rel=1e-12)
    assert radioss.nonlocal_length == pytest.approx(length - 0.25, rel=1e-12)
    assert radioss.nose == dyna.nose == pytest.approx(nose_radius(spread), rel=1e-12)
    text = deck_text(dyna)
    card = text[text.index("*MAT_NONLOCAL\n") :].splitlines()
    assert card[2] == f"{1:10d}{1:10d}{8.0:10}{2.0:10}{fitted(dyna.nonlocal_length, 10):>10}{100:10d}{1:10d}{0:10d}"
    assert card[4] == f"{1:10d}"
    assert "MAT_NONLOCAL" not in deck_text(plain) + deck_text(radioss)
    starter = starter_around("run.k", radioss.nonlocal_lengths).splitlines()
    at = starter.index("/NONLOCAL/MAT/1")
    assert float(starter[at + 2][:20]) == radioss.nonlocal_length
    assert starter[starter.index("/INCLUDE_LS-DYNA/") + 1] == "run.k"
    assert engine_text(radioss, "run").splitlines()[:2] == ["/RUN/run/1/", "0.5"]


def test_deck_tells_that_elements_are_too_coarse_for_its_nose() -> None:
    """0.6 of d/9.5 at 8 mm is 0.50526 mm: the study's d/16 is just not longer, nor is what is advised."""
    sizes = {Length(divisor=16.0): False, Length(divisor=12.0): True, Length(0.51): True, Length(0.505): False}
    for size, told in sizes.items():
        solver = STUDY.solver.model_copy(update={"element_size": size})
        notes = carrying("openradioss", study=STUDY.model_copy(update={"solver": solver})).notes
        assert any(note.endswith("reduce `solver.element_size` to at most 0.505 mm") for note in notes) == told


def test_openradioss_averages_a_row_of_elements_alike_on_every_mesh() -> None:
    """Linear elements with one point: Σ h (m mᵀ + L² s sᵀ) U = Σ h m ε; the mean in a row that alone strains by u/h."""
    for size in (0.05, 0.2, 0.5):
        length, count = nonlocal_length(1.0, "openradioss", size), 2 * round(15.0 / size) + 1
        left, right = np.eye(count, count + 1), np.eye(count, count + 1, 1)
        mean, slope = 0.5 * (left + right), (right - left) / size
        strain = (np.arange(count) == count // 2) / size
        nodes = np.linalg.solve(mean.T @ mean + length**2 * slope.T @ slope, mean.T @ strain)
        assert (mean @ nodes)[count // 2] == pytest.approx(0.5, rel=1e-9)
    assert nonlocal_length(1.0, "openradioss", 2.5) == 0.0


def test_weight_of_ls_dyna_has_the_second_moment_of_a_ball() -> None:
    """The mean of r² over (1 + (r/L)⁸)⁻², which is to be 3/2 ℓ²."""
    r = np.linspace(0.0, 6.0, 200_001)
    weight = (1.0 + (r / nonlocal_length(1.0, "lsdyna", 0.1)) ** 8) ** -2 * r**2
    assert np.trapezoid(weight * r**2, r) / np.trapezoid(weight, r) == pytest.approx(1.5, rel=1e-6)


def test_nonlocal_deck_has_mass_by_its_density_and_tools_that_are_held() -> None:
    deck = carrying("openradioss")
    factor = (wanted_step(deck.solver, deck.parts.stem, deck.law) / shortest(deck.parts.stem)) ** 2
    factor *= deck.law.p_wave_modulus / deck.law.density
    assert deck.material["ro"] == pytest.approx(factor * 1.1e-9, rel=1e-6)
    assert deck.card["ro"] == 1.1e-9
    text = deck_text(deck)
    assert text.count("*MAT_PIECEWISE_LINEAR_PLASTICITY") == 3
    assert "MAT_RIGID" not in text and "MOTION_RIGID" not in text
    nodes = [len(mesh.nodes) for mesh in (deck.parts.stem, deck.parts.blade, deck.parts.supports)]
    ends = np.cumsum(nodes)
    for first, last in ((nodes[0] + 1, ends[1]), (ends[1] + 1, ends[2])):
        assert f"{first:10d}{last:10d}" in text
    held = re.findall(r"\*BOUNDARY_SPC_SET\n\$#.*\n(.*)", text)  # the blade is free along z; no node of a solid turns
    assert [line.split() for line in held] == [list("20110000"), list("30111000")]


def test_the_step_up_to_which_mass_is_added() -> None:
    """4e-5 s over a safety of 0.9; none where the density is raised instead, which nonlocal failure needs."""
    texts = [deck_text(carrying(program)) for program in (None, "lsdyna", "openradioss")]
    cards = [text[text.index("dt2ms\n") + 6 :].splitlines()[0] for text in texts]
    assert [float(card[40:50]) for card in cards] == pytest.approx([-4e-5 / 0.9, -4e-5 / 0.9, 0.0], rel=1e-4)


def test_the_card_of_a_short_length_is_untested_too() -> None:
    """4/4.5 = 0.89 mm; the message is about the card, not about its size."""
    notes = [" ".join(carrying(program, diameter=4.0)._without_lengths()) for program in ("lsdyna", "openradioss")]
    assert ["*MAT_NONLOCAL" in note for note in notes] == [True, False] and "0.889 mm" in notes[0]


def test_deck_as_the_embedded_solver_computes_it() -> None:
    """With the study's own lengths where the deck has them in a program's words, without any where it has none."""
    for program, length, spread in (None, 0.0, 0.0), ("openradioss", 8 / 4.5, 8 / 9.5), ("lsdyna", 8 / 4.5, 8 / 9.5):
        test = shear_test(as_embedded(carrying(program)), {}, 8.0)
        assert (test.material.internal_length, test.blade.edge_spread) == pytest.approx((length, spread))
        assert (test.contact.penalty, test.blade.edge_radius, test.blade.thickness) == (0.25, 0.1, 2.3)
        assert build(test).tools[0].radius == 0.1
        hardening = 0.05 if program == "lsdyna" else 1.0
        assert (test.material.hardening_parameter, test.material.strain_rate_c) == (hardening, 0.0)
        assert (test.material.density, test.material.yield_stress) == (1.1e-9, 17.96)


def test_a_nose_stands_a_quarter_of_the_element_size_beside_a_row_of_nodes() -> None:
    """The rows there are 0.4713 mm apart where the spec says 0.5 mm: that is 0.27 of theirs."""
    sharp, blunt = (carrying(program).parts for program in (None, "openradioss"))
    for parts, beside in ((sharp, 0.0), (blunt, 0.125)):
        lowest = parts.blade.nodes[np.argmin(parts.blade.nodes[:, 2])]
        assert lowest[0] == pytest.approx(beside, abs=1e-12)
        rows = np.unique(np.abs(parts.stem.nodes[:, 0]).round(9))
        assert rows[0] == 0.0 and rows[1] == pytest.approx(0.4713, abs=1e-4)
        assert parts.supports.nodes[:, 0].sum() == pytest.approx(0.0, abs=1e-6)


def test_rate_of_plastic_strain_is_for_ls_dyna_alone() -> None:
    """OpenRadioss forgets the rate where VP is 1; the card of *MAT_024 ends with VP, that of *MAT_003 too."""
    solver = STUDY.solver.model_copy(update={"rate_law": "cowper_symonds"})
    for form, vp in ((DeckForm(), 0.0), (DeckForm("lsdyna"), 1.0), (DeckForm("lsdyna", lengths=True), 1.0)):
        deck = Deck.of(STUDY.model_copy(update={"solver": solver}), CALIBRATED, 8.0, form)
        card = list(stem_material(deck.material, form))[4]
        assert float(card[-10:]) == vp and deck.material["c"] > 0.0
        assert any(f"(VP = {vp:g})" in note for note in deck.notes)


def test_a_sharp_edge_bears_by_four_nodes_to_an_element_and_by_no_others() -> None:
    """Of elements of 0.5 mm: nodes 0.125 mm apart where the embedded solver samples, the next row 0.15 · 2.3 mm up."""
    edge = carrying(None).parts.blade.nodes
    lowest = edge[np.isclose(edge[:, 2], 4.001)]
    y = np.sort(lowest[:, 1])
    assert np.abs(lowest[:, 0]).max() == 0.0
    assert np.diff(y) == pytest.approx(0.125)
    assert np.abs(y).min() == pytest.approx(0.0625)
    assert y[-1] >= 6.0
    assert np.unique(np.round(edge[:, 2], 9))[1] == pytest.approx(4.346)
    blunt = carrying("openradioss").parts.blade.nodes
    assert np.diff(np.unique(np.round(blunt[:, 1], 9))) == pytest.approx(0.5)


def test_openradioss_takes_the_mean_of_segment_and_node_and_half_of_it() -> None:
    """Cubes of side 1: A²/V = 1. In bars of 1 × 2 × 4 a node has (2 · 8)^⅓ inside, 2^⅓ at a corner."""
    bars = brick((2.0, 4.0, 8.0), (2, 2, 2))
    middle, corner = (1.0, 2.0, 4.0), (0.0, 0.0, 0.0)
    assert share_in_openradioss(CUBE, bars, middle) == pytest.approx(0.25 * (1.0 + 16.0 ** (1.0 / 3.0)), rel=1e-12)
    assert share_in_openradioss(CUBE, bars, corner) == pytest.approx(0.25 * (1.0 + 2.0 ** (1.0 / 3.0)), rel=1e-12)


def test_contact_of_a_sharp_edge_is_as_stiff_as_the_embedded_solvers_sample() -> None:
    """A quarter of p m/Δt² for each of four, π/4 for the shape functions between the nodes; a nose has p m/Δt²."""
    pattern = r"\n *([\d.e+-]+) +[\d.e+-]+ +0.0 +0.0 +1.0 +1.0 +1.0 +1.0\n"
    top = (0.0, 0.0, 4.0)
    for program in (None, "lsdyna", "openradioss"):
        deck = carrying(program)
        (blade, _) = re.findall(pattern, deck_text(deck))
        whole = contact_scale(deck.solver, deck.parts.stem, deck.law, 0.25, top)
        taken = share_in_openradioss(deck.parts.stem, deck.parts.blade, top) if program is None else 1.0
        share = 0.25 * np.pi / 4.0 if program is None else 1.0
        assert float(blade) * taken == pytest.approx(whole * share, rel=1e-3)
    sharp = Deck.of(STUDY, CALIBRATED, 8.0, DeckForm("lsdyna"))
    (blade, _) = re.findall(pattern, deck_text(sharp))
    whole = contact_scale(sharp.solver, sharp.parts.stem, sharp.law, 0.25, top)
    assert float(blade) == pytest.approx(whole * np.pi / 16.0, rel=1e-3)


def test_tools_are_meshed_where_they_touch_and_the_stem_rests_on_nodes() -> None:
    parts = carrying(None).parts
    assert np.ptp(parts.blade.nodes, axis=0) == pytest.approx([2.3, 12.125, 28.0])
    assert len(parts.blade.hexes) < 4000
    layers = np.unique(np.round(parts.stem.nodes[:, 0], 9))
    assert {-11.0, 11.0} <= set(layers.tolist())


# ---- layers: a part and a material each

LAYERED = load_study(CONFIGS / "hemp-two-layers.yaml")
PHLOEM, XYLEM = 4, 1  # the numbers of their parts
LEVELS = {"phloem_yield_stress": 20.0}


def cards(text: str, name: str) -> list[list[str]]:
    """Return the lines of each keyword of this name, without headings of fields."""
    found: list[list[str]] = []
    for line in text.splitlines():
        if line.startswith("*"):
            found.append([line])
        elif found and not line.startswith("$"):
            found[-1].append(line)
    return [lines[1:] for lines in found if lines[0] == f"*{name}"]


def columns(line: str, width: int = 10) -> list[float]:
    return [float(line[i : i + width]) for i in range(0, len(line), width)]


@pytest.mark.parametrize("program", ["lsdyna", "openradioss"])
@pytest.mark.parametrize("lengths", [False, True])
def test_each_layer_is_a_part_with_its_material(program: Any, lengths: bool) -> None:
    """Phloem of 0.5 mm on xylem: densities, moduli, yield stresses of the spec; elements by the radius of their centre.

    The layers are one body: both contacts have the set of both parts, and the elements at the interface share nodes.
    """
    deck = Deck.of(LAYERED, LEVELS, 9.3, DeckForm(program, lengths))
    text = deck_text(deck)
    name = "MAT_PLASTIC_KINEMATIC" if program == "lsdyna" else "MAT_PIECEWISE_LINEAR_PLASTICITY"
    laws = {int(values[0]): values for lines in cards(text, name) if (values := columns(lines[0]))}
    factor = laws[XYLEM][1] / 1e-9
    assert {part: laws[part][2:5] for part in (PHLOEM, XYLEM)} == {
        PHLOEM: [3607.5, 0.3, 20.0],
        XYLEM: [1343.5, 0.3, 16.0],
    }
    assert laws[PHLOEM][1] == pytest.approx(laws[XYLEM][1]) and (factor > 1.0) == (lengths and program != "lsdyna")
    parts = {lines[0]: columns(lines[1]) for lines in cards(text, "PART")}
    assert (parts["phloem"][0], parts["phloem"][2]) == (PHLOEM, PHLOEM)
    assert (parts["xylem"][0], parts["xylem"][2]) == (XYLEM, XYLEM)
    (((sid,), pids),) = ([columns(line) for line in lines] for lines in cards(text, "SET_PART_LIST"))
    assert pids == [XYLEM, PHLOEM]
    for contact in ("ERODING", "AUTOMATIC"):
        (lines,) = cards(text, f"CONTACT_{contact}_SURFACE_TO_SURFACE_ID")
        assert (columns(lines[1])[0], columns(lines[1])[2]) == (sid, 2.0)
    (nodes,) = cards(text, "NODE")
    place = {int(line[:8]): np.array(columns(line[8:], 16)) for line in nodes}
    (elements,) = cards(text, "ELEMENT_SOLID")
    corners: dict[int, list[list[int]]] = {}
    for line in elements:
        _, part, *own = (int(value) for value in columns(line, 8))
        corners.setdefault(part, []).append(own)
    radius = {
        part: np.array([np.linalg.norm(np.mean([place[n] for n in own], axis=0)[1:]) for own in corners[part]])
        for part in (PHLOEM, XYLEM)
    }
    interface = 4.65 - 0.5
    assert radius[PHLOEM].min() > interface * 0.985 and radius[XYLEM].max() < interface
    assert {n for own in corners[PHLOEM] for n in own} & {n for own in corners[XYLEM] for n in own}
    assert len(corners[PHLOEM]) + len(corners[XYLEM]) == len(deck.parts.stem.hexes)
    assert "these decks were not run" in " ".join(deck.notes)


def test_each_layer_averages_its_own_failure() -> None:
    text = deck_text(Deck.of(LAYERED, LEVELS, 9.3, DeckForm("lsdyna", lengths=True)))
    averaged = {int(columns(lines[0])[0]): columns(lines[0])[4] for lines in cards(text, "MAT_NONLOCAL")}
    assert averaged == pytest.approx({PHLOEM: 2.5**0.5 * 9.3 / 4.5, XYLEM: 2.5**0.5 * 9.3 / 4.5}, rel=1e-6)
    starter = starter_around("run.k", Deck.of(LAYERED, LEVELS, 9.3, DeckForm(lengths=True)).nonlocal_lengths)
    assert re.findall(r"/NONLOCAL/MAT/(\d)", starter) == [str(PHLOEM), str(XYLEM)]


def test_step_and_contact_are_of_the_stiffest_and_of_the_outer_layer() -> None:
    deck = Deck.of(LAYERED, LEVELS, 9.3)
    assert (deck.law.elastic_modulus, deck.fastest.elastic_modulus) == (3607.5, 3607.5)
    soft = LAYERED.model_copy(
        update={"layers": (LAYERED.layers[0].model_copy(update={"elastic_modulus": 500.0}), LAYERED.layers[1])}
    )
    deck = Deck.of(soft, LEVELS, 9.3)
    assert (deck.law.elastic_modulus, deck.fastest.elastic_modulus) == (500.0, 1343.5)


def test_a_rounding_has_facets_of_half_the_element_size() -> None:
    """r = 2 mm over π/2 − 0.3 at each side: ceil(2·1.2708/0.1) = 26 facets each."""
    nodes = _rounding(2.0, 0.3, 0.3, 0.2)
    assert len(nodes) == 2 * 26 + 1 and np.hypot(nodes[:, 0], nodes[:, 1] - 2.0) == pytest.approx(2.0)
    assert len(_rounding(0.01, 0.3, 0.3, 0.2)) == 2 * 2 + 1
    assert _even(0.0, 1.0, 5.0) == pytest.approx([0.0, 1.0]) and len(_even(0.0, 1.0, 0.3)) == 5
