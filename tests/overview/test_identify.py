"""What combinations of tests would tell, against least squares by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fakes import TWO_FACTORS, FakeSolver
from scipy.stats import t as student

import stemcal
from stemcal.doe.calibration.misfit import misfit_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.d_optimal import d_optimal_shares
from stemcal.errors import RunsFailed, UsageError
from stemcal.folder.study_folder import StudyFolder
from stemcal.measured.curve_modes import CurveModes
from stemcal.overview.identify import (
    Identified,
    Measurable,
    central_differences,
    divided,
    identify,
    local_surface,
    told_by,
)
from stemcal.runs.answer import ignore
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Answer, Request
from stemcal.stages.work import HERE, Work
from stemcal.study.reading import load_study

TESTS = """
tests:
  - name: pull
    kind: axial-tension
    stroke: 1 mm
    targets:
      - {diameter: 8 mm, maximum_force: 600 N, maximum_force_sd: 30 N, work: 300 mJ, work_sd: 15 mJ, n: 10}
  - {name: squeeze, kind: radial-compression, stroke: 1 mm}
"""
TARGETS = """
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 7 mm, force: 80 N, sd: 8 N, n: 10}
    - {diameter: 8 mm, force: 100 N, sd: 10 N, n: 10}
rsm: {factors: [yield_stress, failure_strain]}
screen: {design: none}
"""
GROWING = """
schema_version: 1
name: growing
factors:
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
  - {name: growth, low: -0.5, high: 1.5}
material:
  density: 1100 kg/m3
  elastic_modulus: 1000 MPa
  poisson_ratio: 0.3
  yield_stress: {at: 8 mm, exponent: growth}
  tangent_modulus: 0.5 MPa
  hardening_parameter: 0.05
  failure_strain: 0.03
  internal_length: d/5
blade: {edge_spread: d/5}
specimen: {outer_diameter: 8 mm, diameter_ratio: 0.41, length: 30 mm}
loading: {duration: 0.8 s}
solver: {kind: embedded, rate_law: none, element_size: d/10, mass_scaling: 3e4, coarsening: 2, outputs: 200}
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 8 mm, force: 179.7 N, sd: 10.8 N, n: 10}
    - {diameter: 11 mm, force: 406.6 N, sd: 24.4 N, n: 10}
screen: {design: none}
rsm: {factors: [yield_stress, growth], centre_points: 1}
invert: {diameters: all}
"""


class Linear(FakeSolver):
    """Cutting sees a + b, the pull's force a, its work b; squeezing sees neither before its maximum, out of reach."""

    def solve(self, request: Request) -> Answer:
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        size = (request.condition / 8.0) ** 2
        responses = {
            "pull_maximum_force": 600.0 + 60.0 * a,
            "pull_work": 300.0 + 60.0 * b,
            "squeeze_slope": 50.0,
            "squeeze_maximum_force": 20.0 + 9.0 * a,
            "squeeze_work": 20.0 + 9.0 * b,
        }
        warned = [{"kind": "maximum_not_passed", "stroke": 1.0}]
        beside = {"pull": {"warnings": []}, "squeeze": {"warnings": warned}}
        return Answer(
            "ok", 100.0 * size + 10.0 * a + 10.0 * b / size, details={RESPONSES: responses, "laboratory": beside}
        )


def foretold(folder: Path, solver: FakeSolver, tests: str, n: int = 10) -> Identified:
    path = folder / "spec.yaml"
    path.write_text(TWO_FACTORS + tests + TARGETS, "utf-8")
    study = load_study(path)
    with StudyFolder(folder / "runs") as place, pytest.MonkeyPatch.context() as patched:
        patched.setattr("stemcal.overview.identify.make_solver", lambda _study: solver)
        return identify(Work(study, place, HERE, ignore, solver), [n])


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Identified:
    return foretold(tmp_path_factory.mktemp("identify"), Linear(), TESTS)


