"""What stages share: attributes, order, defaults and limits of sections, designs, ledger; climb and element size."""

from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fakes import TWO_FACTORS, FakeSolver, make_study
from known_results import known, spec_of
from pydantic import ValidationError
from test_climbing import CLIMB

from stemcal.doe.coding import Coding
from stemcal.drawing.table import Table
from stemcal.errors import RunsFailed, UsageError
from stemcal.runs.record import Outcome, Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.climb import analysis as climbing
from stemcal.stages.climb.options import ClimbOptions
from stemcal.stages.climb.result import ClimbResult, ClimbRow
from stemcal.stages.climb.showing import ClimbShowing
from stemcal.stages.design import Design, StageRuns, runs_of
from stemcal.stages.element_size import SizedStrain, material_lines, not_valid, strain_table, without_lengths
from stemcal.stages.fitting import ConditionAxis, Measured, measured_means, measured_of, priors_of
from stemcal.stages.invert.options import InvertOptions
from stemcal.stages.ledger import LedgerRow, entry_of, keyed, missing
from stemcal.stages.optimise.options import OptimiseOptions
from stemcal.stages.refine.options import RefineOptions
from stemcal.stages.result import CodedScale, DesignRun, DesignRuns, Head, Judged, StageResult, _short
from stemcal.stages.results import Results
from stemcal.stages.rsm.options import RsmOptions
from stemcal.stages.rsm.over import condition_axis, over_design, runs_of_both
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.screen.options import ScreenOptions
from stemcal.stages.stage import STAGES, Stage, calibrating, has_surface, stage_called, stages_known, stages_of
from stemcal.stages.validate.options import ValidateOptions
from stemcal.stages.work import Work, repeats_itself
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.vocabulary import CUTTING, FIRST, Wording

TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"


# ---- stages and their order


ATTRIBUTES = {
    "screen": ("Screening", "screen", ("screen",), True, False, True, False),
    "climb": ("Climb", "climb", ("climb", "rsm", "targets"), True, False, True, True),
    "rsm": ("Response surface", "surface", None, True, False, True, False),
    "invert": ("Calibration", "inversion", ("invert", "targets"), False, False, True, False),
    "refine": ("Refinement", "refinement", ("refine", "targets"), True, True, False, True),
    "validate": ("Validation", "validation", ("targets", "validate"), True, True, False, False),
    "optimise": ("Optimum", "optimum", ("goal", "optimise"), True, True, False, False),
}
"""Title, attribute of results, sections, and whether it simulates, stores pictures, has a surface, runs one by one."""


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_attributes_of_a_stage(name: str) -> None:
    stage, (title, attribute, reads, *flags) = stage_called(name), ATTRIBUTES[name]
    assert (stage.name, stage.title) == (name, title) and (stage.attribute or name) == attribute
    assert reads is None or stage.reads == reads
    assert [stage.simulates, stage.pictured, stage.of_surface, stage.one_by_one] == flags
    assert stage.by_section is (name in ("climb", "refine"))


def test_a_stage_of_another_package_has_these_defaults() -> None:
    class Plain(Stage[Any]):
        name = "plain"

    stage, study = Plain(), SimpleNamespace(goal=None)
    assert (stage.simulates, stage.pictured, stage.of_surface, stage.one_by_one, stage.reads) == (
        True, False, False, False, (),
    )  # fmt: skip
    unused: Any = study
    assert stage.needs(unused) is None and stage.inputs(unused) == {} and not stage.calibrates(unused)
    assert not stage.makes_surface(unused) and stage.tolerance_percent(unused) is None
    assert stage.reasons() == () and stage.later(unused) is None
    with pytest.raises(NotImplementedError, match=r"The stage 'plain' has no .* in its module result\."):
        stage.result()


def names_of(stages: Any) -> list[str]:
    return [stage.name for stage in stages]


