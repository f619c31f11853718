"""The runner of OpenRadioss against recorded runs, which a stand-in replays; every failure told apart."""

import gzip
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from stemcal.cli.app import app
from stemcal.cutting.result import moving_mean
from stemcal.errors import SimulationFailed, UsageError
from stemcal.measured.curve_modes import modes_of
from stemcal.solvers import make_solver
from stemcal.solvers.deck import Deck, DeckProgram
from stemcal.solvers.deck.openradioss import (
    deleted_elements,
    deletes_elements,
    force_in_histories,
    starter_errors,
    values_not_read,
    write_engine_input,
)
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.model.shear_test import GAP
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS

STAND_IN = Path(__file__).with_name("stand_in_for_openradioss.py")
PROGRAMS = {"starter": "starter_linux64_gf", "engine": "engine_linux64_gf", "th_to_csv": "th_to_csv_linux64_gf"}
SPEC = """\
name: radioss
factors:
  - {{name: yield_stress, unit: MPa, low: 10, high: 20}}
  - {{name: failure_strain, low: 0.01, high: 0.05}}
material: {{density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8}}
solver:
  kind: deck
  program: openradioss
  home: {home}
  rate_law: cowper_symonds
  element_size: 2 mm
  environment: {environment}
  time_limit: 20 s
{options}
targets: [{{diameter: 8 mm, force: 150 N}}, {{diameter: 7 mm, force: 150 N}}]
rsm: {{factors: [yield_stress, failure_strain], centre_points: 1}}
"""
# the levels of the recorded runs
REQUEST = Request("screen", 0, {"yield_stress": 18.07, "failure_strain": 0.03484}, 8.0)
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the stand-in's programs are scripts")


def study_of(folder: Path, recorded: str = "mat024", mode: str = "", options: str = "") -> Study:
    home = folder / "openradioss"
    (home / "exec").mkdir(parents=True)
    (home / "hm_cfg_files").mkdir()
    for name, program in PROGRAMS.items():
        for ending, content in (
            ("", f"#!/bin/sh\nexec {sys.executable} -S {STAND_IN} {name} $*\n"),
            ("_ompi", "#!/bin/false\n"),
        ):
            path = home / "exec" / f"{program}{ending}"
            path.write_text(content, encoding="utf-8")
            path.chmod(0o755)
    environment = json.dumps({"RECORDED": recorded, "STAND_IN": mode})
    path = folder / "radioss.yaml"
    path.write_text(SPEC.format(home=json.dumps(str(home)), environment=environment, options=options), encoding="utf-8")
    return load_study(path)


def command(*args: object) -> Result:
    return CliRunner().invoke(app, [str(arg) for arg in args])


def solved(folder: Path, *args: str, **spec: str) -> Answer:
    return DeckProgram(study_of(folder / "spec", *args, **spec)).placed(folder / "work").solve(REQUEST)


# ---- the recorded runs


def test_elements_deleted_and_the_force_until_the_stem_breaks(tmp_path: Path) -> None:
    answer = solved(tmp_path)
    assert answer.ok, answer.message
    # the mean over 11 rows of −(FNZ + FTZ) is largest at 0.276 s; at 0.28203 s the first four elements go
    assert answer.response == pytest.approx(125.9459, abs=1e-4)
    details = answer.details
    assert details["peak_time"] == pytest.approx(0.276012, abs=1e-6)
    assert (details["deleted_elements"], details["deleted_in_all"]) == (0, 22)
    assert details["stroke_was_enough"] is True
    assert 0.46 < details["break_travel"] < 0.50
    assert set(details["program_seconds"]) == {"starter", "engine", "th_to_csv"}
    assert details["program_version"] == "Date of build : Aug 1 2026, CommitID : bd4557ba7"
    assert not list((tmp_path / "work").glob("*"))


def test_first_deck_has_a_force_and_a_warning_that_nothing_is_deleted(tmp_path: Path) -> None:
    answer = solved(tmp_path, "first")
    assert answer.ok, answer.message
    assert answer.response == pytest.approx(193.4367, abs=1e-4)
    assert answer.details["warnings"][0]["kind"] == "nothing_deleted"
    assert "deleted_in_all" not in answer.details


