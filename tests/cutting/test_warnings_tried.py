"""Every warning of a run provoked, and gone once its remedy is followed."""

from dataclasses import replace
from typing import Any

from test_shipped import cut_of as shipped

from stemcal.cutting.parts import ShearTest
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import shear
from stemcal.fem.tools import Contact


def integrated(test: ShearTest, **how: Any) -> ShearTest:
    integration = replace(test.discretisation.integration, **how)
    return replace(test, discretisation=replace(test.discretisation, integration=integration))


def warned(result: CuttingResult, kind: str) -> bool:
    return any(warning.kind == kind for warning in result.warnings)


def test_a_stroke_that_is_too_short() -> None:
    assert warned(shear(shipped(duration=0.2)), "stroke_too_short")
    assert not shear(shipped()).warnings


def test_added_mass_that_carries_force() -> None:
    """4e5 with its time step, then a hundredth of the mass and a tenth of the step."""
    before, after = shear(shipped(mass_scaling=4.0e5)), shear(shipped(mass_scaling=4.0e3))
    assert warned(before, "inertia_in_force") and before.inertia_percent > 10.0
    assert not warned(after, "inertia_in_force") and after.inertia_percent < 1.0


def test_the_true_mass_at_the_speed_of_a_mower_is_no_doubt() -> None:
    """At 3 m/s the stem's own inertia has more than the limit of the force: that is the force of cutting there."""
    slow = shipped(mass_scaling=1.0)
    loading = replace(slow.loading, speed=3000.0, duration=0.833 / 3000.0)
    fast = integrated(replace(slow, loading=loading), time_step=None)
    window = replace(fast, discretisation=replace(fast.discretisation, filter_window=10e-3 * 1.667 / 3000.0))
    result = shear(window)
    assert result.inertia_percent > 5.0 and abs(result.added_mass_percent) < 1e-3
    assert not warned(result, "inertia_in_force")
    heavier = shear(integrated(window, mass_scaling=4.0))
    assert abs(heavier.added_mass_percent - 300.0) < 1e-3
    assert warned(heavier, "inertia_in_force")


def test_a_step_at_its_limit() -> None:
    """Stiff supports at the whole stable step, then half of both numbers."""
    whole = replace(shipped(), contact=Contact(0.15, 0.10, 0.0, 1.0, 0.5))
    before = shear(integrated(whole, safety=1.0))
    assert warned(before, "energy_drifts") and before.energy_drift_percent > 2.0
    step = whole.discretisation.integration.time_step
    assert step is not None
    after = shear(integrated(whole, safety=0.5, time_step=0.5 * step))
    assert not warned(after, "energy_drifts") and after.energy_drift_percent < 0.2


def test_elements_that_fold() -> None:
    before = shear(shipped(element_size=8.0 / 6.0))
    assert warned(before, "hourglass_energy") and before.hourglass_ratio_percent > 10.0
    assert not warned(shear(shipped()), "hourglass_energy")
