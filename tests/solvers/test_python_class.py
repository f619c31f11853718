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


# ---- what `solve` may return, and what loading a class leaves behind


@pytest.mark.parametrize(
    ("returned", "found"),
    [
        ("{'force': 3}", 3.0),
        ("{'force': __import__('fractions').Fraction(3, 2)}", 1.5),
        ("{'force': __import__('numpy').float32(0.5)}", 0.5),
        ("{'force': 1e308}", 1e308),
        ("{'force': -10**400}", float("inf")),
        ("{'force': True}", "the returned force is of type bool, not a number"),
        ("{'force': None}", "the returned force is of type NoneType, not a number"),
        ("{'force': 1j}", "the returned force is of type complex, not a number"),
        ("{}", "`solve` returned no force; return a mapping such as {'force': 12.5}"),
        ("12.5", "`solve` returned no force; return a mapping such as {'force': 12.5}"),
        ("['force']", "`solve` returned no force; return a mapping such as {'force': 12.5}"),
    ],
)
def test_returned_numbers(tmp_path: Path, returned: str, found: float | str) -> None:
    code = f"class Mine:\n    def solve(self, levels, condition):\n        return {returned}\n"
    answer = make_solver(study_of(tmp_path, code)).solve(REQUEST)
    if isinstance(found, float):
        assert (answer.status, answer.response, answer.message) == ("ok", found, "")
    else:
        reason = "no_result" if "no force" in found else "bad_result"
        assert (answer.status, answer.reason, answer.message) == ("failed", reason, found)


@pytest.mark.parametrize(
    ("signature", "replicates", "fits"),
    [
        ("self, levels, condition", False, True),
        ("self, levels, condition", True, False),
        ("self, levels, condition, seed", True, True),
        ("self, levels, condition, seed", False, False),
        ("self, levels, condition, seed=0", False, True),
        ("self, *given", True, True),
        ("self, levels", False, False),
    ],
)
def test_arguments_of_solve_are_checked_before_a_study(
    tmp_path: Path, signature: str, replicates: bool, fits: bool
) -> None:
    code = f"class Mine:\n    def solve({signature}): return {{'force': 1}}\n"
    solver = make_solver(study_of(tmp_path, code, solver=", replicates: 2" if replicates else ""))
    if fits:
        assert solver.solve(REQUEST).response == 1.0
        return
    seed = ", seed" if replicates else ""
    answer = solver.solve(REQUEST)
    message = f"the class Mine cannot be loaded: it has no method `solve(self, levels, condition{seed})`"
    assert (answer.reason, answer.message) == ("raised", f"solver.file mine.py: {message}")


def test_a_compiled_function_without_a_signature_may_solve(tmp_path: Path) -> None:
    code = "class Mine:\n    solve = staticmethod(max)\n"
    answer = make_solver(study_of(tmp_path, code)).solve(REQUEST)
    assert answer.reason == "raised" and "TypeError" in answer.message
    answer = make_solver(study_of(tmp_path, "class Mine:\n    solve = 5\n")).solve(REQUEST)
    assert "it has no method `solve" in answer.message


def test_identity_has_what_determines_an_answer_and_no_more(tmp_path: Path) -> None:
    (tmp_path / "law_a.py").write_text("", encoding="utf-8")
    plain = make_solver(study_of(tmp_path, SOLVER)).identity(REQUEST)
    code = plain["code"]
    assert plain == {"solver": "python", "code": code, "class": "Mine", "levels": LEVELS, "condition": 8.0}
    numbered = Request("screen", 0, LEVELS, 8.0, replicate=2)
    chance = make_solver(study_of(tmp_path, SOLVER, solver=", replicates: 2"))
    assert chance.identity(numbered) == {**plain, "replicate": 2, "seed": seed_of(numbered)}
    assert chance.identity(REQUEST) == {**plain, "seed": seed_of(REQUEST)}
    importing = make_solver(study_of(tmp_path, "import law_a\n" + SOLVER)).identity(REQUEST)
    assert list(importing["inputs"]) == ["law_a.py"] and importing["code"] != code


