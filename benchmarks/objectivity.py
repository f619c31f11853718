"""Sensitivity of the peak force to mesh and method, with the defaults of the shipped study.

python benchmarks/objectivity.py phases        ten mesh positions along the stem, at the centre of the design
python benchmarks/objectivity.py edge          the edge over a row of nodes and over a row of elements
python benchmarks/objectivity.py sizes         elements of d/12 to d/40, the same lengths, three points and stems (slow)
python benchmarks/objectivity.py grading       graded meshes and added mass versus a uniform mesh without added mass
python benchmarks/objectivity.py contact       a quarter of and four times the penalty of the supports
python benchmarks/objectivity.py choices       friction, radii, bevel, wall, filter: one at a time
python benchmarks/objectivity.py blades        edge angle and radius, with elements of d/16 and d/24; single bevel
python benchmarks/objectivity.py lengths       peak force versus edge spread and internal length
python benchmarks/objectivity.py cut           work until the break and over the whole stroke versus element size
python benchmarks/objectivity.py precision     elements in single precision versus double precision, all 32 cases
python benchmarks/objectivity.py crops         other crops: mesh positions, d/24, hourglass stiffness (slow)
python benchmarks/objectivity.py even          graded meshes versus a uniform mesh, the 15 points of the design (slow)

Without a name, all rows except the slow ones are run.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from cases import Case, agreement, paper_cases, simulate_all, tests_of
from contact_energy import SOFT, STRONG
from contact_energy import centre as centre_of_sizes
from contact_energy import crops as tests_of_crops

from stemcal.cutting.build import build
from stemcal.cutting.parts import ShearTest
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import placed, shear
from stemcal.fem.stepper import simulate

CALIBRATED = Case("validate", {"yield_stress": 17.96, "failure_strain": 0.0387, "strain_rate_c": 87.27}, 8.0, 169.0)


def centre() -> list[ShearTest]:
    """Return the centre of the design and the paper's calibrated point, 8 mm."""
    return tests_of([paper_cases(["rsm"])[0], CALIBRATED])


def mesh(test: ShearTest, **changes: object) -> ShearTest:
    """Return a test with a change of its discretisation."""
    return replace(test, discretisation=replace(test.discretisation, **changes))  # type: ignore[arg-type]


def told(results: list[CuttingResult]) -> str:
    """Return the forces and what the runs say of themselves."""
    forces = ", ".join(f"{result.peak_force:.1f}" for result in results)
    drift = max(result.energy_drift_percent for result in results)
    return f"{forces} N ({results[0].elements} elements, {results[0].steps} steps, drift at most {drift:.2f} %)"


def scatter(results: list[CuttingResult]) -> str:
    """Return mean, standard deviation and range."""
    force = np.array([result.peak_force for result in results])
    share = 100.0 * force.std(ddof=1) / force.mean()
    return f"{force.mean():.1f} N, SD {share:.2f} %, {force.min():.1f} to {force.max():.1f} N"


def at_places(test: ShearTest, count: int) -> list[ShearTest]:
    """Return the test with its mesh at so many places along the stem."""
    return [placed(test, (i + 0.5) / (2 * count)) for i in range(count)]


def phases() -> None:
    """Print the scatter over ten phases of the mesh along the stem."""
    for test in centre():
        print("ten phases:", scatter(simulate_all(at_places(test, 10))), flush=True)


def edge() -> None:
    """Print the force with the edge over nodes and over elements."""
    for place in ("nodes", "elements"):
        tests = [mesh(test, symmetry="half", edge_over=place) for test in centre()]
        print(f"edge over {place}:", told(simulate_all(tests)), flush=True)


def sizes() -> None:
    """Print the force of three materials and three other stems over the element size; the time step follows it."""
    for name, changes in (("centre", {}), ("soft", SOFT), ("strong", STRONG)):
        for parts in (12, 16, 20, 24, 32, 40):
            print(f"{name}, d/{parts}:", told([shear(centre_of_sizes(parts, **changes))]), flush=True)
    for diameter, ratio, changes in ((5.3, 0.25, {}), (13.0, 0.55, STRONG), (8.0, 0.0, {})):
        for parts in (16, 24, 32):
            test = of_diameter(centre_of_sizes(16, **changes), diameter, ratio)
            print(f"{diameter:g} mm, ratio {ratio:g}, d/{parts}:", told([shear(of_size(test, parts))]), flush=True)


def of_diameter(test: ShearTest, diameter: float, ratio: float) -> ShearTest:
    """Return a test of a stem of another diameter and bore, the model's lengths in proportion."""
    k = diameter / test.stem.outer_diameter
    return replace(
        test,
        stem=replace(test.stem, outer_diameter=diameter, diameter_ratio=ratio),
        blade=replace(test.blade, edge_spread=k * test.blade.edge_spread),
        material=replace(test.material, internal_length=k * test.material.internal_length),
    )


