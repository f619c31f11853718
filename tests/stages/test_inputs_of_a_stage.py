"""The inputs of a stage file by name, what changes them, and when a result agrees with the records of its runs."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fakes import FakeSolver, SpecSolver, make_study
from known_results import Known, known, spec_of

from stemcal.by_hand.options import SheetSolver
from stemcal.errors import UsageError
from stemcal.runs.answer import Progress
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import Outcome
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.program import file_hash
from stemcal.stages import fresh
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.stage import stage_called
from stemcal.study.model.study import Study
from stemcal.version import code_version

TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"
NOWHERE: Any = SimpleNamespace(read_stage=lambda name: {"stage": name})


def inputs(study: Study, stage: str, solver: Any = None) -> dict[str, str]:
    """Return the inputs without those of the solver."""
    found = fresh.inputs_of(study, solver, NOWHERE, stage)
    assert found.pop("stemcal") == code_version()
    return found


def names(study: Study, stage: str) -> set[str]:
    sections = ("specimen", "layers", "blade", "supports", "loading", "contact", "material", "solver")
    return {name for name in inputs(study, stage) if not name.startswith(sections)}


def test_what_a_stage_is_made_of(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO)
    base = {"factors", "calibrate_at"}
    assert names(study, "screen") == {*base, "screen"}
    assert names(study, "invert") == {*base, "invert", "targets", "rsm.json"}
    assert names(study, "validate") == {*base, "targets", "validate", "invert.json"}
    assert "rsm" in names(study, "rsm") and "screen.json" not in names(study, "rsm")  # the spec lists the factors
    assert "screen.json" in names(make_study(tmp_path), "rsm")
    quick = make_study(tmp_path, "screen: {design: none}\nrsm: {design: none}\n")
    assert names(quick, "refine") == {*base, "refine", "targets", "varied", "fitted"}
    assert all(len(digest) == 16 for digest in inputs(study, "screen").values())


def test_stages_that_simulate_depend_on_the_test(tmp_path: Path) -> None:
    """Every value by its path, but neither threads nor time limit; a stage without runs on none of them."""
    study = make_study(tmp_path, TWO)
    screen, invert = inputs(study, "screen"), inputs(study, "invert")
    assert {"blade.edge_angle", "solver.replicates", "loading.speed"} <= {*screen}
    assert not {"solver.threads", "solver.time_limit"} & {*screen}
    assert not [name for name in invert if name.startswith(("blade", "solver", "loading"))]
    faster = make_study(tmp_path, f"{TWO}loading: {{speed: 2 mm/s}}\n")
    changed = {name for name, digest in inputs(faster, "screen").items() if screen.get(name) != digest}
    assert changed == {"loading.speed"}
    other = inputs(study, "screen", FakeSolver())
    assert any(name.startswith("solver ") for name in other) and "blade.edge_angle" not in other
    assert inputs(study, "screen", SpecSolver()) == screen


@pytest.mark.parametrize(
    ("extra", "stage", "changed"),
    [
        ("screen: {alpha: 0.1}\n", "screen", {"screen"}),
        ("screen: {alpha: 0.1}\n", "validate", set()),
        ("validate: {tolerance_percent: 5}\n", "validate", {"validate"}),
        ("invert: {diameters: [10 mm]}\n", "screen", {"calibrate_at"}),
        ("blade: {edge_angle: 30 deg}\n", "screen", {"blade.edge_angle"}),
        ("blade: {edge_angle: 30 deg}\n", "invert", set()),
    ],
)
def test_what_a_change_of_the_spec_changes(tmp_path: Path, extra: str, stage: str, changed: set[str]) -> None:
    before, after = (inputs(make_study(tmp_path, TWO + more), stage) for more in ("", extra))
    assert {name for name in {*before, *after} if before.get(name) != after.get(name)} == changed


def test_paths_are_replaced_by_what_is_in_them(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("1\n", encoding="utf-8")
    found = fresh._with_contents({"a": [file, 1], "b": {"c": file}, "d": (2.0, "x")})
    assert found == {"a": [file_hash(file), 1], "b": {"c": file_hash(file)}, "d": [2.0, "x"]}


# ---- agreement with the records


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return known(tmp_path_factory.mktemp("known"), spec_of())


def record(status: str = "ok", response: float | None = 100.0, **more: Any) -> dict[str, Any]:
    reason = more.pop("reason", "" if status == "ok" else "inverted")
    base = {"status": status, "response": response, "reason": reason, "message": "", "details": {}, "key": "a"}
    return {**base, "request": {"condition": 8.0}, "provenance": {}, **more}


@pytest.mark.parametrize(
    ("outcome", "stored", "whole", "agrees"),
    [
        (Outcome(response=100.0, key="a"), record(), True, True),
        (Outcome(response=100.0, key="a"), None, True, False),
        (Outcome(response=100.0, key="a"), None, False, True),
        (Outcome(response=100.0), None, True, True),  # a run without a record
        (Outcome(response=100.0, key="a"), record("failed", None), True, False),
        (Outcome(response=None, status="failed", reason="inverted", key="a"), record("failed", None), True, True),
        (Outcome(response=None, status="failed", reason="inverted", key="a"), record(), True, False),
        (Outcome(response=None, status="failed", key="a"), record("failed", None, reason="worker_died"), True, False),
        (Outcome(response=99.0, key="a"), record(), True, True),  # only results that people enter may be corrected
    ],
)
def test_a_result_agrees_with_its_records(
    done: Known, outcome: Outcome, stored: dict[str, Any] | None, whole: bool, agrees: bool
) -> None:
    result: Any = SimpleNamespace(name="screen", runs=lambda: [("run 1", outcome)])
    folder: Any = SimpleNamespace(peek={"a": stored}.get)
    assert fresh._runs_agree(result, done.study, folder, whole) is agrees


@pytest.mark.parametrize(("response", "agrees"), [(100.0, True), (99.0, False)])
def test_a_result_entered_by_hand_may_be_corrected(done: Known, response: float, agrees: bool) -> None:
    sheet = done.study.model_copy(update={"solver": SheetSolver()})
    result: Any = SimpleNamespace(name="screen", runs=lambda: [("run 1", Outcome(response=response, key="a"))])
    folder: Any = SimpleNamespace(peek={"a": record()}.get)
    assert fresh._runs_agree(result, sheet, folder) is agrees


def test_a_finished_study_is_read_and_its_runs_are_counted(done: Known) -> None:
    seen: list[Progress] = []
    stage = stage_called("validate")
    result = fresh.make(stage, done.study, done.folder, InlineExecutor(), seen.append)
    assert result.name == "validate"
    (progress,) = seen
    assert (progress.stage, progress.done, progress.total, progress.failed) == ("validate", 3, 3, 0)
    seen.clear()
    fresh.make(stage_called("invert"), done.study, done.folder, InlineExecutor(), seen.append)
    assert seen == []  # it has no runs
    assert fresh.finished(done.study, done.folder) and fresh.finished(done.study, done.folder, "rsm")
    assert not fresh.finished(done.study, StudyFolder(done.folder.path / "none"), "rsm")
    assert fresh.calibrated_parameters(done.study, SpecSolver(), done.folder) == done.of(InvertResult).parameters
    renamed = done.study.model_copy(update={"title": "Another"})
    assert fresh.fresh(InvertResult, renamed, done.folder) is None
    assert fresh.fresh(InvertResult, done.study, done.folder) is not None


def test_stages_in_order_until_one(tmp_path: Path) -> None:
    """Each result is reported at once."""
    done = known(tmp_path, spec_of(), until="rsm")
    assert [result.name for result in done.results.done] == ["screen", "rsm"]
    called: list[str] = []
    made = fresh.make_all(
        done.study, done.folder, InlineExecutor(), done=lambda result: called.append(result.name), until="screen"
    )
    assert called == ["screen"] == [result.name for result in made]


def test_a_stage_of_a_goal_needs_one(done: Known) -> None:
    def refused(study: Study, name: str) -> str:
        with pytest.raises(UsageError) as error:
            fresh.make(stage_called(name), study, done.folder, InlineExecutor(), lambda _progress: None)
        return str(error.value)

    assert refused(done.study, "optimise") == ("optimise: this stage requires `goal`; add a section `goal` to the spec")
    goal: Any = SimpleNamespace(goal="force", pending="")
    assert refused(goal, "validate") == "validate: this stage requires `targets`; add a section `targets` to the spec"
    assert refused(goal, "invert").startswith("invert: this stage requires `targets`")


def test_an_outdated_stage_names_what_changed(tmp_path: Path) -> None:
    done = known(tmp_path, spec_of())
    changed = done.study.model_copy(
        update={"screen": done.study.screen.model_copy(update={"alpha": 0.1}), "title": "Another"}
    )
    assert fresh.changes_since(changed, SpecSolver(), done.folder, "screen") == ["screen"]
    with pytest.raises(UsageError) as error:
        fresh.require_fresh(changed, SpecSolver(), done.folder, "screen")
    assert str(error.value) == (
        f"{done.folder.path / 'screen'}.json is out of date (screen changed). Run `stemcal screen SPEC` again; "
        "recorded runs are reused."
    )
    fresh.require_fresh(done.study, SpecSolver(), done.folder, "validate")
    (done.folder.path / "rsm.json").unlink()
    assert fresh.changes_since(done.study, SpecSolver(), done.folder, "invert") == ["rsm.json"]
    head = fresh.head_of(done.study, SpecSolver(), done.folder, "screen")
    assert (head.stage, head.study, head.title) == ("screen", done.study.name, done.study.title)
    assert head.inputs == fresh.inputs_of(done.study, SpecSolver(), done.folder, "screen")


def test_tables_that_changed(done: Known) -> None:
    result = done.of(InvertResult)
    assert fresh.changed_tables(result, done.folder) == []
    other = replace(
        result, point=replace(result.point, coded_radius=9.0, coded={"yield_stress": 1.0, "failure_strain": 0.0})
    )
    assert fresh.changed_tables(other, done.folder) == ["invert.csv"]