@pytest.mark.parametrize(
    ("extra", "names", "last"),
    [
        (TWO, "screen rsm invert validate", "invert"),
        (f"{TWO}climb: {{}}\nrefine: {{}}\n", "screen climb rsm invert refine validate", "refine"),
        (f"{TWO}refine: {{in: {{kind: sheet}}}}\n", "screen rsm invert validate refine", "invert"),
        ("screen: {design: none}\nrsm: {factors: [yield_stress]}\n", "rsm invert validate", "invert"),
        ("screen: {design: none}\nrsm: {design: none}\n", "refine validate", "refine"),
    ],
)
def test_the_stages_of_a_study_in_order(tmp_path: Path, extra: str, names: str, last: str) -> None:
    study = make_study(tmp_path, extra)
    assert names_of(stages_of(study)) == names.split() and calibrating(study).name == last
    assert has_surface(study) is ("rsm" in names)
    every = names_of(stages_known(study))
    assert every[: len(names.split())] == names.split() and sorted(every) == sorted(ATTRIBUTES)


def test_unknown_stages_and_circles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match=r"The stage 'nonesuch' does not exist\."):
        stage_called("nonesuch")
    study = make_study(tmp_path)  # the factors of its surface are those of the screening
    monkeypatch.setattr(type(stage_called("screen")), "needs", lambda _self, _study: "validate")
    with pytest.raises(UsageError, match=r"The stages (.*) depend on each other\.") as error:
        stages_of(study)
    assert all(name in str(error.value) for name in ("screen", "validate"))


# ---- defaults and limits of the sections


DEFAULTS: list[tuple[type, dict[str, Any]]] = [
    (ScreenOptions, {"design": "plackett-burman", "centre_points": 0, "runs": None, "fold_over": False, "alpha": 0.05}),
    (
        RsmOptions,
        {
            "design": "central-composite", "factors": "significant", "over": "factors", "centre_points": 6,
            "alpha": "rotatable", "runs": None, "extra_runs": 0, "reduce": "none", "coding": {},
        },
    ),
    (InvertOptions, {"rule": "least_coded_distance", "conditions": None, "responses": (FIRST,)}),
    (
        RefineOptions,
        {
            "in_": None, "internal_length": None, "edge_spread": None, "duration": None, "adjust": {},
            "tolerance_percent": 1.0, "budget": 10,
        },
    ),
    (ValidateOptions, {"tolerance_percent": 10.0}),
    (ClimbOptions, {"steps": 5, "at_once": False}),
    (OptimiseOptions, {"present": {}}),
]  # fmt: skip


@pytest.mark.parametrize(("options", "values"), DEFAULTS)
def test_defaults(options: Any, values: dict[str, Any]) -> None:
    assert {name: getattr(options(), name) for name in type(options()).model_fields} == values


@pytest.mark.parametrize(
    ("options", "key", "inside", "outside"),
    [
        (ScreenOptions, "centre_points", (0, 50), (-1, 51)),
        (ScreenOptions, "runs", (4, 512), (3, 513)),
        (ScreenOptions, "alpha", (0.001, 0.999), (0, 1)),
        (RsmOptions, "centre_points", (0, 100), (-1, 101)),
        (RsmOptions, "runs", (6, 10_000), (5, 10_001)),
        (RsmOptions, "extra_runs", (0, 200), (-1, 201)),
        (RsmOptions, "alpha", (0.001, 100), (0, 100.1)),
        (RefineOptions, "tolerance_percent", (0.001, 50), (0, 50.1)),
        (RefineOptions, "budget", (1, 1000), (0, 1001)),
        (ValidateOptions, "tolerance_percent", (0.001, 99.9), (0, 100)),
        (ClimbOptions, "steps", (1, 50), (0, 51)),
    ],
)
def test_limits(options: Any, key: str, inside: tuple[float, float], outside: tuple[float, float]) -> None:
    for value in inside:
        assert getattr(options.model_validate({key: value}), key) == value
    for value in outside:
        with pytest.raises(ValidationError):
            options.model_validate({key: value})


