"""The optimum of a goal: planted programs with a known optimum, and what the verdict makes of them."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from edits import accepted

import stemcal
from stemcal.arrays import Array
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs import SurfaceOptions, surface_design, surface_runs
from stemcal.doe.regression.surface import fit_surface
from stemcal.drawing.showing import Setting
from stemcal.errors import TargetUnreachable
from stemcal.runs.record import Outcome
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.deck import Deck, deck_text
from stemcal.solvers.deck.keywords import form_of
from stemcal.stages.fresh import make_all
from stemcal.stages.optimise.analysis import _is_physical_bound, gain_of
from stemcal.stages.optimise.result import Cutter, OptimiseResult
from stemcal.stages.optimise.search import NoneAllowed, Problem, find_optimum, intervals_of
from stemcal.stages.optimise.showing import OptimiseShowing
from stemcal.stages.optimise.verdict_rules import at_edge, limit_exceeded
from stemcal.stages.results import fresh_results
from stemcal.stages.stage import stage_called, stages_of
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.stages.work import HERE
from stemcal.study.reading import load_study
from stemcal.testing import check_stage
from stemcal.vocabulary import CUTTING, Wording

SLOW = pytest.mark.slow
NAMES = ("a", "b", "c", "e")
PRESENT = np.array([0.8, -0.6, -0.5, 0.3])


def force(x: Array) -> float:
    """Least at (0.3, −0.2, 0.1, −0.4)."""
    a, b, c, e = x - [0.3, -0.2, 0.1, -0.4]
    return float(150 + 30 * a * a + 15 * b * b + 10 * c * c + 6 * e * e + 8 * a * c)


def energy(x: Array) -> float:
    """Least at (−0.4, 0.3, 0.3, −0.1)."""
    a, b, c, e = x - [-0.4, 0.3, 0.3, -0.1]
    return float(300 + 60 * a * a + 20 * b * b + 40 * c * c + 10 * e * e)


LAWS: dict[str, Callable[[Array], float]] = {"response": force, "energy": energy}
DESIGN = SurfaceOptions("box-behnken", 3)
RUNS, RADIUS = surface_runs(4, DESIGN), surface_design("box-behnken").radius(4, DESIGN)
REGION = Region(-np.ones(4), np.ones(4), RADIUS)


def planted(count: int, noise: float, rng: np.random.Generator, **limits: float) -> Problem:
    """Return the surfaces of one or two responses with a relative scatter."""
    surfaces = {}
    for name, law in list(LAWS.items())[:count]:
        values = np.array([law(x) for x in RUNS]) * (1.0 + noise * rng.standard_normal(len(RUNS)))
        surfaces[name] = replace(fit_surface(RUNS, values, NAMES), deterministic=noise == 0.0)
    return Problem(surfaces, dict.fromkeys(surfaces, 1.0), limits, REGION)


def test_optimum_of_one_response_without_scatter() -> None:
    """The stationary point, to rounding."""
    found = find_optimum(planted(1, 0.0, np.random.default_rng(0)))
    assert found.point == pytest.approx([0.3, -0.2, 0.1, -0.4], abs=1e-5)
    assert found.front == ()


def test_front_of_two_quadratics() -> None:
    """On the front the gradients are opposite (here no bound is active); the knee is farthest from its chord."""
    problem = planted(2, 0.0, np.random.default_rng(0))
    found = find_optimum(problem)
    one, two = problem.surfaces.values()
    assert found.front[0] == pytest.approx([0.3, -0.2, 0.1, -0.4], abs=2e-2)
    assert found.front[-1] == pytest.approx([-0.4, 0.3, 0.3, -0.1], abs=2e-2)
    for x in found.front[2:-2]:
        p, q = one.gradient(x), two.gradient(x)
        assert p @ q / np.linalg.norm(p) / np.linalg.norm(q) == pytest.approx(-1.0, abs=1e-3)
    y = np.array([[float(s.predict(x)[0]) for s in (one, two)] for x in (*found.front, found.point)])
    scaled = (y - y[:-1].min(axis=0)) / np.ptp(y[:-1], axis=0)
    depth = 1.0 - scaled.sum(axis=1)  # √2 times the distance from the chord
    assert depth[-1] >= depth[:-1].max() - 1e-9
    assert depth[-1] > 0.3


def test_responses_that_differ_less_than_their_tolerance_have_no_front() -> None:
    """y = 10b + 0.004 (a + 1)² and −a: the first differs by 0.016 of a span of 20, the second by more than a third."""
    runs = surface_runs(2, SurfaceOptions("central-composite", 1))
    laws = {"force": lambda x: 10 * x[1] + 0.004 * (x[0] + 1) ** 2, "energy": lambda x: -x[0]}
    surfaces = {name: fit_surface(runs, np.array([law(x) for x in runs]), ("a", "b")) for name, law in laws.items()}
    problem = Problem(surfaces, dict.fromkeys(surfaces, 1.0), {}, Region(-np.ones(2), np.ones(2), None))
    found = find_optimum(problem)
    assert found.front == () and found.point == pytest.approx([1.0, -1.0], abs=1e-3)


def test_the_end_of_a_range_may_be_that_of_the_parameter() -> None:
    """A sliding angle of 0° is; 30° and an edge angle of 15° are not."""
    study = load_study(Path(__file__).parents[2] / "configs" / "chrysanthemum-cutter.yaml")
    ends = [("sliding_angle", "low"), ("sliding_angle", "high"), ("edge_angle", "low"), ("edge_angle", "high")]
    assert [_is_physical_bound(study, name, end) for name, end in ends] == [True, False, False, False]


def test_limit_moves_the_optimum_to_its_border() -> None:
    """min energy with force ≤ 160 N: force is 160 N there, and the gradients are opposite (Lagrange)."""
    whole = planted(2, 0.0, np.random.default_rng(0))
    problem = replace(whole, signs={"energy": 1.0}, limits={"response": 160.0})
    x = find_optimum(problem).point
    p, q = (problem.surfaces[name].gradient(x) for name in ("response", "energy"))
    assert float(problem.surfaces["response"].predict(x)[0]) == pytest.approx(160.0, abs=1e-4)
    assert p @ q / np.linalg.norm(p) / np.linalg.norm(q) == pytest.approx(-1.0, abs=1e-4)


def test_limits_that_exclude_everything() -> None:
    with pytest.raises(NoneAllowed, match=r"smallest 150\)"):
        find_optimum(planted(1, 0.0, np.random.default_rng(0), response=149.0))


def truth(count: int) -> Array:
    return find_optimum(planted(count, 0.0, np.random.default_rng(0))).point


@pytest.mark.parametrize(("count", "noise"), [(1, 0.0), (2, 0.0), (1, 0.02), pytest.param(2, 0.02, marks=SLOW)])
def test_planted_optimum_is_within_its_interval(count: int, noise: float) -> None:
    """20 of 20; at a scatter of 2 % the intervals leave out part of the range of each factor."""
    rng, true, shares = np.random.default_rng(5), truth(count), []
    for _ in range(20 if noise else 1):
        problem = planted(count, noise, rng)
        low, high = np.array(list((intervals_of(problem, find_optimum(problem)) or {}).values())).T
        assert np.all((true >= low - 2e-4) & (true <= high + 2e-4))
        shares.append((high - low) / 2.0)
    assert np.mean(shares) < (0.7 if noise else 1e-6)


def simulated(x: Array, noise: float, rng: np.random.Generator) -> Cutter:
    values = {name: law(x) * (1.0 + noise * float(rng.standard_normal())) for name, law in LAWS.items()}
    outcome = Outcome(response=values["response"], responses={"energy": values["energy"]}, key="k")
    return Cutter(cutter="", levels={}, predicted={}, outcome=outcome)


@pytest.mark.parametrize("count", [1, pytest.param(2, marks=SLOW)])
def test_coverage_of_the_gain(count: int) -> None:
    """Over 100 studies with a scatter of 2 %, the 95 % interval contains the true gain in 90 to 99 of them."""
    rng = np.random.default_rng(1)
    covered = dict.fromkeys(list(LAWS)[:count], 0)
    for _ in range(100):
        problem = planted(count, 0.02, rng)
        x = find_optimum(problem).point
        cutters = [simulated(x, 0.02, rng), simulated(PRESENT, 0.02, rng)]
        for name, surface in problem.surfaces.items():
            found, law = gain_of(name, 1.0, surface, cutters, []), LAWS[name]
            assert found is not None
            _, low, high = found[0]
            covered[name] += low <= 100.0 * (1.0 - law(x) / law(PRESENT)) <= high
    assert all(90 <= hits <= 99 for hits in covered.values()), covered


# ---- whole studies

SPEC = """\
name: planted
responses: [{name: force, unit: N}, {name: energy, unit: mJ}]
factors:
  - {name: a, unit: deg, low: -1, high: 1}
  - {name: b, low: -1, high: 1}
  - {name: c, low: -1, high: 1}
  - {name: e, low: -1, high: 1}
