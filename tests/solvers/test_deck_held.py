"""Decks of stems held at one end and of sliding blades, read from their text; forces along an oblique travel."""

import sys
from math import cos, radians, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from stemcal.cutting.build import build
from stemcal.errors import SimulationFailed
from stemcal.solvers.deck import Deck, DeckForm, DeckProgram, deck_text
from stemcal.solvers.deck.equivalents import contact_scale
from stemcal.solvers.deck.lsdyna import force_in_rcforc
from stemcal.solvers.deck.openradioss import force_in_histories
from stemcal.solvers.deck.peak import ContactForce, peak_answer
from stemcal.solvers.deck.writer import engine_text
from stemcal.solvers.embedded import shear_test
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.protocol import Request
from stemcal.study.model.shear_test import LoadingSection
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

SPEC = """\
name: held
factors: [{name: yield_stress, unit: MPa, low: 10, high: 20}]
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 1, failure_strain: 0.03, internal_length: 2 mm}
specimen: {outer_diameter: 8 mm, diameter_ratio: 0.5, length: 30 mm}
BLADE
SUPPORTS
LOADING
solver: {SOLVER}
targets: [{diameter: 8 mm, force: 150 N}]
"""
EMBEDDED = "kind: embedded, rate_law: none, element_size: 1 mm"
CLAMPED = "supports: {kind: clamped, height: 18 mm}"
KNIFE = "supports: {kind: counter_edge, height: 18 mm, clearance: 1.3 mm, fillet_radius: 0.4 mm}"
LEVELS = {"yield_stress": 17.0}


def deck_solver(program: str, more: str = "") -> str:
    command = f'[{sys.executable}, -S, "{Path(__file__).with_name("stand_in_for_lsdyna.py")}", "i={{{{deck}}}}"]'
    ran = f", command: {command}" if program == "lsdyna" else ""
    return f"kind: deck, program: {program}, rate_law: none{ran}{more}"


def study_of(folder: Path, supports: str = "", blade: str = "", loading: str = "", solver: str = EMBEDDED) -> Study:
    text = SPEC.replace("SUPPORTS", supports).replace("BLADE", f"blade: {{edge_spread: 0.8 mm{blade}}}")
    text = text.replace("LOADING", f"loading: {{{loading}}}" if loading else "").replace("SOLVER", solver)
    (folder / "held.yaml").write_text(text, encoding="utf-8")
    return load_study(folder / "held.yaml")


class Read(NamedTuple):
    """A deck as read: nodes by number, the numbers of the nodes of each part, the rows of all other keywords."""

    nodes: dict[int, np.ndarray]
    parts: dict[int, set[int]]
    cards: dict[str, list[list[list[float]]]]

    def of(self, *parts: int) -> np.ndarray:
        return np.array([self.nodes[node] for node in sorted(set[int]().union(*(self.parts[p] for p in parts)))])


def read(deck: Deck) -> Read:
    """Read a deck by columns, without any function of the writer."""
    nodes: dict[int, np.ndarray] = {}
    parts: dict[int, set[int]] = {}
    cards: dict[str, list[list[list[float]]]] = {}
    for line in deck_text(deck).splitlines():
        if line.startswith("*"):
            cards.setdefault(name := line[1:], []).append([])
        elif name == "NODE" and not line.startswith("$"):
            nodes[int(line[:8])] = np.array([float(line[i : i + 16]) for i in (8, 24, 40)])
        elif name == "ELEMENT_SOLID" and not line.startswith("$"):
            _, part, *own = (int(line[i : i + 8]) for i in range(0, 80, 8))
            parts.setdefault(part, set()).update(own)
        elif not line.startswith("$"):
            width = 20 if name == "DEFINE_CURVE" and cards[name][-1] else 10
            fields = [line[i : i + width].strip() for i in range(0, len(line), width)]
            try:
                cards[name][-1].append([float(field) for field in fields])
            except ValueError:
                cards[name][-1].append([])  # a title
    return Read(nodes, parts, cards)


FORMS = [DeckForm("lsdyna"), DeckForm("openradioss"), DeckForm("lsdyna", True), DeckForm("openradioss", True)]
SOLVERS = [EMBEDDED, deck_solver("lsdyna"), deck_solver("openradioss")]


