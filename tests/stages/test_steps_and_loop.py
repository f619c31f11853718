"""Single steps of a refinement on responses that are known: by the slope, between two points, by secants; the loop.

The surface is the plane ŷ = 100 + 10x + 4y unless stated; the longest first step is 1 (coded).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fakes import TWO_FACTORS
from known_results import Known, known, spec_of
from planting import Law

from stemcal.doe.calibration.search_path import Mover, SearchPath
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import RunsFailed
from stemcal.runs.record import Outcome
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.loop import JudgedPoint, Loop, PathSteps, PointToTry, RefineRun
from stemcal.stages.refine.secant import SecantSteps
from stemcal.stages.refine.steps import SurfaceSteps, Trial, next_trial, toward
from stemcal.stages.rsm.result import RsmResult
from stemcal.study.reading import load_study

RUNS = central_composite(2, centre_points=1)
PLANE = fit_surface(RUNS, 100.0 + RUNS @ np.array([10.0, 4.0]), ("x", "y"))
BOX = Region(np.full(2, -1.5), np.full(2, 1.5), None)
STEEP = np.array([10.0, 4.0]) / math.hypot(10.0, 4.0)


def trial(x: float, y: float, response: float) -> Trial:
    return Trial(np.array([x, y]), np.array([response]))


# ---- on the surface


def test_the_surface_is_shifted_to_the_run() -> None:
    """A run of 105 N where 100 N were predicted: to reach 110 N the surface must rise by 5 N, 5/116·(10, 4)."""
    x, how, radius = next_trial(PLANE, 110.0, BOX, [trial(0, 0, 105.0)], 1.0)
    assert (how, radius) == ("surface", 1.0) and x == pytest.approx([50.0 / 116.0, 20.0 / 116.0])


def test_a_step_is_at_most_the_radius_long() -> None:
    x, how, _ = next_trial(PLANE, 200.0, BOX, [trial(0, 0, 100.0)], 1.0)
    assert how == "surface" and x == pytest.approx(STEEP) and np.linalg.norm(x) == pytest.approx(1.0)
    assert toward(PLANE, 200.0, BOX, np.zeros(2), 5.0) == pytest.approx([1.5, 1.5])  # the corner of the box


def test_on_a_flat_surface_there_is_no_step() -> None:
    flat: Any = SimpleNamespace(predict=lambda _x: np.array([100.0]), gradient=lambda _x: np.zeros(2))
    assert toward(flat, 110.0, BOX, np.array([0.2, 0.1]), 1.0) == pytest.approx([0.2, 0.1])


@pytest.mark.parametrize(
    ("second", "radius", "how", "x"),
    [
        (115.0, 1.0, "surface", None),  # half of 10 N: progress
        (115.1, 0.5, "bracket", 10.0 / 15.1),
        (104.9, 0.5, "surface", None),  # little progress, and no run on the other side
        (150.0, 0.5, "bracket", 0.2),
        (300.0, 0.5, "bracket", 0.1),  # 0.05 of the way would be too near to the better run
    ],
)
def test_after_little_progress_a_step_is_shorter_or_between(
    second: float, radius: float, how: str, x: float | None
) -> None:
    """Target 110 N; the first run gave 100 N at (0, 0), the second lies at (1, 0)."""
    found, by, left = next_trial(PLANE, 110.0, BOX, [trial(0, 0, 100.0), trial(1, 0, second)], 1.0)
    assert (by, left) == (how, radius)
    if x is not None:
        assert found == pytest.approx([x, 0.0])


def test_between_is_measured_from_the_nearest_run_on_the_other_side() -> None:
    """Best 108 N at (0, 0); 130 N at (1, 0) is nearer than 140 N at (−1.4, 0); the last run brought nothing."""
    trials = [trial(1, 0, 130.0), trial(-1.4, 0, 140.0), trial(0, 0, 108.0), trial(0, 1, 107.0)]
    x, how, _ = next_trial(PLANE, 110.0, BOX, trials, 1.0)
    assert how == "bracket" and x == pytest.approx([0.1, 0.0])  # 2/22 is below a tenth
    x, *_ = next_trial(PLANE, 112.0, BOX, trials, 1.0)
    assert x == pytest.approx([4.0 / 22.0, 0.0])


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return known(tmp_path_factory.mktemp("single"), spec_of())


def outcomes(*forces: float | None, at: Sequence[float] = (8.0,)) -> dict[float, Outcome]:
    return {d: Outcome(response=force) for d, force in zip(at, forces, strict=True)}


def test_a_point_of_one_target(single: Known) -> None:
    steps = SurfaceSteps(single.study, single.of(RsmResult), single.of(InvertResult))
    first = steps.first()
    solved = single.of(InvertResult).point
    assert first.how == "solution" and first.levels == pytest.approx(single.of(InvertResult).parameters)
    assert first.place == pytest.approx(list(solved.coded.values())) and steps.conditions == [8.0]
    assert first.predicted[8.0][0] == pytest.approx(110.0) and first.predicted[8.0][1] is not None
    judged = steps.judge(first, outcomes(104.5))
    assert (judged.error_percent, judged.merit, judged.point) == (pytest.approx(5.0), pytest.approx(5.0), first)
    assert steps.judge(first, outcomes(121.0)).error_percent == pytest.approx(-10.0)
    assert steps.end() == "settled" and steps.undetermined == ()


def test_a_failed_point_is_left_half_way_to_the_best(single: Known) -> None:
    steps = SurfaceSteps(single.study, single.of(RsmResult), single.of(InvertResult))
    first = steps.first()
    failed = steps.judge(first, outcomes(None))
    assert failed.error_percent is None and failed.merit == math.inf
    back = steps.next()
    assert back is not None and back.how == "back" and back.place == pytest.approx(0.5 * first.place)  # of the centre
    steps.judge(back, outcomes(105.0))
    onward = steps.next()
    assert onward is not None and onward.how == "surface"
    steps.judge(onward, outcomes(None))
    again = steps.next()
    assert again is not None and again.how == "back"
    assert again.place == pytest.approx(0.5 * (onward.place + back.place))


def test_no_step_to_where_a_run_was(single: Known) -> None:
    steps = SurfaceSteps(single.study, single.of(RsmResult), single.of(InvertResult))
    steps.judge(steps.first(), outcomes(110.0))
    assert steps.next() is None


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Known:
    law = Law(growth=0.3)
    measured = {d: law.at(0.2, 0.3, d)[0] for d in (7.0, 8.0, 10.0)}
    return known(
        tmp_path_factory.mktemp("joint"), spec_of(measured, "invert: {diameters: all}\n", ", sd: 3 N, n: 9"), law
    )


def test_the_box_of_a_joint_step_shrinks_without_progress(joint: Known) -> None:
    """Progress: the misfit falls to at most half of the least before."""
    steps = SurfaceSteps(joint.study, joint.of(RsmResult), joint.of(InvertResult))
    measured = steps.measured
    off = np.array([10.0, 0.0, 0.0])
    steps.trials = [Trial(np.zeros(2), measured + off)]
    assert steps.shrunk(1.0) == 1.0 and steps.best is steps.trials[0]
    steps.trials.append(Trial(np.ones(2), measured + 0.7 * off))  # 0.49 of the misfit
    assert steps.shrunk(1.0) == 1.0 and steps.best is steps.trials[1]
    steps.trials[1] = Trial(np.ones(2), measured + 0.72 * off)  # 0.518
    assert steps.shrunk(0.8) == 0.4
    steps.trials[1] = Trial(np.ones(2), measured + 1.5 * off)
    assert steps.shrunk(1.0) == 0.5 and steps.best is steps.trials[0]


def test_the_worst_error_of_a_joint_point_and_its_merit(joint: Known) -> None:
    steps = SurfaceSteps(joint.study, joint.of(RsmResult), joint.of(InvertResult))
    at = steps.conditions
    forces = [m * (1.0 - e) for m, e in zip(steps.measured, (0.01, -0.04, 0.02), strict=True)]
    judged = steps.judge(steps.first(), outcomes(*forces, at=at))
    assert judged.error_percent == pytest.approx(-4.0)
    gap = steps.measured - np.array(forces)
    assert judged.merit == pytest.approx(float(gap @ steps.precision @ gap))
    failed = steps.judge(steps.first(), outcomes(forces[0], None, forces[2], at=at))
    assert failed.error_percent is None


# ---- by secants


QUICK = f"{TWO_FACTORS}rsm: {{design: none}}\n"
LN2 = math.log(2.0)


def secants(folder: Path, extra: str = "", rows: str = "  - {diameter: 8 mm, force: 110 N}\n") -> SecantSteps:
    """Return the steps of a study: the yield stress of 10 to 20 MPa and the failure strain of 0.01 to 0.05 by ratio."""
    text = QUICK if not extra else QUICK.replace("low: 0.01, high: 0.05}", f"low: 0.01, high: 0.05, {extra}}}")
    (folder / "quick.yaml").write_text(f"{text}targets:\n{rows}", encoding="utf-8")
    return SecantSteps(load_study(folder / "quick.yaml"), 1.0)


def at_stress(mpa: float) -> float:
    """Return the coded yield stress: ±1 at 10 and 20 MPa, by ratio."""
    return math.log(mpa / 200.0**0.5) / (0.5 * LN2)


def test_it_begins_in_the_middle(tmp_path: Path) -> None:
    steps = secants(tmp_path)
    first = steps.first()
    assert first.how == "middle" and first.predicted == {8.0: (None, None)}
    assert first.levels["yield_stress"] == 15.0 and first.levels["failure_strain"] == 0.03
    assert first.place == pytest.approx([at_stress(15.0), math.log(0.03 / 0.0005**0.5) / (0.5 * math.log(5.0))])
    assert steps.undetermined == ("yield_stress", "failure_strain")
    with_prior = secants(tmp_path, "prior: {mean: 0.02, sd: 0.01, source: a paper}")
    assert with_prior.first().levels["failure_strain"] == 0.02


@pytest.mark.parametrize(
    ("force", "z", "moved"),
    [
        (90.0, 0.0, math.log(110.0 / 90.0) / (0.5 * LN2)),  # as far as a proportional force needs
        (108.0, 0.0, 0.5),
        (112.0, 0.0, -0.5),
        (10.0, 0.2, 1.0),  # to the end of the range
        (108.0, 0.9, 0.4),  # there is no room upwards
        (112.0, -0.9, -0.4),
        (108.0, 0.75, 1.0),  # a quarter of room is enough
    ],
)
def test_a_factor_is_moved_by_itself(tmp_path: Path, force: float, z: float, moved: float) -> None:
    steps = secants(tmp_path)
    steps.trials = [Trial(np.array([z, 0.3]), np.array([force]))]
    assert steps._probed(0) == pytest.approx([moved, 0.3])


@pytest.mark.parametrize(("force", "sign", "moved"), [(108.0, "-", -0.5), (112.0, "-", 0.5), (108.0, "+", 0.5)])
def test_the_expected_sign_decides_where_to(tmp_path: Path, force: float, sign: str, moved: float) -> None:
    steps = secants(tmp_path, f'expected_sign: "{sign}"')
    steps.trials = [Trial(np.zeros(2), np.array([force]))]
    assert steps._probed(1) == pytest.approx([0.0, moved])


def test_a_factor_that_includes_zero_moves_up(tmp_path: Path) -> None:
    steps = secants(tmp_path)
    steps.by_ratio = np.array([True, False])
    steps.trials = [Trial(np.zeros(2), np.array([200.0]))]
    assert steps._probed(1) == pytest.approx([0.0, 0.5])
    assert steps._scaled([20.0, -3.0]) == pytest.approx([math.log(20.0), -3.0])


def test_a_probe_gives_the_slope_if_it_is_seen(tmp_path: Path) -> None:
    """From 100 to 110 N by 0.5: ln 1.1/0.5; from 100 to 101.9 N is within twice the tolerance of 1 %."""
    steps = secants(tmp_path)
    assert steps.learn(Trial(np.zeros(2), np.array([100.0])))
    steps.probe = 0
    assert steps.learn(Trial(np.array([0.5, 0.0]), np.array([110.0])))
    assert steps.slopes[0] == pytest.approx([math.log(1.1) / 0.5, 0.0]) and steps.determined == [0]
    assert steps.undetermined == ("failure_strain",) and steps.probe is None
    steps.probe = 1
    assert not steps.learn(Trial(np.array([0.5, 0.5]), np.array([112.1])))  # 1.9 %
    assert steps.determined == [0] and len(steps.trials) == 2 and steps.probe is None


def test_a_change_that_another_factor_makes_as_well_is_not_seen(tmp_path: Path) -> None:
    rows = "".join(f"  - {{diameter: {d} mm, force: {f} N}}\n" for d, f in ((7, 84), (8, 110)))
    (tmp_path / "two.yaml").write_text(f"{QUICK}invert: {{diameters: all}}\ntargets:\n{rows}", encoding="utf-8")
    steps = SecantSteps(load_study(tmp_path / "two.yaml"), 1.0)
    steps.trials, steps.determined = [Trial(np.zeros(2), np.array([84.0, 110.0]))], [0]
    steps.slopes[:, 0] = [0.3, 0.3]
    assert not steps._is_seen(np.array([0.2, 0.2]))
    assert steps._is_seen(np.array([0.2, -0.2])) and not steps._is_seen(np.array([0.215, 0.185]))
    steps.trials = [Trial(np.array([0.9995, 0.0]), np.array([84.0, 110.0]))]  # the first is at its end
    assert steps._is_seen(np.array([0.2, 0.2])) and steps._free() == [] and steps.end() == "out_of_reach"
    steps.trials = [Trial(np.array([0.9985, 0.0]), np.array([84.0, 110.0]))]
    assert steps._free() == [0] and steps.end() == "settled"


def test_broyden_s_update(tmp_path: Path) -> None:
    """J s becomes Δ ln y, in the direction of s only; steps below 0.2 show roughness, not the slope."""
    for length, updated in ((0.5, True), (0.1, False)):
        steps = secants(tmp_path)
        steps.trials, steps.determined = [Trial(np.zeros(2), np.array([100.0]))], [0, 1]
        steps.slopes[:] = [[0.2, 0.1]]
        s = length * np.array([0.6, 0.8])
        steps.learn(Trial(s, np.array([100.0 * math.exp(0.3 * length)])))
        assert (float((steps.slopes @ s)[0]) == pytest.approx(0.3 * length)) is updated
        across = np.array([0.8, -0.6])
        assert float((steps.slopes @ across)[0]) == pytest.approx(0.2 * 0.8 - 0.1 * 0.6)


def test_a_step_by_the_slope(tmp_path: Path) -> None:
    """ln(110/100) = 0.0953 by a slope of 0.3: 0.318."""
    steps = secants(tmp_path)
    steps.trials, steps.determined = [Trial(np.zeros(2), np.array([100.0]))], [0]
    steps.visited, steps.slopes[:] = [np.zeros(2)], [[0.3, 0.0]]
    found = steps._step()
    assert found is not None and found.how == "secant"
    assert found.place == pytest.approx([math.log(1.1) / 0.3, 0.0], abs=1e-4)
    assert found.predicted[8.0][0] == pytest.approx(110.0, rel=1e-4)
    steps.reach = 0.2
    found = steps._step()
    assert found is not None and found.place[0] == pytest.approx(0.2, abs=1e-3)
    steps.slopes[:] = [[0.05, 0.0]]
    steps.reach = 5.0
    found = steps._step()
    assert found is not None and found.place[0] == pytest.approx(1.0, abs=1e-3)  # the end of the range
    steps.determined = []
    assert steps._step() is None


def test_a_step_that_gains_less_than_a_twentieth_is_not_made(tmp_path: Path) -> None:
    """From z = 1 − δ a gap is closed by δ·slope only; the misfit falls by twice that share."""
    for delta, made in ((0.002, False), (0.2, True)):
        steps = secants(tmp_path)
        z = np.array([1.0 - delta, 0.0])
        steps.trials, steps.determined, steps.visited = [Trial(z, np.array([100.0]))], [0], [z]
        steps.slopes[:] = [[0.3, 0.0]]
        assert (steps._step() is not None) is made


def test_a_step_to_a_visited_point_is_halved(tmp_path: Path) -> None:
    steps = secants(tmp_path)
    aim = np.array([math.log(1.1) / 0.3, 0.0])
    steps.trials, steps.determined = [Trial(np.zeros(2), np.array([100.0]))], [0]
    steps.slopes[:] = [[0.3, 0.0]]
    steps.visited = [np.zeros(2), aim]
    found = steps._step()
    assert found is not None and found.place == pytest.approx(0.5 * aim, abs=1e-3)


def test_after_a_failed_run_it_goes_back_or_aside(tmp_path: Path) -> None:
    steps = secants(tmp_path)
    first = steps.first()
    steps.judge(first, outcomes(None))
    aside = steps.next()
    assert aside is not None and aside.how == "back"
    assert aside.place == pytest.approx(0.5 * (first.place - 0.5))  # the first failure; the second goes to +0.5
    steps.judge(aside, outcomes(None))
    second = steps.next()
    assert second is not None and second.place == pytest.approx(0.5 * (aside.place + 0.5))


def test_factors_are_probed_while_the_means_can_determine_one_more(tmp_path: Path) -> None:
    steps = secants(tmp_path)
    steps.judge(steps.first(), outcomes(100.0))
    probe = steps.next()
    assert probe is not None and probe.how == "probe" and steps.untried == [1]
    steps.judge(probe, outcomes(106.0))
    step = steps.next()
    assert step is not None and step.how == "secant" and steps.untried == [1]  # one mean, one factor
    assert step.levels["failure_strain"] == 0.03


def test_negative_means_are_not_taken_by_ratio(tmp_path: Path) -> None:
    steps = secants(tmp_path)
    steps.logarithmic = False
    assert steps._level(np.array([-3.0])) == pytest.approx([-3.0])
    steps.trials = [Trial(np.zeros(2), np.array([100.0]))]
    steps.slopes[:] = [[20.0, 0.0]]
    assert steps._expected(np.array([0.5, 0.0])) == pytest.approx([110.0])
    assert steps._is_seen(np.array([2.3])) and not steps._is_seen(np.array([2.1]))  # 2 % of 110 N
    logarithmic = secants(tmp_path)
    assert logarithmic._level(np.array([-3.0])) == pytest.approx([math.log(1e-9 * 110.0)])


# ---- the loop


@dataclass
class Steps:
    """Points at 0, 1, 2, … with these errors (None: failed)."""

    errors: Sequence[float | None]
    conditions: Sequence[float] = (8.0,)
    seen: list[Mapping[float, Outcome]] = field(default_factory=list)

    def first(self) -> PointToTry:
        return self._point(0)

    def judge(self, point: PointToTry, outcomes: Mapping[float, Outcome]) -> JudgedPoint:
        self.seen.append(outcomes)
        error = self.errors[point.place]
        return JudgedPoint(point) if error is None else JudgedPoint(point, error, abs(error))

    def next(self) -> PointToTry | None:
        return self._point(len(self.seen)) if len(self.seen) < len(self.errors) else None

    def end(self) -> Any:
        return "settled"

    def _point(self, place: int) -> PointToTry:
        return PointToTry({"a": float(place)}, "surface", place, dict.fromkeys(self.conditions, (50.0, (40.0, 60.0))))


class Simulation:
    """Answers 100 N plus the level; the rows and conditions of its calls are kept."""

    def __init__(self, fails: bool = False) -> None:
        self.calls: list[tuple[int, list[float]]] = []
        self.fails = fails

    def __call__(self, row: int, points: Sequence[Mapping[str, float]], conditions: Sequence[float]) -> list[Outcome]:
        self.calls.append((row, list(conditions)))
        if self.fails:
            return [Outcome(response=None, status="failed", reason="timeout", message="too long")] * len(conditions)
        return [Outcome(response=100.0 + points[0]["a"] + d) for d in conditions]


def looped(
    errors: Sequence[float | None], budget: int, conditions: Sequence[float] = (8.0,), tolerance: float = 1.0
) -> Any:
    simulation = Simulation()
    loop = Loop(Steps(errors, conditions), simulation, tolerance, budget)
    loop.run()
    return loop, simulation


@pytest.mark.parametrize(
    ("errors", "budget", "runs", "stopped", "best"),
    [
        ([5.0, -1.0, 0.5], 9, 2, "tolerance", 1),
        ([5.0, -1.01, 0.5], 9, 3, "tolerance", 2),
        ([5.0, 3.0, 4.0], 9, 3, "settled", 1),
        ([5.0, 3.0, 2.0], 2, 2, "budget", 1),
        ([5.0, None, 7.0], 9, 3, "settled", 0),
    ],
)
def test_where_the_loop_ends(errors: Sequence[float | None], budget: int, runs: int, stopped: str, best: int) -> None:
    loop, simulation = looped(errors, budget)
    assert (len(loop.runs), loop.stopped, loop.best.point.place) == (runs, stopped, best)
    assert simulation.calls == [(n, [8.0]) for n in range(runs)] and loop.left == budget - runs
    assert loop.runs[0] == RefineRun(
        run=1, how="surface", condition=8.0, levels={"a": 0.0}, predicted=50.0, prediction_interval=(40.0, 60.0),
        outcome=Outcome(response=108.0),
    )  # fmt: skip
    assert [run.run for run in loop.runs] == list(range(1, runs + 1))


def test_a_point_needs_budget_for_all_its_conditions() -> None:
    loop, _ = looped([5.0, 4.0, 3.0], 5, (7.0, 8.0))
    assert (len(loop.runs), loop.stopped) == (4, "budget")
    loop, _ = looped([5.0, 4.0, 3.0], 6, (7.0, 8.0))
    assert (len(loop.runs), loop.stopped) == (6, "budget")


def test_other_conditions_are_simulated_as_far_as_the_budget_allows() -> None:
    """First the best point, then the first, in the rows that they had."""
    loop, simulation = looped([5.0, 0.5], 6)
    loop.run_elsewhere([7.0, 9.0, 10.0])
    assert simulation.calls[2:] == [(1, [7.0, 9.0, 10.0]), (0, [7.0])]
    assert [(run.how, run.condition, run.predicted) for run in loop.runs[2:]] == [
        ("elsewhere", 7.0, None), ("elsewhere", 9.0, None), ("elsewhere", 10.0, None), ("elsewhere", 7.0, None),
    ]  # fmt: skip
    assert loop.responses({"a": 1.0}) == {d: Outcome(response=101.0 + d) for d in (8.0, 7.0, 9.0, 10.0)}
    assert set(loop.responses({"a": 0.0})) == {8.0, 7.0} and loop.left == 0
    once, simulation = looped([0.5], 6)
    once.run_elsewhere([7.0])
    assert simulation.calls == [(0, [8.0]), (0, [7.0])]  # the best point is the first


def test_no_point_without_a_failed_run() -> None:
    loop = Loop(Steps([None]), Simulation(fails=True), 1.0, 3)  # type: ignore[arg-type]
    loop.run()
    with pytest.raises(RunsFailed) as error:
        _ = loop.best
    assert str(error.value) == ("refine: at least one run failed at every simulated point (1 runs; timeout: too long).")
    loop = Loop(Steps([None]), Simulation(), 1.0, 3)  # type: ignore[arg-type]
    loop.run()
    with pytest.raises(RunsFailed, match=r"\(1 runs; the records do not contain all fitted responses\)"):
        _ = loop.best


@pytest.mark.parametrize(
    ("response", "inside"), [(40.0, True), (60.0, True), (60.1, False), (39.9, False), (None, None)]
)
def test_inside_the_prediction_interval(response: float | None, inside: bool | None) -> None:
    run = RefineRun(
        run=1, how="surface", condition=8.0, levels={}, predicted=50.0, prediction_interval=(40.0, 60.0),
        outcome=Outcome(response=response),
    )  # fmt: skip
    assert run.inside_interval is inside and replace(run, prediction_interval=None).inside_interval is None


def test_steps_along_a_path() -> None:
    """A force that is proportional to the strain: 80 N at 0.04, of 160 N expected; 120 N need 0.06."""
    path = SearchPath((Mover("strain", 0.04, 0.01, 0.2, 25.0),))
    steps = PathSteps(path, {"strain": 0.04, "other": 1.0}, 8.0, 120.0, 160.0)
    first = steps.first()
    assert (first.how, first.levels, first.predicted) == (
        "solution",
        {"strain": 0.04, "other": 1.0},
        {8.0: (160.0, None)},
    )
    judged = steps.judge(first, outcomes(80.0))
    assert judged.error_percent == pytest.approx(100.0 / 3.0) and judged.merit == pytest.approx(math.log(1.5))
    second = steps.next()
    assert (
        second is not None and second.how == "path" and second.levels == {"strain": pytest.approx(0.06), "other": 1.0}
    )
    assert second.predicted[8.0][0] == pytest.approx(120.0)
    failed = steps.judge(second, outcomes(None))
    assert (failed.point, failed.error_percent, failed.merit) == (second, None, math.inf)
    back = steps.next()
    assert back is not None and back.how == "back" and 0.04 < back.levels["strain"] < 0.06
    assert steps.end() == "settled"
    at_end = PathSteps(path, {"strain": 0.04}, 8.0, 9000.0, 160.0)
    at_end.judge(PointToTry({"strain": 0.2}, "path", path.ends[1], {}), outcomes(400.0))
    assert at_end.end() == "out_of_reach"


def test_the_interval_of_a_factor_on_the_path() -> None:
    """y proportional to the strain: ± 1.96·4 % of the force are ± 7.8 % of the strain, on a logarithmic scale."""
    path = SearchPath((Mover("strain", 0.04, 0.001, 2.0, 25.0),))
    steps = PathSteps(path, {"strain": 0.04}, 8.0, 120.0, 120.0)
    for strain in (0.04, 0.05, 0.03):
        place = math.log(strain / 0.04)
        steps.judge(PointToTry({"strain": strain}, "path", place, {}), outcomes(3000.0 * strain))
    point: Any = SimpleNamespace(place=0.0)
    low, high = steps.intervals(point, 0.04, math.inf)["strain"]
    assert math.log(high / 0.04) == pytest.approx(1.96 * 0.04, rel=0.02)
    assert math.log(low / 0.04) == pytest.approx(-1.96 * 0.04, rel=0.02)