def test_curve_of_a_recorded_run_is_scored(tmp_path: Path) -> None:
    """That of the table's −(FNZ + FTZ), the mean over 11 rows, to the row before the break at 0.46 to 0.50 mm."""
    u = np.linspace(0.0, 0.5, 100)
    modes = modes_of([(u, force * (1.0 - (1.0 - 2.0 * u) ** (force / 60.0))) for force in (115, 122, 125, 131, 140.0)])
    study = study_of(tmp_path / "spec")
    study = study.model_copy(update={"targets": study.targets.with_modes({0: modes})})
    answer = DeckProgram(study, tmp_path / "work").solve(REQUEST)
    table = gzip.decompress((STAND_IN.with_name("openradioss") / "mat024" / "runT01.csv.gz").read_bytes()).decode()
    contact = force_in_histories(table)
    travel, filtered = study.loading.speed * contact.time - GAP, moving_mean(contact.force, 10)
    before = travel < answer.details["break_travel"]
    assert filtered[before].max() == pytest.approx(125.9459, abs=1e-4)
    assert list(answer.details["responses"].values()) == pytest.approx(modes.scores(travel[before], filtered[before]))


@pytest.mark.parametrize(
    ("recorded", "mode", "reason", "said"),
    [
        (
            "long_format",
            "",
            "starter_error",
            "ERROR ID : 178 ** ERROR IN PART DEFINITION (PROPERTY)",
        ),
        ("broken_material", "", "starter_error", "(and 2 more)"),
        ("broken_node", "", "starter_error", "ERROR ID : 78 ** ERROR: UNDEFINED NODE NUMBER"),
        ("engine_no_restart", "", "no_restart", "run_0000_0001.rst"),
        ("mat024", "deaf", "not_as_written", "did not read these values from the deck: yield stress = 18.07 ("),
        ("mat024", "mute", "not_as_written", "density = 1.1e-09"),
        ("mat024", "killed", "exit_code", "signal 11"),
        ("mat024", "stops", "no_termination", "normal termination"),
        ("mat024", "unwritten", "no_engine_input", "run_0001.rad"),
        ("mat024", "empty", "no_history", "wrote no runT01"),
    ],
)
def test_failures_have_their_reason(tmp_path: Path, recorded: str, mode: str, reason: str, said: str) -> None:
    answer = solved(tmp_path, recorded, mode)
    assert (answer.status, answer.reason, answer.response) == ("failed", reason, None)
    assert said in answer.message
    (folder,) = (tmp_path / "work").glob("*")
    assert (folder / "run.k").is_file()
    assert not list(folder.glob("*.rst"))  # they take most room


def test_one_time_limit_for_all_programs(tmp_path: Path) -> None:
    study = study_of(tmp_path / "spec", mode="hang")
    limited = study.model_copy(update={"solver": study.solver.model_copy(update={"time_limit": 1.5})})
    answer = DeckProgram(limited).placed(tmp_path / "work").solve(REQUEST)
    assert answer.reason == "timeout"
    assert "1.5 s" in answer.message


# ---- what it is told and what determines its answer


def test_identity_follows_the_model_not_the_installation(tmp_path: Path) -> None:
    def identity(name: str, **spec: str) -> dict[str, Any]:
        return make_solver(study_of(tmp_path / name, **spec)).identity(REQUEST)

    first = identity("a")
    assert {**identity("b", mode="hang"), "environment": first["environment"]} == first
    assert identity("c", options="blade: {edge_angle: 30 deg}\n") != first
    assert identity("d", options="  mass_scaling: 2\n") != first
    json.dumps(first)


