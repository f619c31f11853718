"""A program as solver. Its stand-ins are small Python scripts written by the tests."""

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from stemcal.errors import SpecError, UsageError
from stemcal.runs.answer import answer_all
from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver, options
from stemcal.solvers.program import Command, scripts_in
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

SPEC = """\
name: outside
factors:
  - {{name: stiffness, unit: N/mm2, low: 1, high: 3}}
  - {{name: width, unit: mm, low: 10, high: 20}}
solver:
  kind: command
  command: {command}
  templates: [input.txt]
  files: [program.py]
  time_limit: {limit}
  result: {result}
targets: [{{diameter: 8 mm, force: 100 N}}]
"""
TEMPLATE = "k = {{stiffness}}\nb = {{ width }}\nd = {{diameter}}\n"
# answers k·b·d
PRODUCT = """
import json
k, b, d = (float(line.split("=")[1]) for line in open("input.txt"))
json.dump({"out": [0, k * b * d]}, open("out.json", "w"))
"""
JSON = "{file: out.json, path: out}"
REQUEST = Request("screen", 0, {"stiffness": 1.5, "width": 10.0}, 8.0)
POSIX = pytest.mark.skipif(os.name != "posix", reason="process groups are tried where there are signals")


def study_of(
    folder: Path, program: str = PRODUCT, result: str = JSON, template: str = TEMPLATE, limit: str = "20 s", **more: str
) -> Study:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "program.py").write_text(program, encoding="utf-8")
    (folder / "input.txt").write_text(template, encoding="utf-8", newline="")
    command = more.get("command", json.dumps([sys.executable, "-S", "program.py"]))
    spec = folder / "study.yaml"
    spec.write_text(SPEC.format(command=command, result=result, limit=limit), encoding="utf-8")
    return load_study(spec)


def solved(folder: Path, program: str = PRODUCT, **options: str) -> Answer:
    study = study_of(folder / "spec", program, **options)
    return Command(study).placed(folder / "work").solve(REQUEST)


def kept(folder: Path) -> list[Path]:
    return sorted((folder / "work").glob("*"))


# ---- what comes out


@POSIX
def test_what_a_program_says_is_written_through_no_link(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("precious", encoding="utf-8")
    solved(tmp_path, f"import os; os.symlink({str(precious)!r}, 'program-output.txt')")
    assert precious.read_text("utf-8") == "precious"


def test_answer_is_what_the_program_makes_of_the_values(tmp_path: Path) -> None:
    answer = solved(tmp_path)
    assert answer.ok, answer.message
    assert answer.response == 1.5 * 10 * 8
    assert answer.details["exit_code"] == 0
    assert kept(tmp_path) == []


def test_arguments_take_values_too(tmp_path: Path) -> None:
    program = "import sys, json; json.dump({'out': float(sys.argv[1])}, open('out.json', 'w'))"
    command = json.dumps([sys.executable, "-S", "program.py", "{{width}}"])
    assert solved(tmp_path, program, command=command).response == 10.0


def test_a_shell_sees_nothing(tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    program = "import sys, json; json.dump({'out': len(sys.argv[1])}, open('out.json', 'w'))"
    argument = f"; touch {canary} $(touch {canary}) `touch {canary}` | %COMSPEC% & *"
    answer = solved(tmp_path, program, command=json.dumps([sys.executable, "-S", "program.py", argument]))
    assert answer.response == len(argument)
    assert not canary.exists()


def test_templates_change_nothing_but_placeholders(tmp_path: Path) -> None:
    hostile = "k={{stiffness}}\r\n$(rm) %d {0} {% x %} ${width} {width} \\n \\1 {{{width}}}\ttab \u4e2d\n"
    program = "import shutil; shutil.copy('input.txt', 'seen.txt'); raise SystemExit(1)"
    study = study_of(tmp_path / "spec", program, template=hostile + "{{width}}")
    Command(study).placed(tmp_path / "work").solve(REQUEST)
    seen = (kept(tmp_path)[0] / "seen.txt").read_bytes()
    assert seen == hostile.replace("{{stiffness}}", "1.5").replace("{{width}}", "10.0").encode() + b"10.0"


def test_values_are_written_with_all_their_digits(tmp_path: Path) -> None:
    request = Request("rsm", 0, {"stiffness": 0.1 + 0.2, "width": 1e-300}, 8.0)
    program = "raise SystemExit(1)"
    Command(study_of(tmp_path / "spec", program)).placed(tmp_path / "work").solve(request)
    lines = (kept(tmp_path)[0] / "input.txt").read_text(encoding="utf-8").splitlines()
    assert [float(line.split("=")[1]) for line in lines] == [0.1 + 0.2, 1e-300, 8.0]


# ---- failures, each under its own name


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("raise SystemExit(3)", "exit_code"),
        ("import os; os.abort()", "exit_code"),
        ("pass", "no_result"),
        ("open('out.json', 'w')", "no_result"),
        ("open('out.json', 'w').write('{\"out\": [1, 2')", "bad_result"),
        ("open('out.json', 'w').write('[' * 100000)", "bad_result"),
        ("open('out.json', 'wb').write(bytes(range(256)))", "bad_result"),
        ("open('out.json', 'w').write('{\"out\": \"about 5\"}')", "bad_result"),
        ("open('out.json', 'w').write('{\"out\": []}')", "no_result"),
        ("open('out.json', 'w').write('{\"out\": NaN}')", "nan"),
        ("open('out.json', 'w').write('{\"out\": [1, Infinity]}')", "nan"),
        ("open('out.json', 'w').write('{\"out\": null}')", "nan"),
        ("open('out.json', 'w').write('{\"other\": 1}')", "no_result"),
        ("import os; os.mkdir('out.json')", "no_result"),
    ],
)
def test_failure_has_its_reason_and_keeps_its_folder(tmp_path: Path, program: str, reason: str) -> None:
    answer = solved(tmp_path, program)
    assert (answer.status, answer.reason, answer.response) == ("failed", reason, None)
    assert len(kept(tmp_path)) == 1
    assert str(kept(tmp_path)[0]) in answer.message