def test_a_parameter_that_one_response_tells_has_students_interval(found: Identified) -> None:
    """Force 600 + 60a with sd 30 over ten pieces: a ± t(9)·30/√10/60, in MPa five times that; so the work, sd 15."""
    alone, pulled = (one for one in found.combinations if "squeeze" not in one.tests)
    assert alone.tests == ("cutting",)
    assert pulled.tests == ("cutting", "pull")
    stress, strain = pulled.parameters
    t = float(student.ppf(0.975, 9))
    # cutting, sd 10, adds its share of the information on a + b
    slopes = np.array([[60.0 / 30.0, 0.0], [0.0, 60.0 / 15.0], [10.0 / 10.0, 10.0 / 10.0]])
    sd = np.sqrt(np.diag(np.linalg.inv(10.0 * slopes.T @ slopes)))
    width = np.array([5.0, 0.02]) * sd
    got = np.array([stress.expected_high - stress.expected_low, strain.expected_high - strain.expected_low]) / 2.0
    assert np.all(got < t * width)  # degrees of freedom of three sources
    assert np.all(got > 1.96 * width)
    np.testing.assert_allclose(0.5 * (stress.expected_high + stress.expected_low), 15.0, rtol=1e-3)


def test_what_only_a_sum_tells_leaves_both_free_along_their_difference(found: Identified) -> None:
    alone = found.combinations[0]
    assert all(one.free for one in alone.parameters)
    assert alone.loosest["yield_stress"] / 5.0 == pytest.approx(-alone.loosest["failure_strain"] / 0.02, rel=1e-6)
    assert not found.combinations[1].loosest


@pytest.mark.parametrize(("specimens", "kept"), [(4, 0), (5, 2), (6, 3), (20, 3)])
def test_few_specimens_are_foretold_with_few_modes(specimens: int, kept: int) -> None:
    """A laboratory of five finds two; of fewer it has the maximum by itself."""
    parts = np.zeros(26)
    modes = CurveModes(100.0, 0.5, *(tuple(parts),) * 3, (tuple(parts),) * 3, (6.0,) * 3, (0.0,) * 3, 20)
    points = central_differences(2)
    names = ("force", "curve_1", "curve_2", "curve_3")
    surfaces = [local_surface(points, 100.0 + points @ [a, 10.0], ("x", "y")) for a in (9.0, 7.0, -5.0, 3.0)]
    found = [Measurable("cutting", 8.0, name, s, 0.1, "8") for name, s in zip(names, surfaces, strict=True)]
    told = [one.measured(specimens) for one in told_by(found, [modes], specimens)]
    assert [one.kind for one in told] == list(names[: 1 + kept])
    (laboratory,) = (source for source in misfit_of(told).sources if source.name == "laboratory")
    assert (laboratory.matrix, laboratory.df) == (kept > 0, specimens - 1 - kept)


def test_runs_and_levels_are_told(found: Identified) -> None:
    assert found.runs == 5
    reach = np.sqrt(2.0)  # of a rotatable design in two factors
    assert [step.low for step in found.steps] == pytest.approx([15.0 - 5.0 / reach, 0.03 - 0.02 / reach])
    assert {type(note).__name__ for note in found.notes} == {"ScatterAssumed", "MaximumOutOfReach"}
    assert found.notes[0].responses == ("squeeze_slope",)  # type: ignore[attr-defined]
    assert found.notes[1].responses == ("squeeze_maximum_force", "squeeze_work")  # type: ignore[attr-defined]


def test_specimens_go_where_they_tell(found: Identified) -> None:
    """The pull tells both parameters, cutting their sum more weakly, squeezing nothing."""
    share = {one.test: one.share for one in found.division}
    assert share["pull"] > 0.99
    assert sum(share.values()) == pytest.approx(1.0)
    # |diag(4, 16) + 11ᵀ|/9 over |diag(4, 16)|, and a little that the ranges tell
    assert found.even_percent == pytest.approx(100.0 * np.sqrt(84.0 / 9.0 / 64.0), rel=0.03)


def test_of_one_test_the_diameters_are_combined(tmp_path: Path) -> None:
    """At 7 mm the force sees a + 1.3·b, at 8 mm a + b: together they tell both, if barely."""
    found = foretold(tmp_path, Linear(), "", n=1000)
    assert [one.conditions for one in found.combinations] == [(8.0,), (7.0, 8.0)]
    alone, both = (np.array([one.share for one in each.parameters]) for each in found.combinations)
    assert np.all(both < alone)


@pytest.mark.slow
def test_three_tests_are_foretold_as_their_study_ends(tmp_path: Path) -> None:
    """Its intervals are 955 to 1045 MPa, 14.51 to 15.47 MPa, 0.0272 to 0.0332; asked within 20 %, found within 4 %."""
    study = load_study(Path(__file__).parents[2] / "configs" / "three-tests.yaml")
    with StudyFolder(tmp_path) as place:
        found = identify(Work(study, place, HERE, ignore, make_solver(study)), [10])
    assert found.combinations[-1].tests == ("cutting", "bending", "pull")
    widths = [one.expected_high - one.expected_low for one in found.combinations[-1].parameters]
    assert widths == pytest.approx([90.0, 0.96, 0.00597], rel=0.1)