def test_a_design_or_none() -> None:
    assert ScreenOptions().wanted and not ScreenOptions(design="none").wanted
    assert RsmOptions().wanted and not RsmOptions(design="none").wanted
    assert RsmOptions(factors="strongest 12").strongest == 12 and RsmOptions(factors=("a",)).strongest == 0


# ---- designs and results


CODING = Coding(("a", "b"), (10.0, 1.0), (2.0, 0.5))
DESIGN = Design(
    "rsm", "given", CODING, np.array([[-1.0, 1.0], [0.0, 0.0]]), ({"a": 8.0, "b": 1.5}, {"a": 10.0, "b": 1.0})
)


def test_requests_of_a_design() -> None:
    assert DESIGN.names == ("a", "b")
    assert DESIGN.requests(8.0) == [
        Request("rsm", 0, {"a": 8.0, "b": 1.5}, 8.0), Request("rsm", 1, {"a": 10.0, "b": 1.0}, 8.0),
    ]  # fmt: skip
    thrice = DESIGN.repeated(3)
    assert [request.replicate for request in thrice.requests(8.0)] == [1, 1, 2, 2, 3, 3]
    assert [request.row for request in thrice.requests(8.0)] == list(range(6)) and len(thrice.coded) == 6
    assert thrice.coded[2:4].tolist() == DESIGN.coded.tolist()
    same = DESIGN.repeated(0)
    assert (len(same.coded), same.replicates, same.levels) == (2, 0, DESIGN.levels)
    placed = replace(DESIGN, conditions=(7.0, 9.0)).repeated(2)
    assert [request.condition for request in placed.requests(8.0)] == [7.0, 9.0, 7.0, 9.0]


def test_runs_of_a_design() -> None:
    outcomes = [Outcome(response=100.0), Outcome(response=None, status="failed", reason="timeout")]
    runs = runs_of(DESIGN, DESIGN.requests(8.0), outcomes)
    first, second = runs.runs
    assert first == DesignRun(run=1, levels={"a": 8.0, "b": 1.5}, coded={"a": -1.0, "b": 1.0}, outcome=outcomes[0])
    assert first.condition is first.replicate is None and second.response is None and runs.kind == "given"
    assert runs.varied == ("a", "b") and DesignRuns("x", Rows([])).varied == ()
    assert runs.table().rows == ((1, 8.0, 1.5, 100.0), (2, 10.0, 1.0, None))
    over = replace(DESIGN, conditions=(7.0, 9.0), held=("c",), replicates=2)
    first, second = runs_of(over, over.requests(8.0), outcomes).runs
    assert (first.condition, first.replicate, second.replicate) == (7.0, 1, 2)
    assert first.coded == {"c": 0.0, "a": -1.0, "b": 1.0}
    table = runs_of(over, over.requests(8.0), outcomes).table()
    assert [column.key for column in table.columns] == ["run", "a", "b", "condition", "replicate", "response"]


class Tabled(StageResult):
    """A result with one table."""

    name = "tabled"
    shown = ("mean", "levels")

    def __init__(self) -> None:
        self.head = Head(3, "tabled", "known")
        self.mean, self.levels = 18.36612, {"a": 0.0300012, "b": "x"}

    def _tables(self) -> dict[str, Table]:
        return {"tabled": Table.of(["condition", "response"], [{"condition": 8.0, "response": 1.0}])}


def test_defaults_of_a_result() -> None:
    result = Tabled()
    assert repr(result) == "Tabled(study='known', mean=18.37, levels={'a': 0.03, 'b': 'x'})"
    assert result.settles is result.recentred is result.best is result.prediction is None
    assert result.misses == result.gains == () and list(result.runs()) == []
    unused: Any = None
    assert list(result.judged(unused)) == [] and result.naming == CUTTING
    assert result.tables()["tabled"].heads == ("diameter", "force")
    assert (
        result._repr_html_().startswith("<p>Tabled(study=&#x27;known&#x27;, mean=18.37")
        and "<table" in result._repr_html_()
    )
    with pytest.raises(NotImplementedError):
        StageResult._tables(result)
    assert _short(3) == 3 and _short("x") == "x"
    assert CodedScale(10.0, 2.0).natural(-0.5) == 9.0
    assert Judged("force", 8.0, -3.0, True).size == 3.0 and Judged("force", 8.0, None, True).size == 0.0


