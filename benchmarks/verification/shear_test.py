"""The whole virtual shear test: mirror planes, energy balance, determinism."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from test_cutting import MATERIAL, coarse, coarse_test
from test_shipped_model import ODD, apart, run

from stemcal.cutting.parts import Discretisation, ShearTest, Symmetry
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import shear
from verification import figures
from verification.case import Case, Drawing, Topic

PHASES = {"edge over elements, 2 mm": ("elements", 2.0), "edge over nodes, 1 mm": ("nodes", 1.0)}


@cache
def real(symmetry: Symmetry) -> CuttingResult:
    """Return the shear test with elements of 1 mm, through the first failures."""
    how = Discretisation(symmetry=symmetry, edge_over="elements", stop_after_peak=False)
    return shear(ShearTest(MATERIAL, discretisation=how))


def symmetry() -> Topic:
    """Compare quarter and half models with the full one."""
    cases = []
    for name, phase in PHASES.items():
        full = coarse("none", *phase)
        for part in ("quarter", "half") if "nodes" in phase else ("half",):
            off = np.abs(coarse(part, *phase).history.force - full.history.force).max() / full.peak_force
            text = f"{name}: {part} model, largest difference of the curve over the peak"
            cases.append(Case(text, float(off), 0.0, 1e-6, "the full model", relative=False))
    text = "1 mm, through the first failures: peak of the half model"
    cases.append(Case(text, real("half").peak_force, real("none").peak_force, 0.005, "the full model", "N"))
    for name in ODD:
        off = apart(run(name, "none"), run(name, "quarter"))
        text = f"as shipped, {name}: quarter model, largest difference of the curve up to the peak over the peak"
        cases.append(Case(text, off, 0.0, 1e-4, "the full model", relative=False))
    text = (
        "The shear test has two mirror planes, so the force–travel curves of the quarter, half and full models must be "
        "equal except for rounding errors. In the simulations with element sizes of 1 and 2 mm, the blade edge is "
        "sharp, and failure is based on the local strain. After the first failure, rounding errors may determine which "
        "element fails next. Tolerances are therefore larger after the first failure. The cases labelled *as shipped* "
        "use the default model options (spread edge, nonlocal failure, graded mesh) with unusual parameter values. The "
        "element size in these cases is d/12, where d is the stem diameter."
    )
    return Topic("Full model and quarter model", text, tuple(cases))


def energy() -> Topic:
    """Check the balance of the shear test over its travel."""
    cases = []
    for name, tolerance in (("edge over elements, 2 mm", 1.0), ("edge over nodes, 1 mm", 1.5)):
        drift = coarse("half", *PHASES[name]).energy_drift_percent
        cases.append(Case(f"{name}: energy drift", drift, 0.0, tolerance, "energy", "%", relative=False))
    result = real("half")
    drift, kinetic = result.energy_drift_percent, result.kinetic_ratio_percent
    cases.append(Case("1 mm, published stroke (0.83 mm): energy drift", drift, 0.0, 1.0, "energy", "%", relative=False))
    text = "1 mm, published stroke (0.83 mm): kinetic over internal energy before failure"
    cases.append(Case(text, kinetic, 0.0, 5.0, "slow loading", "%", relative=False))
    for name in ODD:
        one = run(name, "none")
        text = f"as shipped, {name}: energy drift"
        cases.append(Case(text, one.energy_drift_percent, 0.0, 1.0, "energy", "%", relative=False))
    work = coarse().history
    force_times_way = float(np.sum(work.force * np.diff(work.travel, prepend=work.travel[0])))
    cases.append(
        Case("work of the blade, Σ force · displacement", work.external[-1], force_times_way, 0.002, "definition", "mJ")
    )
    text = (
        "The kinetic, internal, hourglass, eroded and contact energies must add up to the work done by the blade. The "
        "contact energy includes the energy dissipated by friction and damping. The energy drift is the largest error "
        "in the energy balance divided by the maximum work done by the blade. In the shear test with an element size "
        f"of 1 mm, the peak force is {result.peak_force:.1f} N at a travel of {result.peak_travel:.3f} mm. Up to the "
        f"peak force, the hourglass energy is at most {result.hourglass_ratio_percent:.1f} % of the internal energy."
    )
    caption = "Energies and error in the energy balance versus blade travel (half model, element size of 1 mm)."
    return Topic("Energy balance of the shear test", text, tuple(cases),
                 (Drawing("energy", figures.energy(result.history), caption),))  # fmt: skip


def determinism() -> Topic:
    """Run the same thing twice, and with two threads."""
    cases = []
    for name, test in (("half model", coarse_test()), ("full model, turned and shifted",
                       coarse_test("none", turn=0.3, shift=0.2))):  # fmt: skip
        text = f"{name}, run twice: values that differ"
        cases.append(Case(text, differing(shear(test), shear(test)), 0, 0.0, "same input, same bits", relative=False))
    one = coarse_test("none")
    how = one.discretisation
    two = replace(one, discretisation=replace(how, integration=replace(how.integration, threads=2)))
    text = "full model with one and two threads: values that differ"
    cases.append(Case(text, differing(shear(one), shear(two)), 0, 0.0, "fixed order of sums", relative=False))
    text = (
        "Repeated simulations with the same input must produce bit-identical force histories. Nodal forces are summed "
        "in a fixed order, regardless of the number of threads."
    )
    return Topic("Determinism", text, tuple(cases))


def differing(first: CuttingResult, second: CuttingResult) -> int:
    """Return how many values of two histories are not the same."""
    columns = vars(first.history)
    return int(sum(np.sum(column != getattr(second.history, name)) for name, column in columns.items()))