# ---- a clamp


@pytest.mark.parametrize("form", FORMS, ids=str)
@pytest.mark.parametrize("supports", [CLAMPED, KNIFE])
def test_the_nodes_at_the_clamp_are_held_and_no_others(tmp_path: Path, supports: str, form: DeckForm) -> None:
    """18 mm to the left of the cut, where the specimen of 30 mm begins; a hollow section has as many nodes as any."""
    found = read(Deck.of(study_of(tmp_path, supports), LEVELS, 8.0, form))
    ((sid, *rest), *rows) = found.cards["SET_NODE_LIST"][0]
    assert (sid, rest) == (4.0, [])
    listed = [int(node) for row in rows for node in row]
    assert all(len(row) == 8 for row in rows[:-1]) and 1 <= len(rows[-1]) <= 8
    stem = {n: found.nodes[n][0] for n in found.parts[1]}
    assert sorted(listed) == sorted(n for n, x in stem.items() if abs(x + 18.0) < 1e-9)
    assert len(listed) > 20 and (min(stem.values()), max(stem.values())) == pytest.approx((-18.0, 12.0), abs=1e-9)
    held = {int(row[0]): row[1:] for (row,) in found.cards["BOUNDARY_SPC_SET"]}
    assert held[4] == [0, 1, 1, 1, 0, 0, 0]
    ids = [int(rows[0][0]) for name, all_ in found.cards.items() if name.startswith("SET_NODE") for rows in all_]
    assert len(ids) == len(set(ids))
    assert "SET_NODE_LIST" not in read(Deck.of(study_of(tmp_path), LEVELS, 8.0, form)).cards


def test_another_reader_finds_the_clamp_and_both_motions(tmp_path: Path) -> None:
    """dynars reads the set of nodes, what holds it, and a motion along z and one along y, each with its curve."""
    dynars = pytest.importorskip("dynars", reason='dynars is missing: pip install "stemcal[deck-test]"')
    deck = Deck.of(study_of(tmp_path, CLAMPED, ", sliding_angle: 20 deg"), LEVELS, 8.0)
    (tmp_path / "run.k").write_text(deck_text(deck), encoding="utf-8", newline="\n")
    found = dynars.parse_deck(str(tmp_path / "run.k"))
    (nodes,), (held,) = found.keywords("SET_NODE_LIST"), found.keywords("BOUNDARY_SPC_SET")
    own = read(deck)
    at_clamp = sorted(n for n in own.parts[1] if abs(own.nodes[n][0] + 18.0) < 1e-9)[:8]
    assert [nodes.field("sid"), *(nodes.field(f"nid{i}") for i in range(1, 9))] == [4, *at_clamp]
    names = ("nsid", "cid", "dofx", "dofy", "dofz", "dofrx", "dofry", "dofrz")
    assert [held.field(name) for name in names] == [4, 0, 1, 1, 1, 0, 0, 0]
    motions = found.keywords("BOUNDARY_PRESCRIBED_MOTION_RIGID")
    fields = [[motion.field(name) for name in ("pid", "dof", "vad", "lcid", "sf")] for motion in motions]
    assert fields == [[2, 3, 0, 1, -1.0], [2, 2, 0, 2, 1.0]]
    assert [curve.field("lcid") for curve in found.keywords("DEFINE_CURVE")] == [1, 2]
    assert found.material(2).field("con1") == 1


@pytest.mark.parametrize("form", FORMS, ids=str)
def test_a_stem_that_is_only_clamped_has_no_supports(tmp_path: Path, form: DeckForm) -> None:
    deck = Deck.of(study_of(tmp_path, CLAMPED), LEVELS, 8.0, form)
    found = read(deck)
    assert set(found.parts) == {1, 2} and len(found.cards["PART"]) == 2
    assert [name for name in found.cards if name.startswith("CONTACT")] == ["CONTACT_ERODING_SURFACE_TO_SURFACE_ID"]
    assert len(found.cards.get("MAT_RIGID", [0])) == 1 and len(found.cards.get("SET_NODE_LIST_GENERATE", [0])) == 1
    assert set(found.nodes) == found.parts[1] | found.parts[2]
    (note,) = (note for note in deck.notes if "were not run" in note)
    assert "a clamp" in note and "knife" not in note and "sliding" not in note