def test_results_without_a_calibration() -> None:
    with pytest.raises(UsageError, match=r"The study is not calibrated yet\. Run `stemcal run SPEC` first\."):
        _ = Results((Tabled(),)).parameters
    assert not Results((Tabled(),)).calibrated and Results((Tabled(),)).of(Tabled) is not None
    assert Results().of(Tabled) is None


def test_measured_means(tmp_path: Path) -> None:
    study = make_study(tmp_path, f"{TWO}invert: {{diameters: all}}\n")
    assert [(mean.condition, mean.response, mean.value) for mean in measured_means(study)] == [
        (7.0, FIRST, 84.21875), (8.0, FIRST, 110.0), (10.0, FIRST, 171.875),
    ]  # fmt: skip
    single = make_study(tmp_path, TWO)
    assert [mean.condition for mean in measured_means(single)] == [8.0]
    assert measured_of(single.targets.means[0], [FIRST, "travel"], CUTTING)[0].specimens is not None
    assert len(measured_of(single.targets.means[0], ["travel"], CUTTING)) == 0
    force, travel = Measured(8.0, FIRST, 1.0), Measured(8.0, "travel", 1.0)
    assert force.leads and not travel.leads and travel.named.name == "travel"
    assert ConditionAxis("d", 2.0, 0.25, True, 8.0, {}).coded(np.e**2.5) == pytest.approx(2.0)
    assert ConditionAxis("d", 2.0, 0.25, False, 8.0, {}).coded(2.5) == 2.0


def test_priors_of_the_factors_of_a_surface(tmp_path: Path) -> None:
    text = TWO_FACTORS.replace("high: 0.05}", "high: 0.05, prior: {mean: 0.02, sd: 0.005, source: a paper}}")
    (tmp_path / "prior.yaml").write_text(f"{text}{TWO}targets: [{{diameter: 8 mm, force: 110 N}}]\n", encoding="utf-8")
    study = load_study(tmp_path / "prior.yaml")
    (prior,) = priors_of(study, Coding(("yield_stress", "failure_strain"), (15.0, 0.03), (5.0, 0.02)))
    assert list(asdict(prior).values()) == [1, 0.02, 0.005, 0.03, 0.02]


# ---- the ledger


def record(folder: StudyFolder, solver: FakeSolver, request: Request, answer: Answer) -> str:
    run = Run.of(solver, request)
    content = {"key": run.key, "identity": run.identity, "request": asdict(request), **asdict(answer)}
    provenance = {"started": "now", "wall_seconds": 2.5, "tries": 2, "host": "here", "stemcal": "1"}
    folder.save({**content, "provenance": provenance})
    return run.key


def test_the_states_of_a_run(tmp_path: Path) -> None:
    study, solver = make_study(tmp_path, TWO), FakeSolver()
    request = Request("rsm", 3, {"yield_stress": 15.0}, 8.0, replicate=2)
    answers = [
        (Answer("ok", 100.0), "ok", ""),
        (Answer("ok", 100.0, details={"stroke_was_enough": False}), "censored", ""),
        (Answer("failed", None, "inverted", "element 3"), "failed", "inverted"),
    ]
    for number, (answer, status, reason) in enumerate(answers):
        with StudyFolder(tmp_path / str(number)) as folder:
            key = record(folder, solver, request, answer)
            assert entry_of(request, key, study, folder, 2) == LedgerRow(
                "rsm", 4, key, status, answer.response, reason, answer.message, False, 8.0, {"yield_stress": 15.0}, 2,
                2, "now", 2.5, 2, "here", "1",
            )  # fmt: skip
    with StudyFolder(tmp_path / "none") as folder:
        left = entry_of(replace(request, replicate=0), "f" * 32, study, folder)
        assert (left.status, left.again, left.replicate, left.material, left.host) == ("left", True, None, None, None)
        key = record(folder, solver, request, answers[0][0])
        folder.record_path(key).write_bytes(b"{")
        assert entry_of(request, key, study, folder).status == "damaged"
        died = record(folder, solver, replace(request, row=4), Answer("failed", None, "worker_died", ""))
        assert entry_of(request, died, study, folder).again


