"""The lengths of cutting: spread edge versus a static solution, nonlocal failure, and a plate of known toughness."""

from __future__ import annotations

from functools import cache

import numpy as np
from test_nonlocal_mean import averaged
from test_notched_plate import work_to_failure
from test_plate import ANGLE, split, steady
from test_spread_edge import SPREAD, pressed, static_compliance, stiffness

from stemcal.fem.mesh import brick
from verification.case import Case, Topic


def edge() -> Topic:
    """Press the spread edge into an elastic block."""
    source = "static plane strain, bilinear quadrilaterals of 0.1 mm"
    exact = 1.0 / static_compliance()
    cases = [
        Case(f"elements of {share}: force over travel and length", stiffness(pressed(h)), exact, off, source, "N/mm²")
        for h, share, off in ((0.5, "a/2", 0.05), (0.25, "a/4", 0.015))
    ]
    over_nodes = stiffness(pressed(0.5))
    for shift, place in ((0.25, "between nodes and elements"), (0.5, "over elements")):
        slope = stiffness(pressed(0.5, shift))
        cases.append(Case(f"elements of a/2, edge {place}", slope, over_nodes, 0.01, "the edge over nodes", "N/mm²"))
    cases.append(
        Case("a tenth of the mass", stiffness(pressed(0.5, 0.0, 1.0e3)), over_nodes, 0.005, "mass scaling 10⁴", "N/mm²")
    )
    drift = pressed(0.5).drift_percent()
    cases.append(Case("elements of a/2: energy drift", drift, 0.0, 0.5, "energy", "%", relative=False))
    text = (
        f"A blade edge whose load is spread over a strip of half-width a = {SPREAD:g} mm is pressed into an elastic "
        "block. The slope of the force–travel curve must equal the stiffness of the block under the same "
        "pressure distribution. The reference stiffness is computed by an independent static finite element program. "
        "The slope of the force–travel curve must not depend on the position of the mesh relative to the edge or on "
        "mass scaling. With elements of size a/2 that have a single integration point, the computed stiffness of the "
        "block is too low."
    )
    return Topic("Spread edge", text, tuple(cases))


def failure() -> Topic:
    """Average a peak of strain, and pull a notched plate apart."""
    cases = [Case("strain of one slice: largest mean, ℓ = 1 mm", slice_mean(), 0.1 / np.sqrt(np.pi), 0.006, "Gauss")]
    fine, coarse = work_to_failure(0.25, 1.0), work_to_failure(0.5, 1.0)
    text = "notched plate, ℓ = 1 mm: work to failure, elements of 0.25 mm"
    cases.append(Case(text, fine, coarse, 0.06, "elements of 0.5 mm", "mJ"))
    text = (
        "With an internal length ℓ, an element fails when the weighted mean of the plastic strain in its neighbourhood "
        "reaches the failure strain. If only one slice of a bar is strained, the weighted mean along "
        "the bar must be proportional to exp(−x²/ℓ²), where x is the distance from the slice. The work done on a "
        "sharply notched plate up to the first element failure must be almost independent of the element size. If "
        f"failure is based on the local strain, the work decreases from {work_to_failure(0.5, 0.0):.1f} to "
        f"{work_to_failure(0.25, 0.0):.1f} mJ when the element size is halved from 0.5 to 0.25 mm."
    )
    return Topic("Nonlocal failure", text, tuple(cases))


def plate() -> Topic:
    """Split a plate of known toughness by parting."""
    cases = []
    for h, share, force, strain in ((0.2, "t", 0.09, 0.10), (0.1, "t/2", 0.05, 0.06)):
        found = split(h, 0.1)
        net = found.force - found.hourglass
        cases.append(Case(f"elements of {share}: force over toughness", net, steady(), force, "Atkins; Euler beam"))
        cases.append(Case(f"elements of {share}: strain over ε_f", found.strain, 1.0, strain, "criterion of parting"))
    text = (
        f"A thin, sharp, smooth wedge of {ANGLE:g}° splits a plate along a plastic layer of half thickness t between "
        "two elastic arms. All of the layer fails at the failure strain ε_f, so the toughness is 2 t σ_y ε_f. "
        "The force per thickness must equal the toughness plus the work of bending the arms' plastic faces and the "
        "kinetic energy of the arms. Hourglass energy (7 to 11 % of the toughness) is subtracted from the force. The "
        "strain is that of the layer behind the cut front."
    )
    return Topic("Plate of known toughness", text, tuple(cases))


@cache
def slice_mean() -> float:
    """Return the largest mean strain where one slice of 0.1 mm in a bar has strain 1."""
    strain = np.zeros(101)
    strain[50] = 1.0
    return float(averaged(brick((10.1, 1.0, 1.0), (101, 1, 1)), strain, 1.0).max())