def test_programs_are_looked_for_and_missed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = study_of(tmp_path)
    make_solver(study).prepare()
    (tmp_path / "openradioss" / "exec" / PROGRAMS["engine"]).unlink()
    make_solver(study).prepare()  # takes that of another parallel library
    (tmp_path / "openradioss" / "hm_cfg_files").rmdir()
    with pytest.raises(UsageError, match=r"openradioss does not contain the folder hm_cfg_files"):
        make_solver(study).prepare()
    (tmp_path / "openradioss" / "hm_cfg_files").mkdir()
    bare = study.model_copy(update={"solver": study.solver.model_copy(update={"home": None})})
    monkeypatch.delenv("OPENRADIOSS_PATH", raising=False)
    with pytest.raises(UsageError, match=r"solver\.home: the OpenRadioss folder is unknown"):
        make_solver(bare).prepare()
    monkeypatch.setenv("OPENRADIOSS_PATH", str(tmp_path / "openradioss"))
    make_solver(bare).prepare()
    monkeypatch.setenv("OPENRADIOSS_PATH", str(tmp_path / "elsewhere"))
    with pytest.raises(UsageError, match=r"elsewhere does not contain"):
        make_solver(bare).prepare()


def test_rate_law_none_needs_no_constants(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    spec = (tmp_path / "radioss.yaml").read_text(encoding="utf-8")
    spec = spec.replace(", strain_rate_c: 90 1/s, strain_rate_p: 8", "").replace("cowper_symonds", "none")
    (tmp_path / "none.yaml").write_text(spec, encoding="utf-8")
    without = load_study(tmp_path / "none.yaml")
    values = {name: Deck.of(s, REQUEST.levels, 8.0).material["c"] for name, s in (("none", without), ("law", study))}
    assert values == {"none": 0.0, "law": 90.0}


# ---- from the command line


def test_commands_say_what_is_missing_and_run_once(tmp_path: Path) -> None:
    study_of(tmp_path)
    spec, levels = tmp_path / "radioss.yaml", ("--set", "yield_stress=18.07", "--set", "failure_strain=0.03484")
    assert "no run can start" not in command("check", spec).stderr
    run = command("simulate", spec, *levels, "--csv", tmp_path / "curve.csv")
    assert "Maximum force: 125.9 N" in run.stdout
    assert "travel at maximum force: 0.459 mm" in run.stdout
    assert (tmp_path / "curve.csv").read_text(encoding="utf-8").startswith("travel,force")
    told = json.loads(command("simulate", spec, *levels, "--json").stdout)["result"]
    assert (told["status"], told["response"]) == ("ok", pytest.approx(125.9459, abs=1e-4))
    assert command("simulate", spec, "--frames", tmp_path / "frames").exit_code == 2
    other = command("simulate", spec, "--set", "yield_stress=17")
    assert (other.exit_code, "not_as_written" in other.stderr) == (3, True)
    (tmp_path / "openradioss" / "hm_cfg_files").rmdir()
    done = command("check", spec)
    assert done.exit_code == 0
    assert "does not contain the folder hm_cfg_files" in " ".join(done.stderr.split())
    assert json.loads(command("check", spec, "--json").stdout)["result"]["warnings"]
    assert command("simulate", spec).exit_code == 2


def test_doctor_looks_at_what_the_environment_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study_of(tmp_path)
    monkeypatch.setenv("OPENRADIOSS_PATH", str(tmp_path / "openradioss"))
    ((_, found, ok),) = SOLVERS.named("deck").ready()
    assert (ok, found.endswith("starter_linux64_gf")) == (True, True)
    (tmp_path / "openradioss" / "hm_cfg_files").rmdir()
    ((_, found, ok),) = SOLVERS.named("deck").ready()
    assert (ok, "hm_cfg_files" in found) == (False, True)


# ---- listings


def test_values_that_the_reader_left_out_are_found() -> None:
    listing = "     MATERIAL NUMBER. . . . =         1\n     YIELD STRESS . . . . . =  18.07000000000    \n"
    listing += "     FIRST  FAILURE PARAMETER (D1). . . . . =  3.4840000000000E-02\n"
    written = {"ro": 1e-9, "e": 1e3, "pr": 0.3, "sigy": 18.07, "etan": 0.0, "c": 0.0, "p": 0.0, "fail": 0.03484}
    assert deletes_elements(listing)
    assert values_not_read(listing, written) == ["density = 1e-09", "elastic modulus = 1000", "Poisson's ratio = 0.3"]
    assert values_not_read(listing, {**written, "fail": 0.03}, 0.5)[3:] == [
        "failure strain = 0.03",
        "nonlocal length = 0.5",
    ]


def test_deletions_are_timed_by_what_is_printed_or_by_the_cycle_before() -> None:
    listing = (
        "    7100  0.2812      0.3960E-04 NODE        2694  -9.9%   25.07\n DELETE SOLID ELEMENT NUMBER       1911\n"
    )
    listing += " DELETE SOLID ELEMENT NUMBER       1912\n"
    assert deleted_elements(listing, "") == [0.2812, 0.2812]
    assert deleted_elements(listing, " DELETE SOLID ELEMENT NUMBER       1911 AT TIME :  2.8203E-01\n") == [
        0.2812,
        0.28203,
    ]


def test_force_of_a_contact_by_its_number_whatever_its_title() -> None:
    names = [f'"TH-INTER  {n} {title}   {part}  "' for n, title in ((1, "a b"), (2, "")) for part in ("FNZ", "FTZ")]
    text = f'"time",{",".join(names)}\n0.0,0,0,0,0\n1.0,-2.0,-0.5,3.0,1.0\n2.0,-1.0,-0.5,2.0,1.0\n'
    assert force_in_histories(text).force.tolist() == [0.0, 2.5, 1.5]
    with pytest.raises(SimulationFailed, match=r"no force for contact 1 \(contacts found: \[2, 3\]\)"):
        force_in_histories(text.replace("TH-INTER  1", "TH-INTER  3"))
    with pytest.raises(SimulationFailed, match="not a number after 2 s"):
        force_in_histories(text.replace("-2.0", "NaN"))
    assert np.allclose(force_in_histories(text).time, [0.0, 1.0, 2.0])


def test_a_run_of_a_sliding_blade_needs_its_forces_along_y(tmp_path: Path) -> None:
    """The recorded table has those along z only."""
    assert solved(tmp_path / "straight").ok
    answer = solved(tmp_path / "sliding", options="blade: {sliding_angle: 10 deg}")
    assert (answer.status, answer.reason) == ("failed", "no_result")


def test_impulses_are_no_forces() -> None:
    """Without /TH/TITLE th_to_csv has no titles and leaves impulses, which only grow while the blade presses."""
    untitled = "time,DEFAULT 1 var 1,DEFAULT 1 var 2\n0.0,0,0\n1.0,-2.0,-0.5\n2.0,-1.0,-0.5\n"
    with pytest.raises(SimulationFailed, match="no titles, so they may contain impulses") as caught:
        force_in_histories(untitled)
    assert caught.value.reason == "impulse"
    titled = '"time","TH-INTER 1 a FNZ","TH-INTER 1 a FTZ"\n'
    with pytest.raises(SimulationFailed, match="blade force never decreases") as caught:
        force_in_histories(titled + "0.0,0,0\n1.0,-2.0,-0.5\n2.0,-5.0,-0.5\n3.0,-5.0,-0.5\n")
    assert caught.value.reason == "impulse"
    assert force_in_histories(titled + "0.0,0,0\n1.0,-2.0,-0.5\n2.0,-1.0,-0.5\n").force.max() == 2.5
    assert force_in_histories(titled + "0.0,0,0\n1.0,0,0\n").force.max() == 0.0  # no contact, which is told elsewhere


def test_engine_input_asks_for_titles(tmp_path: Path) -> None:
    write_engine_input(tmp_path, "/RUN/runk/1/\n0.5\n")
    assert (tmp_path / "run_0001.rad").read_text("utf-8") == "/RUN/run/1/\n0.5\n/TH/TITLE\n"


def test_errors_without_a_description() -> None:
    assert starter_errors("ERROR ID :   3046\n** ERROR IN MATERIAL\n .. NEXT\n") == [
        "ERROR ID : 3046 ** ERROR IN MATERIAL"
    ]
