"""Results of a cut all the way through the stem: first fracture, cutting energy, and whether the stem is severed."""

from dataclasses import replace

import numpy as np

from stemcal.cutting import checks
from stemcal.cutting.parts import Discretisation, ShearTest
from stemcal.cutting.result import CuttingResult, filter_rows, moving_mean
from stemcal.cutting.severing import Severing
from stemcal.notes import Note

# The force of a whole cut is averaged over a travel of this share of the diameter: the cut front moves from node to
# node, and the variation of the force within one element depends on the mesh.
_MEAN_TRAVEL = 0.05


def mean_over_travel(test: ShearTest) -> Discretisation:
    """Return the discretisation with a filter window of at least `_MEAN_TRAVEL` of the diameter."""
    how, over = test.discretisation, _MEAN_TRAVEL * test.stem.outer_diameter / test.loading.speed
    return replace(how, filter_window=max(how.filter_window, over))


def of_whole_cut(result: CuttingResult, test: ShearTest, severing: Severing) -> CuttingResult:
    """Return the result of a whole cut with its additional fields, such as `severed` and `cutting_energy`."""
    curve, loading, severed = result.history, test.loading, severing.cut_through
    first = int(np.argmax(curve.failed > 0))
    before = moving_mean(curve.force, filter_rows(loading, test.discretisation))[: first + 1]
    failed, highest = curve.failed[-1] > 0, int(np.argmax(before))
    if failed and before[highest] > result.peak_force:  # until a failure, the force does not vary within an element
        time, travel = float(curve.time[highest]), float(curve.travel[highest])
        result = replace(result, peak_force=float(before[highest]), peak_time=time, peak_travel=travel)
    kept = tuple(note for note in result.warnings if note.kind != checks.STROKE_TOO_SHORT)
    return replace(
        result,
        first_fracture_force=float(before[highest]) if failed else None,
        first_fracture_travel=float(curve.travel[first]) if failed else None,
        severed=severed,
        severed_travel=float(curve.travel[-1]) if severed else None,
        cutting_energy=float(curve.external[-1]),
        stroke_was_enough=severed,
        warnings=(*_outcome(result, test, severing), *kept),
    )


def _outcome(result: CuttingResult, test: ShearTest, severing: Severing) -> list[Note]:
    """Return a note if the stem was not cut through, and one if much of the work is kinetic energy at the end."""
    curve, notes = result.history, list[Note]()
    travel, percent = float(curve.travel[-1]), 100.0 * severing.holding
    if severing.time is not None and not severing.cut_through:
        notes.append(checks.broken_elsewhere(travel, severing.elsewhere))
    elif not severing.cut_through and test.supports.kind == "clamped":
        notes.append(checks.bent_away(travel, severing.aside, percent))
    elif not severing.cut_through:
        notes.append(checks.not_severed(travel, percent))
    kinetic = float(100.0 * curve.kinetic[-1] / curve.external[-1])
    return [*notes, checks.kinetic_energy(kinetic)] if kinetic > checks.MOST_KINETIC else notes