solver: {kind: python, file: laws.py, class: Laws}
screen: {design: none}
rsm: {design: box-behnken, factors: [a, b, c, e], centre_points: 1}
"""
PROGRAM = """\
class Laws:
    def solve(self, levels, condition):
        a, b, c, e = (levels[name] for name in "abce")
        force = 150 + 30 * (a - 0.3)**2 + 15 * (b + 0.2)**2 + 10 * (c - 0.1)**2 + 6 * (e + 0.4)**2
        return {"force": force, "energy": 300 + 60 * (a + 0.4)**2 + 20 * (b - 0.3)**2 - 40 * c + 10 * e}
"""


def optimised(folder: Path, goal: str) -> tuple[OptimiseResult | None, Verdict]:
    """Take a study with a goal through its stages; None where no optimum is found."""
    (folder / "laws.py").write_text(PROGRAM, encoding="utf-8")
    (folder / "spec.yaml").write_text(SPEC + goal, encoding="utf-8")
    study, place = load_study(folder / "spec.yaml"), StudyFolder(folder / "out")
    with suppress(TargetUnreachable):
        make_all(study, place, HERE)
    verdict = verdict_of(study, place)
    accepted(SPEC + goal, verdict, study.source)
    return fresh_results(study, place).of(OptimiseResult), verdict


def kinds(verdict: Verdict) -> set[str]:
    return {reason.kind for reason in verdict.reasons}


def test_confirmed(tmp_path: Path) -> None:
    """The gain of the simulated optimum over the present cutter, by the planted law."""
    goal = "goal: {minimise: [force]}\noptimise: {present: {a: -0.5 deg, b: 0.5}}\n"
    found, verdict = optimised(tmp_path, goal)
    assert found is not None
    assert verdict.verdict == "calibrated"
    assert found.optimum == pytest.approx({"a": 0.3, "b": -0.2, "c": 0.1, "e": -0.4}, abs=1e-3)
    assert found.present_levels == {"a": -0.5, "b": 0.5, "c": 0.0, "e": 0.0}
    before = 150 + 30 * 0.64 + 15 * 0.49 + 10 * 0.01 + 6 * 0.16
    gain = found.gain_percent["force"]
    assert found.present["force"] == pytest.approx(before)
    assert gain is not None
    assert gain[0] == pytest.approx(100 * (1 - 150 / before), abs=1e-3)
    place = StudyFolder(tmp_path / "out")
    records = [place.peek(one.outcome.key) for one in found.cutters if one.material is None]
    assert [record["request"]["row"] for record in records if record] == [0, 1]
    (table,) = (each for each in OptimiseShowing().tables(found, Wording(found.naming)) if "Confirmation" in each.title)
    study = load_study(tmp_path / "spec.yaml")
    closing = OptimiseShowing().closing(found, Setting(study, fresh_results(study, place)))
    assert [each.title for each in closing] == ["Optimal and present cutter", table.title]
    keys = [column.key for column in table.columns]
    rows = {row[0]: dict(zip(keys, row, strict=True)) for row in table.rows}
    assert rows["optimum"]["change"] == pytest.approx(100 * (150 / before - 1), abs=1e-3)
    assert rows["present"]["change"] is None and rows["present"]["error_percent"] == pytest.approx(0.0, abs=1e-6)
    exported = OptimiseShowing().tables(found, Wording(found.naming, {"a": "Angle (deg)", "b": "Part (a)"}))[0]
    assert [row[:2] for row in exported.cells[:2]] == [("Angle", "deg"), ("Part (a)", "")]  # the unit once
    assert verdict.gains[0].startswith("maximum force 150 N, 16 % less than the present cutter (95 %: 16 to 16 %)")


def test_the_interval_has_the_direction_of_its_word(tmp_path: Path) -> None:
    """A gain of −g is "more", and its interval is that of the increase."""
    found, _ = optimised(tmp_path, "goal: {minimise: [force]}\n")
    assert found is not None
    for gain, words in (
        ((-3.0, -5.0, -1.0), "3.0 % more than the present cutter (95 %: 1.0 to 5.0 %)"),
        ((-3.0, -5.0, 1.0), "3.0 % more than the present cutter (95 %: −1.0 to 5.0 %)"),
        ((3.0, -1.0, 5.0), "3.0 % less than the present cutter (95 %: −1.0 to 5.0 %)"),
    ):
        assert replace(found, gain_percent={"force": gain}).compared("force").endswith(words)


def test_maximise(tmp_path: Path) -> None:
    """The greatest force is at the border of the region: a and b away from their optimum, no range beyond it."""
    found, verdict = optimised(tmp_path, "goal: {maximise: [force]}\n")
    assert found is not None
    gain = found.gain_percent["force"]
    assert gain is not None
    assert gain[0] > 20.0
    assert found.maximised == ("force",) and "at_edge" in kinds(verdict)
    study = load_study(tmp_path / "spec.yaml")
    for level, region in ((-1.0, False), (-0.9, True)):  # at the border of a ball, no range ends
        other = replace(found, optimum={**found.optimum, "a": level}, edges={"a": "low"})
        evidence: Any = SimpleNamespace(study=study, of=lambda _kind, other=other: other)
        (edge,) = at_edge(evidence)
        assert ("edge of the experimental region" in edge.text) is region


def test_the_present_cutter_is_the_optimum(tmp_path: Path) -> None:
    goal = "goal: {minimise: [force]}\noptimise: {present: {a: 0.3, b: -0.2, c: 0.1, e: -0.4}}\n"
    _, verdict = optimised(tmp_path, goal)
    assert kinds(verdict) & {"not_distinguishable", "present_is_better"}
    assert verdict.verdict == "not_calibrated"


def test_two_responses_that_are_not_distinguishable(tmp_path: Path) -> None:
    """The present cutter is the knee itself: one sentence on both responses, in the plural."""
    first, _ = optimised(tmp_path, "goal: {minimise: [force, energy]}\n")
    assert first is not None
    levels = ", ".join(f"{name}: {value:g}" for name, value in first.optimum.items())
    (tmp_path / "again").mkdir()
    goal = f"goal: {{minimise: [force, energy]}}\noptimise: {{present: {{{levels}}}}}\n"
    _, verdict = optimised(tmp_path / "again", goal)
    (text,) = (one.text for one in verdict.reasons if one.kind == "not_distinguishable")
    assert "force and energy of the optimum are" in text.replace("maximum ", "")


def test_edge_of_a_range(tmp_path: Path) -> None:
    """The energy falls with c everywhere: the remedy widens that range."""
    found, verdict = optimised(tmp_path, "goal: {minimise: [energy]}\n")
    assert found is not None
    assert found.edges["c"] == "high"
    (edge,) = (one for one in verdict.reasons if one.kind == "at_edge" and "c" in one.text.split())
    assert edge.remedy is not None
    assert edge.remedy.edit == "factors: [{name: c, high: 2}]"


def test_limits_that_exclude_every_run(tmp_path: Path) -> None:
    found, verdict = optimised(tmp_path, "goal: {minimise: [energy], at_most: {force: 140}}\n")
    assert found is None
    (reason,) = (reason for reason in verdict.reasons if reason.kind == "limits_exclude_all")
    assert "force at most 140 N (smallest 150 N)" in reason.text
    assert verdict.verdict == "not_calibrated"


def test_front_of_a_study(tmp_path: Path) -> None:
    """Both ends of the front are simulated; on the knee both responses are between those of the ends."""
    found, _ = optimised(tmp_path, "goal: {minimise: [energy, force]}\n")
    assert found is not None
    assert [one.cutter for one in found.cutters] == ["optimum", "present", "front 1", "front 2"]
    for name in ("energy", "force"):
        ends = sorted(one.outcome.number(found.key(name)) for one in found.cutters[2:])
        value = found.simulated[name]
        assert value is not None
        assert ends[0] < value < ends[1]
    assert len(found.front) == 13
    (sources,) = (note.text for note in found.notes if note.kind == "gain_sources")
    assert "maximum force: " in sources


def test_stage_passes_the_checks(tmp_path: Path) -> None:
    optimised(tmp_path, goal := "goal: {minimise: [energy, force]}\n")
    assert goal in (tmp_path / "spec.yaml").read_text(encoding="utf-8")
    check_stage(stage_called("optimise"), tmp_path / "spec.yaml")


def test_runs_by_hand(tmp_path: Path) -> None:
    """Runs done by people give the optimum that the program gives."""
    goal = "goal: {minimise: [force]}\noptimise: {present: {a: -0.5 deg, b: 0.5}}\n"
    (tmp_path / "spec.yaml").write_text(SPEC.replace("python, file: laws.py, class: Laws", "sheet") + goal, "utf-8")
    study, asked = stemcal.load_study(tmp_path / "spec.yaml"), []
    while rows := study.ask(tmp_path / "out"):
        asked.append(len(rows))
        for row in rows:
            x = np.array([float(row[name]) for name in NAMES])
            row |= {"force": force(x), "energy": energy(x)}
        assert study.tell(rows, tmp_path / "out") == len(rows)
    found = stemcal.open_results(tmp_path / "out", study).optimum
    assert asked == [25, 2]
    assert [found.optimum[name] for name in NAMES] == pytest.approx([0.3, -0.2, 0.1, -0.4], abs=1e-3)
    assert found.simulated["force"] == pytest.approx(150.0, abs=1e-4)


DECK = """\
name: cutter
factors:
  - {name: edge_angle, unit: deg, low: 15, high: 60}
  - {name: speed, unit: m/s, low: 0.5, high: 3}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, yield_stress: 15 MPa,
  tangent_modulus: 0.5 MPa, hardening_parameter: 0.05, failure_strain: 0.03}
