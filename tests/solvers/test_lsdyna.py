"""The runner of LS-DYNA against a stand-in, and the user's own deck with nothing changed but nine fields."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import workflow

from stemcal.cutting.result import moving_mean
from stemcal.errors import SimulationFailed, SpecError
from stemcal.measured.curve_modes import CurveModes, modes_of
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.deck import DeckProgram
from stemcal.solvers.deck.lsdyna import force_in_rcforc
from stemcal.solvers.deck.peak import ContactForce, peak_answer
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.protocol import Answer, Request
from stemcal.solvers.readers import read_text
from stemcal.study.model.shear_test import GAP, LoadingSection
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

STAND_IN = Path(__file__).with_name("stand_in_for_lsdyna.py")
SPEC = """\
name: dyna
factors:
  - {{name: yield_stress, unit: MPa, low: 10, high: 20}}
  - {{name: failure_strain, low: 0.01, high: 0.05}}
{material}
solver:
  kind: deck
  program: lsdyna
  command: {command}
  element_size: 2 mm
  environment: {{STAND_IN: {mode}}}
  time_limit: 20 s
{options}
targets: [{{diameter: 8 mm, force: 150 N}}, {{diameter: 7 mm, force: 150 N}}]
rsm: {{factors: [yield_stress, failure_strain], centre_points: 1}}
invert: {{rule: others_at_centre}}
"""
MATERIAL = """\
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8}
"""
COMMAND = json.dumps([sys.executable, "-S", str(STAND_IN), "i={{deck}}"])
UNFILTERED = DeckSolver(program="lsdyna", filter_window=0.0)
REQUEST = Request("screen", 0, {"yield_stress": 17.96, "failure_strain": 0.0387}, 8.0)


def study_of(folder: Path, mode: str = '""', options: str = "", material: str = MATERIAL) -> Study:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "dyna.yaml"
    text = SPEC.format(command=COMMAND, mode=mode, options=options, material=material)
    path.write_text(text, encoding="utf-8")
    return load_study(path)


def solved(folder: Path, request: Request = REQUEST, **spec: str) -> Answer:
    return DeckProgram(study_of(folder / "spec", **spec)).placed(folder / "work").solve(request)


# ---- runs


def test_peak_is_that_of_the_filtered_force(tmp_path: Path) -> None:
    answer = solved(tmp_path)
    assert answer.ok, answer.message
    # the stand-in's force is a triangle of height 179.6 N over 0.5 s, sampled at 101 points; 10 ms make 2 → 3 of them
    triangle = 179.6 * np.minimum(np.linspace(0, 1, 101), np.linspace(1, 0, 101)) * 2
    assert answer.response == pytest.approx(moving_mean(triangle, 2).max(), rel=1e-5)
    assert answer.details["peak_force_raw"] == pytest.approx(179.6, rel=1e-5)
    assert answer.details["peak_time"] == 0.25
    assert answer.details["peak_travel"] == pytest.approx(100 / 60 * 0.25 - 0.001, rel=1e-12)
    assert answer.details["stroke_was_enough"] is True
    assert len(answer.details["curve"]["force"]) == 101
    assert not list((tmp_path / "work").glob("*"))


@pytest.mark.parametrize(
    ("mode", "options", "reason"),
    [
        ("error", "", "error_termination"),
        ("silent", "", "no_termination"),
        ("nan", "", "nan"),
        ("broken", "", "no_result"),
    ],
)
def test_failures_have_their_reason(tmp_path: Path, mode: str, options: str, reason: str) -> None:
    answer = solved(tmp_path, mode=mode, options=options)
    assert (answer.status, answer.reason, answer.response) == ("failed", reason, None)
    assert len(list((tmp_path / "work").glob("*/run.k"))) == 1


def test_error_of_lsdyna_is_told(tmp_path: Path) -> None:
    assert "*** Error 40509" in solved(tmp_path, mode="error").message


def test_force_that_still_rises_is_marked(tmp_path: Path) -> None:
    answer = solved(tmp_path, mode="rising")
    assert answer.ok
    assert answer.details["stroke_was_enough"] is False
    (warning,) = answer.details["warnings"]
    assert warning["kind"] == "stroke_too_short"


def test_failed_elements_end_the_search_for_the_peak(tmp_path: Path) -> None:
    """The stand-in's triangle falls to half its height at 0.375 s; it tells of one element at 0.3 s, twice."""
    answer = solved(tmp_path, mode="fails")
    assert answer.details["deleted_in_all"] == 1
    assert answer.details["stroke_was_enough"] is True
    assert answer.details["break_travel"] == pytest.approx(100 / 60 * 0.375 - 0.001, rel=0.02)


