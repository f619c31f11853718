"""The keys of `solver`: the bounds and default values of numbers, and the values that are derived from them."""

from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from stemcal.solvers.kinds import CommandKind, DeckKind, EmbeddedKind, PythonKind
from stemcal.solvers.options import CommandSolver, DeckSolver, EmbeddedSolver, PythonSolver
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.solvers.replicates import Replicates, repeated, seed_of, values_of
from stemcal.study.types.solver_kind import SolverOptions
from stemcal.vocabulary import FIRST, Variable, Vocabulary

COMMAND = {"command": ("ccx",)}
PATH = {"file": "o", "path": "p"}
CLASS = {"file": Path("mine.py"), "class": "Mine"}
# kind, key: default value, largest value that is too small, bounds, smallest value that is too large
NUMBERS: list[tuple[type[SolverOptions], dict[str, Any], str, Any, Any, Any, Any, Any]] = [
    (EmbeddedSolver, {}, "elements_through_wall", None, 0, 1, 50, 51),
    (EmbeddedSolver, {}, "hourglass", 0.01, -0.001, 0.0, 1.0, 1.001),
    (EmbeddedSolver, {}, "mass_scaling", 1e4, 0.999, 1.0, 1e9, None),
    (EmbeddedSolver, {}, "time_step_safety", 0.9, 0.0009, 0.001, 1.0, 1.001),
    (EmbeddedSolver, {}, "outputs", 500, 9, 10, 100_000, 100_001),
    (EmbeddedSolver, {}, "filter_window", 0.010, -0.001, 0.0, 10.0, None),
    (EmbeddedSolver, {}, "coarsening", 6.0, 0.99, 1.0, 10.0, 10.1),
    (EmbeddedSolver, {}, "coarsening_around", 2.0, 0.99, 1.0, 10.0, 10.1),
    (EmbeddedSolver, {}, "replicates", None, 1, 2, 100, 101),
    (EmbeddedSolver, {}, "threads", 1, 0, 1, 256, 257),
    (CommandSolver, COMMAND, "replicates", None, 0, 1, 100, 101),
    (CommandSolver, COMMAND, "time_limit", 3600.0, 0.0, 1e-3, 1e6, None),
    (PythonSolver, CLASS, "replicates", None, 0, 1, 100, 101),
    (PythonSolver, CLASS, "time_limit", 3600.0, 0.0, 1e-3, 1e6, None),
    (DeckSolver, {"program": "lsdyna"}, "elements_through_wall", None, 0, 1, 50, 51),
    (DeckSolver, {"program": "lsdyna"}, "mass_scaling", 1e4, 0.999, 1.0, 1e9, None),
    (DeckSolver, {"program": "lsdyna"}, "filter_window", 0.010, -0.001, 0.0, 10.0, None),
    (DeckSolver, {"program": "lsdyna"}, "time_limit", 86400.0, 0.0, 1e-3, 1e6, None),
]


def typed(key: str, value: float) -> Any:
    """Return a number as a spec has it: times with their unit."""
    return f"{value:g} s" if key in ("filter_window", "time_limit") else value


@pytest.mark.parametrize(
    ("kind", "more", "key", "default", "below", "low", "high", "above"), NUMBERS, ids=lambda value: str(value)[-24:]
)
def test_numbers_have_bounds(
    kind: type[SolverOptions], more: dict[str, Any], key: str, default: Any, below: Any, low: Any, high: Any, above: Any
) -> None:
    assert getattr(kind(**more), key) == default
    for value in (low, high):
        assert getattr(kind(**more, **{key: typed(key, value)}), key) == pytest.approx(value)
    for value in (below, above):
        if value is not None:
            with pytest.raises(ValidationError):
                kind(**more, **{key: typed(key, value)})


@pytest.mark.parametrize(
    ("key", "most", "too_many"),
    [
        ("command", ("x",) * 200, ("x",) * 201),
        ("files", (Path("a"),) * 100, (Path("a"),) * 101),
        ("templates", (Path("a"),) * 100, (Path("a"),) * 101),
        ("environment", {f"K{i}": "" for i in range(100)}, {f"K{i}": "" for i in range(101)}),
        ("environment", {"K" * 100: ""}, {"K" * 101: ""}),
        ("result", {f"r{i}": PATH for i in range(20)}, {f"r{i}": PATH for i in range(21)}),
    ],
)
def test_lists_have_a_largest_length(key: str, most: Any, too_many: Any) -> None:
    CommandSolver(**{**COMMAND, key: most})
    with pytest.raises(ValidationError):
        CommandSolver(**{**COMMAND, key: too_many})