@pytest.mark.parametrize("supports", [CLAMPED, KNIFE])
def test_the_stem_has_the_nodes_of_the_embedded_solver(tmp_path: Path, supports: str) -> None:
    """With a sliding blade, the embedded solver simulates the whole stem, too."""
    study = study_of(tmp_path, supports, ", sliding_angle: 20 deg")
    embedded = build(shear_test(study, LEVELS, 8.0)).mesh.nodes
    stem = read(Deck.of(study, LEVELS, 8.0)).of(1)
    assert stem.shape == embedded.shape and stem == pytest.approx(embedded, abs=1e-9)


@pytest.mark.parametrize(("solver", "over_a_row"), [(SOLVERS[0], True), (SOLVERS[1], False), (SOLVERS[2], False)])
def test_the_edge_is_over_a_row_of_nodes_or_the_middle_of_elements(
    tmp_path: Path, solver: str, over_a_row: bool
) -> None:
    """As between two supports: decks of their own solver have the edge over elements, which fail there."""
    x = np.unique(read(Deck.of(study_of(tmp_path, CLAMPED, solver=solver), LEVELS, 8.0)).of(1)[:, 0].round(9))
    beside = x[np.argsort(np.abs(x))][:2]
    if over_a_row:
        assert beside[0] == 0.0 and 0.8 < abs(beside[1]) <= 1.0
    else:
        assert sorted(np.sign(beside)) == [-1.0, 1.0] and 0.8 < np.ptp(beside) <= 1.0
        assert beside.mean() == pytest.approx(0.0, abs=0.05)
    assert np.diff(x).max() < (1.001 if not over_a_row else 6.0)


# ---- a fixed knife


@pytest.mark.parametrize("form", FORMS[:2], ids=str)
@pytest.mark.parametrize(("bevel", "near"), [("both", 0.5 * 2.4 + 1.3), ("one", 1.3)])
def test_the_fixed_knife_is_where_the_embedded_solver_has_it(
    tmp_path: Path, bevel: str, near: float, form: DeckForm
) -> None:
    """Half the blade and the clearance to the left; flat on top beyond its rounding of 0.4 mm, up to the clamp."""
    study = study_of(tmp_path, KNIFE, f", thickness: 2.4 mm, bevel: {bevel}")
    found = read(Deck.of(study, LEVELS, 8.0, form))
    x, y, z = found.of(3).T
    assert x.max() == pytest.approx(-near, abs=1e-9) and x.min() < -18.0
    assert z.max() == -4.0 and x[z == z.max()].max() == pytest.approx(-near - 0.4, abs=1e-9)
    assert (y.min(), y.max()) == (-4.0, 4.0)
    (tool,) = build(shear_test(study, LEVELS, 8.0)).tools[1:]
    assert max(corner[0] for corner in tool.corners) + tool.radius == pytest.approx(x.max(), abs=1e-9)
    assert tool.height == z.max()
    layers = found.of(1)[:, 0]
    assert np.abs(layers + near + 0.4).min() < 1e-9  # the stem rests on nodes
    assert len(found.cards["CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID"]) == 1 and len(found.cards["PART"]) == 3


@pytest.mark.parametrize("program", ["lsdyna", "openradioss"])
@pytest.mark.parametrize("bevel", ["both", "one"])
def test_a_rounded_edge_keeps_the_gap_to_the_knife(tmp_path: Path, program: Any, bevel: str) -> None:
    """A nose of 1.4 · 0.8 mm needs a body of 2.12 mm; the study's blade has 1 mm, and a face at −0.1 with one bevel."""
    study = study_of(tmp_path, KNIFE, f", thickness: 1 mm, bevel: {bevel}")
    found, blades = {}, {}
    for lengths in (False, True):
        deck = Deck.of(study, LEVELS, 8.0, DeckForm(program, lengths))
        found[lengths], blades[lengths] = read(deck).of(3)[:, 0].max(), read(deck).of(2)[:, 0].min()
        assert any("the fixed knife is at" in note for note in deck.notes) == lengths
        rows = read(deck).of(1)[:, 0]
        assert np.abs(rows - (found[lengths] - 0.4)).min() < 1e-9
    assert blades[True] < blades[False] - 0.3
    assert blades[True] - found[True] == pytest.approx(blades[False] - found[False], abs=1e-9)
    assert blades[True] - found[True] == pytest.approx(1.3 if bevel == "both" else 1.2, abs=1e-9)