def test_the_request_of_a_row() -> None:
    row = LedgerRow("validate", 3, "k", "ok", 1.0, "", "", False, 8.0, {"a": 1.0}, 2)
    assert row.request == Request("validate", 2, {"a": 1.0}, 8.0, pictured=True, replicate=2)
    assert not replace(row, stage="rsm").request.pictured and not replace(row, material=1).request.pictured
    assert replace(row, replicate=None).request.replicate == 0


def test_runs_that_are_missing(tmp_path: Path) -> None:
    """Equal runs count once; one with a record, or whose result is known, is not missing; one that died is."""

    class Knows(FakeSolver):
        def has_result(self, request: Request) -> bool:
            return request.levels["yield_stress"] == 11.0

    study, solver = make_study(tmp_path, TWO), Knows()
    levels = [{**study.midlevels(), "yield_stress": stress} for stress in (11.0, 12.0, 12.0, 13.0, 14.0)]
    part = StageRuns("rsm", [Request("rsm", row, each, 8.0) for row, each in enumerate(levels)], True)
    assert [request.row for request in missing(part, study, solver, None)] == [1, 3, 4]
    with StudyFolder(tmp_path / "out") as folder:
        record(folder, solver, part.requests[3], Answer("ok", 100.0))
        record(folder, solver, part.requests[4], Answer("failed", None, "worker_died", ""))
        assert [request.row for request in missing(part, study, solver, folder)] == [1, 4]
    assert [number for _, _, number in keyed(part, study, solver)] == [None] * 5


# ---- the work of a stage


@pytest.mark.parametrize(
    ("second", "reported"), [(100.0, False), (100.0001, False), (100.00011, True), (None, False), (-100.0, True)]
)
def test_a_program_that_answers_differently(tmp_path: Path, second: float | None, reported: bool) -> None:
    """The first run of the study is done twice; the relative difference of sums may be 1e-6."""
    spec = f"{TWO_FACTORS}{TWO}targets: [{{diameter: 8 mm, force: 110 N}}]\n"
    solver = (
        'solver: {kind: command, command: [heap, "{{yield_stress}} {{failure_strain}}"], result: {file: a, path: b}}\n'
    )
    (tmp_path / "own.yaml").write_text(spec + solver, encoding="utf-8")
    study = load_study(tmp_path / "own.yaml")
    answers = [[Outcome(response=100.0), Outcome(response=second)], [Outcome(response=1.0)]]
    work: Any = SimpleNamespace(study=study, _answered=lambda _requests, _quorum=0.0: answers.pop(0))
    requests = [Request("screen", 4, study.midlevels(), 8.0)]
    if not reported:
        assert Work.outcomes(work, requests) == [Outcome(response=1.0)]
        return
    with pytest.raises(UsageError) as error:
        Work.outcomes(work, requests)
    assert str(error.value) == (
        "solver: the program is stochastic (two runs at the levels of screen run 5 returned 100 and "
        f"{second:.9g}). {study.solver.chance_remedy().text}"
    )


def test_which_programs_repeat_themselves(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO)
    assert repeats_itself(study)
    assert not repeats_itself(make_study(tmp_path, f"{TWO}solver: {{kind: sheet}}\n"))
    assert not repeats_itself(make_study(tmp_path, f"{TWO}solver: {{kind: embedded, replicates: 3}}\n"))


# ---- the climb


def climb_study(folder: Path, options: str) -> Study:
    return make_study(folder, f"{TWO}climb: {options}\n")