@pytest.mark.slow
def test_two_diameters_are_foretold_as_their_study_ends(tmp_path: Path) -> None:
    """Of forces that mid-levels give; widths of yield stress and its exponent, asked within 20 %, found within 2 %."""
    spec = tmp_path / "growing.yaml"
    spec.write_text(GROWING)
    study = load_study(spec)
    with StudyFolder(tmp_path / "runs") as place:
        found = identify(Work(study, place, HERE, ignore, make_solver(study)), [10])
    one, both = found.combinations
    assert (one.conditions, both.conditions) == ((8.0,), (8.0, 11.0))
    assert [told.free for told in one.parameters] == [False, True]
    ended = stemcal.calibrate(study, out=tmp_path / "runs", workers=1, progress=False).inversion.certainty.intervals
    for told in both.parameters:
        low, high = ended[told.factor]
        assert told.expected_high - told.expected_low == pytest.approx(high - low, rel=0.1)


def test_a_run_that_fails_is_told(tmp_path: Path) -> None:
    class Failing(Linear):
        def solve(self, request: Request) -> Answer:
            return Answer("failed", reason="no_contact", message="it never touched")

    with pytest.raises(RunsFailed, match="it never touched"):
        foretold(tmp_path, Failing(), TESTS)


def test_a_screening_comes_first(tmp_path: Path) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(
        TWO_FACTORS + TARGETS.replace("rsm: {factors: [yield_stress, failure_strain]}\nscreen: {design: none}\n", "")
    )
    with StudyFolder(tmp_path / "runs") as place, pytest.raises(UsageError, match="stemcal screen"):
        identify(Work(load_study(path), place, HERE, ignore, FakeSolver()))


def test_a_product_of_powers_is_met_off_the_axes() -> None:
    """y = (1 + 0.2a)(1 − 0.1b): central differences and the products of slopes give it everywhere."""
    points = central_differences(2)
    surface = local_surface(points, (1.0 + 0.2 * points[:, 0]) * (1.0 - 0.1 * points[:, 1]), ["a", "b"])
    np.testing.assert_allclose(surface.predict(np.array([[1.0, 1.0], [-1.0, 1.0]])), [1.2 * 0.9, 0.8 * 0.9], rtol=1e-12)


def test_what_all_specimens_share_is_not_averaged_away() -> None:
    """One factor, told by a score of variance v that the machine moves by u, and by a force of variance V, slopes 1.

    w of N specimens tell wN/(v + wNu²), the others (1 − w)N/V: most where V v = (v + wNu²)², here w = 1/4.
    """
    surface = local_surface(central_differences(1), 100.0 + central_differences(1)[:, 0], ("a",))
    score = Measurable("cutting", 8.0, "curve_1", surface, 0.08, systematic={"stiffness": 0.8})
    force = Measurable("pull", 8.0, "pull_maximum_force", surface, 0.1)
    rows, even = divided([score, force], Region(np.full(1, -1e3), np.full(1, 1e3), None), 50)
    assert [row.share for row in rows] == pytest.approx([0.25, 0.75], abs=1e-3)
    assert even == pytest.approx(100.0 * (50 / (64 + 32) + 50 / 100) / (25 / (64 + 16) + 75 / 100), abs=0.01)


def test_d_optimal_shares_of_a_line() -> None:
    """A straight line over [−1, 1]: half at either end, none between (Atkinson, Donev and Tobias, 2007, chapter 9)."""
    x = np.linspace(-1.0, 1.0, 5)
    rows = np.stack([np.ones(5), x], axis=1)
    shares = d_optimal_shares(np.einsum("mi,mj->mij", rows, rows), np.zeros((2, 2)))
    np.testing.assert_allclose(shares, [0.5, 0.0, 0.0, 0.0, 0.5], atol=1e-3)


def test_what_is_known_needs_no_effort() -> None:
    """With M₀ = diag(4, 0) beside unit experiments: w₁ + 4 = w₂ would need w₁ < 0, so all goes to the second."""
    each = np.array([np.diag([1.0, 0.0]), np.diag([0.0, 1.0])])
    np.testing.assert_allclose(d_optimal_shares(each, np.diag([4.0, 0.0])), [0.0, 1.0], atol=1e-3)
