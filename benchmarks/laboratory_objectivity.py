"""Mesh sensitivity of the simulated laboratory tests other than cutting.

python benchmarks/laboratory_objectivity.py [test ...]

The tests are those of configs/three-tests.yaml and of benchmarks/several_tests.py (bending, pull, squeeze, crush), and
axial compression and tension between held ends (press, clamp), with the known material. A line per response gives, in
%: the standard deviation over four mesh positions (full model rotated by quarters of an element), the change from a
layer of nodes to a layer of elements in the middle, the change with half the element size, and the difference between
quarter and full model. The script takes some minutes on one core, mostly for bending.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from several_tests import TRUTH, spec_text

from stemcal.laboratory.build import LaboratoryTest
from stemcal.laboratory.perform import perform
from stemcal.solvers.embedded import shear_test
from stemcal.solvers.laboratory_runs import laboratory_test
from stemcal.study.reading import load_study

TURNS = (0.0, 0.25, 0.5, 0.75)
MORE = """
  - {name: press, kind: axial-compression, ends: held, stroke: 1 mm}
  - {name: clamp, kind: axial-tension, ends: held, stroke: 1.2 mm}
"""


def main(names: list[str]) -> None:
    """Print the lines of each test."""
    with TemporaryDirectory() as folder:
        spec = Path(folder) / "tests.yaml"
        spec.write_text(spec_text().replace("\ntargets:\n", MORE + "\ntargets:\n"), "utf-8")
        study = load_study(spec)
    sheared = shear_test(study, TRUTH, 8.0)
    for section in study.tests:
        if not names or section.name in names:
            test = laboratory_test(section, sheared)
            own = answers(test)
            full = [answers(test, symmetry="none", turn=turn) for turn in TURNS]
            between = answers(test, symmetry="none", edge_over="elements")
            finer = answers(test, element_size=0.5 * test.discretisation.element_size, through_wall=finer_wall(test))
            for name in own:
                places = np.array([one[name] for one in full])
                spread = 100.0 * places.std(ddof=1) / places.mean()
                shifted = 100.0 * (between[name] / full[0][name] - 1.0)
                halved, mirrored = (100.0 * (own[name] / other[name] - 1.0) for other in (finer, full[0]))
                measured = "measured" if name in section.measured else ""
                print(
                    f"{section.name:8s} {name:13s} {own[name]:8.2f}  turned {spread:.2f}  between {shifted:+.2f}"
                    f"  h/2 {halved:+.2f}  quarter {mirrored:+.4f}  {measured}",
                    flush=True,
                )


def answers(test: LaboratoryTest, **changed: Any) -> Mapping[str, float]:
    """Return the responses of a test with its mesh changed."""
    return perform(replace(test, discretisation=replace(test.discretisation, **changed))).responses


def finer_wall(test: LaboratoryTest) -> int | None:
    """Return twice the elements through the wall, if their number is given."""
    layers = test.discretisation.through_wall
    return None if layers is None else 2 * layers


if __name__ == "__main__":
    main(sys.argv[1:])