@pytest.mark.parametrize("wrong", [{"command": ()}, {"command": ("",)}, {"environment": {"1X": ""}, **COMMAND}])
def test_a_program_and_its_variables_have_names(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        CommandSolver(**wrong)
    assert DeckSolver(program="openradioss").command == ()
    with pytest.raises(ValidationError):
        DeckSolver(program="lsdyna", command=("x",) * 201)


def test_the_embedded_solver_by_default() -> None:
    solver = EmbeddedSolver()
    assert (solver.element_size.at(8.0), solver.time_step, solver.time_limit) == (0.5, 4e-5, None)
    assert (solver.rate_law, solver.rate, solver.edge_over, solver.has_lengths) == ("paper", "paper", "nodes", True)
    assert solver.mesh is not None and (solver.mesh.element_size.at(8.0), solver.mesh.through_wall) == (0.5, None)
    assert solver.without_curve() is None


@pytest.mark.parametrize(
    ("speed", "slower"), [(1.0, 1.0), (100.0 / 60.0, 1.0), (100.0 / 30.0, 0.5), (1000.0, 1.0 / 600.0)]
)
def test_above_100_mm_a_minute_the_blade_travels_as_far_in_a_step(speed: float, slower: float) -> None:
    """Mass scaling falls with the square of the speed, but not below 1."""
    fast = EmbeddedSolver().at_speed(speed)
    assert fast.time_step == pytest.approx(4e-5 * slower) and fast.filter_window == pytest.approx(0.01 * slower)
    assert fast.mass_scaling == pytest.approx(max(1.0, 1e4 * slower**2))
    assert EmbeddedSolver(time_step=None).at_speed(speed).time_step is None


def test_limit_of_a_run_includes_ending_the_program_and_reading_its_result() -> None:
    """A hundredth of the limit and 10 s; the class of a user is ended at its own limit."""
    assert CommandSolver(**COMMAND, time_limit="100 s").run_limit == pytest.approx(111.0)
    assert PythonSolver(**CLASS, time_limit="100 s").run_limit == 100.0
    assert EmbeddedSolver(time_limit="100 s").run_limit == 100.0
    assert CommandSolver(**COMMAND, environment={"VERSION": "12.1"}).version == "12.1"
    assert CommandSolver(**COMMAND).version == ""


@pytest.mark.parametrize(
    ("program", "safety", "law", "title"),
    [("lsdyna", 0.8, "cowper_symonds", "LS-DYNA"), ("openradioss", 0.9, "paper", "OpenRadioss")],
)
def test_what_the_program_of_a_deck_decides(program: Any, safety: float, law: str, title: str) -> None:
    solver = DeckSolver(program=program)
    assert (solver.time_step_safety, solver.law, solver.rate, solver.title) == (safety, law, law, title)
    assert (solver.program_name, solver.outputs, solver.has_lengths) == (program, 500, False)
    assert DeckSolver(program=program, rate_law="none").law == "none"
    assert DeckSolver(program=program, nonlocal_failure=True).has_lengths
    assert solver.element_size.at(8.0) == 1.0 and solver.mesh is not None and solver.without_curve() is None
    remedy = solver.chance_remedy().text
    assert ("ncpu=-4" in remedy, "/PARITH/ON" in remedy) == (program == "lsdyna", program != "lsdyna")


def test_a_class_with_chance_has_replicates() -> None:
    remedy = PythonSolver(**CLASS).chance_remedy()
    assert remedy.edit == "solver: {replicates: 5}" and "`solve(levels, condition, seed)`" in remedy.text


READER = {"file": "o.csv", "column": "F"}


@pytest.mark.parametrize(
    ("reader", "has_curve"),
    [
        ({**READER, "reduction": "max", "along": "t"}, True),
        ({**READER, "reduction": "max"}, False),
        ({**READER, "reduction": "min", "along": "t"}, False),
        ({"file": "o", "pattern": "(?P<x>.) (?P<y>.)", "reduction": "max"}, True),
        ({"file": "o", "pattern": "(.)", "reduction": "max"}, False),
    ],
)
def test_a_curve_is_a_maximum_along_the_travel(reader: dict[str, str], has_curve: bool) -> None:
    assert (CommandSolver(**COMMAND, result=reader).without_curve() is None) is has_curve
    missing = CommandSolver(**COMMAND, result={"work": reader}).without_curve()
    assert missing is not None and "reduction: max" in missing[1]


@pytest.mark.parametrize(
    ("result", "response", "edit", "place"),
    [
        (READER, "force", "solver: {result: {scale: -1}}", "`solver.result`"),
        ({**READER, "scale": -2.5}, "force", "solver: {result: {scale: 2.5}}", "`solver.result`"),
        ({**READER, "reduction": "max"}, "force", "solver: {result: {reduction: min, scale: -1}}", "`solver.result`"),
        ({"work": READER}, "work", "solver: {result: {work: {scale: -1}}}", "`solver.result.work`"),
        ({"work": READER}, "force", None, "Reverse the sign"),
    ],
)
def test_a_wrong_sign_is_reversed_by_its_reader(result: Any, response: str, edit: str | None, place: str) -> None:
    remedy = CommandSolver(**COMMAND, result=result).sign_remedy(response)
    assert remedy.edit == edit and place in remedy.text


# ---- requests, answers, replicates

RUN = Request("rsm", 3, {"a": 1.5}, 8.0)


def test_an_answer_has_a_limited_message() -> None:
    """5,000 characters of a message and 100 of a reason, with an ellipsis only where something is cut."""
    cut = Answer("failed", reason="r" * 101, message="m" * 5001).readable()
    assert (cut.reason, cut.message) == ("r" * 100, "m" * 5000 + "…")
    assert Answer("failed", message="m" * 5000).readable().message == "m" * 5000
    assert Answer("ok").readable().message == "" and Answer("ok").ok and not Answer("failed").ok


def test_a_solver_without_more_promises_nothing() -> None:
    solver = Solver()
    assert (solver.immediate, solver.asks_people, solver.of_spec_alone, solver.preparing()) == (False,) * 4
    assert solver.has_result(RUN) is False and solver.given_design("rsm") is None and solver.table_of("rsm") == []
    assert solver.cost_estimate(RUN) is solver.memory_estimate(RUN) is solver.settings_that_matter(8.0) is None
    assert solver.cost_by_test(RUN) == {} and solver.placed(Path()) is solver
    assert solver.naming.response.name == "force"
    for method in (solver.identity, solver.solve):
        with pytest.raises(NotImplementedError):
            method(RUN)
    assert RUN.as_record() == {"stage": "rsm", "row": 3, "levels": {"a": 1.5}, "condition": 8.0, "pictured": False}


def test_replicates_are_numbered_from_one() -> None:
    other = Request("rsm", 4, {"a": 2.5}, 8.0)
    assert repeated([RUN, other], 0) == [RUN, other]
    numbers = [(run.row, run.replicate) for run in repeated([RUN, other], 2)]
    assert numbers == [(3, 1), (3, 2), (4, 1), (4, 2)]
    values = Replicates((1.0, 2.0), ("k", "l"), {"work": (3.0,)})
    assert (values.of(FIRST), values.of("work"), values.of("travel")) == ((1.0, 2.0), (3.0,), ())
    assert Replicates((1.0,), ("k",)).of("work") == ()


def test_placeholders_have_all_digits_and_the_condition_its_name() -> None:
    texts = values_of(Request("rsm", 0, {"a": 0.1 + 0.2}, 8, replicate=2), 17)
    assert texts == {"seed": "17", "replicate": "2", "diameter": "8.0", "a": "0.30000000000000004"}
    assert values_of(Request("rsm", 0, {"seed": 5.0}, 8.0), 17)["seed"] == "5.0"
    bare = Vocabulary(None, (Variable("y", "Y", "y", ""),))
    assert set(values_of(RUN, naming=bare)) == {"seed", "replicate", "a"}


def test_a_seed_depends_on_everything_that_distinguishes_runs() -> None:
    others = [
        Request("screen", 3, {"a": 1.5}, 8.0),
        Request("rsm", 4, {"a": 1.5}, 8.0),
        Request("rsm", 3, {"a": 1.6}, 8.0),
        Request("rsm", 3, {"a": 1.5}, 7.0),
        Request("rsm", 3, {"a": 1.5}, 8.0, replicate=1),
    ]
    seeds = {seed_of(run) for run in (RUN, *others)}
    assert len(seeds) == 6 and all(1 <= seed <= 900_000_000 for seed in seeds)
    assert seed_of(Request("rsm", 3, {"a": 1.5}, 8.0, pictured=True)) == seed_of(RUN)


def test_kinds_declare_what_they_can() -> None:
    kinds = {kind.name: kind for kind in (EmbeddedKind(), CommandKind(), DeckKind(), PythonKind())}
    flags = ("of_spec_alone", "starts_program", "simulates_stems", "gives_curve", "has_layers", "writes_decks")
    declared = {name: [flag for flag in flags if getattr(kind, flag)] for name, kind in kinds.items()}
    assert declared == {
        "embedded": ["of_spec_alone", "simulates_stems", "gives_curve", "has_layers"],
        "command": ["starts_program"],
        "deck": ["starts_program", "gives_curve", "writes_decks"],
        "python": ["starts_program"],
    }
    assert "yield_stress" in kinds["deck"].parameters and kinds["command"].parameters == {}
