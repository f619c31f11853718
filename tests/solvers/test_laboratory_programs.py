"""Laboratory tests that a program of the user's does beside the embedded solver; the stand-in is a few lines of Python.

Torsion of a tube until it yields: T = τ J/R with J = π/2 (R⁴ − r⁴), τ = σ/√3; the force is that at a lever of 50 mm.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from stemcal.cli.app import app
from stemcal.errors import SimulationFailed, SpecError
from stemcal.solvers.embedded import Embedded
from stemcal.solvers.laboratory_programs import run_all
from stemcal.solvers.protocol import Placed, Request
from stemcal.stages.fresh import inputs_of
from stemcal.study.model import Study
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
TESTS = """
tests:
  - name: torsion
    kind: other
    solver:
      kind: command
      command: {command}
      templates: [torsion.in]
      files: [torsion.py]
      result:
        force: {{file: out.json, path: force}}
        slope: {{file: out.json, path: slope}}
"""
PROGRAM = """
import json, math
given = dict(line.split("=") for line in open("torsion.in"))
radius = float(given["d"]) / 2
polar = math.pi / 2 * radius**4 * (1 - 0.41**4)
if float(given["y"]) > 19.5:
    raise SystemExit("no convergence")
json.dump({"force": float(given["y"]) / 3**0.5 * polar / radius / 50, "slope": 1.0}, open("out.json", "w"))
"""


def command(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def force(yield_stress: float, radius: float) -> float:
    polar = math.pi / 2.0 * radius**4 * (1.0 - 0.41**4)
    return yield_stress / math.sqrt(3.0) * polar / radius / 50.0


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return study_in(tmp_path)


def study_in(folder: Path, tests: str = TESTS) -> Study:
    (folder / "torsion.in").write_text("y={{yield_stress}}\nd={{diameter}}\n", encoding="utf-8")
    (folder / "torsion.py").write_text(PROGRAM, encoding="utf-8")
    spec = folder / "study.yaml"
    smoke = (CONFIGS / "smoke.yaml").read_text(encoding="utf-8").replace("159.2 N}", "159.2 N, sd: 8 N, n: 6}")
    row = "  - {test: torsion, diameter: 8 mm, force: 16 N, sd: 1 N, n: 6}\n"
    smoke = smoke.replace("targets:\n", f"targets:\n{row}")
    spec.write_text(smoke + tests.format(command=json.dumps([sys.executable, "torsion.py"])), encoding="utf-8")
    return load_study(spec)


def asked(study: Study, yield_stress: float = 15.0, diameter: float = 8.0) -> Request:
    return Request("rsm", 0, {**study.midlevels(), "yield_stress": yield_stress}, diameter)


def test_what_a_program_reads_is_a_response_of_its_test(study: Study) -> None:
    assert [one.name for one in study.naming.responses] == ["force", "torsion_force"]
    assert study.invert.responses == ("response", "torsion_force")
    solver = Embedded(study)
    done = run_all(solver.programs, asked(study, 12.0, 10.0))
    assert done.responses == {"torsion_force": pytest.approx(force(12.0, 5.0), rel=1e-12)}


def test_it_stands_beside_the_simulated_cut(study: Study, tmp_path: Path) -> None:
    """One run simulates the cut and asks the program; the record keeps all that was read."""
    solver = Embedded(study).placed(tmp_path / "work")
    assert isinstance(solver, Placed)
    solver.prepare()
    answer = solver.solve(asked(study))
    assert answer.ok, answer.message
    assert answer.response is not None and answer.response > 50.0
    assert answer.details["responses"] == {"torsion_force": pytest.approx(force(15.0, 4.0), rel=1e-12)}
    assert answer.details["laboratory"]["torsion"]["responses"]["slope"] == 1.0
    assert list((tmp_path / "work").iterdir()) == []


def test_a_run_fails_as_its_program_does(study: Study) -> None:
    answer = Embedded(study).solve(asked(study, 20.0))
    assert (answer.status, answer.reason) == ("failed", "exit_code")
    assert answer.message.startswith("torsion: the program ended with exit code 1: no convergence")


def test_its_files_determine_the_run_where_it_is_done(study: Study, tmp_path: Path) -> None:
    begun = Embedded(study)
    before, away = Embedded(study).identity(asked(study)), Embedded(study).identity(asked(study, diameter=9.0))
    stage = inputs_of(study, None, None, "screen")  # type: ignore[arg-type]
    assert [one["name"] for one in before["laboratory"]] == ["torsion"]
    assert "laboratory" not in away
    (tmp_path / "torsion.py").write_text(PROGRAM + "# new\n", encoding="utf-8")
    again = load_study(tmp_path / "study.yaml")
    assert Embedded(again).identity(asked(again))["laboratory"] != before["laboratory"]
    changed = inputs_of(again, None, None, "screen")  # type: ignore[arg-type]
    assert [name for name, hashed in stage.items() if hashed != changed[name]] == ["tests"]
    with pytest.raises(SimulationFailed, match=r"torsion: torsion.py has changed since"):
        run_all(begun.programs, asked(study))


def test_one_test_is_shown_beside_what_was_measured(study: Study) -> None:
    shown = command("simulate", study.source, "--test", "torsion", "--set", "yield_stress=15").stdout
    assert "Maximum force: 16.92 N, measured 16 ± 1 N" in shown
    told = json.loads(command("simulate", study.source, "--test", "torsion", "--json").stdout)["result"]
    assert told["test"] == "torsion"
    assert told["responses"]["force"] == pytest.approx(force(15.0, 4.0))
    refused = command("simulate", study.source, "--test", "torsion", "--frames", "frames")
    assert refused.exit_code == 2
    assert "--frames" in refused.stderr


def test_a_result_of_an_earlier_run_is_not_put_beside_the_program(tmp_path: Path) -> None:
    """It would pass for the answer of a program that writes none: as an argument it is not to be copied, nor may it."""
    (tmp_path / "out.json").write_text('{"force": 17.0, "slope": 1.0}', encoding="utf-8")
    named = TESTS.format(command=json.dumps([sys.executable, "torsion.py", "out.json"])).replace("{", "{{")
    assert study_in(tmp_path, named.replace("}", "}}")).warnings == ()
    with pytest.raises(SpecError, match=r"tests.torsion.solver.files\[2\]: Out.json is read as a result") as told:
        (tmp_path / "Out.json").write_text("{}", encoding="utf-8")
        study_in(tmp_path, TESTS.replace("[torsion.py]", "[torsion.py, Out.json]"))
    assert "remove it, or let the program write another file" in str(told.value)


def test_what_is_wrong_with_a_program_is_told_at_its_key(tmp_path: Path) -> None:
    wrong = (
        TESTS.replace("force: {{file", "stiffness: {{file")
        .replace("torsion.in]", "torsion.in]\n      replicates: 3")
        .replace("files: [torsion.py]", "files: [torsion.py, missing.py]")
        .replace("kind: other\n", "kind: other\n    stroke: 1 mm\n")
    )
    with pytest.raises(SpecError) as told:
        study_in(tmp_path, wrong.replace(", missing.py", ""))
    text = str(told.value)
    for expected in (
        "tests.torsion.solver.result.stiffness: 'stiffness' is no response of a test",
        "tests.torsion.solver.result: nothing reads force",
        "tests.torsion.solver: a test's program gives the same answer every time",
        "tests.torsion.stroke: stroke is for a test that is simulated here",
    ):
        assert expected in text
    with pytest.raises(SpecError, match=r"tests.torsion.solver.files.*missing.py"):
        study_in(tmp_path, wrong)
    (doubt,) = study_in(tmp_path, TESTS.replace("files: [torsion.py]", "time_limit: 9 s")).warnings
    assert "tests.torsion.solver.command[2]: torsion.py lies beside the spec, but not in the folder of a run" in doubt
    assert doubt.endswith("; add files: [torsion.py]")
    spec = study_in(tmp_path, TESTS.replace("{command}", "[no-such-program]")).source
    told = command("check", spec).stderr
    assert told.startswith(
        "warning: no run can begin on this machine: tests.torsion.solver.command: there is no program"
    )
    with pytest.raises(SpecError, match=r"tests.torsion.kind: only a program"):
        study_in(tmp_path, "\ntests: [{{name: torsion, kind: other, stroke: 1 mm}}]\n")
    with pytest.raises(SpecError, match=r":54:23: tests.torsion.solver.result.slope.file"):
        study_in(tmp_path, TESTS.replace("slope: {{file: out.json", "slope: {{file: 3"))