def simulated(law: Any) -> Any:
    calls: list[int] = []

    def simulate(first: int, points: Any, conditions: Any) -> list[Outcome]:
        calls.append(first)
        assert list(conditions) == [8.0]
        return [law(levels) for levels in points]

    simulate.calls = calls  # type: ignore[attr-defined]
    return simulate


EFFECTS = {"yield_stress": 40.0, "failure_strain": -20.0}


def screening(*responses: float | None) -> Any:
    runs = [SimpleNamespace(response=response) for response in responses]
    return SimpleNamespace(effect=lambda name: SimpleNamespace(effect=EFFECTS[name]), design=SimpleNamespace(runs=runs))


def test_all_steps_at_once_go_where_the_mean_of_the_screening_says(tmp_path: Path) -> None:
    """Mean 100 N below 110 N: upwards; 120 N: downwards. Levels at a fifth of 5 MPa each, the strain against it."""
    study, names = climb_study(tmp_path, "{at_once: true, steps: 2}"), ["yield_stress", "failure_strain"]
    good = simulated(lambda levels: Outcome(response=levels["yield_stress"]))
    up = climbing._leap(study, names, screening(90.0, None, 110.0), good)
    assert [row.levels["yield_stress"] for row in up] == [15.0, 17.5, 20.0] and good.calls == [0]
    assert [row.levels["failure_strain"] for row in up] == [0.03, 0.025, 0.02]
    assert [(row.step, row.coded["yield_stress"]) for row in up] == [(0, 0.0), (1, 0.5), (2, 1.0)]
    assert up[0].error_percent == pytest.approx(100.0 * (110.0 - 15.0) / 110.0)
    down = climbing._leap(study, names, screening(120.0), good)
    assert [row.levels["yield_stress"] for row in down] == [15.0, 12.5, 10.0]
    equal = climbing._leap(study, names, screening(110.0), good)
    assert equal[1].levels["yield_stress"] == 12.5
    bad = simulated(lambda _levels: Outcome(response=None, status="failed", reason="timeout", message="too long"))
    with pytest.raises(RunsFailed, match=r"climb: all 3 runs failed \(timeout\): too long"):
        climbing._leap(study, names, screening(90.0), bad)


def test_one_step_after_the_other_until_the_target_is_passed(tmp_path: Path) -> None:
    study, names = climb_study(tmp_path, "{steps: 4}"), ["yield_stress", "failure_strain"]
    rising = simulated(lambda levels: Outcome(response=100.0 + 8.0 * (levels["yield_stress"] - 15.0)))
    rows = climbing._walk(study, names, screening(), rising)
    assert [row.outcome.response for row in rows] == [100.0, 110.0] and rising.calls == [0, 1]  # 110 N is passed
    falling = simulated(lambda levels: Outcome(response=120.0 + 4.0 * (levels["yield_stress"] - 15.0)))
    rows = climbing._walk(study, names, screening(), falling)
    assert [row.levels["yield_stress"] for row in rows] == [15.0, 13.75, 12.5]
    never = simulated(lambda _levels: Outcome(response=50.0))
    assert len(climbing._walk(study, names, screening(), never)) == 5
    bad = simulated(lambda _levels: Outcome(response=None, status="failed", reason="timeout", message="too long"))
    with pytest.raises(RunsFailed) as error:
        climbing._walk(study, names, screening(), bad)
    assert str(error.value) == "climb: the run at the centre of the factor ranges failed (timeout): too long"


@pytest.mark.parametrize(("level", "centre"), [(15.0, 15.0), (12.0, 12.5), (19.9, 17.5)])
def test_the_next_design_covers_half_of_the_range(tmp_path: Path, level: float, centre: float) -> None:
    found = climbing._around(climb_study(tmp_path, "{}"), "yield_stress", level, 2)
    assert found == CodedScale(centre, pytest.approx(2.5 / 2**0.5))


