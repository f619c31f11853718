"""Laboratory tests in a spec: their responses, what is fitted, what a run does."""

from dataclasses import replace
from pathlib import Path

import pytest

from stemcal.cutting.checks import buckles, hourglass_energy
from stemcal.laboratory.axial import Axial
from stemcal.laboratory.radial_compression import RadialCompression, RadialSection
from stemcal.laboratory.three_point_bending import ThreePointBending
from stemcal.solvers.embedded import Embedded, shear_test
from stemcal.solvers.laboratory_runs import laboratory_test, measured_at
from stemcal.solvers.protocol import Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.field_types import Length

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(CONFIGS / "three-tests.yaml")


def test_what_is_measured_is_a_response_of_the_study(study: Study) -> None:
    assert [(one.name, one.label, one.unit) for one in study.naming.responses] == [
        ("force", "Maximum force", "N"),
        ("bending_slope", "Bending slope", "N/mm"),
        ("pull_force", "Pull maximum force", "N"),
        ("pull_work", "Pull work", "mJ"),
    ]
    assert study.invert.responses == ("response", "bending_slope", "pull_force", "pull_work")
    assert study.naming.is_force_on_stems
    assert [study.test_of(name) for name in study.invert.responses] == ["", "bending", "pull", "pull"]


def test_each_mean_has_its_own_number_of_specimens(study: Study) -> None:
    target = study.targets.means[0]
    changed = target.model_copy(update={"n": 4})
    assert changed.count_of("response") == 4
    assert changed.count_of("pull_work") == 10


def test_a_spec_without_tests_is_one_cutting_test() -> None:
    plain = load_study(CONFIGS / "smoke.yaml")
    assert plain.naming.is_cutting
    assert plain.tests == ()
    assert "laboratory" not in Embedded(plain).identity(Request("screen", 0, plain.midlevels(), 8.0))


def test_a_piece_is_of_the_stem_that_is_cut(study: Study) -> None:
    """Lengths that are shares of the diameter follow it; the material is that of the levels."""
    levels = {**study.midlevels(), "yield_stress": 13.0}
    bending, pull = (laboratory_test(one, shear_test(study, levels, 10.0)) for one in study.tests)
    assert bending.kind == ThreePointBending(56.0, 3.0, 3.0)
    assert bending.stem.length == pytest.approx(67.2)
    assert bending.discretisation.element_size == pytest.approx(10.0 / 12.0)
    assert bending.material.yield_stress == 13.0
    assert bending.loading.speed * bending.loading.duration == pytest.approx(1.2)
    careful = study.model_copy(update={"solver": study.solver.model_copy(update={"time_step_safety": 0.4})})
    assert laboratory_test(study.tests[0], shear_test(careful, levels, 10.0)).discretisation.integration.safety == 0.4
    assert pull.kind == Axial("tension", "lubricated")
    assert pull.stem.length == 20.0
    ring = RadialSection(name="ring", stroke=study.tests[1].stroke)
    found = laboratory_test(ring, shear_test(study, levels, 9.6))
    assert found.kind == RadialCompression()
    assert (found.discretisation.element_size, found.discretisation.through_wall) == (pytest.approx(0.15), 8)


def test_a_run_does_the_tests_that_are_measured_at_its_diameter(study: Study) -> None:
    assert [test.name for test in measured_at(study, 8.0)] == ["bending", "pull"]
    assert measured_at(study, 9.0) == ()


def test_what_determines_a_test_is_in_the_key(study: Study) -> None:
    request = Request("rsm", 0, study.midlevels(), 8.0)
    before = Embedded(study).identity(request)["laboratory"]
    bending = study.tests[0].model_copy(update={"radius": 4.0})
    after = Embedded(study.model_copy(update={"tests": (bending, *study.tests[1:])})).identity(request)["laboratory"]
    assert [one["name"] for one in before] == ["bending", "pull"]
    assert before[0] != after[0]
    assert before[1] == after[1]


def test_cost_counts_the_tests(study: Study) -> None:
    request = Request("rsm", 0, study.midlevels(), 8.0)
    alone = study.model_copy(update={"tests": ()})
    assert Embedded(study).cost_estimate(request) > 2.0 * Embedded(alone).cost_estimate(request)


def test_an_answer_has_the_responses_of_all_tests(study: Study) -> None:
    """The second test alone: force of cutting and two responses of the pull."""
    answer = Embedded(study.model_copy(update={"tests": study.tests[1:]})).solve(
        Request("rsm", 0, study.midlevels(), 8.0)
    )
    assert answer.ok, answer.message
    assert set(answer.details["responses"]) == {"pull_force", "pull_work"}
    area = 0.25 * 3.14159 * 64.0 * (1.0 - 0.41**2)
    assert answer.details["responses"]["pull_force"] == pytest.approx(15.0 * area, rel=0.03)


def test_a_slope_needs_no_maximum(study: Study) -> None:
    from stemcal.laboratory.perform import perform
    from stemcal.solvers.laboratory_runs import relevant_warnings

    pull = study.tests[1].model_copy(update={"stroke": Length(0.1)})
    result = perform(laboratory_test(pull, shear_test(study, study.midlevels(), 8.0)))
    assert [warning.kind for warning in result.warnings] == ["maximum_not_passed"]
    result = replace(result, warnings=(*result.warnings, buckles(40.0), hourglass_energy(20.0)))
    assert [warning.kind for warning in relevant_warnings(result, ["slope"])] == ["hourglass_energy"]
    assert len(relevant_warnings(result, ["slope", "work"])) == 3
