"""Programs with chance in them: every run simulated anew, with a seed and a record of its own."""

import json
from pathlib import Path

import numpy as np
import pytest
from fakes import PYTHON

from stemcal.errors import SpecError, UsageError
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.program import Command
from stemcal.solvers.protocol import Request
from stemcal.solvers.replicates import seed_of
from stemcal.stages.rsm.analysis import RsmResult, rsm, study_design
from stemcal.stages.screen.analysis import screen, screening_design
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.validate.analysis import requests_at
from stemcal.stages.work import second_time
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

# y = 30 + 4·a + 2·b, with normal noise of standard deviation 0.4 drawn from the seed
NOISY = """
import json, random
given = json.load(open("in.json"))
y = 30 + 4 * given["a"] + 2 * given["b"] + 0 * given["c"] + random.Random(given["seed"]).gauss(0, 0.4)
json.dump({"y": y}, open("out.json", "w"))
"""
TEMPLATE = '{"a": {{a}}, "b": {{b}}, "c": {{c}}, "seed": {{seed}}}'
SPEC = """\
name: chance
factors:
  - {name: a, low: -1, high: 1}
  - {name: b, low: -1, high: 1}
  - {name: c, low: -1, high: 1}
solver:
  kind: command
  command: [%s, program.py]
  files: [program.py]
  templates: [in.json]
  result: {file: out.json, path: y}
  %s
screen: {design: plackett-burman}
rsm: {factors: [a, b], centre_points: 4}
targets: [{diameter: 8 mm, force: 32 N}]
"""
LEVELS = {"a": 0.5, "b": 0.0, "c": 0.0}


def study_of(folder: Path, said: str, program: str = NOISY, template: str = TEMPLATE) -> Study:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "program.py").write_text(program, encoding="utf-8")
    (folder / "in.json").write_text(template, encoding="utf-8")
    spec = folder / "chance.yaml"
    spec.write_text(SPEC % (PYTHON, said), encoding="utf-8")
    return load_study(spec)


def test_a_deterministic_program_is_asked_as_ever(tmp_path):
    """Neither the number of a replicate nor a seed is in the identity that names its records."""
    study = study_of(tmp_path, "", template=TEMPLATE.replace("{{seed}}", "7"))
    identity = Command(study).identity(Request("screen", 3, LEVELS, 8.0))
    assert not {"replicate", "seed"} & set(identity)
    assert study.solver.repeats == 0
    assert {request.replicate for request in screening_design(study, make_solver(study)).requests(8.0)} == {0}


def test_replicates_imply_chance_and_repeat_the_whole_design(tmp_path):
    study = study_of(tmp_path, "replicates: 3")
    solver = make_solver(study)
    once = study_design(study_of(tmp_path / "once", "replicates: 1"), solver, ["a", "b"])
    design = study_design(study, solver, ["a", "b"])
    assert np.array_equal(design.coded, np.tile(once.coded, (3, 1)))
    assert [request.replicate for request in design.requests(8.0)] == [1] * 12 + [2] * 12 + [3] * 12
    assert len(requests_at(study, LEVELS)) == 3


def test_every_run_has_a_seed_and_a_record_of_its_own(tmp_path):
    study = study_of(tmp_path, "replicates: 2")
    solver = make_solver(study)
    requests = [r for d in (screening_design(study, solver), study_design(study, solver, ["a", "b"]))
                for r in d.requests(8.0)]  # fmt: skip
    identities = [solver.identity(request) for request in requests]
    assert len({identity["seed"] for identity in identities}) == len(requests) == 2 * 4 + 2 * (8 + 4)


def test_seeds_stay_when_more_replicates_are_asked_for(tmp_path):
    """So that the records of before answer still."""
    two, three = (study_of(tmp_path / str(n), f"replicates: {n}") for n in (2, 3))
    before = [seed_of(r) for r in screening_design(two, make_solver(two)).requests(8.0)]
    after = [seed_of(r) for r in screening_design(three, make_solver(three)).requests(8.0)]
    assert after[: len(before)] == before


def test_template_gets_seed_and_replicate(tmp_path):
    study = study_of(tmp_path / "spec", "replicates: 2", template=TEMPLATE + "\n{{replicate}}")
    solver = Command(study).placed(tmp_path / "work")
    request = Request("screen", 0, LEVELS, 8.0, replicate=2)
    (tmp_path / "run").mkdir()
    solver._write(tmp_path / "run", request)
    first, second = (tmp_path / "run" / "in.json").read_text(encoding="utf-8").splitlines()
    assert json.loads(first)["seed"] == seed_of(request)
    assert second == "2"


