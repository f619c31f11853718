"""The same shear test with the mesh in other places, and what the mean over them says.

Erosion takes away whole elements, so the force depends on where the nodes lie under the edge.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stemcal.cutting.parts import ShearTest
from stemcal.cutting.result import CuttingResult


def in_phases(test: ShearTest, count: int) -> tuple[ShearTest, ...]:
    """Return the test with the mesh shifted along the stem to `count` places; one phase is the test as it is.

    A shift by s elements mirrors one by −s, so the midpoints of `count` equal parts of [0, ½] stand for all.
    """
    return (test,) if count == 1 else tuple(placed(test, (i + 0.5) / (2 * count)) for i in range(count))


def placed(test: ShearTest, shift: float) -> ShearTest:
    """Return the half model with its mesh shifted along the stem by a share of an element, 0 to ½."""
    return replace(test, discretisation=replace(test.discretisation, symmetry="half", shift=shift))


def mean_over_phases(results: Sequence[CuttingResult]) -> CuttingResult:
    """Return the first result with the mean peak force of all, their standard deviation, and the worst of each check.

    Curves stay those of the first phase.
    """
    if len(results) == 1:
        return results[0]
    peaks = np.array([result.peak_force for result in results])
    return replace(
        results[0],
        peak_force=float(peaks.mean()),
        peak_force_raw=float(np.mean([result.peak_force_raw for result in results])),
        peak_sd=float(peaks.std(ddof=1)),
        phase_peaks=tuple(float(peak) for peak in peaks),
        steps=sum(result.steps for result in results),
        wall_seconds=sum(result.wall_seconds for result in results),
        energy_drift_percent=max(result.energy_drift_percent for result in results),
        kinetic_ratio_percent=max(result.kinetic_ratio_percent for result in results),
        hourglass_ratio_percent=max(result.hourglass_ratio_percent for result in results),
        inertia_percent=max(result.inertia_percent for result in results),
        contact_energy_percent=min(result.contact_energy_percent for result in results),
        stroke_was_enough=all(result.stroke_was_enough for result in results),
        stroke_end=next((r.stroke_end for r in results if not r.stroke_was_enough), results[0].stroke_end),
        warnings=tuple(dict.fromkeys(warning for result in results for warning in result.warnings)),
    )
