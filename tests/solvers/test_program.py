"""Everything around the run of a program: its files, its output, its exit code and its record."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.errors import SimulationFailed, UsageError
from stemcal.measured.curve_modes import modes_of
from stemcal.processes.program import ProgramRun
from stemcal.solvers.options import CommandSolver
from stemcal.solvers.program import (
    Command,
    Inputs,
    code_is_zero,
    executable,
    file_hash,
    run_folder,
    run_in,
    scripts_in,
)
from stemcal.solvers.protocol import Answer, Request
from stemcal.storage.canonical import key_of
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

SPEC = """\
name: outside
factors: [{{name: k, low: 1, high: 3}}]
solver:
  kind: command
  command: {command}
  templates: [input.txt]
  files: [program.py]
  environment: {{COLOUR: green}}
  result: {result}
{more}
"""
TARGETS = "targets: [{diameter: 8 mm, force: 100 N}]"
RUN = Request("screen", 0, {"k": 1.5}, 8.0)
SHA_OF_ABC = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


def study_of(
    folder: Path, program: str, result: str, more: str = TARGETS, template: str = "{{k}} {{diameter}}"
) -> Study:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "program.py").write_text(program, encoding="utf-8")
    (folder / "input.txt").write_text(template, encoding="utf-8")
    command = json.dumps([sys.executable, "-S", "program.py"])
    spec = SPEC.format(command=command, result=result, more=more)
    (folder / "study.yaml").write_text(spec, encoding="utf-8")
    return load_study(folder / "study.yaml")


def options(**keys: Any) -> CommandSolver:
    return CommandSolver(command=("x",), **keys)


def failing(finished: ProgramRun) -> str:
    with pytest.raises(SimulationFailed) as caught:
        code_is_zero(finished)
    assert caught.value.reason == "exit_code"
    return str(caught.value)


def test_an_exit_code_has_the_last_line_that_was_printed() -> None:
    code_is_zero(ProgramRun(0, False, "licence expired", 1.0))
    assert failing(ProgramRun(-11, False, "bye", 1.0)) == "the program was terminated by signal 11"
    assert failing(ProgramRun(3, False, "one\n  two  \n \n", 1.0)) == "the program finished with exit code 3: two"
    assert failing(ProgramRun(1, False, "\n", 1.0)) == "the program finished with exit code 1"
    assert failing(ProgramRun(1, False, "x" * 300, 1.0)) == f"the program finished with exit code 1: {'x' * 200}"


def test_a_program_that_cannot_be_started_fails_the_run(tmp_path: Path) -> None:
    answer = run_in(tmp_path, [str(tmp_path / "missing")], options(), lambda finished: Answer("ok", 1.0))
    assert (answer.status, answer.reason) == ("failed", "not_started")
    assert answer.message == f"{tmp_path / 'missing'}: No such file or directory"


def printing(text: str) -> list[str]:
    return [sys.executable, "-S", "-c", text]


def test_the_record_of_a_run_has_its_exit_code_its_time_and_more_only_if_it_failed(tmp_path: Path) -> None:
    def read(finished: ProgramRun) -> Answer:
        return Answer("ok", 2.0, details={"output": finished.output.strip(), "more": finished.code})

    answer = run_in(tmp_path, printing("print('hello'); raise SystemExit(4)"), options(), read)
    assert (answer.response, answer.details["exit_code"]) == (2.0, 4)
    assert (answer.details["output"], answer.details["more"]) == ("hello", 4)
    seconds = answer.details["program_seconds"]
    assert 0.0 < seconds < 60.0 and seconds == round(seconds, 3)
    assert (tmp_path / "program-output.txt").read_text(encoding="utf-8").strip() == "hello"

    def refuse(finished: ProgramRun) -> Answer:
        raise SimulationFailed("nan", "value 1 is not finite")

    failed = run_in(tmp_path, printing("print('y' * 3000, end='')"), options(), refuse)
    assert (failed.reason, failed.message) == ("nan", f"value 1 is not finite ({tmp_path})")
    assert failed.details["output"] == "y" * 2000 and failed.details["exit_code"] == 0


def test_a_program_beyond_its_limit_is_named_with_the_limit_of_the_spec(tmp_path: Path) -> None:
    hanging = printing("import time; time.sleep(30)")
    for limit, seconds in (("0.2 s", None), ("3600 s", 0.2)):
        answer = run_in(tmp_path, hanging, options(time_limit=limit), lambda finished: Answer("ok", 1.0), seconds)
        assert (answer.status, answer.reason) == ("failed", "timeout")
        assert f"after {limit} (`solver.time_limit`)" in answer.message


def test_a_program_has_the_variables_of_the_spec(tmp_path: Path) -> None:
    program = "import os, json; json.dump({'n': len(os.environ['COLOUR'])}, open('o.json', 'w'))"
    study = study_of(tmp_path, program, "{file: o.json, path: n}")
    assert Command(study).placed(tmp_path / "work").solve(RUN).response == 5.0


# ---- files


def test_the_hash_of_a_file_is_its_sha_256(tmp_path: Path) -> None:
    (tmp_path / "abc").write_bytes(b"abc")
    assert file_hash(tmp_path / "abc") == SHA_OF_ABC
    with pytest.raises(UsageError, match=r"missing: No such file or directory; specify an existing file"):
        file_hash(tmp_path / "missing")


def test_inputs_are_named_by_their_place_in_the_command(tmp_path: Path) -> None:
    for name in ("a.txt", "b.dat", "c.py", "d.py"):
        (tmp_path / name).write_bytes(b"abc" if name != "b.dat" else b"{{k}} kept")
    inputs = Inputs.of([tmp_path / "a.txt"], [tmp_path / "b.dat"], [tmp_path / "c.py", tmp_path / "d.py"])
    hashes = inputs.identity()
    assert list(hashes) == ["a.txt", "b.dat", "command 0: c.py", "command 1: d.py"]
    assert [hashes[name] == SHA_OF_ABC for name in hashes] == [True, False, True, True]
    folder = tmp_path / "run"
    folder.mkdir()
    inputs.write(folder, {})
    assert sorted(path.name for path in folder.iterdir()) == ["a.txt", "b.dat"]
    assert (folder / "b.dat").read_bytes() == b"{{k}} kept"
    for name in ("a.txt", "b.dat", "d.py"):
        before = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(b"changed")
        with pytest.raises(SimulationFailed, match=f"{name} has changed since") as caught:
            inputs.write(folder, {})
        assert caught.value.reason == "input_changed"
        (tmp_path / name).write_bytes(before)
    (tmp_path / "c.py").unlink()
    with pytest.raises(SimulationFailed, match=r"c\.py has changed"):
        inputs.write(folder, {})


def test_the_folder_of_a_run_is_empty_and_has_the_name_of_its_record(tmp_path: Path) -> None:
    identity = {"solver": "command", "levels": {"k": 1.0}}
    folder = run_folder(tmp_path / "work", identity)
    assert folder == tmp_path / "work" / key_of(identity)
    (folder / "old").write_text("", encoding="utf-8")
    assert not list(run_folder(tmp_path / "work", identity).iterdir())
    elsewhere = run_folder(None, identity)
    assert elsewhere.is_dir() and elsewhere.name.startswith("stemcal-run-")
    elsewhere.rmdir()


@pytest.mark.skipif(os.name != "posix", reason="programs have an extension on Windows")
def test_a_program_is_on_the_path_or_next_to_the_spec(tmp_path: Path) -> None:
    (tmp_path / "own").write_text("#!/bin/sh\n", encoding="utf-8")
    (tmp_path / "own").chmod(0o755)
    assert executable("./own", tmp_path) == str(tmp_path / "own")
    assert Path(executable("sh", tmp_path)).is_absolute()
    with pytest.raises(UsageError) as caught:
        executable("own", tmp_path)
    message = "the program 'own' was not found on PATH; install the program or correct its name"
    assert str(caught.value) == f"solver.command: {message}"
    with pytest.raises(UsageError, match=f"^solver.command: the program './none' was not found in {tmp_path};"):
        executable("./none", tmp_path)
    with pytest.raises(UsageError, match="was not found in"):
        executable(".\\none", tmp_path)


def test_scripts_of_a_command_are_those_named_by_their_whole_path(tmp_path: Path) -> None:
    """Scripts anywhere and any file in the folder of the spec; once each, with the modules that they import."""
    spec, other = tmp_path / "spec", tmp_path / "other"
    texts = {spec / "mesh.dat": "", other / "run.py": "import law", other / "law.py": "", other / "mesh.dat": ""}
    for path in (*texts, other / "RUN.SH"):
        path.parent.mkdir(exist_ok=True)
        path.write_text(texts.get(path, ""), encoding="utf-8")
    script, law = other / "run.py", other / "law.py"
    assert scripts_in(["python", str(script)], spec) == [script, law]
    assert scripts_in(["python", f"--file={script}", str(script)], spec) == [script, law]
    assert scripts_in(["python", str(other / "RUN.SH")], spec) == [other / "RUN.SH"]
    assert scripts_in(["python", str(spec / "mesh.dat")], spec) == [spec / "mesh.dat"]
    assert scripts_in(["python", str(other / "mesh.dat"), "mesh.dat", str(other)], spec) == []
    assert scripts_in(["./mesh.dat"], spec) == [spec / "mesh.dat"] and scripts_in(["mesh.dat"], spec) == []
    assert scripts_in([str(script)], spec) == [script, law] and scripts_in([], spec) == []
    assert scripts_in(["python", "/" + "x" * 5000, "/\0"], spec) == []


# ---- the record and the answer of a command

WRITE = "import json; json.dump({content}, open('o.json', 'w'))"
PEAK = "{file: o.json, path: y, along: x, reduction: max, scale: 2}"


def test_the_identity_of_a_run_has_what_determines_it_and_no_more(tmp_path: Path) -> None:
    study = study_of(tmp_path, "", "{file: o.json, path: y}")
    identity = Command(study).identity(RUN)
    assert set(identity) == {
        *("solver", "revision", "environment", "inputs", "command", "result", "levels", "condition"),
    }
    assert (identity["solver"], identity["revision"], identity["condition"]) == ("command", 1, 8.0)
    assert identity["environment"] == {"COLOUR": "green"} and identity["levels"] == {"k": 1.5}
    reader = {"file": "o.json", "column": None, "path": "y", "pattern": None, "along": None, "reduction": "last"}
    assert identity["result"] == {"response": {**reader, "scale": 1.0}}
    ended = study_of(tmp_path, "", "{file: o.json, path: y, ends_with: END}")
    assert Command(ended).identity(RUN)["result"]["response"] == {**reader, "ends_with": "END", "scale": 1.0}
    numbered = Command(study).identity(replace(RUN, replicate=2))
    assert {key for key in numbered if key not in identity} == {"replicate", "seed"} and numbered["replicate"] == 2


def test_a_study_without_a_condition_has_none_in_its_records(tmp_path: Path) -> None:
    more = "responses: [{name: y, unit: N}]\nconditions: []\ntargets: [{y: 3}]"
    study = study_of(tmp_path, "", "{file: o.json, path: y}", more, "{{k}}")
    assert "condition" not in Command(study).identity(RUN)


def test_further_responses_are_details_and_the_first_is_the_response(tmp_path: Path) -> None:
    more = "responses: [{name: y, unit: N}, {name: z, unit: mJ}]\nconditions: [{name: size, unit: mm}]\n"
    more += "targets: [{size: 8, y: 3, z: 4, sd: {y: 1, z: 1}}]"
    result = "{z: {file: o.json, path: b}, y: {file: o.json, path: a, scale: 10}}"
    study = study_of(tmp_path / "spec", WRITE.format(content="{'a': 0.3, 'b': 4.0}"), result, more, "{{k}} {{size}}")
    answer = Command(study).placed(tmp_path / "work").solve(RUN)
    assert (answer.response, answer.details["responses"]) == (3.0, {"z": 4.0})
    assert set(answer.details) == {"exit_code", "program_seconds", "responses"}


def test_a_curve_is_scored_and_kept_with_its_scale(tmp_path: Path) -> None:
    content = "{'x': [0.0, 0.1, 0.2, 0.3, 0.4, 0.5], 'y': [0, 30, 55, 75, 90, 80]}"
    study = study_of(tmp_path / "spec", WRITE.format(content=content), PEAK)
    plain = Command(study).placed(tmp_path / "work").solve(RUN)
    assert (plain.response, set(plain.details)) == (180.0, {"exit_code", "program_seconds"})
    shares = np.linspace(0.0, 1.0, 101)
    shapes = ((165.0, 2.0), (172.0, 2.4), (178.0, 1.9), (180.0, 2.1), (186.0, 2.6))
    modes = modes_of([(0.4 * shares, force * (1.0 - (1.0 - shares) ** power)) for force, power in shapes])
    curved = study.model_copy(update={"targets": study.targets.with_modes({0: modes})})
    answer = Command(curved).placed(tmp_path / "work").solve(RUN)
    force = np.array([0.0, 60.0, 110.0, 150.0, 180.0, 160.0])
    known = modes.scores(np.linspace(0.0, 0.5, 6), force)
    assert list(answer.details["responses"].values()) == pytest.approx(known)
    assert answer.details["curve"]["force"] == force.tolist()
    assert answer.details["curve"]["travel"] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert "curves" in Command(curved).identity(RUN)
