"""An optimum whose numbers are known, in full: gain, front, tables, figure, reasons, and mistakes of its section."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_optimising import PROGRAM, SPEC

from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.drawing.table import Table
from stemcal.errors import SpecError
from stemcal.notes import Remedy
from stemcal.runs.record import Outcome
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.stages.fresh import make_all
from stemcal.stages.optimise import verdict_rules as rules
from stemcal.stages.optimise.analysis import _edges, _first_in, _notes, foresee, gain_of
from stemcal.stages.optimise.options import present_levels
from stemcal.stages.optimise.result import Cutter, FrontPoint, OptimiseResult, _ends
from stemcal.stages.optimise.search import NoneAllowed, Optimum, Problem, find_optimum, intervals_of
from stemcal.stages.optimise.showing import OptimiseShowing
from stemcal.stages.result import Head
from stemcal.stages.results import fresh_results
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.work import HERE
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.vocabulary import CUTTING, Variable, Wording

NAMES = Wording()
SHOWING = OptimiseShowing()


def cutter(name: str, force: float | None, predicted: float = 100.0, material: int | None = None) -> Cutter:
    outcome = Outcome(response=force, key=f"{name} {material}")
    if force is None:
        outcome = Outcome(response=None, status="failed", reason="timeout")
    return Cutter(
        cutter=name, levels={"edge_angle": 20.0}, predicted={"force": predicted}, material=material, outcome=outcome
    )


RESULT = OptimiseResult(
    head=Head(3, "optimise", "known"),
    minimised=("force",),
    maximised=(),
    limits={"force": 120.0},
    units={"edge_angle": "deg", "ratio": "1"},
    optimum={"edge_angle": 20.0, "ratio": 0.25},
    optimum_interval={"edge_angle": (18.0, 25.0)},
    predicted={"force": 92.0},
    simulated={"force": 90.0},
    present_levels={"edge_angle": 30.0, "ratio": 0.5},
    present={"force": 120.0},
    gain_percent={"force": (25.0, 20.0, 30.0)},
    gain_sd={"force": {"runs": 2.5}},
    edges={},
    cutters=Rows([cutter("optimum", 90.0, 92.0), cutter("present", 120.0, 114.0), cutter("optimum", 80.0, material=1)]),
)


def cells(table: Table) -> list[tuple[str, ...]]:
    return [tuple(cell.strip() for cell in row) for row in table.cells]


# ---- tables and sentences


def test_the_tables() -> None:
    levels, confirmation = SHOWING.tables(RESULT, NAMES)
    assert levels.title == "Optimal and present cutter"
    assert levels.heads[:4] == ("Factor", "Unit", "Present cutter", "Optimum")
    assert cells(levels) == [
        ("edge_angle", "deg", "30.00", "20.00", "18.0 to 25.0"),
        ("ratio", "", "0.5000", "0.2500", ""),
    ]
    assert confirmation.title == "Confirmation by simulation: maximum force"
    assert confirmation.heads == ("Cutter", "Predicted, N", "Simulated, N", "Error, %", "Change, %")
    assert cells(confirmation) == [
        ("optimum", "92.00", "90.00", "−2.22", "−25.00"), ("present", "114.0", "120.0", "5.00", "–"),
    ]  # fmt: skip
    failed = replace(RESULT, present={"force": None}, cutters=Rows([cutter("optimum", None, 92.0)]))
    assert cells(SHOWING.tables(failed, NAMES)[1]) == [("optimum", "92.00", "–", "–", "–")]
    unknown = replace(RESULT, optimum_interval=None)
    assert [row[4] for row in cells(SHOWING.tables(unknown, NAMES)[0])] == ["", ""]


def test_the_outcome_and_the_gain() -> None:
    assert SHOWING.outcome(RESULT, NAMES) == [
        "Optimum on the response surfaces: edge_angle 20.00 deg and ratio 0.2500."
    ]
    assert RESULT.gains == ("maximum force 90 N, 25 % less than the present cutter (95 %: 20 to 30 %).",)
    assert RESULT.best == (RESULT.optimum, RESULT.present_levels)


@pytest.mark.parametrize(
    ("maximised", "gain", "text"),
    [
        (False, (9.96, 1.0, 9.9), "10.0 % less than the present cutter (95 %: 1.0 to 9.9 %)"),
        (False, (10.0, -1.25, 20.0), "10 % less than the present cutter (95 %: −1 to 20 %)"),
        (False, (-4.0, -6.0, -2.0), "4.0 % more than the present cutter (95 %: 2.0 to 6.0 %)"),
        (True, (12.3, 10.0, 14.0), "12 % more than the present cutter (95 %: 10 to 14 %)"),
        (True, (-12.3, -14.0, -10.0), "12 % less than the present cutter (95 %: 10 to 14 %)"),
        (False, (5.0, None, None), "5.0 % less than the present cutter"),
        (False, None, "not simulated"),
    ],
)
def test_a_gain_in_words(maximised: bool, gain: Any, text: str) -> None:
    ways = {"minimised": (), "maximised": ("force",)} if maximised else {}
    found = replace(RESULT, gain_percent={"force": gain}, **ways).compared("force")
    assert found == (f"maximum force: {text}" if gain is None else f"maximum force 90 N, {text}")
    assert replace(RESULT, simulated={"force": None}).compared("force") == "maximum force: not simulated"


@pytest.mark.parametrize(
    ("ends", "text"), [((-9.94, 9.9), "−9.9 to 9.9"), ((1.0, 10.0), "1 to 10"), ((-10.0, 1.0), "−10 to 1")]
)
def test_digits_of_an_interval(ends: tuple[float, float], text: str) -> None:
    assert _ends(*ends) == text


def test_files_and_runs() -> None:
    front = (FrontPoint({"edge_angle": 20.0, "ratio": 0.25}, {"force": 92.0}),)
    tables = replace(RESULT, front=front).tables()
    assert list(tables) == ["optimise", "optimise_front"] and list(RESULT.tables()) == ["optimise"]
    assert tables["optimise"].heads == ("cutter", "edge_angle", "ratio", "force", "predicted_force", "status", "reason")
    assert tables["optimise"].rows[0] == ("optimum", 20.0, None, 90.0, 92.0, "ok", "")
    assert tables["optimise"].rows[2][0] == "optimum, material 1"
    assert tables["optimise_front"].rows == ((20.0, 0.25, 92.0),)
    assert [label for label, _ in RESULT.runs()] == ["optimum", "present", "optimum, material 1"]
    assert (RESULT.key("force"), RESULT.key("work")) == ("response", "work")


# ---- the gain


PLANE = fit_surface(central_composite(2, centre_points=1), np.full(9, 100.0), ("a", "b"))


def surface_of(mean_square: float | None, own: float = 1.0, df: int = 4) -> Any:
    return SimpleNamespace(mean_square=mean_square, own_scatter=own, df=df)


def test_a_gain_and_its_interval() -> None:
    """From 120 to 90 N: 25 %. With s² = 4 N², √(4·(1 + 0.75²))·100/120 = 2.083 %, times t(0.975; 4) = 2.776."""
    both = [cutter("optimum", 90.0), cutter("present", 120.0)]
    found = gain_of("response", 1.0, surface_of(4.0), both, [])
    assert found is not None
    (gain, low, high), sources = found
    assert sources == {"runs": pytest.approx(2.08333, rel=1e-5)} and gain == pytest.approx(25.0)
    assert (low, high) == (
        pytest.approx(25.0 - 2.7764 * 2.08333, rel=1e-4),
        pytest.approx(25.0 + 2.7764 * 2.08333, rel=1e-4),
    )
    more = gain_of("response", -1.0, surface_of(4.0), both, [])
    assert more is not None and more[0][0] == pytest.approx(-25.0)
    half = gain_of("response", 1.0, surface_of(4.0, own=0.25), both, [])
    assert half is not None and half[1]["runs"] == pytest.approx(1.041667)
    exact = gain_of("response", 1.0, surface_of(None), both, [])
    assert exact == ((pytest.approx(25.0), None, None), {})
    below_zero = [cutter("optimum", -150.0), cutter("present", -120.0)]
    falls = gain_of("response", 1.0, surface_of(None), below_zero, [])
    assert falls is not None and falls[0][0] == pytest.approx(25.0)


@pytest.mark.parametrize("forces", [(None, 120.0), (90.0, None), (90.0, 0.0)])
def test_no_gain_without_both_runs(forces: tuple[float | None, float | None]) -> None:
    assert (
        gain_of("response", 1.0, surface_of(4.0), [cutter("optimum", forces[0]), cutter("present", forces[1])], [])
        is None
    )


def test_other_materials_widen_the_interval() -> None:
    """Gains of 25, 28 and 21 %: √(3² + 4²) = 5 %, with 1.96; a material with a failed run is left out."""
    both = [cutter("optimum", 90.0), cutter("present", 120.0)]
    others = [
        cutter("optimum", 72.0, material=1), cutter("present", 100.0, material=1),
        cutter("optimum", 79.0, material=2), cutter("present", 100.0, material=2),
        cutter("optimum", None, material=3), cutter("present", 100.0, material=3),
    ]  # fmt: skip
    found = gain_of("response", 1.0, surface_of(4.0), both, others)
    assert found is not None and found[1]["material"] == pytest.approx(5.0)
    half = math.hypot(2.7764 * 2.08333, 1.96 * 5.0)
    assert found[0][1:] == (pytest.approx(25.0 - half, rel=1e-4), pytest.approx(25.0 + half, rel=1e-4))
    assert [_first_in(number) for number in (1, 2, 3)] == [4, 6, 8]


def test_notes_on_the_kind_of_optimum() -> None:
    study: Any = SimpleNamespace(naming=CUTTING, materials=())
    two = Optimum(np.zeros(2), {"a": 1.0, "b": 1.0}, (np.zeros(2),))
    gains: Any = {
        "force": ((5.0, 1.0, 9.0), {"runs": 1.234, "material": 2.5}),
        "work": None,
        "travel": ((1.0, None, None), {}),
    }
    knee, sources = _notes(study, two, gains)
    assert (knee.kind, knee.severity) == ("knee", "info")
    assert sources.text == (
        "Standard deviations of the gain by source (maximum force: runs 1.2 %, material 2.5 %). The uncertainty of the "
        "material is not included; use `material: {from: FOLDER}` to include it."
    )
    assert [note.kind for note in _notes(study, replace(two, front=()), {})] == ["no_conflict"]
    assert list(_notes(study, replace(two, front=(), weights={"a": 1.0}), {"work": None})) == []
    study.materials = ({},)
    assert list(_notes(study, two, gains))[1].text.endswith("material 2.5 %).")


def test_ends_of_ranges() -> None:
    """Within a thousandth (coded) of an end; without any, at the border of the ball, the factor farthest out."""
    kind = SimpleNamespace(parameters={})
    study: Any = SimpleNamespace(factor=lambda _name: None, kind=kind)

    def edges(x: list[float], radius: float | None = None) -> dict[str, str]:
        region = Region(np.array([-1.0, -1.0]), np.array([1.0, 2.0]), radius)
        return _edges(study, SimpleNamespace(region=region, names=("a", "b")), np.array(x))  # type: ignore[arg-type]

    assert edges([0.9991, 0.0]) == {"a": "high"} and edges([0.9989, 0.0]) == {}
    assert edges([-0.9991, 1.9995]) == {"b": "high", "a": "low"}
    assert edges([0.6, 0.7991], 1.0) == {"b": "high"} and edges([0.3, -0.9535], 1.0) == {"b": "low"}
    assert edges([0.6, 0.78], 1.0) == {} and edges([0.6, 0.78]) == {}


# ---- the search


def quadratics(*centres: float, limits: dict[str, float] | None = None) -> Problem:
    """Return surfaces y = 10 + (x − c)² + z² over ±2."""
    runs = central_composite(2, centre_points=1)
    surfaces = {
        name: fit_surface(runs, 10.0 + (runs[:, 0] - c) ** 2 + runs[:, 1] ** 2, ("x", "z"))
        for name, c in zip(("one", "two"), centres, strict=False)
    }
    return Problem(surfaces, dict.fromkeys(surfaces, 1.0), limits or {}, Region(-2 * np.ones(2), 2 * np.ones(2), None))


def test_spans_and_the_scaled_sum() -> None:
    """y is from 10 to 10 + 3² + 2² for c = 1; the sum is divided by Σ |w| span."""
    problem = quadratics(1.0)
    assert problem.spans == {"one": pytest.approx(13.0, rel=0.01)}
    objective = problem.sum_of({"one": 3.0})
    x = np.array([0.5, 1.0])
    assert objective.value(x) == pytest.approx(11.25 / problem.spans["one"])
    assert objective.gradient(x) == pytest.approx(np.array([-1.0, 2.0]) / problem.spans["one"])
    assert objective.many(np.stack([x, x])) == pytest.approx([11.25 / problem.spans["one"]] * 2)
    flat = Problem({"one": PLANE}, {"one": 1.0}, {}, problem.region)
    assert flat.spans["one"] > 0.0


def test_one_response_and_its_limit() -> None:
    assert find_optimum(quadratics(1.0)).point == pytest.approx([1.0, 0.0], abs=1e-5)
    largest = replace(quadratics(1.0), signs={"one": -1.0})
    assert np.abs(find_optimum(largest).point) == pytest.approx([2.0, 2.0], abs=1e-6)
    assert find_optimum(largest).point[0] == pytest.approx(-2.0, abs=1e-6)
    # min (x + 1)² + z² with (x − 1)² + z² ≤ 1: x = 0
    limited = replace(quadratics(1.0, -1.0, limits={"one": 11.0}), signs={"two": 1.0})
    assert find_optimum(limited).point == pytest.approx([0.0, 0.0], abs=1e-4)


def test_the_front_and_its_knee() -> None:
    """c = ±1: the front is the line between the centres, of 13 points; its knee by symmetry is in the middle."""
    found = find_optimum(quadratics(1.0, -1.0))
    assert len(found.front) == 13 and found.point == pytest.approx([0.0, 0.0], abs=2e-3)
    assert [x[1] for x in found.front] == pytest.approx([0.0] * 13, abs=5e-3)
    first, last = found.front[0], found.front[-1]
    assert sorted([first[0], last[0]]) == pytest.approx([-1.0, 1.0], abs=5e-3)
    one = [float((x[0] - 1.0) ** 2) for x in found.front]
    assert np.diff(one) == pytest.approx(np.full(12, (one[-1] - one[0]) / 12), abs=0.02)  # equal bounds on the first
    assert find_optimum(quadratics(0.5, 0.5)).front == ()


def test_limits_that_leave_nothing() -> None:
    named = {"one": Variable("force", "Force", "F", "N")}
    problem = replace(quadratics(1.0, limits={"one": 9.0}), named=named)
    with pytest.raises(NoneAllowed) as error:
        find_optimum(problem)
    assert str(error.value).startswith(
        "goal.at_most: no point of the response surfaces satisfies the limits: force at most 9 N (smallest 10 N). "
    )


def test_the_interval_of_the_optimum() -> None:
    """None without a residual; it contains the optimum, and is wider for more scatter."""
    runs, rng = central_composite(2, centre_points=5), np.random.default_rng(3)
    noise = rng.standard_normal(len(runs))
    found = []
    for size in (0.02, 0.2):
        y = 10.0 + (runs[:, 0] - 0.5) ** 2 + runs[:, 1] ** 2 + size * noise
        problem = replace(quadratics(0.5), surfaces={"one": fit_surface(runs, y, ("x", "z"))})
        optimum = find_optimum(problem)
        intervals = intervals_of(problem, optimum)
        assert intervals is not None
        assert all(low <= x <= high for (low, high), x in zip(intervals.values(), optimum.point, strict=True))
        found.append(intervals["x"][1] - intervals["x"][0])
    assert 0.0 < found[0] < found[1]
    six = fit_surface(runs[[0, 1, 2, 4, 6, 8]], runs[[0, 1, 2, 4, 6, 8], 0] + 10.0, ("x", "z"))
    assert six.mean_square is None
    assert intervals_of(replace(quadratics(0.5), surfaces={"one": six}), Optimum(np.zeros(2), {"one": 1.0})) is None


# ---- a study


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, StudyFolder, Any]:
    folder = tmp_path_factory.mktemp("front")
    goal = "goal: {minimise: [force, energy]}\noptimise: {present: {a: -0.5 deg, b: 0.5}}\n"
    (folder / "laws.py").write_text(PROGRAM, encoding="utf-8")
    (folder / "spec.yaml").write_text(SPEC + goal, encoding="utf-8")
    study, place = load_study(folder / "spec.yaml"), StudyFolder(folder / "out")
    make_all(study, place, HERE)
    return study, place, fresh_results(study, place)


def test_the_figure_of_the_front(done: tuple[Study, StudyFolder, Any]) -> None:
    study, _, results = done
    found = results.of(OptimiseResult)
    setting: Any = SimpleNamespace(results=results, study=study)
    (plot,) = SHOWING.figures(found, setting)
    assert (plot.name, plot.section) == ("pareto-front", "optimise")
    axes = plot.make().axes[0]
    runs, front, present, optimum = axes.lines
    assert len(runs.get_xdata()) == 25 and len(front.get_xdata()) == 13
    assert front.get_xdata().tolist() == [point.predicted["force"] for point in found.front]
    assert front.get_ydata().tolist() == [point.predicted["energy"] for point in found.front]
    for line, values, label in ((present, found.present, "present"), (optimum, found.simulated, "optimum")):
        assert (line.get_xdata()[0], line.get_ydata()[0]) == (values["force"], values["energy"])
        assert line.get_label() == label
    surface = results.of(RsmResult)
    assert runs.get_xdata()[0] == surface.design.runs[0].response
    assert "force" in axes.get_xlabel() and "energy" in axes.get_ylabel()
    assert SHOWING.figures(replace(found, front=()), setting) == []
    failed = replace(found, present={"force": None, "energy": 1.0})
    assert len(SHOWING.figures(failed, setting)[0].make().axes[0].lines) == 3


def test_runs_that_will_be_asked_for(done: tuple[Study, StudyFolder, Any], tmp_path: Path) -> None:
    """Before there is a surface at 1/5 … 4/5 of each range, as two cutters and the ends of a front."""
    study, folder, results = done
    unknown = foresee(study, make_solver(study), None)
    assert not unknown.settled and [request.levels["a"] for request in unknown.requests] == pytest.approx(
        [-0.6, -0.2, 0.2, 0.6]
    )
    assert [request.row for request in unknown.requests] == [0, 1, 2, 3] and unknown.in_materials == []
    known = foresee(study, make_solver(study), folder)
    assert known.settled and all(request.pictured for request in known.requests)
    assert [dict(request.levels) for request in known.requests] == [
        one.levels for one in results.of(OptimiseResult).cutters if one.material is None
    ]
    assert study.goal is not None
    one = study.model_copy(update={"goal": study.goal.model_copy(update={"minimise": ("force",)})})
    assert [r.levels["b"] for r in foresee(one, make_solver(one), None).requests] == pytest.approx([-1 / 3, 1 / 3])


# ---- reasons


def evidence(result: Any, surface: Any = None, study: Any = None) -> Any:
    found = {OptimiseResult: result, RsmResult: surface}
    return SimpleNamespace(of=found.get, study=study)


def test_a_limit_that_the_optimum_exceeds() -> None:
    """150 of at most 120 N: 120·120/150 = 96 N, to be on the safe side."""
    over = replace(RESULT, simulated={"force": 150.0})
    (note,) = rules.limit_exceeded(evidence(over))
    assert (note.kind, note.severity) == ("limit_exceeded", "error")
    assert note.text == "The simulated maximum force of the optimum is 150 N, above 120 N."
    assert note.remedy == Remedy("Lower `goal.at_most` to 96 N.")
    (slightly,) = rules.limit_exceeded(evidence(replace(RESULT, simulated={"force": 121.0})))
    assert slightly.remedy == Remedy("Lower `goal.at_most` to 110 N.")  # 119.0, rounded down to two digits
    assert not list(rules.limit_exceeded(evidence(RESULT))) and not list(rules.limit_exceeded(evidence(None)))


FORCE = "The maximum force of the optimum "


@pytest.mark.parametrize(
    ("gain", "kind", "text"),
    [
        ((25.0, 20.0, 30.0), None, ""),
        ((25.0, None, None), None, ""),
        (None, "optimum_failed", f"{FORCE}was not simulated for both cutters."),
        ((5.0, -1.0, 11.0), "not_distinguishable", f"{FORCE}is not distinguishable from that of the present cutter."),
        ((5.0, 0.0, 11.0), "not_distinguishable", f"{FORCE}is not distinguishable from that of the present cutter."),
        ((0.0, None, None), "not_distinguishable", f"{FORCE}is not distinguishable from that of the present cutter."),
        ((-5.0, -9.0, 0.0), "not_distinguishable", f"{FORCE}is not distinguishable from that of the present cutter."),
        ((-5.0, -9.0, -0.1), "present_is_better", f"{FORCE}is worse than that of the present cutter."),
    ],
)
def test_a_gain_that_is_none(gain: Any, kind: str | None, text: str) -> None:
    found = list(rules.indistinguishable(evidence(replace(RESULT, gain_percent={"force": gain}))))
    assert [(note.kind, note.severity, note.text, note.remedy) for note in found] == (
        [] if kind is None else [(kind, "error", text, None)]
    )
    assert not list(rules.indistinguishable(evidence(None)))


def test_one_gain_of_two() -> None:
    surface: Any = SimpleNamespace(coefficients=[0] * 6, design=SimpleNamespace(runs=[0] * 9))
    two = replace(RESULT, gain_percent={"force": (25.0, 20.0, 30.0), "work": (-5.0, -9.0, -1.0)})
    (note,) = rules.indistinguishable(evidence(two, surface))
    assert (note.kind, note.severity) == ("present_is_better", "warning")
    assert note.remedy is not None and note.remedy.edit == "rsm: {design: latin-hypercube, runs: 24, extra_runs: 0}"
    front = replace(two, front=(FrontPoint({}, {}),))
    (note,) = rules.indistinguishable(evidence(front, surface))
    assert note.remedy == Remedy("Choose another point of the Pareto front, or limit the response with `goal.at_most`.")
    neither = replace(front, gain_percent={"force": (-5.0, -9.0, -1.0), "work": (-5.0, -9.0, -1.0)})
    (note,) = rules.indistinguishable(evidence(neither, surface))
    assert note.severity == "error" and note.text.endswith("of the optimum are worse than those of the present cutter.")
    assert note.remedy is not None and "runs: 24" in str(note.remedy.edit)


def test_limits_exclude_all(done: tuple[Study, StudyFolder, Any]) -> None:
    study, _, results = done
    surface = results.of(RsmResult)
    assert study.goal is not None
    strict = study.model_copy(update={"goal": study.goal.model_copy(update={"at_most": {"response": 100.0}})})
    (note,) = rules.limits_exclude_all(evidence(None, surface, strict))
    assert (note.kind, note.severity) == ("limits_exclude_all", "error") and "100 N" in note.text
    for seen in (
        evidence(RESULT, surface, strict),
        evidence(None, None, strict),
        evidence(None, surface, study),
        evidence(None, surface, strict.model_copy(update={"goal": None})),
    ):
        assert not list(rules.limits_exclude_all(seen))


# ---- the present cutter, and mistakes


def study_of(folder: Path, extra: str) -> Study:
    (folder / "laws.py").write_text(PROGRAM, encoding="utf-8")
    (folder / "spec.yaml").write_text(SPEC + extra, encoding="utf-8")
    return load_study(folder / "spec.yaml")


CUTTER = """\
name: cutter
factors:
  - {name: edge_angle, unit: deg, low: 15, high: 60}
  - {name: speed, unit: m/s, low: 0.5, high: 3}
  - {name: clearance, unit: mm, low: CLEARANCE}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, yield_stress: 12 MPa,
  tangent_modulus: 0.5 MPa, hardening_parameter: 0.05, failure_strain: 0.06}
