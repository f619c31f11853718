"""All cards of decks, column by column, and the sentences on their differences from the study."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.cutting.parts import Blade, Stem, Supports
from stemcal.errors import UsageError
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.solvers.deck import Deck, DeckForm, DeckProgram, deck_text
from stemcal.solvers.deck.equivalents import contact_scale, density_factor, rate_constants, shortest, wanted_step
from stemcal.solvers.deck.keywords import fitted, form_of, keyword
from stemcal.solvers.deck.openradioss import values_not_read
from stemcal.solvers.deck.tools import _blade_section, blade_mesh, supports_mesh
from stemcal.solvers.deck.writer import engine_text, material_text, starter_around
from stemcal.solvers.protocol import Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.field_types import Length

SPEC = """\
name: own-deck
factors: [{name: yield_stress, unit: MPa, low: 10, high: 20}]
material: {density: 1.2 g/cm3, elastic_modulus: 1.1 GPa, poisson_ratio: 0.31, tangent_modulus: 0.7 MPa,
  hardening_parameter: 0.06, strain_rate_c: 70 1/s, strain_rate_p: 5, failure_strain: 0.04, internal_length: 2 mm}
specimen: {outer_diameter: 8 mm, diameter_ratio: 0.5, length: 30 mm}
blade: {thickness: 2.1 mm, width: 2.5 cm, edge_angle: 40 deg, edge_radius: 0.15 mm, edge_spread: 0.8 mm}
supports: {clearance: 18 mm, fillet_radius: 0.9 mm}
loading: {speed: 60 mm/min, duration: 0.6 s}
contact: {static_friction: 0.25, dynamic_friction: 0.2, decay: 0.3 s/mm, penalty: 0.3}
solver: {kind: deck, program: PROGRAM, element_size: 1 mm, mass_scaling: 9, rate_law: LAW, MORE}
targets: [{diameter: 8 mm, force: 150 N}]
"""
LEVELS = {"yield_stress": 17.0}


def study_of(folder: Path, program: str, law: str = "cowper_symonds", more: str = "nonlocal_failure: false") -> Study:
    command = ', command: [ls-dyna, "i={{deck}}"]' if program == "lsdyna" else ""
    text = SPEC.replace("PROGRAM", program).replace("LAW", law).replace("MORE", more + command)
    (folder / "deck.yaml").write_text(text, encoding="utf-8")
    return load_study(folder / "deck.yaml")


def cards_of(text: str) -> dict[str, list[list[Any]]]:
    """Return the rows of each keyword before the mesh: numbers in columns of ten; the titles of parts as texts."""
    cards: dict[str, list[list[Any]]] = {}
    for line in text.split("*NODE\n")[0].splitlines():
        if line.startswith("*"):
            rows = cards.setdefault(line[1:], [])
        elif not line.startswith("$"):
            try:
                rows.append([float(line[at : at + 10]) for at in range(0, len(line), 10)])
            except ValueError:
                rows.append([line.strip()])
    return cards


ZEROS = [0.0] * 8
FRICTION = [0.25, 0.2, 0.3, 0.0, 50.0, 0.0, 0.0, 1e20]
COMMON: dict[str, list[list[Any]]] = {
    "KEYWORD": [],
    "CONTROL_TERMINATION": [[0.6]],
    "CONTROL_HOURGLASS": [[4, 0.05]],
    "CONTROL_ENERGY": [[2, 2, 2, 1]],
    "CONTROL_CONTACT": [[1.0, 0, 0, 0, 0, 0, 0, 0]],
    "DATABASE_GLSTAT": [[0.0012, 1]],
    "DATABASE_RCFORC": [[0.0012, 1]],
    "DATABASE_BINARY_D3PLOT": [[0.012]],
    # the curve has columns of twenty
    "DEFINE_CURVE": [[1], ["0.0                 1.0"], ["1.2                 1.0"]],
}
RIGID: dict[str, list[list[Any]]] = {
    "MAT_RIGID": [
        *([2, 7.8e-9, 1100, 0.31, 0, 0, 0], [1, 4, 7], [0] * 6),
        *([3, 7.8e-9, 1100, 0.31, 0, 0, 0], [1, 7, 7], [0] * 6),
    ],
    "SECTION_SOLID": [[1, 1], [2, 1]],
    "PART": [["stem"], [1, 1, 1], ["blade"], [2, 2, 2], ["supports"], [3, 2, 3]],
    "BOUNDARY_PRESCRIBED_MOTION_RIGID": [[2, 3, 0, 1, -1]],
}


def contacts(found: dict[str, list[list[Any]]]) -> dict[str, list[list[Any]]]:
    """The contacts; their two scale factors are compared elsewhere."""
    cards = {}
    for number, name, tool, title in (
        (1, "ERODING", 2, "blade and stem"),
        (2, "AUTOMATIC", 3, "supports and stem"),
    ):
        full = f"CONTACT_{name}_SURFACE_TO_SURFACE_ID"
        scale = found[full][3][0]
        assert 0.0 < scale < 100.0
        rows: list[list[Any]] = [[f"{number}{title}"], [1, tool, 3, 3, 0, 0, 1, 1], FRICTION]
        rows.append([scale, scale, 0, 0, 1, 1, 1, 1])
        cards[full] = rows + ([[0, 1, 1]] if name == "ERODING" else [])
    return cards


def test_every_card_for_ls_dyna(tmp_path: Path) -> None:
    """Mass scaling of 9 allows three times the step of the shortest element."""
    deck = Deck.of(study_of(tmp_path, "lsdyna"), LEVELS, 8.0)
    found = cards_of(deck_text(deck))
    step = found["CONTROL_TIMESTEP"][0].pop()
    sound = (deck.law.p_wave_modulus / deck.law.density) ** 0.5
    assert step == pytest.approx(-3.0 * shortest(deck.parts.stem) / sound, rel=1e-4)
    assert found == {
        **COMMON,
        "CONTROL_TIMESTEP": [[0, 0.8, 0, 0]],
        "MAT_PLASTIC_KINEMATIC": [[1, 1.2e-9, 1100, 0.31, 17, 0.7, 0.06], [70, 5, 0.04, 1]],
        **RIGID,
        **contacts(found),
    }


def test_every_card_for_openradioss(tmp_path: Path) -> None:
    deck = Deck.of(study_of(tmp_path, "openradioss"), LEVELS, 8.0)
    found = cards_of(deck_text(deck))
    assert found["CONTROL_TIMESTEP"][0].pop() < 0.0
    assert found == {
        **COMMON,
        "CONTROL_TIMESTEP": [[0, 0.9, 0, 0]],
        "MAT_PIECEWISE_LINEAR_PLASTICITY": [
            *([1, 1.2e-9, 1100, 0.31, 17, 0.7, 0.04, 0], [70, 5, 0, 0, 0], ZEROS, ZEROS)
        ],
        **RIGID,
        **contacts(found),
    }


def test_every_card_of_a_nonlocal_openradioss_deck(tmp_path: Path) -> None:
    """The stem has nine times its density, so that the step needs no added mass; tools a hundred times that."""
    deck = Deck.of(study_of(tmp_path, "openradioss", more="nonlocal_failure: true"), LEVELS, 8.0)
    found = cards_of(deck_text(deck))
    stem, blade, supports = (len(mesh.nodes) for mesh in (deck.parts.stem, deck.parts.blade, deck.parts.supports))
    heavy = [pytest.approx(9 * 1.2e-7, rel=1e-6), 1100, 0.31, 1e6, 0, 1e6, 0]
    assert found == {
        **COMMON,
        "CONTROL_TIMESTEP": [[0, 0.9, 0, 0, 0]],
        "MAT_PIECEWISE_LINEAR_PLASTICITY": [
            *([1, pytest.approx(9 * 1.2e-9, rel=1e-6), 1100, 0.31, 17, 0.7, 0.04, 0], [70, 5, 0, 0, 0], ZEROS, ZEROS),
            *([2, *heavy], [0, 5, 0, 0, 0], ZEROS, ZEROS),
            *([3, *heavy], [0, 5, 0, 0, 0], ZEROS, ZEROS),
        ],
        "SET_NODE_LIST_GENERATE": [
            *([2], [stem + 1, stem + blade]),
            *([3], [stem + blade + 1, stem + blade + supports]),
        ],
        "BOUNDARY_SPC_SET": [[2, 0, 1, 1, 0, 0, 0, 0], [3, 0, 1, 1, 1, 0, 0, 0]],
        "SECTION_SOLID": [[1, 1]],
        "PART": [["stem"], [1, 1, 1], ["blade"], [2, 1, 2], ["supports"], [3, 1, 3]],
        "BOUNDARY_PRESCRIBED_MOTION_SET": [[2, 3, 0, 1, -1]],
        **contacts(found),
    }


def test_a_nonlocal_ls_dyna_deck_has_one_more_card(tmp_path: Path) -> None:
    """L = 2 mm · √2.5 = 3.16227766 mm."""
    plain, nonlocal_ = (
        cards_of(deck_text(Deck.of(study_of(tmp_path, "lsdyna", more=f"nonlocal_failure: {flag}"), LEVELS, 8.0)))
        for flag in ("false", "true")
    )
    assert nonlocal_.pop("MAT_NONLOCAL") == [[1, 1, 8, 2, 3.16227766, 100, 1, 0], [1]]
    scales = [nonlocal_[name][3] for name in nonlocal_ if name.startswith("CONTACT_ERODING")]
    assert scales != [plain[name][3] for name in plain if name.startswith("CONTACT_ERODING")]  # a rounded edge
    assert set(plain) == set(nonlocal_) and plain["MAT_PLASTIC_KINEMATIC"] == nonlocal_["MAT_PLASTIC_KINEMATIC"]


def test_runs_of_openradioss_have_no_pictures(tmp_path: Path) -> None:
    run = Request("rsm", 0, LEVELS, 8.0)
    forms = {p: DeckProgram(study_of(tmp_path, p))._deck(run).form.pictures for p in ("lsdyna", "openradioss")}
    assert forms == {"lsdyna": True, "openradioss": False}
    assert "D3PLOT" not in deck_text(DeckProgram(study_of(tmp_path, "openradioss"))._deck(run))


def test_nodes_and_elements_are_numbered_from_one(tmp_path: Path) -> None:
    deck = Deck.of(study_of(tmp_path, "lsdyna"), LEVELS, 8.0)
    body = deck_text(deck).split("*NODE\n")[1]
    nodes, elements = (part.splitlines() for part in body.split("*ELEMENT_SOLID\n"))
    assert elements.pop() == "*END"
    meshes = (deck.parts.stem, deck.parts.blade, deck.parts.supports)
    numbers = [int(line[:8]) for line in nodes if not line.startswith("$")]
    assert numbers == list(range(1, 1 + sum(len(mesh.nodes) for mesh in meshes)))
    rows = [[int(line[at : at + 8]) for at in range(0, 80, 8)] for line in elements if not line.startswith("$")]
    assert [row[0] for row in rows] == list(range(1, len(rows) + 1))
    parts = [part for part, mesh in zip((1, 2, 3), meshes, strict=True) for _ in mesh.hexes]
    assert [row[1] for row in rows] == parts
    first = 1 + len(meshes[0].nodes) + len(meshes[1].nodes)
    assert rows[-1][2:] == (meshes[2].hexes[-1] + first).tolist()


# ---- the files around a deck


def test_starter_and_engine_files_line_by_line(tmp_path: Path) -> None:
    deck = Deck.of(study_of(tmp_path, "openradioss", more="nonlocal_failure: true"), LEVELS, 8.0)
    assert engine_text(deck, "cut").splitlines() == [
        *("/RUN/cut/1/", "0.6", "/TFILE/4", "0.0012", "/DT", "0.9 0", "/PARITH/OFF", "/TH/TITLE", "/PRINT/-1000")
    ]
    units = " " * 18 + "Mg" + " " * 18 + "mm" + " " * 19 + "s"
    assert starter_around("run.k", {1: 1.5, 4: 0.25}).splitlines() == [
        *("#RADIOSS STARTER", "/BEGIN", "run", "      2022         0", units, units, "/INCLUDE_LS-DYNA/", "run.k"),
        *("/NONLOCAL/MAT/1", "#             LENGTH              LE_MAX", " " * 17 + "1.5" + " " * 19 + "0"),
        *("/NONLOCAL/MAT/4", "#             LENGTH              LE_MAX", " " * 16 + "0.25" + " " * 19 + "0"),
        "/END",
    ]
    assert starter_around("deck", {}).splitlines()[2] == "deck"


def test_a_material_card_is_an_include_file_with_its_comments(tmp_path: Path) -> None:
    deck = Deck.of(study_of(tmp_path, "lsdyna"), LEVELS, 8.0)
    lines = material_text(deck, ["of a stem", "word " * 30]).splitlines()
    assert (lines[0], lines[1], lines[-1]) == ("*KEYWORD", "$ of a stem", "*END")
    assert lines[2] == "$ " + " ".join(["word"] * 15) and lines[3] == "$   " + " ".join(["word"] * 15)
    assert cards_of("\n".join(lines))["MAT_PLASTIC_KINEMATIC"][1] == [70, 5, 0.04, 1]


# ---- cards and numbers


def test_titles_have_at_most_eighty_columns() -> None:
    assert list(keyword("PART", {"pid": 1}, title="t" * 90)) == ["*PART", "t" * 80, "$#     pid", " " * 9 + "1"]
    assert list(keyword("END")) == ["*END"]
    assert list(keyword("X", {"a": 1.5, "bb": 2}, {"c": "text"}))[1:] == [
        *("$#       a        bb", "       1.5         2", "$#       c", "      text")
    ]


@pytest.mark.parametrize(
    ("value", "width", "text"),
    [
        (1.0, 10, "1.0"),
        (0.1 + 0.2, 10, "0.3"),
        (1.0 / 3.0, 10, "0.33333333"),
        (1e22, 10, "1e+22"),
        (123456789.25, 10, "1.234568e8"),
        (1.23456789e-105, 10, "1.235e-105"),
        (-1.23456789e-105, 10, "-1.23e-105"),
        (2.0 / 3.0, 15, "0.6666666666667"),
    ],
)
def test_numbers_have_the_digits_that_fit(value: float, width: int, text: str) -> None:
    assert len(fitted(value, width)) <= width
    assert float(fitted(value, width)) == pytest.approx(float(text), rel=1e-9)


def test_a_number_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="-1e-300 does not fit in 5 columns"):
        fitted(-1e-300, 5)
    assert fitted(-1e-300, 7) == "-1e-300"


@pytest.mark.parametrize(
    ("law", "p", "rate", "found"),
    [
        ("cowper_symonds", 5.0, 1e-9, (70.0, 5.0)),
        ("none", 5.0, 1e9, (0.0, 0.0)),
        ("paper", 0.5, 70.0, (70.0, 2.0)),
        ("paper", 1.0, 0.0701, (70.0, 1.0)),  # 1.001 thousandths
        ("paper", 1.0, 0.0699, (0.0, 0.0)),
    ],
)
def test_a_rate_law_is_written_if_its_effect_is_at_least_a_thousandth(
    law: str, p: float, rate: float, found: tuple[float, float]
) -> None:
    assert rate_constants(law, 70.0, p, rate) == found


CUBE, LAW = brick((2.0, 2.0, 2.0), (2, 2, 2)), Material(1e-9, 1000.0, 0.3)


def test_density_that_needs_no_added_mass(tmp_path: Path) -> None:
    """The masses of a scaling of 9; never less than the density of the study."""
    solver: Any = study_of(tmp_path, "openradioss").solver
    sound = (LAW.p_wave_modulus / LAW.density) ** 0.5
    assert wanted_step(solver, CUBE, LAW) == pytest.approx(3.0 / sound)
    assert density_factor(solver, CUBE, LAW) == pytest.approx(9.0)
    unscaled = solver.model_copy(update={"mass_scaling": 1.0})
    assert (wanted_step(unscaled, CUBE, LAW), density_factor(unscaled, CUBE, LAW)) == (0.0, 1.0)


def test_contact_stiffness_is_proportional_to_its_share_and_that_of_the_place(tmp_path: Path) -> None:
    """Slabs of 1 × 1 × 2: A²/V is ½ at their ends and 2 at their sides, where a node has as much mass."""
    slabs = brick((2.0, 2.0, 4.0), (2, 2, 2))
    solver: Any = study_of(tmp_path, "openradioss").solver
    end, side = (contact_scale(solver, slabs, LAW, 1.0, place) for place in ((0.5, 0.5, 0.0), (0.0, 0.5, 1.0)))
    assert end / side == pytest.approx(4.0 * 1.0, rel=1e-9)
    assert contact_scale(solver, slabs, LAW, 0.5, (0.5, 0.5, 0.0)) == pytest.approx(0.5 * end, rel=1e-12)


def test_contact_is_on_the_surface_even_if_an_inner_face_is_nearer(tmp_path: Path) -> None:
    """Plates of 1 × 1 × 0.2: the face between two of them is nearer to their common edge than both outer faces."""
    plates = brick((2.0, 2.0, 0.4), (2, 2, 2))
    solver: Any = study_of(tmp_path, "openradioss").solver
    inner, outer = (contact_scale(solver, plates, LAW, 1.0, place) for place in ((1.0, 0.5, 0.0), (0.5, 0.5, 0.0)))
    assert inner == pytest.approx(outer, rel=1e-9)


# ---- the tools


def test_supports_reach_five_millimetres_beyond_the_stem_and_ten_below() -> None:
    mesh = supports_mesh(Supports(20.0, 1.0), Stem(8.0, 0.4, 50.0), 1.0)
    x, y, z = mesh.nodes.T
    assert (np.abs(x).max(), np.abs(x).min()) == (30.0, 10.0)
    assert (z.max(), z.min(), y.min(), y.max()) == (-4.0, -15.0, -4.0, 4.0)
    top = np.unique(np.round(x[(z == z.max()) & (x > 0)], 9))
    assert top == pytest.approx(np.arange(11.0, 31.0))
    fillet = np.unique(np.round(np.stack([x, z])[:, (x >= 10.0) & (x < 11.0) & (z > -10.0)], 9), axis=1)
    assert fillet.shape[1] == 4  # of five nodes, one is on top
    assert np.hypot(fillet[0] - 11.0, fillet[1] + 5.0) == pytest.approx(1.0)
    short = supports_mesh(Supports(60.0, 2.0), Stem(8.0, 0.4, 50.0), 1.0)
    assert np.abs(short.nodes[:, 0]).max() == 37.0
    sharp = supports_mesh(Supports(20.0, 0.0), Stem(8.0, 0.4, 50.0), 1.0)
    assert sharp.nodes[:, 2].min() == -14.0 and sharp.volumes().min() > 0.0
    assert sharp.volumes().sum() == pytest.approx(2 * 20.0 * 10.0 * 8.0)


@pytest.mark.parametrize("line", [False, True])
@pytest.mark.parametrize("radius", [0.0, 0.2])
def test_the_section_of_a_symmetric_blade_is_symmetric_and_one_with_one_bevel_has_a_straight_side(
    line: bool, radius: float
) -> None:
    """Flanks at 20° to the vertical, or at 40° on one side; between rounding and body they are straight."""
    if line and radius:
        pytest.skip("a sharp edge has no rounding")
    both = _blade_section(Blade(2.0, 20.0, 40.0, radius, "both"), 0.5, line=line)
    assert both[:, ::-1, 0] == pytest.approx(-both[:, :, 0], abs=1e-12)
    assert both[:, ::-1, 1] == pytest.approx(both[:, :, 1], abs=1e-12)
    one = _blade_section(Blade(2.0, 20.0, 40.0, radius, "one"), 0.5, line=line)
    assert one[1:, 0, 0] == pytest.approx(np.full(len(one) - 1, -radius), abs=1e-12)
    for section, lean, offset in ((both, 20.0, 0.0), (one, 40.0, radius)):
        x, z = section[1:, -1].T
        rising = x < x.max() - 1e-9
        slope = np.diff(x[rising]) / np.diff(z[rising])
        assert slope == pytest.approx(np.tan(np.radians(lean)), rel=1e-9)
        assert x.max() == pytest.approx(1.0 if section is both else 2.0 - offset)
        assert section[0, :, 1].min() == pytest.approx(0.0, abs=1e-12) and z.max() == 20.0


def test_a_widened_blade_has_no_inverted_element() -> None:
    blade = Blade(thickness=0.1, width=28.0, edge_angle=20.0, edge_radius=0.1)
    assert blade_mesh(blade, 5.0, 0.0, size=0.5).volumes().min() > 0.0


def test_a_blade_is_meshed_as_far_as_the_stem_can_touch_it() -> None:
    """Flank up to 1/tan 20° = 2.747 mm, then up to twice a stroke of 3 mm above it; the rest is one element."""
    heights = np.unique(np.round(_blade_section(Blade(2.0, 28.0, 40.0, 0.0), 0.5, 3.0)[..., 1], 9))
    shoulder = 1.0 / np.tan(np.radians(20.0))
    assert heights[-1] == 28.0 and heights[-2] == pytest.approx(shoulder + 6.0)
    assert np.diff(heights[heights >= shoulder - 1e-9])[:-1] == pytest.approx(2.0)
    whole = np.unique(np.round(_blade_section(Blade(2.0, 8.0, 40.0, 0.0), 0.5, 3.0)[..., 1], 9))
    assert whole[-1] == 8.0 and np.diff(whole[whole >= shoulder - 1e-9]) == pytest.approx(5.253 / 3, rel=1e-3)


def test_a_sharp_edge_has_one_node_and_a_v_of_a_seventh_of_the_thickness() -> None:
    section = _blade_section(Blade(2.0, 28.0, 40.0, 0.0), 0.5, line=True)
    assert section[0] == pytest.approx(np.array([[-0.1091911, 0.3], [0.0, 0.0], [0.1091911, 0.3]]), rel=1e-6)
    thin = _blade_section(Blade(2.0, 28.0, 40.0, 0.0), 0.1, line=True)
    assert thin[0, :, 1].tolist() == [0.1, 0.0, 0.1]


# ---- refusals and differences


def test_a_deck_has_at_most_two_million_elements(tmp_path: Path) -> None:
    study = study_of(tmp_path, "lsdyna")
    fine = study.model_copy(update={"solver": study.solver.model_copy(update={"element_size": Length(0.05)})})
    deck = Deck.of(fine, LEVELS, 8.0)
    with pytest.raises(UsageError, match=r"element size 0\.05 mm\), more than the limit of 2e\+06; increase"):
        _ = deck.parts


def notes_of(folder: Path, program: str, law: str = "cowper_symonds", more: str = "nonlocal_failure: false") -> str:
    return "\n".join(Deck.of(study_of(folder, program, law, more), LEVELS, 8.0).notes)


def test_differences_from_the_study_have_their_numbers(tmp_path: Path) -> None:
    """94 % of the hardening is kinematic; a nose of 1.4 · 0.8 = 1.12 mm; L = (2·2 − 1)/2 = 1.5 mm in OpenRadioss."""
    assert notes_of(tmp_path, "lsdyna") == ""
    assert notes_of(tmp_path, "openradioss") == (
        "*MAT_024 uses isotropic hardening; in the study, 94 % of the hardening is kinematic"
    )
    notes = notes_of(tmp_path, "openradioss", more="nonlocal_failure: true").splitlines()
    assert notes[0].startswith(
        "an edge radius of 1.12 mm and a nonlocal length of 1.5 mm replace edge_spread (0.8 mm) "
    )
    assert "internal_length (2 mm); the resulting" in notes[0]
    assert notes[1].endswith("reduce `solver.element_size` to at most 0.48 mm") and "size of 1 mm is too" in notes[1]
    assert notes[2].startswith("the density of the stem is multiplied by 9 because")
    assert len(notes) == 4
    dyna = notes_of(tmp_path, "lsdyna", more="nonlocal_failure: true").splitlines()
    assert "a nonlocal length of 3.16 mm" in dyna[0] and dyna[2].startswith("*MAT_NONLOCAL averages")
    assert len(dyna) == 3


def test_the_printed_rate_law_is_converted_or_left_out(tmp_path: Path) -> None:
    """(ε̇/C)⁵ with a rate of 1 mm/s over the shortest element; P of the form 1/P is 0.2."""
    study = study_of(tmp_path, "lsdyna", "paper")
    deck = Deck.of(study, LEVELS, 8.0)
    rate = 1.0 / shortest(deck.parts.stem)
    most = 100.0 * (rate / 70.0) ** 5
    assert deck.notes == [
        f"the rate law 1 + (rate/C)^5 is omitted because it changes the yield stress by at most {most:.1g} %"
    ]
    assert (deck.material["c"], deck.material["p"]) == (0.0, 0.0)
    fast = Deck.of(study.model_copy(update={"loading": study.loading.model_copy(update={"speed": 100.0})}), LEVELS, 8.0)
    assert fast.notes == [
        "the rate law 1 + (rate/C)^5 is written in the LS-DYNA form, 1 + (rate/C)^(1/P), with P = 0.2"
    ]
    assert (fast.material["c"], fast.material["p"]) == (70.0, 0.2)


def test_small_constants_are_constants_too(tmp_path: Path) -> None:
    """C of 0.5 1/s, a hardening of 0.7 MPa, and lengths below 1 mm: each is more than none."""
    deck = Deck.of(study_of(tmp_path, "lsdyna", "paper"), LEVELS, 8.0)
    slow = study_of(tmp_path, "openradioss", more="nonlocal_failure: true, elements_through_wall: 3")
    law = slow.material.model_copy(update={"strain_rate_c": 0.5, "internal_length": Length(0.9)})
    small = Deck.of(slow.model_copy(update={"material": law}), LEVELS, 8.0)
    assert small.material["c"] == 0.5 and small.nonlocal_length == pytest.approx(0.4)
    assert values_not_read("", small.material, 0.4)[-2:] == ["C = 0.5", "1/P = 0.2"]
    dyna = Deck.of(study_of(tmp_path, "lsdyna").model_copy(update={"material": law}), LEVELS, 8.0)
    assert cards_of(deck_text(dyna))["MAT_PLASTIC_KINEMATIC"][1] == [0.5, 5, 0.04, 1]
    printed = Deck.of(deck.study.model_copy(update={"material": law}), LEVELS, 8.0)
    assert printed.notes == [
        "the rate law 1 + (rate/C)^5 is written in the LS-DYNA form, 1 + (rate/C)^(1/P), with P = 0.2"
    ]


def test_rates_of_an_embedded_study_are_not_smoothed_in_its_deck(tmp_path: Path) -> None:
    """1 % of 8 mm at 1 mm/s is 0.08 s."""
    text = SPEC.replace("kind: deck, program: PROGRAM, ", "kind: embedded, ").replace("LAW", "cowper_symonds")
    (tmp_path / "e.yaml").write_text(text.replace(", MORE", ""), encoding="utf-8")
    study = load_study(tmp_path / "e.yaml")
    assert form_of(study) == DeckForm("openradioss", lengths=False, pictures=True)
    for program, rate in (("lsdyna", "plastic strain (VP = 1)"), ("openradioss", "total strain (VP = 0)")):
        last = Deck.of(study, LEVELS, 8.0, DeckForm(program)).notes[-1]  # type: ignore[arg-type]
        assert f"the unsmoothed rate of {rate}" in last and last.endswith("the strain rate is smoothed over 0.08 s")
    first = Deck.of(study, LEVELS, 8.0).notes[0]
    assert (
        first
        == "the deck has no card for edge_spread (0.8 mm) and internal_length (2 mm), so the force depends on the mesh"
    )


def test_a_whole_cut_and_layers_are_differences(tmp_path: Path) -> None:
    study = study_of(tmp_path, "lsdyna")
    severed = study.model_copy(update={"loading": study.loading.model_copy(update={"until": "severed"})})
    (note,) = Deck.of(severed, LEVELS, 8.0).notes
    assert note.startswith("the deck deletes elements over the whole stroke, but in the study the stem parts")


def test_the_files_of_a_run(tmp_path: Path) -> None:
    """OpenRadioss needs a starter file around the deck only for nonlocal failure."""
    run = Request("rsm", 0, LEVELS, 8.0)
    for program, flag, files in (
        ("openradioss", "true", ["run.k", "run_0000.rad"]),
        ("openradioss", "false", ["run.k"]),
        ("lsdyna", "true", ["run.k"]),
    ):
        solver = DeckProgram(study_of(tmp_path, program, more=f"nonlocal_failure: {flag}"))
        folder = tmp_path / f"{program}-{flag}"
        folder.mkdir()
        solver._write(folder, run)
        assert sorted(path.name for path in folder.iterdir()) == files
        assert (folder / "run.k").read_text("utf-8") == deck_text(solver._deck(run))
        if len(files) == 2:
            assert (folder / "run_0000.rad").read_text("utf-8") == starter_around("run.k", {1: 1.5})


def test_identity_of_a_deck_has_its_model_and_not_its_installation(tmp_path: Path) -> None:
    run = Request("rsm", 0, LEVELS, 8.0)
    found = DeckProgram(study_of(tmp_path, "lsdyna")).identity(run)
    assert (found["solver"], found["revision"]) == ("deck", DeckProgram.revision)
    assert set(found["model"]) == {"specimen", "blade", "supports", "loading", "contact"}
    assert not {"environment", "time_limit", "files", "home"} & set(found["options"])
    assert {"mass_scaling", "rate_law", "command"} <= set(found["options"])
    assert found["material"]["yield_stress"] == 17.0 and found["material"]["density"] == pytest.approx(1.2e-9)