def test_the_climb_in_words() -> None:
    rows = [ClimbRow(step, {}, {}, error, Outcome(response=1.0)) for step, error in enumerate((9.0, -1.26))]
    first, *others = climbing._notes(rows, rows[1], True, Wording())
    assert (first.kind, first.severity, others) == ("nearest_step", "info", [])
    assert first.text == (
        "The response surface design is centred at step 1 of 2 on the path of steepest ascent, where the response is "
        "closest to the target (error: 1.3 % too high)."
    )
    _, missed = climbing._notes(rows, rows[1], False, Wording())
    assert (missed.kind, missed.severity) == ("target_not_passed", "warning")
    assert missed.text == (
        "Steepest ascent ended at the limits of the factor ranges before the maximum force reached the target. The "
        "target may be out of reach."
    )
    result = replace(CLIMB, coding={"a": CodedScale(15.0, 2.5)})
    (table,) = ClimbShowing().tables(result, Wording())
    assert table.heads == ("Step", "a", "b", "Force, N", "Error, %") and table.strong == {2}
    assert [cell.strip() for cell in table.cells[3]][3:] == ["150.0", "7.00 too low"]
    assert table.foot == (
        "Target 159.2 N at a diameter of 8 mm.",
        "Error in % = 100·(measured − simulated)/measured.",
        "Levels of the response surface design: a 15.00 ± 2.500 (coded 0 ± 1).",
    )
    one = replace(CLIMB, names=("a",), rows=CLIMB.rows[:1])
    assert ClimbShowing().outcome(one, Wording())[0] == "During steepest ascent, a was changed in 1 run."
    assert isinstance(one, ClimbResult) and one.recentred == {} and [label for label, _ in one.runs()] == ["climb 1"]
    assert list(one.tables()) == ["climb"]


# ---- one surface over conditions


def test_the_axis_of_the_diameter(tmp_path: Path) -> None:
    """ln 7 to ln 10 are the outermost runs, at √3·… of three coordinates: 2^(3/4) = 1.682."""
    extra = (
        "rsm: {factors: [yield_stress, failure_strain], over: conditions, centre_points: 1}\ninvert: {diameters: all}\n"
    )
    study, names = make_study(tmp_path, extra), ("yield_stress", "failure_strain")
    axis = condition_axis(study, names)
    low, high = np.log(7.0), np.log(10.0)
    assert (axis.name, axis.logarithmic, axis.at, axis.growing) == ("diameter", True, 8.0, {})
    assert (axis.center, axis.half_step) == (
        pytest.approx(0.5 * (low + high)), pytest.approx(0.5 * (high - low) / 2**0.75),
    )  # fmt: skip
    coding = Coding(names, (15.0, 0.03), (3.0, 0.01))
    design = over_design(study, coding)
    assert design.names == (*names, "diameter") and len(design.coded) == 15 == len(design.conditions)
    assert (min(design.conditions), max(design.conditions)) == (7.0, 10.0)
    assert design.coded[:, 2].tolist() == pytest.approx([axis.coded(d) for d in design.conditions])
    assert design.levels[0] == pytest.approx({**study.midlevels(), "yield_stress": 12.0, "failure_strain": 0.02})
    note = runs_of_both(study, names, design)
    assert note is not None and (note.kind, note.severity) == ("surface_runs", "info")
    assert note.text.startswith(
        "One response surface over factors and diameter (`rsm.over: conditions`) needs 15 runs; a response surface at "
        "each of 3 diameters needs 27."
    )
    faced = make_study(tmp_path, extra.replace("centre_points: 1", "centre_points: 1, alpha: face"))
    bent = runs_of_both(faced, names, over_design(faced, coding))
    assert bent is not None and bent.text.endswith("also uses the simulations of the validation.")
    assert "This design alone rarely or never shows a bend of the response over the diameter;" in bent.text
    each = make_study(
        tmp_path, "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\ninvert: {diameters: all}\n"
    )
    plain = runs_of_both(each, names, DESIGN)
    assert plain is not None and plain.text.endswith("needs 27.")
    assert runs_of_both(make_study(tmp_path, TWO), names, DESIGN) is None


# ---- element sizes