@pytest.mark.parametrize("form", FORMS[:2], ids=str)
def test_the_contact_stiffness_is_that_of_the_stem_over_the_knife(tmp_path: Path, form: DeckForm) -> None:
    """The stem rests 1.15 + 1.3 + 0.4 mm to the left of the cut; elements at the right are longer and softer."""
    deck = Deck.of(study_of(tmp_path, KNIFE.replace("18 mm", "8 mm")), LEVELS, 8.0, form)
    factor = read(deck).cards["CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID"][0][3][0]
    left, right = (contact_scale(deck.solver, deck.parts.stem, deck.law, 0.25, (x, 0.0, -4.0)) for x in (-2.85, 2.85))
    assert factor == pytest.approx(left, rel=1e-3) and abs(left / right - 1.0) > 0.01


# ---- a sliding blade


def severed(folder: Path, *sections: str) -> Study:
    """Return a study of a whole cut at 1 m/s; the spec of one would have responses."""
    study = study_of(folder, *sections, "speed: 1 m/s")
    loading = LoadingSection(speed=study.loading.speed, until="severed")
    return study.model_copy(update={"loading": loading})


def velocities(found: Read, of: str) -> dict[int, float]:
    """Return the velocity (mm/s) of the blade by direction, with the curve of each motion."""
    curves = {int(rows[0][0]): rows[1:] for rows in found.cards["DEFINE_CURVE"]}
    speeds = {}
    for ((part, dof, vad, curve, factor),) in found.cards[f"BOUNDARY_PRESCRIBED_MOTION_{of}"]:
        assert (part, vad) == (2, 0) and curves[int(curve)][0][1] == curves[int(curve)][1][1]
        ((end,),) = found.cards["CONTROL_TERMINATION"][0]
        assert curves[int(curve)][0][0] == 0.0 and curves[int(curve)][1][0] >= end
        speeds[int(dof)] = factor * curves[int(curve)][0][1]
    return speeds


@pytest.mark.parametrize("form", FORMS, ids=str)
@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0])
def test_the_blade_slides_along_its_edge_and_covers_the_stem(tmp_path: Path, angle: float, form: DeckForm) -> None:
    """1 m/s at θ: cos θ down, sin θ along y; a stroke of 1.5 · 8 mm after the gap of 0.001 mm takes 12.001 ms."""
    deck = Deck.of(severed(tmp_path, CLAMPED, f", sliding_angle: {angle} deg"), LEVELS, 8.0, form)
    found = read(deck)
    rigid = form.for_ls_dyna or not form.lengths
    speeds = velocities(found, "RIGID" if rigid else "SET")
    expected = {3: -1000.0 * cos(radians(angle)), **({2: 1000.0 * sin(radians(angle))} if angle else {})}
    assert speeds == pytest.approx(expected, rel=1e-12)
    ((end,),) = found.cards["CONTROL_TERMINATION"][0]
    assert end == pytest.approx(12.001e-3, rel=1e-9)
    assert float(engine_text(deck, "run").splitlines()[1]) == pytest.approx(12.001e-3, rel=1e-12)
    y = found.of(2)[:, 1]
    edge = y[found.of(2)[:, 2] < 4.002]
    for time in (0.0, end):  # over the stem of 8 mm and 2 mm next to it, at the edge and at the back
        slid = time * expected.get(2, 0.0)
        assert (edge if form.lengths is False else y).min() + slid <= -5.7 and y.max() + slid >= 5.7
        assert y.min() + slid <= -5.9
    assert np.ptp(y) < 12.0 + end * expected.get(2, 0.0) + 1.5
    blade = found.cards["MAT_RIGID"][0][1] if rigid else found.cards["BOUNDARY_SPC_SET"][0][0]
    free = [1, 4 if not angle else 1, 7] if rigid else [2, 0, 1, 0 if angle else 1, 0, 0, 0, 0]
    assert blade == free
    assert any("a sliding blade" in note for note in deck.notes) == (angle > 0.0)
    assert any("deletes elements over the whole stroke" in note for note in deck.notes)