def test_centre_points_really_run_again_and_their_scatter_is_the_pure_error(tmp_path):
    """Ten pure-error runs' sd of 0.4 noise: within the 99.9 % limits of chi over its degrees of freedom."""
    study = study_of(tmp_path, "replicates: 2")
    surface = rsm(study, StudyFolder(tmp_path / "runs"))
    assert isinstance(surface, RsmResult)
    centre = [run.response for run in surface.design.runs if not any(run.coded.values())]
    assert len(centre) == len(set(centre)) == 8
    pure = next(row for row in surface.anova if row.source == "Pure error")
    assert pure.df == 8 + 7
    assert 0.4**2 * 3.483 / 15 < pure.sum_of_squares / pure.df < 0.4**2 * 37.70 / 15
    assert surface.lack_of_fit_testable
    assert surface.pure_error is not None and surface.pure_error.kind == "scatter"
    assert f"({pure.df} degrees of freedom)" in surface.pure_error.text


def test_effects_are_tested_against_the_scatter_of_replicates(tmp_path):
    study = study_of(tmp_path, "replicates: 3")
    found = screen(study, StudyFolder(tmp_path / "runs"))
    assert isinstance(found, ScreenResult) and not found.by_lenth
    assert found.residual.df == 4 * 3 - 1 - len(found.effects)
    assert found.effect("a").effect == pytest.approx(8.0, abs=4 * 0.4 * (4 / 12) ** 0.5)
    assert {"a", "b"} <= set(found.significant)


def test_seedless_runs_that_agree_are_said(tmp_path):
    program = NOISY.replace('random.Random(given["seed"])', "random.Random(1)")
    study = study_of(tmp_path, "replicates: 2", program)
    surface = rsm(study, StudyFolder(tmp_path / "runs"))
    assert surface.pure_error is not None and surface.pure_error.kind == "equal_repeats"
    assert surface.pure_error in surface.notes and "{{seed}}" in str(surface.pure_error)


UNSEEDED = NOISY.replace('random.Random(given["seed"])', "random")


def test_chance_that_nobody_declared_is_found_at_the_start(tmp_path):
    """Two answers to the same levels show it."""
    template = TEMPLATE.replace("{{seed}}", "7")
    study = study_of(tmp_path, "", UNSEEDED, template)
    folder = StudyFolder(tmp_path / "runs")
    with pytest.raises(UsageError, match=r"the program is stochastic .*\. Write `replicates: 5`"):
        rsm(study, folder)
    assert len(list(folder.runs.glob("*.json"))) == 2


def test_a_deterministic_program_is_run_once_more_and_goes_on(tmp_path):
    program = NOISY.replace('random.Random(given["seed"]).gauss(0, 0.4)', "0.0")
    template = TEMPLATE.replace("{{seed}}", "7")
    study = study_of(tmp_path, "", program, template)
    folder = StudyFolder(tmp_path / "runs")
    surface = rsm(study, folder)
    assert len(list(folder.runs.glob("*.json"))) == 9 + 1  # 8 points and the centre, and one of them again
    assert surface.pure_error is not None and surface.pure_error.kind == "equal_repeats"


def test_only_a_program_that_should_repeat_itself_is_asked_twice(tmp_path: Path) -> None:
    """Not one with declared chance, and not the embedded solver, which depends on the spec alone."""
    runs = [Request("screen", row, LEVELS, 8.0) for row in range(3)]
    again = second_time(study_of(tmp_path / "own", "", template='{"a": {{a}}, "b": {{b}}, "c": {{c}}}'), runs)
    assert [(run.row, run.replicate) for run in again] == [(0, 0), (0, 1)]
    assert second_time(study_of(tmp_path / "noisy", "replicates: 2"), runs) == []
    assert second_time(load_study(Path(__file__).parents[2] / "configs" / "smoke.yaml"), runs) == []


def test_a_seed_without_replicates_is_refused(tmp_path):
    with pytest.raises(
        SpecError, match="is allowed only for a stochastic program; write `replicates: 1` under `solver`"
    ):
        study_of(tmp_path, "")
