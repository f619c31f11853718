"""What a cut all the way through gives: its largest force, its energy, its first fracture, and whether it severed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stemcal.cutting.checks import STROKE_TOO_SHORT, not_severed
from stemcal.cutting.parts import Discretisation, ShearTest
from stemcal.cutting.result import CuttingResult, filter_rows, moving_mean
from stemcal.cutting.severing import Severing

# The force of a whole cut is its mean over this share of the diameter: the front moves from node to node, and what the
# force does within an element depends on the mesh.
MEAN_TRAVEL = 0.05


def mean_over_travel(test: ShearTest) -> Discretisation:
    """Return the discretisation whose filter covers `MEAN_TRAVEL`, or the spec's window if that is wider."""
    how, over = test.discretisation, MEAN_TRAVEL * test.stem.outer_diameter / test.loading.speed
    return replace(how, filter_window=max(how.filter_window, over))


def of_whole_cut(result: CuttingResult, test: ShearTest, severing: Severing) -> CuttingResult:
    """Return the result of a cut with those numbers that only a whole one has."""
    curve, loading, severed = result.history, test.loading, severing.time
    fails = int(np.argmax(curve.failed > 0))
    before = moving_mean(curve.force, filter_rows(loading, test.discretisation))[: fails + 1]
    first = curve.failed[-1] > 0
    notes = tuple(note for note in result.warnings if note.kind != STROKE_TOO_SHORT)
    if severed is None:
        notes = (not_severed(float(curve.travel[-1]), 100.0 * severing.holding), *notes)
    return replace(
        result,
        first_fracture_force=float(before.max()) if first else None,
        first_fracture_travel=float(curve.travel[fails]) if first else None,
        severed=severed is not None,
        severed_travel=None if severed is None else loading.speed * severed - loading.gap,
        cutting_energy=float(curve.external[-1]),
        stroke_was_enough=severed is not None,
        warnings=notes,
    )