goal: {minimise: [force]}
loading: {stroke: d/2}
solver: {rate_law: none}
screen: {design: none}
rsm: {factors: [edge_angle, speed, clearance]}
"""


def test_settings_of_the_test_are_the_present_cutter(tmp_path: Path) -> None:
    """Those within the range of their factor: an edge of 37.5° and no clearance of 20 mm; else the middle."""
    spec = tmp_path / "cutter.yaml"
    text = CUTTER.replace("CLEARANCE", "2, high: 4")
    spec.write_text(text, encoding="utf-8")
    study = load_study(spec)
    assert study.blade.edge_angle == 37.5 and not 2.0 <= study.supports.clearance <= 4.0
    assert present_levels(study) == {"edge_angle": 37.5, "speed": 1.75, "clearance": 3.0}
    spec.write_text(f"{text}optimise: {{present: {{speed: 900 mm/s, edge_angle: 20}}}}\n", encoding="utf-8")
    found = present_levels(load_study(spec))
    assert found == {"edge_angle": 20.0, "speed": pytest.approx(0.9), "clearance": 3.0}


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (
            "optimise: {present: {a: 0.5}}\n",
            "the study has no goal; add `goal: {minimise: [force]}`, or remove this key",
        ),
        (
            "goal: {minimise: [force]}\noptimise: {present: {aa: 0.5}}\n",
            "optimise.present.aa: 'aa' is not a factor of this study",
        ),
        (
            "goal: {minimise: [force]}\noptimise: {present: {a: 1.5 deg}}\n",
            "1.5 deg is outside the range of the factor (-1 to 1 deg); remove this key, or widen the range",
        ),
        (
            "goal: {minimise: [force]}\noptimise: {present: {b: -1.5}}\n",
            "-1.5 is outside the range of the factor (-1 to 1); remove this key, or widen the range",
        ),
        ("goal: {minimise: [force]}\noptimise: {present: {a: 1 mm}}\n", "optimise.present.a: "),
    ],
)
def test_mistakes_of_the_section(tmp_path: Path, extra: str, message: str) -> None:
    with pytest.raises(SpecError) as error:
        study_of(tmp_path, extra)
    assert message in " ".join(str(error.value).split())


def test_a_goal_needs_a_surface(tmp_path: Path) -> None:
    spec = tmp_path / "cutter.yaml"
    text = CUTTER.replace("CLEARANCE", "2, high: 4").replace("rsm: {factors: [edge_angle, speed, clearance]}",
                                                           "rsm: {design: none}")  # fmt: skip
    spec.write_text(text, encoding="utf-8")
    with pytest.raises(SpecError, match=r"a goal requires a response surface, but the spec has `rsm\.design: none`"):
        load_study(spec)