def test_huge_result_is_refused_without_reading_it(tmp_path: Path) -> None:
    answer = solved(tmp_path, "open('out.json', 'wb').truncate(10**11)")
    assert answer.reason == "bad_result"
    assert "larger than" in answer.message


@POSIX
def test_link_out_of_the_run_folder_is_no_result(tmp_path: Path) -> None:
    (tmp_path / "secret.json").write_text('{"out": 5}', encoding="utf-8")
    answer = solved(tmp_path, f"import os; os.symlink({str(tmp_path / 'secret.json')!r}, 'out.json')")
    assert answer.reason == "no_result"


def test_flood_of_output_is_capped(tmp_path: Path) -> None:
    program = "for i in range(200): print('x' * 100000)\nprint('the last word'); raise SystemExit(2)"
    answer = solved(tmp_path, program)
    assert "the last word" in answer.message
    assert len(answer.details["output"]) <= 2000
    assert (kept(tmp_path)[0] / "program-output.txt").stat().st_size < 100_000


STUBBORN = """
import os, signal, subprocess, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = subprocess.Popen(
    ["sh", "-c", "trap '' TERM; echo $$ > {pids}.child; (trap '' TERM; sleep 300) & echo $! > {pids}.grandchild; wait"]
)
open("{pids}", "w").write(str(os.getpid()))
time.sleep(300)
"""


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0]
        return state != b"Z"
    except FileNotFoundError:
        return False