def test_the_blocks_are_as_long_as_the_stem_may_be_dragged(tmp_path: Path) -> None:
    """A blade at 30° and 1 m/s for 12.001 ms slides by 6.0005 mm in the direction of y."""
    found = read(Deck.of(severed(tmp_path, KNIFE, ", sliding_angle: 30 deg"), LEVELS, 8.0))
    y = found.of(3)[:, 1]
    assert (y.min(), y.max()) == pytest.approx((-4.0, 4.0 + 6.0005))


def test_any_speed_fits_the_columns_of_a_curve(tmp_path: Path) -> None:
    """A sliding angle of 0.001 deg has a speed with an exponent, whose digits would not fit 20 columns."""
    found = read(Deck.of(study_of(tmp_path, "", ", sliding_angle: 0.001 deg"), LEVELS, 8.0))
    assert velocities(found, "RIGID")[2] == pytest.approx(100 / 60 * sin(radians(0.001)), rel=1e-12)


# ---- true mass at machine speed


@pytest.mark.parametrize("solver", SOLVERS)
def test_at_machine_speed_the_stem_has_its_true_mass(tmp_path: Path, solver: str) -> None:
    """The mass scaling 10⁴ falls with V⁻² to 1, and a minimum time step of 40 µs with V⁻¹ to 67 ns."""
    masses = {}
    for speed in ("100 mm/min", "1 m/s"):
        study = study_of(tmp_path, CLAMPED, loading=f"speed: {speed}, stroke: 4 mm", solver=solver)
        form = DeckForm("openradioss", lengths=True)
        density = read(Deck.of(study, LEVELS, 8.0, form)).cards["MAT_PIECEWISE_LINEAR_PLASTICITY"][0][0][1]
        plain = read(Deck.of(study, LEVELS, 8.0)).cards["CONTROL_TIMESTEP"][0][0][4]
        masses[speed] = density, plain
    assert masses["100 mm/min"][0] > 1e3 * 1.1e-9 and masses["100 mm/min"][1] < -1e-5
    assert masses["1 m/s"][0] == 1.1e-9
    assert -1e-7 < masses["1 m/s"][1] <= 0.0


def test_the_window_of_the_filter_is_a_part_of_the_travel(tmp_path: Path) -> None:
    """10 ms at 100 mm/min are 0.0167 ms at 1 m/s; the identity of slow runs is what it was."""
    options = DeckSolver(program="openradioss")
    assert options.at_speed(1000.0).filter_window == pytest.approx(0.01 / 600, rel=1e-12)
    assert options.at_speed(1000.0).mass_scaling == 1.0
    assert options.at_speed(100 / 60) == options.at_speed(0.1) == options
    request = Request("rsm", 0, LEVELS, 8.0)
    slow, fast = (
        DeckProgram(study_of(tmp_path, CLAMPED, loading=f"speed: {speed}", solver=deck_solver("openradioss")))
        for speed in ("100 mm/min", "1 m/s")
    )
    assert slow.identity(request)["options"]["mass_scaling"] == 1e4
    assert fast.identity(request)["options"]["mass_scaling"] == 1.0


# ---- the force along the travel