def test_study_through_all_stages(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    with InlineExecutor() as executor:
        workflow.calibrate(study, StudyFolder(tmp_path / "out"), executor)
    solution = StudyFolder(tmp_path / "out").read_stage("invert")["solution"]
    # force = 10·SIGY less what the filter takes from the tip: a mean of three points of a triangle
    assert solution["yield_stress"] == pytest.approx(15.0 / (1 - 2 * 0.02 / 3), rel=1e-5)


def test_identity_follows_deck_and_geometry_not_limits(tmp_path: Path) -> None:
    def identity(name: str, **spec: str) -> dict[str, Any]:
        return make_solver(study_of(tmp_path / name, **spec)).identity(REQUEST)

    first = identity("a")
    assert identity("b") == first
    assert identity("c", options="blade: {edge_angle: 30 deg}\n") != first
    assert identity("d", options="  filter_window: 5 ms\n") != first
    json.dumps(first)


# ---- rcforc


def test_rcforc_of_both_generations_and_fortran_numbers(tmp_path: Path) -> None:
    text = "  surfa 1 time  1.0-101  x  0. y  0. z -5.00000E+00\n"
    text += "  surfa 1 time 1.0D+00 x-1.0E+00 y 2.0 z-7.50000E+00 mass 1.\n"
    (tmp_path / "rcforc").write_text(text, encoding="utf-8")
    assert force_in_rcforc(read_text(tmp_path, "rcforc")).force.tolist() == [5.0, 7.5]
    assert force_in_rcforc(read_text(tmp_path, "rcforc")).time.tolist() == [1e-101, 1.0]


def test_rcforc_refuses_stars_and_missing_file(tmp_path: Path) -> None:
    with pytest.raises(SimulationFailed, match="not write the file rcforc"):
        force_in_rcforc(read_text(tmp_path, "rcforc"))
    text = "  slave 1 time  0.0  x  0. y  0. z 1.\n  slave 1 time 0.5 x 0. y 0. z ************\n"
    (tmp_path / "rcforc").write_text(text, encoding="utf-8")
    with pytest.raises(SimulationFailed) as caught:
        force_in_rcforc(read_text(tmp_path, "rcforc"))
    assert caught.value.reason == "nan"


def test_a_force_that_is_no_number_has_the_time_of_the_last_one() -> None:
    with pytest.raises(SimulationFailed, match=r"not a number after 0\.2 s") as caught:
        ContactForce.of(np.array([0.0, 0.1, 0.2, 0.3]), np.array([0.0, 1.0, 2.0, np.nan]), "rcforc")
    assert caught.value.reason == "nan"


def test_no_force_is_no_contact() -> None:
    with pytest.raises(SimulationFailed) as caught:
        peak_answer(ContactForce(np.array([0.0, 1.0]), np.zeros(2)), UNFILTERED, LoadingSection())
    assert caught.value.reason == "no_contact"


def test_peak_is_that_before_the_stem_breaks() -> None:
    """What the released stem does afterwards is no cutting force; without failed elements nothing has broken."""
    force = np.array([0.0, 50.0, 100.0, 40.0, 20.0, 150.0, 10.0])
    contact = ContactForce(np.arange(7.0), force)
    broken = peak_answer(contact, UNFILTERED, LoadingSection(), failed=[2.5, 2.7])
    assert broken.response == 100.0
    assert broken.details["stroke_was_enough"] is True
    assert (broken.details["deleted_elements"], broken.details["deleted_in_all"]) == (0, 2)
    assert peak_answer(contact, UNFILTERED, LoadingSection()).response == 150.0
    assert peak_answer(contact, UNFILTERED, LoadingSection(), failed=[5.5]).response == 150.0


# ---- measured curves

END, SPECIMENS = 0.5, ((165.0, 2.0), (172.0, 2.4), (178.0, 1.9), (180.0, 2.1), (186.0, 2.6), (195.0, 2.2))


def measured() -> CurveModes:
    u = np.linspace(0.0, END, 400)
    return modes_of([(u, force * (1.0 - (1.0 - u / END) ** power)) for force, power in SPECIMENS])


def test_curve_is_scored_as_it_is_filtered(tmp_path: Path) -> None:
    """The stand-in's triangle by hand, at 100/60 mm/s, a mean of three; unfiltered it is another curve."""
    study, modes = study_of(tmp_path / "spec"), measured()
    curved = study.model_copy(update={"targets": study.targets.with_modes({0: modes})})
    solver = DeckProgram(curved, tmp_path / "work")
    answer = solver.solve(REQUEST)
    share = np.linspace(0, 1, 101)
    travel, triangle = 100 / 60 * 0.5 * share, 179.6 * 2 * np.minimum(share, 1 - share)
    scores = list(answer.details["responses"].values())
    assert scores == pytest.approx(modes.scores(travel, moving_mean(triangle, 2)), rel=1e-4)
    assert scores != pytest.approx(modes.scores(travel, triangle), rel=1e-4)
    assert "responses" not in DeckProgram(study, tmp_path / "work").solve(REQUEST).details
    assert solver.identity(REQUEST) != DeckProgram(study).identity(REQUEST)


def test_curve_ends_where_the_stem_breaks() -> None:
    """A specimen's curve has the specimen's scores, whatever the released stem does to the blade afterwards."""
    modes, loading = measured(), LoadingSection()
    u = np.linspace(0.0, END, 400)
    force = 186.0 * (1.0 - (1.0 - u / END) ** 2.6)
    contact = ContactForce((u + GAP) / loading.speed, force)
    swings = np.concatenate([force, [20.0, 10.0, 400.0, 5.0]])
    after = ContactForce((np.append(u, END + 0.01 * np.arange(1, 5)) + GAP) / loading.speed, swings)
    known = pytest.approx(modes.scores(u, force), rel=1e-9)
    whole = peak_answer(contact, UNFILTERED, loading, modes=modes)
    broken = peak_answer(after, UNFILTERED, loading, [float(contact.time[-1])], modes=modes)
    assert broken.response == whole.response == pytest.approx(186.0)
    assert list(whole.details["responses"].values()) == known
    assert list(broken.details["responses"].values()) == known


def test_force_without_a_rise_has_no_curve() -> None:
    falling = ContactForce(np.arange(5.0), np.array([100.0, 80.0, 60.0, 40.0, 20.0]))
    with pytest.raises(SimulationFailed, match="cannot be compared") as caught:
        peak_answer(falling, UNFILTERED, LoadingSection(), modes=measured())
    assert caught.value.reason == "no_curve"


# ---- at check time


def test_spec_is_checked_like_that_of_the_embedded_solver(tmp_path: Path) -> None:
    with pytest.raises(SpecError) as caught:
        study_of(tmp_path, material="", options="")
    assert "the LS-DYNA solver requires `density`" in str(caught.value)
    with pytest.raises(SpecError, match="does not contain the placeholder"):
        text = SPEC.format(command='["ls-dyna", "i=run.k"]', mode='""', options="", material=MATERIAL)
        (tmp_path / "b.yaml").write_text(text, encoding="utf-8")
        load_study(tmp_path / "b.yaml")
