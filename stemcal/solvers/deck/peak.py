"""Convert the history of a contact force into an answer, by the same rules as the embedded solver."""

from collections.abc import Sequence
from math import cos, radians
from typing import Any, NamedTuple

import numpy as np

from stemcal.arrays import Array
from stemcal.cutting.result import break_row, moving_mean, short_stroke
from stemcal.errors import SimulationFailed
from stemcal.measured.curve_modes import CurveModes
from stemcal.notes import Note
from stemcal.solvers.kept_curve import curve_scores, kept_curve
from stemcal.solvers.options import BREAK_DROP, DeckSolver
from stemcal.solvers.protocol import RESPONSES, Answer
from stemcal.storage.typed import to_json
from stemcal.study.model.shear_test import GAP, LoadingSection


class ContactForce(NamedTuple):
    """Time (s) and the contact force along the travel of the blade (N), with the sign that makes its peak positive."""

    time: Array
    force: Array

    @classmethod
    def of(cls, time: Array, force: Array, file: str) -> "ContactForce":
        """Return the force in a result file; `SimulationFailed` if it is not finite, or the time does not increase."""
        if not (finite := np.isfinite(time) & np.isfinite(force)).all():
            last = time[finite].max(initial=0.0)
            raise SimulationFailed("nan", f"the blade force in {file} is not a number after {last:g} s")
        if len(time) < 2 or not (np.diff(time) > 0).all():
            message = f"the time values of the blade force in {file} are not in increasing order"
            raise SimulationFailed("bad_result", message)
        return cls(time, force if force.max() >= -force.min() else -force)


def peak_answer(
    contact: ContactForce,
    options: DeckSolver,
    loading: LoadingSection,
    failed: Sequence[float] = (),
    warnings: Sequence[Note] = (),
    modes: CurveModes | None = None,
    angle: float = 0.0,
) -> Answer:
    """Return the peak of the filtered force before the first fracture, as the embedded solver reports it.

    `failed` contains the times (s) at which elements were deleted. Without deleted elements there is no fracture, and
    the peak is that of the whole stroke. If curves were measured, the answer contains the scores on their `modes`, too.
    `angle` is the sliding angle of the blade in degrees.
    """
    time, force = contact.time, contact.force
    filtered = moving_mean(force, max(1, round(options.filter_window / float(np.median(np.diff(time))))))
    deleted = np.searchsorted(np.sort(np.asarray(failed, dtype=float)), time, side="right")
    broken = break_row(filtered, deleted, BREAK_DROP)
    peak = int(np.argmax(filtered[:broken]))
    if filtered[peak] <= 0.0:
        message = "the blade exerted no force on the stem; check the gap, the speed and the duration of loading"
        raise SimulationFailed("no_contact", message)
    travel = loading.speed * time - GAP / cos(radians(angle))
    broke = None if broken is None else float(travel[broken])
    scores = curve_scores(modes, travel, filtered, broke)
    short = short_stroke(travel, filtered, broken)
    details: dict[str, Any] = {
        "peak_force": float(filtered[peak]),
        "peak_force_raw": float(force[:broken].max()),
        "peak_time": float(time[peak]),
        "peak_travel": float(travel[peak]),
        **({} if broke is None else {"break_travel": broke}),
        **({"deleted_elements": int(deleted[peak]), "deleted_in_all": len(failed)} if failed else {}),
        "stroke_was_enough": not short,
        "warnings": to_json([*warnings, *short]),
        "curve": kept_curve(travel, filtered),
        **({RESPONSES: scores} if scores else {}),
    }
    return Answer("ok", response=float(filtered[peak]), details=details)
