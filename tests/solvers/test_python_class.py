"""A class of one's own as a solver: known answers, failures with their reasons, and its code as an input."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from fakes import TWO_FACTORS

from stemcal.errors import UsageError
from stemcal.runs.answer import answer_all
from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.record import Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

SOLVER = """
class Mine:
    def solve(self, levels, condition):
        if levels["failure_strain"] > 0.045:
            raise ValueError("too tough")
        return {"force": levels["yield_stress"] * condition, "work": condition}
"""
LEVELS = {"yield_stress": 15.0, "failure_strain": 0.03}
REQUEST = Request("screen", 0, LEVELS, 8.0)


def study_of(folder: Path, code: str = SOLVER, more: str = "targets: [{diameter: 8 mm, force: 120 N}]\n") -> Study:
    (folder / "mine.py").write_text(code, encoding="utf-8")
    spec = folder / "mine.yaml"
    spec.write_text(f"{TWO_FACTORS}solver: {{kind: python, file: mine.py, class: Mine}}\n{more}", encoding="utf-8")
    return load_study(spec)


def test_the_class_answers(tmp_path: Path) -> None:
    answer = make_solver(study_of(tmp_path)).solve(REQUEST)
    assert (answer.response, answer.details) == (120.0, {})


def test_it_answers_with_several_responses(tmp_path: Path) -> None:
    own = "responses: [{name: work, unit: mJ}, {name: force, unit: N}]\nconditions: [{name: size, unit: mm}]\n"
    more = own + "targets: [{size: 8, work: 8, force: 120, sd: {work: 1, force: 2}}]\n"
    answer = make_solver(study_of(tmp_path, more=more)).solve(REQUEST)
    assert (answer.response, answer.details[RESPONSES]) == (8.0, {"force": 120.0})


@pytest.mark.parametrize(
    ("code", "reason", "told"),
    [
        (SOLVER.replace("0.045", "0.02"), "raised", "ValueError: too tough"),
        (SOLVER.replace('"force":', '"strength":'), "no_result", "no force"),
        (
            SOLVER.replace('levels["yield_stress"] * condition', '"much"'),
            "bad_result",
            "the returned force is of type str",
        ),
    ],
)
def test_failures_have_their_reason(tmp_path: Path, code: str, reason: str, told: str) -> None:
    answer = make_solver(study_of(tmp_path, code)).solve(REQUEST)
    assert (answer.ok, answer.reason) == (False, reason) and told in answer.message


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("import nothing_of_this_name", "ModuleNotFoundError: No module"),
        ("class Other: pass", "AttributeError"),
        ("class Mine: pass", "no `solve"),
        ("import sys\nsys.exit(0)", "SystemExit: 0"),
        ("import os\nos._exit(0)", "SystemExit: 0"),
        ("from os import _exit\nimport threading\nthreading.Thread(target=_exit, args=(0,)).start()", "exit code 0"),
        ("import os\nos.abort()", "the process ended with"),
        ("class Mine:\n    def __init__(self): raise GeneratorExit('no licence')", "GeneratorExit: no licence"),
        ("class Mine:\n    def __init__(self): raise ValueError('m' * 5_000_000)", "4,999,500 more characters"),
    ],
)
def test_no_study_begins_with_a_class_that_cannot_be_loaded(tmp_path: Path, code: str, reason: str) -> None:
    with pytest.raises(UsageError, match=r"solver.file mine.py: the class Mine cannot be loaded: ") as raised:
        make_solver(study_of(tmp_path, code)).prepare()
    assert reason in str(raised.value) and len(str(raised.value)) < 1000


NOISY = "import os\nprint('loading')\nos.write(1, b'loading')\nos.system('echo loading')\n" + SOLVER


@pytest.mark.parametrize(
    ("code", "command", "exit_code", "status"),
    [
        (NOISY, "check", 0, "done"),
        (NOISY, "simulate", 0, "done"),
        ("import os\nos._exit(0)\n", "check", 0, "done"),
        ("import os\nos._exit(0)\n", "simulate", 2, "wrong"),
        (SOLVER.replace("if ", "import sys; sys.exit(0)\n        if "), "simulate", 3, "runs_failed"),
    ],
)
def test_no_code_of_a_class_ends_or_garbles_a_command(
    tmp_path: Path, code: str, command: str, exit_code: int, status: str
) -> None:
    study_of(tmp_path, code)
    files = set(tmp_path.rglob("*"))
    line = [sys.executable, "-m", "stemcal", command, "mine.yaml", "--json"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, encoding="utf-8", check=False)
    assert (done.returncode, json.loads(done.stdout)["status"]) == (exit_code, status), done.stderr
    assert command != "check" or files == set(tmp_path.rglob("*"))


def test_runs_of_other_code_are_other_runs(tmp_path: Path) -> None:
    keys = [Run.of(make_solver(study_of(tmp_path, code)), REQUEST).key for code in (SOLVER, SOLVER, SOLVER + "# new\n")]
    assert keys[0] == keys[1] != keys[2]
    changed = make_solver(study_of(tmp_path))
    (tmp_path / "mine.py").write_text("class Mine: pass\n", encoding="utf-8")
    assert changed.solve(REQUEST).reason == "input_changed"


def test_workers_compute_it(tmp_path: Path) -> None:
    solver = make_solver(study_of(tmp_path))
    with StudyFolder(tmp_path / "out") as folder, LocalExecutor(1) as executor:
        answers = answer_all([REQUEST], solver, folder, executor)
    assert [answer.response for answer in answers] == [120.0]
