"""Every built-in stage, kind of solver, design and laboratory test passes the checks that other packages can use."""

from pathlib import Path

from stemcal.doe.designs import SURFACES
from stemcal.stages.stage import STAGES
from stemcal.study.model.laboratory_kind import TESTS
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.testing import Check, parametrize_with_checks

SPECS = Path(__file__).parent / "specs"
DECK = SPECS.parents[1] / "solvers" / "stand_in_for_lsdyna.yaml"  # its program has to be in the folder of the spec
OF_THE_EMBEDDED = ("every_response_is_answered", "interrupted_runs_equal_uninterrupted_ones", "nan_is_a_failed_run")
LATER = ("invert", "refine", "validate")  # stages that need several others


@parametrize_with_checks(SURFACES.built_in, slow=["latin-hypercube"])
def test_designs(check: Check) -> None:
    check()


@parametrize_with_checks(
    [(kind, DECK if kind.name == "deck" else SPECS / f"{kind.name}.yaml") for kind in SOLVERS.built_in],
    slow=[f"embedded-{name}" for name in OF_THE_EMBEDDED],
)
def test_solvers(check: Check) -> None:
    check()


@parametrize_with_checks(
    [(stage, SPECS / ("goal.yaml" if "goal" in stage.reads else "python.yaml")) for stage in STAGES.built_in],
    slow=[f"{name}-interrupted_stage_equals_uninterrupted_one" for name in LATER],
)
def test_stages(check: Check) -> None:
    check()


@parametrize_with_checks(
    [(kind, SPECS / "embedded.yaml") for kind in TESTS.built_in], slow=["responses_are_positive_and_repeatable"]
)
def test_laboratory_tests(check: Check) -> None:
    check()