def pids_of(path: Path) -> list[int]:
    files = [path, Path(f"{path}.child"), Path(f"{path}.grandchild")]
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline and not all(f.exists() and f.read_text().strip() for f in files):
        time.sleep(0.02)
    return [int(file.read_text()) for file in files]


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_hung_program_is_gone_with_its_grandchildren(tmp_path: Path) -> None:
    begin = time.monotonic()
    answer = solved(tmp_path, STUBBORN.format(pids=tmp_path / "pids"), limit="1 s")
    took = time.monotonic() - begin
    assert answer.reason == "timeout"
    assert 1.0 <= took < 1.0 + 5.0
    assert not any(alive(pid) for pid in pids_of(tmp_path / "pids"))


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_child_left_behind_by_a_program_that_ended_is_ended(tmp_path: Path) -> None:
    program = PRODUCT + (
        f"import subprocess\nopen({str(tmp_path / 'pid')!r}, 'w').write(str(subprocess.Popen(['sleep', '300']).pid))\n"
    )
    answer = solved(tmp_path, program)
    assert answer.ok
    time.sleep(0.1)
    assert not alive(int((tmp_path / "pid").read_text()))


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_program_dies_with_a_killed_stemcal(tmp_path: Path) -> None:
    study_of(tmp_path / "spec", STUBBORN.format(pids=tmp_path / "pids"))
    script = (
        "from stemcal.solvers.program import Command; from stemcal.solvers.protocol import Request\n"
        "from stemcal.runs.executors.local import LocalExecutor\n"
        f"from stemcal.study.reading import load_study; s = load_study({str(tmp_path / 'spec' / 'study.yaml')!r})\n"
        "with LocalExecutor(1) as executor:\n"
        f"    executor.submit(Command(s).solve, Request('screen', 0, {dict(REQUEST.levels)!r}, 8.0)).result()\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    parent = subprocess.Popen([sys.executable, "-c", script], env=environment)
    pids = pids_of(tmp_path / "pids")
    assert all(alive(pid) for pid in pids)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline and any(alive(pid) for pid in pids):
        time.sleep(0.02)
    assert not any(alive(pid) for pid in pids)


# ---- what determines an answer


def test_identity_holds_templates_command_and_reader(tmp_path: Path) -> None:
    def identity(folder: str, **options: str) -> dict[str, object]:
        return Command(study_of(tmp_path / folder, **options)).identity(REQUEST)

    first = identity("a")
    assert identity("b") == first
    assert identity("c", template=TEMPLATE + "# more\n")["inputs"] != first["inputs"]
    assert identity("d", result="{file: out.json, path: out, reduction: max}")["result"] != first["result"]
    assert identity("e", limit="30 s") == first
    json.dumps(first)


def test_solver_pickles_without_the_files(tmp_path: Path) -> None:
    solver = make_solver(study_of(tmp_path, program=PRODUCT + "#" * 1_000_000))
    blob = pickle.dumps(solver)
    assert len(blob) < 100_000
    assert pickle.loads(blob).solve(REQUEST).response == 120.0


def test_input_changed_meanwhile_fails_the_run(tmp_path: Path) -> None:
    solver = Command(study_of(tmp_path))
    (tmp_path / "program.py").write_text("pass", encoding="utf-8")
    assert solver.solve(REQUEST).reason == "input_changed"


def test_missing_program_is_told_before_anything_runs(tmp_path: Path) -> None:
    solver = make_solver(study_of(tmp_path, command='["no-such-program-here", "x"]'))
    with pytest.raises(UsageError, match="the program 'no-such-program-here' was not found on PATH"):
        solver.prepare()


# ---- at check time


def problems(folder: Path, **options: str) -> str:
    with pytest.raises(SpecError) as caught:
        study_of(folder, **options)
    return str(caught.value)


def test_unknown_placeholder_is_told_with_file_and_line(tmp_path: Path) -> None:
    said = problems(tmp_path, template=TEMPLATE + "x = {{widthh}}\ny = {{__import__('os')}}\n")
    assert "study.yaml:8:15: solver.templates[1]: input.txt:4: {{widthh}} is not a factor; did you mean width?" in said
    assert "input.txt:5: {{__import__('os')}} is not a factor" in said


def test_factor_that_no_template_holds_is_told(tmp_path: Path) -> None:
    said = problems(tmp_path, template="k = {{stiffness}}\n")
    assert "factors.width.name: neither a template nor the command contains {{width}}" in said


@pytest.mark.parametrize("name", ["../out.json", "/etc/passwd", "a/../../b", "C:out.json", "..\\out.json", ""])
def test_result_file_stays_in_the_run_folder(tmp_path: Path, name: str) -> None:
    said = problems(tmp_path, result=json.dumps({"file": name, "path": "out"}))
    assert "is not a file in the run folder" in said


@pytest.mark.parametrize(
    ("result", "said"),
    [
        ("{file: out.json, path: a, column: b}", "solver.result: the reader has column and path; use exactly one of"),
        (
            "{file: out.json}",
            "solver.result: the reader does not specify which numbers to read; use exactly one of `column: …`",
        ),
        ("{file: out.csv, colum: F}", "unknown key 'colum'; did you mean column?"),  # codespell:ignore colum
        ("{file: out.txt, pattern: '(1'}", "is not a valid regular expression"),
        ("{file: out.txt, pattern: '(1{4294967295})'}", "is not a valid regular expression: the repetition number"),
        ("{file: out.txt, pattern: 'F=1'}", "has no capture group around the number"),
        ("{file: out.txt, pattern: 5}", "solver.result.pattern: 5 is not text"),
        ("{file: 5, path: out}", "solver.result.file: 5 is not text"),
        ("{file: out.json, path: out, reduction: mean}", "is not an allowed value"),
    ],
)
def test_wrong_result_section_is_told(tmp_path: Path, result: str, said: str) -> None:
    assert said in problems(tmp_path, result=result)


def test_command_must_be_a_list(tmp_path: Path) -> None:
    assert "is not a list" in problems(tmp_path, command='"ccx model"')


@pytest.mark.parametrize("name", ["outside/shear.py", "outside/law.py", "outside/rest.py"])
def test_a_run_depends_on_the_scripts_that_its_command_names(tmp_path: Path, name: str) -> None:
    """A script by its absolute path, with the module that it imports; other files of its folder do not count."""
    texts = {"shear.py": "import law", "law.py": "K = 1.0", "rest.py": ""}
    for file, text in texts.items():
        (tmp_path / "outside").mkdir(exist_ok=True)
        (tmp_path / "outside" / file).write_text(text, encoding="utf-8")
    command = json.dumps([sys.executable, f"--script={tmp_path / 'outside' / 'shear.py'}"])
    before = Command(study_of(tmp_path / "spec", command=command))
    (tmp_path / name).write_text("K = 2.0", encoding="utf-8")
    after = Command(before.study)
    changed = name != "outside/rest.py"
    assert (before.identity(REQUEST) != after.identity(REQUEST)) is changed
    assert (before.solve(REQUEST).reason == "input_changed") is changed


def test_programs_on_the_path_and_data_elsewhere_are_no_inputs(tmp_path: Path) -> None:
    """`solver` is searched on the PATH, although the folder has a file of this name; `./solver` is that file."""
    (tmp_path / "spec").mkdir()
    for name in ("spec/solver", "table.dat"):
        (tmp_path / name).write_text("1 2\n", encoding="utf-8")
    elsewhere = [str(tmp_path / "table.dat"), str(tmp_path / "spec" / "missing.py")]
    assert scripts_in(["solver", *elsewhere], tmp_path / "spec") == []
    assert scripts_in(["./solver", *elsewhere], tmp_path / "spec") == [tmp_path / "spec" / "solver"]


def test_a_run_depends_on_a_program_next_to_the_spec(tmp_path: Path) -> None:
    (tmp_path / "heap").write_text("#!/bin/sh\n", encoding="utf-8")
    study = study_of(tmp_path, command="[./heap]", template="{{stiffness}} {{width}}")
    before = Command(study).identity(REQUEST)
    (tmp_path / "heap").write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    assert Command(study).identity(REQUEST) != before


TRUNCATED = "open('out.csv', 'w').write('t,F\\n0,1\\n1,5\\n'); print('step 1')"


@pytest.mark.parametrize(("end", "ok"), [("", True), (", ends_with: DONE", False), (", ends_with: step 1", True)])
def test_a_truncated_curve_is_a_lower_bound_or_fails(tmp_path: Path, end: str, ok: bool) -> None:
    result = f"{{file: out.csv, column: F, reduction: max{end}}}"
    answer = solved(tmp_path, TRUNCATED, result=result)
    assert (answer.ok, answer.reason) == (ok, "" if ok else "incomplete")
    assert answer.details.get("stroke_was_enough") is (False if ok else None)
    assert [note["kind"] for note in answer.details.get("warnings", [])] == (["largest_at_end"] if ok else [])


def test_a_pattern_that_searches_for_ever_ends_with_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(options, "_READING_S", 1.0)
    program = "open('log.txt', 'w').write('a' * 40 + '!')"
    study = study_of(tmp_path / "spec", program, result="{file: log.txt, pattern: '(a+)+$'}", limit="1 s")
    solver = Command(study).placed(tmp_path / "work")
    with StudyFolder(tmp_path / "out") as folder, LocalExecutor(1, study.solver.run_limit) as executor:
        [answer] = answer_all([REQUEST], solver, folder, executor, quorum=0.0)
    assert answer.reason == "timeout"
