"""How a force curve ends, and whether its maximum is reliable.

    broken     the stem has broken: the maximum is passed
    fallen     the force ends below nine tenths of its maximum
    rising     the end is the maximum, within the noise: the true maximum is larger
    regained   a maximum was passed, the force fell and has come up again: a larger one may follow
    falling    a maximum was passed, but the force has fallen by less than a tenth of it

The noise is that of the filtered force: the standard deviation of what the filter took away over the last tenth of the
stroke, over the root of the filter's window. Differences of up to five times that, the range of some twenty such
values, are none, nor are those of up to a hundredth of the maximum.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.note import Note
from stemcal.run_warnings import stroke_too_short

Array = NDArray[np.float64]
End = Literal["broken", "fallen", "rising", "regained", "falling"]
# The stroke was long enough if the force ends below this share of its peak.
FALLEN = 0.9
_RANGE, _LEAST = 5.0, 0.01


@dataclass(frozen=True)
class StrokeEnd:
    """How the curve ends: forces in N at the peak, at the lowest point after it and at the end; travel in mm."""

    kind: End
    peak: float
    peak_travel: float
    valley: float
    end: float
    stroke: float

    @property
    def was_enough(self) -> bool:
        """Whether the maximum is known to be passed."""
        return self.kind in ("broken", "fallen")

    @property
    def warnings(self) -> list[Note]:
        """What keeps the maximum in doubt."""
        forces = self.peak, self.peak_travel, self.valley, self.end
        return [] if self.was_enough else [stroke_too_short(self.kind, *forces, self.stroke)]


def stroke_end(travel: Array, raw: Array, filtered: Array, window: int, broken: int | None = None) -> StrokeEnd:
    """Return how a curve ends.

    Parameters
    ----------
    raw, filtered : (R,)
        Force before and after the filter, N.
    window : int
        Rows that the filter takes the mean of.
    broken : int, optional
        Row at which the stem has broken.
    """
    peak = int(np.argmax(filtered[:broken]))
    top, end, valley = float(filtered[peak]), float(filtered[-1]), float(filtered[peak:].min())
    last = slice(-max(len(raw) // 10, 2), None)
    noise = float(np.std(raw[last] - filtered[last])) / window**0.5
    return StrokeEnd(
        _kind(top, valley, end, max(_RANGE * noise, _LEAST * top), broken is not None),
        top,
        float(travel[peak]),
        valley,
        end,
        float(travel[-1]),
    )


def _kind(top: float, valley: float, end: float, none: float, broken: bool) -> End:
    if broken:
        return "broken"
    if end < FALLEN * top:
        return "fallen"
    if valley >= top - none:
        return "rising"
    return "regained" if end > valley + none else "falling"