def of_size(test: ShearTest, parts: float) -> ShearTest:
    """Return a test with elements of so many to the diameter."""
    step = test.discretisation.integration.time_step
    how = replace(test.discretisation.integration, time_step=step and step * 16.0 / parts)
    return mesh(test, element_size=test.stem.outer_diameter / parts, integration=how)


def cut() -> None:
    """Print the work of the blade until the stem breaks and over the whole stroke, and the force in its last tenth."""
    for parts in (12.0, 16.0, 24.0):
        results = simulate_all([mesh(of_size(test, parts), stop_after_peak=False) for test in centre()])
        for result in results:
            curve = result.history
            broke = int(np.searchsorted(curve.travel, result.break_travel or np.inf))
            last = curve.force_filtered[-len(curve.time) // 10 :].mean()
            until = f"{curve.external[: broke + 1][-1]:.1f} mJ until the break at {result.break_travel or 0.0:.3f} mm"
            whole = f"{curve.external[-1]:.1f} mJ over {curve.travel[-1]:.3f} mm"
            print(f"d/{parts:g}: {until}, {whole}, at last {last:.1f} N", flush=True)


def grading() -> None:
    """Print the force on graded meshes and with added mass, one at a time."""
    heavy = centre()[0].discretisation.integration
    light = replace(heavy, time_step=None)
    changes: dict[str, dict[str, object]] = {
        "as shipped": {},
        "even mesh": {"coarsening": 1.0, "coarsening_around": 1.0},
        "even around": {"coarsening_around": 1.0},
        "coarsening 3": {"coarsening": 3.0},
        "coarsening 7 and 3": {"coarsening": 7.0, "coarsening_around": 3.0},
        "no mass added to small elements": {"integration": light},
        "mass scaling 1e3, no mass added": {"integration": replace(light, mass_scaling=1.0e3)},
        "time step safety 0.45": {"integration": replace(heavy, safety=0.45, time_step=2.0e-5)},
    }
    for name, change in changes.items():
        print(f"{name}:", told(simulate_all([mesh(test, **change) for test in centre()])), flush=True)


def contact() -> None:
    """Print the force with the supports' penalty changed; the edge has no stiffness to change."""
    for penalty, safety in ((0.25, 0.9), (0.0625, 0.9), (1.0, 0.45)):
        tests = []
        for test in centre():
            how = replace(test.discretisation.integration, safety=safety)
            changed = replace(test, contact=replace(test.contact, penalty=penalty))
            tests.append(mesh(changed, integration=how))
        print(f"penalty {penalty:g}:", told(simulate_all(tests)), flush=True)


def choices() -> None:
    """Print the forces with something that the paper leaves open changed."""
    changes: dict[str, Callable[[ShearTest], ShearTest]] = {
        "4 elements through the wall": lambda test: mesh(test, through_wall=4),
        "6 elements through the wall": lambda test: mesh(test, through_wall=6),
        "no friction": lambda test: replace(
            test, contact=replace(test.contact, static_friction=0.0, dynamic_friction=0.0)
        ),
        "edge radius 0.05 mm": lambda test: replace(test, blade=replace(test.blade, edge_radius=0.05)),
        "edge radius 0.3 mm": lambda test: replace(test, blade=replace(test.blade, edge_radius=0.3)),
        "bevel on one side": lambda test: mesh(replace(test, blade=replace(test.blade, bevel="one")), symmetry="half"),
        "fillet 0.5 mm": lambda test: replace(test, supports=replace(test.supports, fillet_radius=0.5)),
        "fillet 2 mm": lambda test: replace(test, supports=replace(test.supports, fillet_radius=2.0)),
        "filter 2 ms": lambda test: mesh(test, filter_window=0.002),
        "filter 20 ms": lambda test: mesh(test, filter_window=0.02),
    }
    for name, change in changes.items():
        print(f"{name}:", told(simulate_all([change(test) for test in centre()])), flush=True)


def blades() -> None:
    """Print the force over edge angle and radius at the centre, and how an edge ground on one side pushes sideways."""
    test = centre()[0]
    changes = [{"edge_angle": angle} for angle in (15.0, 25.0, 37.5, 60.0)]
    changes += [{"edge_radius": radius} for radius in (0.02, 0.5)]
    for change in changes:
        blade = replace(test.blade, **change)
        tests = [of_size(replace(test, blade=blade), parts) for parts in (16.0, 24.0)]
        print(f"{change}, d/16 and d/24:", told(simulate_all(tests)), flush=True)
    for bevel in ("both", "one"):
        half = mesh(replace(test, blade=replace(test.blade, bevel=bevel)), symmetry="half")
        history = simulate(build(half), 0.6 * half.loading.duration)
        late = history.time > 0.3 * half.loading.duration
        sideways = 100.0 * np.abs(history.force[late, 0, 0]).mean() / history.force[late, 0, 2].mean()
        print(f"bevel {bevel}: {sideways:.3f} % of the force goes sideways", flush=True)


def lengths() -> None:
    """Print the forces of Table 6 and 13 over edge spread and internal length, and how they agree with the paper's."""
    cases = paper_cases(["screen", "validate"])
    paper = np.array([case.paper for case in cases])
    for spread, internal in ((9.5, 4.5), (9.5, 5.0), (9.5, 4.0), (10.5, 4.5), (8.5, 4.5)):
        tests = [
            replace(
                test,
                blade=replace(test.blade, edge_spread=test.stem.outer_diameter / spread),
                material=replace(test.material, internal_length=test.stem.outer_diameter / internal),
            )
            for test in tests_of(cases)
        ]
        force = np.array([result.peak_force for result in simulate_all(tests)])
        said = [
            f"Table {n}: {agreement(force[part], paper[part])}" for n, part in ((6, slice(12)), (13, slice(12, 17)))
        ]
        print(f"edge spread d/{spread:g}, internal length d/{internal:g}: {'; '.join(said)}", flush=True)


def precision() -> None:
    """Print how far forces and energies in mixed precision are from those in double."""
    tests = tests_of(paper_cases())
    exact = [replace(test.discretisation.integration, precision="double") for test in tests]
    double = simulate_all([mesh(test, integration=how) for test, how in zip(tests, exact, strict=True)])
    mixed = simulate_all(tests)
    force = max(abs(a.peak_force / b.peak_force - 1.0) for a, b in zip(mixed, double, strict=True))
    print(f"peak force of {len(tests)} cases: at most {100.0 * force:.2g} % apart", flush=True)
    for name in ("internal", "hourglass", "external", "kinetic"):
        until, whole = 0.0, 0.0
        for a, b in zip(mixed, double, strict=True):
            one, other = getattr(a.history, name), getattr(b.history, name)
            rows = min(len(one), len(other))
            apart = abs(one[:rows] - other[:rows]) / other.max()
            peak = int(b.history.force_filtered.argmax())
            until, whole = max(until, apart[: peak + 1].max()), max(whole, apart.max())
        said = f"at most {100.0 * until:.2g} % of its largest apart until the peak, {100.0 * whole:.2g} % at any time"
        print(f"{name} energy: {said}", flush=True)


def even() -> None:
    """Print the force on graded meshes over that on an even one, at the points of the design."""
    tests = tests_of(paper_cases(["rsm"]))
    reference = None
    for along, around in ((1.0, 1.0), (6.0, 2.0), (7.0, 3.0)):
        results = simulate_all([mesh(test, coarsening=along, coarsening_around=around) for test in tests])
        force = np.array([result.peak_force for result in results])
        reference = force if reference is None else reference
        said = f"{agreement(force, reference)}, largest {100 * np.abs(force / reference - 1).max():.1f} %"
        print(f"coarsening {along:g} and {around:g} ({results[0].elements} elements): {said}", flush=True)


def crops() -> None:
    """Print for the middle of each crop's ranges how mesh, supports and hourglass stiffness move it."""
    for name, test in tests_of_crops().items():
        if "middle" not in name:
            continue
        softer = replace(test, contact=replace(test.contact, penalty=0.25))
        variants = [
            test,
            of_size(test, 24.0),
            mesh(test, hourglass=0.02),
            softer,
            mesh(softer, coarsening=6.0, coarsening_around=2.0),
        ]
        here, finer, other, soft, shipped = (result.peak_force for result in simulate_all(variants))
        print(
            f"{name}: {here:.1f} N, d/24 {finer / here:.3f}, coefficient 0.02 {other / here:.3f}; "
            f"penalty 0.25: {soft:.1f} N, with the shipped study's mesh {shipped:.1f} N; "
            f"five phases: {scatter(simulate_all(at_places(test, 5)))}",
            flush=True,
        )


ROWS = {
    "phases": phases, "edge": edge, "sizes": sizes, "grading": grading, "contact": contact,
    "choices": choices, "blades": blades, "lengths": lengths, "cut": cut, "precision": precision,
    "crops": crops, "even": even,
}  # fmt: skip

if __name__ == "__main__":
    for name in sys.argv[1:] or [row for row in ROWS if row not in ("sizes", "crops", "even")]:
        ROWS[name]()
