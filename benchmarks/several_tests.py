"""Identifiability of the parameters of one material by several laboratory tests.

python benchmarks/several_tests.py [laboratories]

The study is configs/three-tests.yaml with additional radial and axial compression. Its surfaces are fitted once (20
runs, some minutes on one core). Synthetic laboratories are then drawn at the known material (1000 MPa, 15 MPa, 0.03):
ten specimens per test, with 6 % scatter about the responses of the surfaces. Each laboratory is fitted as in a study. A
line per combination of tests gives the coverage of the 95 % interval of each parameter (200 laboratories by default,
sampling error ± 3 %) and, for a quarter of the laboratories, the mean width in % of the true value.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from interval_coverage import holds

from stemcal.doe.calibration.confidence_intervals import profiles_of
from stemcal.doe.calibration.likelihood import Fit, fit
from stemcal.doe.calibration.observations import Observation
from stemcal.doe.calibration.region import Region
from stemcal.doe.coding import Array
from stemcal.doe.regression.surface import Surface
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fitting import fitted_surfaces, measured_means
from stemcal.stages.rsm.analysis import rsm
from stemcal.study.reading import load_study

SPEC = Path(__file__).parents[1] / "configs" / "three-tests.yaml"
SEED, LABORATORIES, SPECIMENS, VARIATION = 27, 200, 10, 0.06
TRUTH = {"elastic_modulus": 1000.0, "yield_stress": 15.0, "failure_strain": 0.03}
FURTHER = """
  - name: squeeze
    kind: radial-compression
    length: 4 mm
    stroke: 1 mm
  - name: crush
    kind: axial-compression
    ends: lubricated
    stroke: 1 mm
"""
ROWS = """
  - {test: squeeze, diameter: 8 mm, slope: 551 N/mm, force: 132 N, sd: {slope: 33 N/mm, force: 8 N}, n: 10}
  - {test: crush, diameter: 8 mm, slope: 2646 N/mm, work: 373 mJ, sd: {slope: 159 N/mm, work: 22 mJ}, n: 10}
"""
COMBINATIONS = (
    ("cutting",),
    ("cutting", "bending"),
    ("cutting", "bending", "squeeze"),
    ("cutting", "bending", "crush"),
    ("cutting", "bending", "pull"),
)


def main(laboratories: int, folder: Path) -> None:
    """Print a line for each combination."""
    folder.mkdir(parents=True, exist_ok=True)
    spec = folder / "tests.yaml"
    spec.write_text(spec_text(), "utf-8")
    study = load_study(spec)
    surface = rsm(study, StudyFolder(folder))
    means, fitted = measured_means(study), fitted_surfaces(study, surface)
    region, truth = surface.region, surface.scales.to_coded([list(TRUTH.values())])[0]
    half_steps = np.array(surface.scales.half_step)
    for tests in COMBINATIONS:
        chosen = [i for i, mean in enumerate(means) if (study.test_of(mean.response) or "cutting") in tests]
        surfaces, kinds = [fitted[i] for i in chosen], [means[i].response for i in chosen]
        random = np.random.default_rng(SEED)
        drawn = [laboratory(surfaces, kinds, region, truth, random) for _ in range(laboratories)]
        held = np.mean([holds(found, truth) for found in drawn], axis=0)
        width = np.mean([widths(found) for found in drawn[: laboratories // 4]], axis=0) * half_steps
        print(told(tests, width, held), flush=True)


def spec_text() -> str:
    """Return the study of configs/three-tests.yaml and additional radial and axial compression."""
    return SPEC.read_text("utf-8").replace("\ntargets:\n", FURTHER + "\ntargets:" + ROWS)


def laboratory(
    surfaces: Sequence[Surface], kinds: Sequence[str], region: Region, truth: Array, random: np.random.Generator
) -> Fit:
    """Draw a laboratory and return its fit."""
    observations = []
    for surface, kind in zip(surfaces, kinds, strict=True):
        true = float(surface.predict(truth[None])[0])
        broken = true * (1.0 + VARIATION * random.standard_normal(SPECIMENS))
        observations.append(Observation(surface, float(broken.mean()), float(broken.std(ddof=1)), SPECIMENS, kind))
    return fit(observations, region)


def widths(fitted: Fit) -> Array:
    """Return how wide the interval of each parameter is, coded."""
    return np.array([found.high - found.low for found in profiles_of(fitted)])


def told(tests: Sequence[str], width: Array, held: Array) -> str:
    """Return the line of a combination."""
    parts = [
        f"{name} {100 * wide / true:5.1f} % wide, held {100 * share:5.1f} %"
        for (name, true), wide, share in zip(TRUTH.items(), width.tolist(), held.tolist(), strict=True)
    ]
    return f"{' + '.join(tests):32s} " + "; ".join(parts)


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else LABORATORIES, Path("runs") / "several-tests")
