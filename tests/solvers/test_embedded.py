"""What the embedded solver says of itself, without a simulation."""

from pathlib import Path

from stemcal.fem.kernels.plasticity import rate_factor
from stemcal.solvers import make_solver
from stemcal.solvers.embedded import Embedded, shear_test
from stemcal.solvers.protocol import Request
from stemcal.storage.canonical import digest
from stemcal.study.reading import load_study
from stemcal.study.rules.factors import wrong_levels

CONFIGS = Path(__file__).parents[2] / "configs"
CASES = Path(__file__).parents[1] / "cases" / "good"


def test_calibrated_values_belong_to_lengths() -> None:
    """Shares of the diameter and what they come to at 8 mm: 8/16, 8/8 and 8/4.5 mm."""
    solver = make_solver(load_study(CONFIGS / "wild-chrysanthemum-as-published.yaml"))
    assert solver.settings_that_matter(8.0) == {
        "element_size": "d/16 (0.5 mm)",
        "edge_spread": "d/9.5 (0.842 mm)",
        "internal_length": "d/4.5 (1.78 mm)",
    }
    thin = load_study(CONFIGS / "wild-chrysanthemum-as-published.yaml", solver={"elements_through_wall": 4})
    assert make_solver(thin).settings_that_matter(8.0)["elements_through_wall"] == "4"


def test_friction_as_a_factor() -> None:
    """µ at any speed, the middle of its range where no level is given; one below 0 is refused."""
    study = load_study(CASES / "friction.yaml")
    contact = shear_test(study, {"stem_friction": 0.3}, 8.0).contact
    assert (contact.static_friction, contact.dynamic_friction, contact.decay) == (0.3, 0.3, 0.0)
    assert shear_test(study, {}, 8.0).contact.static_friction == 0.25
    (wrong,) = wrong_levels(study, {**study.midlevels(), "stem_friction": -0.1})
    assert "stem_friction (-0.1) must not be below 0" in wrong


def test_a_stem_wider_than_the_blade_is_named() -> None:
    study = load_study(CONFIGS / "smoke.yaml")
    wide = "diameter: 1000.5 mm is not a plausible stem diameter; use at most 1000 mm"
    assert list(wrong_levels(study, study.midlevels(), 1000.5)) == [wide]
    assert list(wrong_levels(study, study.midlevels(), 90.0)) == []


def test_rate_dependence_switched_off() -> None:
    """C = 0 is no rate dependence for the kernels and for LS-DYNA alike."""
    study = load_study(CASES / "friction.yaml")
    material = shear_test(study, {}, 8.0).material
    assert material.strain_rate_c == 0.0 and study.parameters({})["strain_rate_c"] == 0.0
    assert rate_factor.py_func(1.0e6, material.strain_rate_c, 1.0) == 1.0


def test_a_solid_stem_has_no_wall_that_could_be_too_thick() -> None:
    study = load_study(CONFIGS / "smoke.yaml", specimen={"diameter_ratio": 0.0})
    assert list(wrong_levels(study, study.midlevels())) == []


def test_replicates_move_the_mesh_along_the_stem() -> None:
    """One position in each n-th of half an element, drawn from levels and diameter: equal runs stay one record."""
    study = load_study(CONFIGS / "smoke.yaml", solver={"replicates": 4})
    solver, levels = Embedded(study), study.midlevels()

    def shifts(stage: str = "rsm", **changed: float) -> list[float]:
        runs = [Request(stage, 0, levels | changed, 8.0, replicate=r) for r in (1, 2, 3, 4)]
        meshes = [solver._test(run).discretisation for run in runs]
        assert {mesh.symmetry for mesh in meshes} == {"half"}
        return [mesh.shift for mesh in meshes]

    found = shifts()
    assert [int(8.0 * shift) for shift in found] == [0, 1, 2, 3]
    assert shifts("validate") == found
    assert shifts(yield_stress=12.0) != found
    assert len({digest(solver.identity(Request("rsm", 0, levels, 8.0, replicate=r))) for r in (0, 1, 2, 3, 4)}) == 5
    assert study.solver.repeats == 4 and solver.settings_that_matter(8.0)["replicates"] == "4"