SIZED = SizedStrain(
    condition=8.0, aim=159.2, levels={"failure_strain": 0.1234}, element_size=0.5, failure_strain=0.1234,
    interval=(0.11, 0.14), force=157.94, sd_percent=5.678, positions=5, runs=17, valid=True,
)  # fmt: skip


def test_the_table_of_an_element_size() -> None:
    table = strain_table(SIZED)
    assert table.title == "Failure strain for this element size"
    assert table.heads == (
        "Element size, mm", "Failure strain", "95 % interval", "Mean force, N", "CV over positions, %", "Positions",
        "Runs", "Valid",
    )  # fmt: skip
    assert table.cells == (("0.5000", "0.1234", "0.1100 to 0.1400", "157.9", "5.68", "5", "17", "yes"),)
    assert strain_table(replace(SIZED, valid=False)).cells[0][-1] == "no"
    assert table.foot[0].startswith(
        "The search ends at the first failure strain at which the mean force is within 2 % of 159.2 N (stem diameter"
    )
    assert not_valid(replace(SIZED, sd_percent=None)).endswith(
        "The mean force is 157.9 N (target 159.2 N), with a coefficient of variation of 0 % over 5 mesh positions. "
        "Choose another element size."
    )
    assert "variation of 5.68 % over" in not_valid(SIZED)


@pytest.mark.parametrize(
    ("sd", "needed"), [(None, 0), (5.0, 1), (5.01, 2), (10.0, 4), (10.1, 5), (20.0, 16), (20.1, 17)]
)
def test_positions_for_a_standard_error_of_five_percent(sd: float | None, needed: int) -> None:
    assert replace(SIZED, sd_percent=sd).positions_needed == needed


def test_the_head_of_a_card(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO)
    lines = material_lines(study, SIZED)
    assert len(lines) == 4 and lines[0].startswith("Stem material of the study known, calibrated with stemcal ")
    assert lines[2] == "The failure strain 0.1234 is valid only for an element size of 0.5 mm."
    assert lines[3] == (
        "For a stem diameter of 8 mm, the mean force over 5 mesh positions is 157.9 N (measured: 159.2 N)."
    )


def test_a_study_without_lengths(tmp_path: Path) -> None:
    study = make_study(tmp_path, f"{TWO}solver: {{kind: embedded, replicates: 4}}\nloading: {{stroke: d/2}}\n")
    there = without_lengths(study)
    assert there.solver.repeats == 0 and there.material.internal_length.mm == 0.0 and there.blade.edge_spread.mm == 0.0
    assert there.loading.stroke_at(8.0) == pytest.approx(12.0)
    others = study.model_copy(update={"factors": tuple(f for f in study.factors if f.name != "failure_strain")})
    with pytest.raises(UsageError) as error:
        without_lengths(others)
    assert str(error.value) == (
        "export material: failure_strain is not a factor of this study. Add failure_strain to the `factors` section."
    )
    sheet = make_study(tmp_path, f"{TWO}solver: {{kind: sheet}}\n")
    with pytest.raises(UsageError, match=r"export material: the solver kind is `sheet`, but `embedded` is required\."):
        without_lengths(sheet)


def test_a_known_surface_is_the_sum_of_its_parts(tmp_path: Path) -> None:
    """Refitted to two points of 130 N at the centre, the surface rises there."""
    done = known(tmp_path, spec_of(), until="rsm")
    surface: RsmResult = done.of(RsmResult)
    assert surface.scales.names == surface.axes == ("yield_stress", "failure_strain")
    assert float(surface.fitted.predict(np.zeros(2))[0]) == pytest.approx(100.0)
    higher = surface.refitted(surface.design.runs, [(np.zeros(2), 130.0)] * 2)
    assert 100.0 < float(higher.predict(np.zeros(2))[0]) < 130.0 and higher.deterministic
    assert surface.region.low == pytest.approx([-(2**0.5)] * 2) and surface.region.radius == pytest.approx(2**0.5)
    assert {stage.name for stage in STAGES.built_in} == set(ATTRIBUTES)