loading: {stroke: d/2}
solver: {kind: deck, program: lsdyna, rate_law: none, command: [ls-dyna, "i={{deck}}"]}
screen: {design: none}
rsm: {factors: [edge_angle, speed], centre_points: 1}
goal: {minimise: [force, work]}
"""


def test_decks_of_a_goal(tmp_path: Path) -> None:
    """Each run of the design has its own deck, with the blade and the speed of that run."""
    (tmp_path / "spec.yaml").write_text(DECK, encoding="utf-8")
    study = load_study(tmp_path / "spec.yaml")
    asked = stage_called("rsm").foresee(study, make_solver(study), None)
    assert asked is not None
    texts = {deck_text(Deck.of(study, one.levels, one.condition, form_of(study))) for one in asked.requests}
    assert len(asked.requests) == 9
    assert len(texts) == 9


def test_shipped_study_of_a_cutter() -> None:
    """Without the first study the spec can be checked: it names the command that makes the material."""
    study = load_study(Path(__file__).parents[2] / "configs" / "chrysanthemum-cutter.yaml")
    assert not study.pending or "stemcal run" in study.pending
    assert [stage.name for stage in stages_of(study)] == ["rsm", "optimise"]
    assert study.material.from_ == "../runs/wild-chrysanthemum"


@pytest.mark.parametrize(("simulated", "exceeded"), [(149.0, 0), (150.0, 0), (150.5, 1), (None, 0)])
def test_a_limit_is_exceeded_above_it(simulated: float | None, exceeded: int) -> None:
    result = SimpleNamespace(limits={"force": 150.0}, naming=CUTTING, simulated={"force": simulated})
    evidence: Any = SimpleNamespace(of=lambda _: result)
    assert len(list(limit_exceeded(evidence))) == exceeded
