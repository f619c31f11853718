"""Change one modelling choice at a time and print what it does to the forces of the paper's cases.

python benchmarks/model_choices.py             the centre of the design and Table 6's twelve runs
python benchmarks/model_choices.py --reference hourglass forms against the fully integrated element (17 cases)
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from cases import agreement, paper_cases, simulate_all, tests_of

from stemcal.cutting import ShearTest
from stemcal.fem.material import Hourglass

Change = Callable[[ShearTest], ShearTest]


def mesh(**changes: object) -> Change:
    """Return a change of the discretisation."""
    return lambda test: replace(test, discretisation=replace(test.discretisation, **changes))


def stepping(**changes: object) -> Change:
    """Return a change of the integration."""
    return lambda test: mesh(integration=replace(test.discretisation.integration, **changes))(test)


def contact(**changes: object) -> Change:
    """Return a change of the contact."""
    return lambda test: replace(test, contact=replace(test.contact, **changes))


def stiff(penalty: float, safety: float) -> Change:
    """Return a change to a contact so stiff that it needs a smaller share of the stable step."""
    return lambda test: stepping(safety=safety)(contact(penalty=penalty)(test))


def blade(**changes: object) -> Change:
    """Return a change of the blade."""
    return lambda test: replace(test, blade=replace(test.blade, **changes))


def one_bevel(test: ShearTest) -> ShearTest:
    """Grind the blade on one side only, which leaves half a model."""
    return mesh(symmetry="half")(blade(bevel="one")(test))


CHOICES: dict[str, Change] = {
    "as shipped": lambda test: test,
    "edge over nodes": mesh(edge_over="nodes"),
    "2 elements through the wall": mesh(through_wall=2),
    "4 elements through the wall": mesh(through_wall=4),
    "element size 1.33 mm": mesh(element_size=4 / 3),
    "element size 0.75 mm": mesh(element_size=0.75),
    "hourglass 0.003": mesh(hourglass=Hourglass("stiffness", 0.003)),
    "hourglass 0.03": mesh(hourglass=Hourglass("stiffness", 0.03)),
    "hourglass viscous 0.1": mesh(hourglass=Hourglass("viscous", 0.1)),
    "contact penalty 0.1": contact(penalty=0.1),
    "contact penalty 0.4": contact(penalty=0.4),
    "contact penalty 0.6": contact(penalty=0.6),
    "contact penalty 0.9": contact(penalty=0.9),
    "contact penalty 1, safety 0.5": stiff(1.0, 0.5),
    "contact penalty 2, safety 0.5": stiff(2.0, 0.5),
    "contact penalty 4, safety 0.45": stiff(4.0, 0.45),
    "contact damping 0.2": contact(damping=0.2),
    "no friction": contact(static_friction=0.0, dynamic_friction=0.0),
    "edge radius 0.05 mm": blade(edge_radius=0.05),
    "edge radius 0.3 mm": blade(edge_radius=0.3),
    "bevel on one side": one_bevel,
    "support fillet 0.5 mm": lambda test: replace(test, supports=replace(test.supports, fillet_radius=0.5)),
    "support fillet 2 mm": lambda test: replace(test, supports=replace(test.supports, fillet_radius=2.0)),
    "mass scaling 1e3": stepping(mass_scaling=1e3),
    "mass scaling 1e5": stepping(mass_scaling=1e5),
    "time step safety 0.5": stepping(safety=0.5),
    "filter 20 ms": mesh(filter_window=0.02),
    "filter 2 ms": mesh(filter_window=0.002),
}

HOURGLASS = {
    **{f"stiffness {c:g}": Hourglass("stiffness", c) for c in (0.003, 0.006, 0.01, 0.015, 0.02, 0.03, 0.06)},
    **{f"viscous {c:g}": Hourglass("viscous", c) for c in (0.03, 0.1)},
}


def print_choices() -> None:
    """Print one line per choice."""
    cases = paper_cases(["screen", "rsm"])
    centre = next(case for case in cases if case.table == "rsm")
    cases = [case for case in cases if case.table == "screen"]
    paper = np.array([case.paper for case in cases])
    shipped = None
    for name, change in CHOICES.items():
        results = simulate_all([change(test) for test in tests_of([centre, *cases])])
        force = np.array([result.peak_force for result in results])
        shipped = force if shipped is None else shipped
        print(
            f"{name:30s} centre {force[0]:6.1f} N; 12 runs {100 * np.mean(force[1:] / shipped[1:] - 1):+6.1f} % "
            f"against as shipped; against the paper: {agreement(force[1:], paper)}",
            flush=True,
        )


def print_reference() -> None:
    """Print how each hourglass form follows the fully integrated element."""
    tests = tests_of(paper_cases(["screen", "validate"]))
    full = simulate_all([mesh(element="full")(test) for test in tests])
    reference = np.array([result.peak_force for result in full])
    cost = sum(result.wall_seconds for result in full)
    print("fully integrated:", " ".join(f"{force:.1f}" for force in reference), "N", flush=True)
    for name, hourglass in HOURGLASS.items():
        results = simulate_all([mesh(hourglass=hourglass)(test) for test in tests])
        ratio = np.array([result.peak_force for result in results]) / reference
        print(
            f"{name:18s} mean ratio {ratio.mean():.3f}, mean |difference| {100 * np.abs(ratio - 1).mean():5.1f} %, "
            f"largest {100 * np.abs(ratio - 1).max():5.1f} %, hourglass/internal at most "
            f"{max(result.hourglass_ratio_percent for result in results):5.1f} %, "
            f"cost 1/{cost / sum(result.wall_seconds for result in results):.0f}",
            flush=True,
        )


if __name__ == "__main__":
    print_reference() if "--reference" in sys.argv else print_choices()