def test_inputs_have_their_path_in_the_folder_of_the_spec_and_others_their_name(tmp_path: Path) -> None:
    (tmp_path / "spec" / "sub").mkdir(parents=True)
    (tmp_path / "law_c.py").write_text("", encoding="utf-8")
    (tmp_path / "spec" / "sub" / "law_b.py").write_text("", encoding="utf-8")
    study = study_of(tmp_path / "spec", "import sub.law_b\nfrom ..law_c import K\n" + SOLVER)
    assert sorted(make_solver(study).identity(REQUEST)["inputs"]) == ["law_c.py", "sub/law_b.py"]


def test_a_class_leaves_nothing_in_the_search_path_and_the_next_one_has_its_own_modules(tmp_path: Path) -> None:
    """Two studies with a module of the same name in one process, and a class that adds a folder to the path."""
    code = "import sys, named_alike\nsys.path.append('/added/by/mine')\n" + SOLVER.replace(
        'levels["yield_stress"] * condition', "named_alike.K"
    )
    before = list(sys.path)
    found = []
    for folder, value in ((tmp_path / "one", 1.0), (tmp_path / "two", 2.0)):
        folder.mkdir()
        (folder / "named_alike.py").write_text(f"K = {value}\n", encoding="utf-8")
        solver = make_solver(study_of(folder, code))
        found += [solver.solve(REQUEST).response, solver.solve(REQUEST).response]
    added = [place for place in sys.path if place not in before]
    sys.path[:] = before
    assert found == [1.0, 1.0, 2.0, 2.0] and set(added) == {"/added/by/mine"}
    assert str(tmp_path / "two") not in before


def test_one_object_answers_until_a_file_changes(tmp_path: Path) -> None:
    code = "class Mine:\n    n = 0\n    def solve(self, levels, condition):\n"
    code += "        self.n += 1\n        return {'force': self.n}\n"
    solver = make_solver(study_of(tmp_path, code))
    assert [solver.solve(REQUEST).response for _ in range(3)] == [1.0, 2.0, 3.0]
    other = make_solver(study_of(tmp_path, code + "# changed\n"))
    assert [other.solve(REQUEST).response, solver.solve(REQUEST).reason] == [1.0, "input_changed"]
    other.get_ready()
    assert other.solve(REQUEST).response == 2.0
    broken = make_solver(study_of(tmp_path, "raise ValueError('no licence')\n"))
    broken.get_ready()  # the reason is reported by the run
    assert "ValueError: no licence" in broken.solve(REQUEST).message


def test_a_module_that_appears_during_a_run_is_refused(tmp_path: Path) -> None:
    """Its name is computed, so its changes would be unnoticed; a module in a Python environment is none of them."""
    for name in ("hidden_law.py", "env/site-packages/installed_law.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("K = 1.0\n", encoding="utf-8")
    code = "import importlib, sys\nclass Mine:\n    def solve(self, levels, condition):\n"
    code += "        name = 'hidden' + '_law'\n        importlib.import_module(name)\n        return {'force': 1}\n"
    answer = make_solver(study_of(tmp_path, code)).solve(REQUEST)
    message = "the import of hidden_law.py cannot be traced; add `files: [hidden_law.py]` under `solver`"
    assert (answer.reason, answer.message) == ("unknown_input", message)
    installed = code.replace("'hidden' + '_law'", "'installed' + '_law'").replace(
        "class", f"sys.path.append({str(tmp_path / 'env' / 'site-packages')!r})\nclass", 1
    )
    before = list(sys.path)
    answer = make_solver(study_of(tmp_path, installed)).solve(REQUEST)
    sys.path[:] = before
    assert (answer.response, answer.message) == (1.0, "")
