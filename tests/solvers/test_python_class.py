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
from stemcal.runs.record import Run, validated
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Request
from stemcal.solvers.replicates import repeated, seed_of
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


TARGETS = "targets: [{diameter: 8 mm, force: 120 N}]\n"


def study_of(folder: Path, code: str = SOLVER, more: str = TARGETS, solver: str = "") -> Study:
    (folder / "mine.py").write_text(code, encoding="utf-8")
    spec = folder / "mine.yaml"
    spec.write_text(
        f"{TWO_FACTORS}solver: {{kind: python, file: mine.py, class: Mine{solver}}}\n{more}", encoding="utf-8"
    )
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


def test_a_number_beyond_floats_is_infinite(tmp_path: Path) -> None:
    """It is refused as any response that is not finite, with the reason `nan`."""
    solver = make_solver(study_of(tmp_path, SOLVER.replace('levels["yield_stress"] * condition', "10**400")))
    answer = validated(solver.solve(REQUEST), solver.naming)
    assert (answer.ok, answer.reason) == (False, "nan")


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("import nothing_of_this_name", "ModuleNotFoundError: No module"),
        ("class Other: pass", "AttributeError"),
        ("class Mine: pass", "no method `solve"),
        (
            "class Mine:\n    def solve(self, levels, condition, seed): pass",
            "no method `solve(self, levels, condition)`",
        ),
        ("import sys\nsys.exit(0)", "SystemExit: 0"),
        ("import os\nos._exit(0)", "SystemExit: 0"),
        ("from os import _exit\nimport threading\nthreading.Thread(target=_exit, args=(0,)).start()", "exit code 0"),
        ("import os\nos.abort()", "the process ended with"),
        ("class Mine:\n    def __init__(self): raise GeneratorExit('no licence')", "GeneratorExit: no licence"),
        ("raise KeyboardInterrupt", "cannot be loaded: KeyboardInterrupt"),
        ("class Mine:\n    def __init__(self): raise KeyboardInterrupt('by me')", "KeyboardInterrupt: by me"),
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


def test_the_file_may_have_any_name_and_a_flag_is_no_number(tmp_path: Path) -> None:
    study = study_of(tmp_path, SOLVER.replace('levels["yield_stress"] * condition', "True"))
    assert make_solver(study).solve(REQUEST).reason == "bad_result"
    (tmp_path / "m.txt").write_text(SOLVER, encoding="utf-8")
    spec = tmp_path / "mine.yaml"
    spec.write_text(spec.read_text("utf-8").replace("mine.py", "m.txt"), encoding="utf-8")
    assert make_solver(load_study(spec)).solve(REQUEST).response == 120.0
    (tmp_path / "m.txt").write_text("not a class", encoding="utf-8")
    with pytest.raises(UsageError, match=r"m\.txt: the class Mine cannot be loaded: SyntaxError"):
        make_solver(load_study(spec)).prepare()


def test_runs_of_other_code_are_other_runs(tmp_path: Path) -> None:
    keys = [Run.of(make_solver(study_of(tmp_path, code)), REQUEST).key for code in (SOLVER, SOLVER, SOLVER + "# new\n")]
    assert keys[0] == keys[1] != keys[2]
    changed = make_solver(study_of(tmp_path))
    (tmp_path / "mine.py").write_text("class Mine: pass\n", encoding="utf-8")
    assert changed.solve(REQUEST).reason == "input_changed"


IMPORTING = """
import json
import law_of_mine
from pathlib import Path
from rules import tough as t
class Mine:
    def solve(self, levels, condition):
        from late.deep import one
        factor = json.loads((Path(__file__).parent / "data.json").read_text())
        return {"force": law_of_mine.K * t.K * one.K * factor}
"""
MODULES = {
    "law_of_mine.py": "from constants_of_mine import *\n",
    "constants_of_mine.py": "K = 2.0\n",
    "rules/__init__.py": "",
    "rules/tough.py": "from . import tables\nfrom .tables import K\n",
    "rules/tables.py": "K = 3.0\n",
    "late/deep/one.py": "K = 5.0\n",
    "unrelated.py": "K = 7.0\n",
    "data.json": "11.0",
}


