"""What a design run with coarse elements and corrected by a few fine runs costs, and how far off its surface is.

python benchmarks/coarse_and_fine.py [folder]

A stem of 8 mm with two unknown factors, a composite of nine different runs: all with elements of d/16, and all with
elements of d/10 of which 3, 4, 5 or 7 are run with d/16 too (`rsm: {coarse: {element_size: d/10, fine_runs: n}}`). Cost
is counted in elements times steps. Tells how far both surfaces are apart over the region, and the force that a
simulation with d/16 gives at either solution. A minute or two on two cores; a folder given keeps its runs.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import stemcal
from stemcal import workflow
from stemcal.executors.local import LocalExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.reading import load_study

SPEC = """\
schema_version: 1
name: coarse-and-fine
factors:
  - {name: yield_stress, unit: MPa, low: 10, high: 24}
  - {name: failure_strain, low: 0.02, high: 0.05}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8}
specimen: {length: 30 mm}
loading: {duration: 0.75 s}
solver: {kind: embedded, outputs: 200}
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 8 mm, force: 120 N}
"""
FINE = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"


def cost(folder: StudyFolder, keys: Iterable[str]) -> float:
    """Return elements times steps of these runs, in millions."""
    told = [record["details"] for key in set(keys) if (record := folder.load(key)) is not None]
    return sum(float(run["elements"] * run["steps"]) for run in told) / 1e6


def surface_of(place: Path, spec: str) -> tuple[SurfaceResult, dict[str, float], float]:
    """Return the surface of a study, its solution, and what its runs have cost."""
    path = place / "study.yaml"
    path.write_text(SPEC + spec, encoding="utf-8")
    study, folder = load_study(path), StudyFolder(place / "out")
    surface = workflow.fit_surface(study, folder, LocalExecutor(2))
    found = workflow.invert(study, folder)
    return surface, found.parameters, cost(folder, [outcome.key for _, outcome in surface.runs()])


def main() -> None:
    """Print a row per number of fine runs."""
    place = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp())
    place.mkdir(parents=True, exist_ok=True)
    fine, solution, whole = surface_of(place, FINE)
    grid = np.array([[a, b] for a in np.linspace(-1, 1, 9) for b in np.linspace(-1, 1, 9)])
    truth = fine.fitted.predict(grid)

    def simulated(levels: dict[str, float]) -> float:
        return stemcal.simulate(load_study(place / "study.yaml"), **levels).peak_force

    print("runs                     cost   saved  surface apart, %     d/16 at the solution of 120 N", flush=True)
    print(f"all with d/16           {whole:5.1f}                          {simulated(solution):8.1f} N", flush=True)
    for count in (3, 4, 5, 7):
        coarse = FINE.replace("}\n", f", coarse: {{element_size: d/10, fine_runs: {count}}}}}\n")
        surface, solution, spent = surface_of(place, coarse)
        apart = 100.0 * (surface.fitted.predict(grid) / truth - 1.0)
        told = f"{np.sqrt(np.mean(apart**2)):.1f} rms, {np.abs(apart).max():.1f} largest"
        print(
            f"d/10, {count} with d/16 too   {spent:5.1f}   {100 * (1 - spent / whole):3.0f} %   {told}"
            f"   {simulated(solution):8.1f} N   factor {surface.coarse.factor if surface.coarse else 1.0:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