def resistance(angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return time, R and the forces along y and z on a blade that moves along (0, sin θ, −cos θ).

    R acts against the travel; a force Q across the travel, along (0, cos θ, sin θ), must not be seen.
    """
    time, along, across = (
        np.arange(5.0),
        np.array([0.0, 30.0, 100.0, 40.0, 10.0]),
        np.array([0.0, 7.0, -20.0, 9.0, 3.0]),
    )
    s, c = sin(radians(angle)), cos(radians(angle))
    return time, along, -s * along + c * across, c * along + s * across


@pytest.mark.parametrize("angle", [20.0, 45.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_force_is_that_along_the_travel(angle: float, sign: float) -> None:
    """On the blade, or with the opposite sign on the stem: normal and friction forces of OpenRadioss are added."""
    time, along, y, z = resistance(angle)
    rows = "".join(
        f" {'master' if sign > 0 else 'slave'} 1 time {t} x 5.0 y {float(sign * fy)!r} z {float(sign * fz)!r} mass 1\n"
        for t, fy, fz in zip(time, y, z, strict=True)
    )
    assert force_in_rcforc(rows, angle).force == pytest.approx(along, abs=1e-9)
    names = ",".join(f'"TH-INTER 1 a {name}"' for name in ("FNX", "FNY", "FNZ", "FTX", "FTY", "FTZ"))
    table = f'"time",{names}\n' + "".join(
        ",".join(
            repr(float(v)) for v in (t, 1.0, sign * 0.3 * fy, sign * 0.9 * fz, 2.0, sign * 0.7 * fy, sign * 0.1 * fz)
        )
        + "\n"
        for t, fy, fz in zip(time, y, z, strict=True)
    )
    assert force_in_histories(table, angle).force == pytest.approx(along, abs=1e-9)
    assert force_in_histories(table).force == pytest.approx(z if z.max() >= -z.min() else -z, abs=1e-9)


def test_a_table_without_forces_along_y_is_no_result_of_a_sliding_blade() -> None:
    table = '"time","TH-INTER 1 a FNZ","TH-INTER 1 a FTZ"\n0.0,0,0\n1.0,-2.0,-0.5\n2.0,-1.0,-0.5\n'
    assert force_in_histories(table).force.tolist() == [0.0, 2.5, 1.5]
    with pytest.raises(SimulationFailed) as caught:
        force_in_histories(table, 10.0)
    assert caught.value.reason == "no_result"


def test_the_travel_begins_at_first_contact_of_an_oblique_edge() -> None:
    """The gap of 0.001 mm is across the edge: at 60° the blade travels 0.002 mm before it."""
    force = ContactForce(np.arange(3.0), np.array([0.0, 5.0, 1.0]))
    options = DeckSolver(program="lsdyna", filter_window=0.0)
    answer = peak_answer(force, options, LoadingSection(speed=1.0), angle=60.0)
    assert answer.details["peak_travel"] == pytest.approx(0.998, abs=1e-12)


def test_a_run_of_a_sliding_blade_has_the_share_of_the_force_along_z(tmp_path: Path) -> None:
    """The stand-in writes a triangle of 10 · 17 N along z and none along y."""
    peaks = {}
    for angle in (0.0, 40.0):
        solver = deck_solver("lsdyna", ", element_size: 2 mm, filter_window: 0 s, time_limit: 20 s")
        study = study_of(tmp_path, CLAMPED, f", sliding_angle: {angle} deg", solver=solver)
        folder = tmp_path / f"{angle}"
        answer = DeckProgram(study).placed(folder).solve(Request("rsm", 0, LEVELS, 8.0))
        assert answer.ok, answer.message
        peaks[angle] = answer.response
    assert peaks[0.0] == pytest.approx(170.0, rel=1e-5)
    assert peaks[40.0] == pytest.approx(170.0 * cos(radians(40.0)), rel=1e-5)


def test_a_fast_run_is_filtered_over_the_same_travel(tmp_path: Path) -> None:
    """The stand-in's outputs are 5 ms apart: 10 ms are three of them, and at 1 m/s the window is less than one."""
    peaks = {}
    for speed in ("100 mm/min", "1 m/s"):
        solver = deck_solver("lsdyna", ", element_size: 2 mm, time_limit: 20 s")
        study = study_of(tmp_path, CLAMPED, loading=f"speed: {speed}", solver=solver)
        answer = DeckProgram(study).placed(tmp_path / speed[:3]).solve(Request("rsm", 0, LEVELS, 8.0))
        assert answer.ok, answer.message
        peaks[speed] = answer.response
    assert peaks["1 m/s"] == pytest.approx(170.0, rel=1e-5)
    assert peaks["100 mm/min"] == pytest.approx(170.0 * (1.0 + 2.0 * 0.98) / 3.0, rel=1e-5)