def written(folder: Path) -> None:
    for name, text in MODULES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize(("name", "counts"), [(name, name != "unrelated.py") for name in MODULES])
def test_a_run_depends_on_what_its_class_imports_and_on_its_files(tmp_path: Path, name: str, counts: bool) -> None:
    """Modules through others, in packages with and without `__init__.py`, inside functions; listed data."""
    written(tmp_path)
    study = study_of(tmp_path, IMPORTING, solver=", files: [data.json]")
    before = make_solver(study)
    with (tmp_path / name).open("a", encoding="utf-8") as file:
        file.write(" ")
    after = make_solver(study)
    assert (Run.of(before, REQUEST).key != Run.of(after, REQUEST).key) is counts
    assert (before.solve(REQUEST).reason == "input_changed") is counts


def test_the_records_of_changed_modules_are_computed_again(tmp_path: Path) -> None:
    written(tmp_path)
    for value in ("5.0", "13.0"):
        (tmp_path / "late/deep/one.py").write_text(f"K = {value}\n", encoding="utf-8")
        solver = make_solver(study_of(tmp_path, IMPORTING, solver=", files: [data.json]"))
        solver.prepare()
        with StudyFolder(tmp_path / "out") as folder, LocalExecutor(1) as executor:
            [answer] = answer_all([REQUEST], solver, folder, executor)
        assert answer.response == 2.0 * 3.0 * float(value) * 11.0


def test_an_import_that_cannot_be_traced_is_refused(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "hidden.py").write_text("import other_hidden\n", encoding="utf-8")
    (tmp_path / "lib" / "other_hidden.py").write_text("", encoding="utf-8")
    code = "import sys\nfrom pathlib import Path\nsys.path.append(str(Path(__file__).parent / 'lib'))\nimport hidden\n"
    with pytest.raises(UsageError, match=r"lib/(other_)?hidden\.py.*add `files: \[lib/(other_)?hidden\.py\]`"):
        make_solver(study_of(tmp_path, code + SOLVER)).prepare()
    traced = make_solver(study_of(tmp_path, code + SOLVER, solver=", files: [lib/hidden.py]"))
    traced.prepare()
    key = Run.of(traced, REQUEST).key
    (tmp_path / "lib" / "other_hidden.py").write_text("# changed\n", encoding="utf-8")
    assert Run.of(make_solver(traced.study), REQUEST).key != key  # type: ignore[attr-defined]


def test_a_class_that_hangs_is_ended_at_its_limit(tmp_path: Path) -> None:
    code = "class Mine:\n    def solve(self, levels, condition):\n        while True: pass\n"
    study = study_of(tmp_path, code, solver=", time_limit: 0.5 s")
    with StudyFolder(tmp_path / "out") as folder, LocalExecutor(1, study.solver.run_limit) as executor:
        [answer] = answer_all([REQUEST], make_solver(study), folder, executor, quorum=0.0)
    assert answer.reason == "timeout"
    hanging = make_solver(study_of(tmp_path, "while True: pass\n", solver=", time_limit: 0.5 s"))
    with pytest.raises(UsageError, match="loading took longer"):
        hanging.prepare()


def test_replicates_have_seeds(tmp_path: Path) -> None:
    """Each replicate has its own seed, the same whenever it is computed; without a seed in `solve` none begins."""
    code = "class Mine:\n    def solve(self, levels, condition, seed):\n        return {'force': seed}\n"
    solver = make_solver(study_of(tmp_path, code, solver=", replicates: 3"))
    solver.prepare()
    requests = repeated([REQUEST], solver.study.solver.repeats)  # type: ignore[attr-defined]
    found = [solver.solve(request).response for request in requests]
    assert found == [float(seed_of(request)) for request in requests] and len(set(found)) == 3
    with pytest.raises(UsageError, match=r"solve\(self, levels, condition, seed\)"):
        make_solver(study_of(tmp_path, solver=", replicates: 3")).prepare()


def test_workers_compute_it(tmp_path: Path) -> None:
    solver = make_solver(study_of(tmp_path))
    with StudyFolder(tmp_path / "out") as folder, LocalExecutor(1) as executor:
        answers = answer_all([REQUEST], solver, folder, executor)
    assert [answer.response for answer in answers] == [120.0]
