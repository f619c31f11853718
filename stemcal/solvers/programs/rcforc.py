"""``rcforc`` in ASCII: the resultant force of every contact over time."""

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.solvers.fortran import NUMBER, number_of
from stemcal.solvers.programs.reductions import NoResult

Array = NDArray[np.float64]

FILE = "rcforc"
_VALUE = rf"({NUMBER}|[-+]?NaN|[-+]?Inf(?:inity)?|\*+)"
_ROW = re.compile(
    rf"\s*(slave|master|surfa|surfb)\s+(\d{{1,18}})\s+time\s*{_VALUE}\s+x\s*{_VALUE}\s+y\s*{_VALUE}\s+z\s*{_VALUE}",
    re.IGNORECASE,
)
_COLUMN = {"x": 4, "y": 5, "z": 6}


class ContactForce(NamedTuple):
    """Time (s) and one component of the force on one side of a contact (N), turned so that its peak is positive."""

    time: Array
    force: Array


def contact_force(text: str, interface: int, component: str) -> ContactForce:
    """Return the force of a contact from the text of an ``rcforc``.

    Interfaces count from 1 in the order of the deck, or by their numbers where the deck gives them.

    Raises
    ------
    NoResult
        ``no_result`` if the contact is not there, ``nan`` or ``bad_result`` if its numbers are none.
    """
    rows = [match for line in text.splitlines() if (match := _ROW.match(line))]
    mine = [match for match in rows if int(match[2]) == interface]
    if not mine:
        there = sorted({int(match[2]) for match in rows})
        raise NoResult("no_result", f"{FILE} has no contact {interface}, only {there}; see solver.interface")
    side = mine[0][1].lower()
    series = [(number_of(m[3]), number_of(m[_COLUMN[component]])) for m in mine if m[1].lower() == side]
    time, force = np.asarray(series, dtype=float).T
    if not np.isfinite(time).all() or not np.isfinite(force).all():
        raise NoResult("nan", f"the force of contact {interface} is NaN from {_last_good(time, force):g} s on")
    if len(time) < 2 or not (np.diff(time) > 0).all():
        raise NoResult("bad_result", f"the times of contact {interface} in {FILE} do not rise")
    return ContactForce(time, force if force.max() >= -force.min() else -force)


def _last_good(time: Array, force: Array) -> float:
    good = np.isfinite(time) & np.isfinite(force)
    return float(time[good].max(initial=0.0))
