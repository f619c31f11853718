"""What `llvm` spells out, in plain loops: slower, for one thread, and the measure that it is tested against."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from stemcal.fem.kernels.compile import inlined
from stemcal.fem.kernels.precision import RUN

_INLINED: Any = {"forceinline": True, "error_model": "numpy"}


@inlined
def prefetch(values: Any, place: int) -> None:
    """Leave it to the processor what it has at hand."""


def read_corners(nodal: Any, unit: Any, runs: Any, r: int, values: Any, place: int, stride: int) -> None:
    """Set values of two runs, r and r + 1, at their elements' corners less those at corner 0 (see `llvm`)."""


@overload(read_corners, jit_options=_INLINED)
def _read_corners(nodal: Any, unit: Any, runs: Any, r: Any, values: Any, place: Any, stride: Any) -> Any:
    difference = _of_counts if isinstance(nodal.dtype, types.Integer) else _of_numbers

    def read(nodal: Any, unit: Any, runs: Any, r: Any, values: Any, place: Any, stride: Any) -> Any:
        for i in range(3):
            for a in range(1, 8):
                for run in range(2):
                    node, origin = runs[a, r + run], runs[0, r + run]
                    at = place + (8 * i + a) * stride + run * RUN
                    for k in range(RUN):
                        values[at + k] = difference(nodal[node + k, i], nodal[origin + k, i], unit)

    return read


@inlined
def _of_numbers(there: Any, origin: Any, _unit: Any) -> Any:
    return there - origin


@inlined
def _of_counts(there: Any, origin: Any, unit: Any) -> Any:
    """Return the last 32 bits of a difference, which may pass 2³¹, times the unit."""
    return np.float32(np.int32(there - origin)) * unit


@inlined
def subtract_run(nodal: Any, node: int, values: Any, place: int, stride: int) -> None:
    """Do ``nodal[node + k, i] -= values[place + i * stride + k]`` for the nodes k of a run and i = 0, 1, 2."""
    for i in range(3):
        for k in range(RUN):
            nodal[node + k, i] -= values[place + i * stride + k]


def counting(relation: str, many: int) -> Any:
    """Return a function of values and a place that counts how many of so many numbers are > 0, or < 0."""

    @inlined
    def positive(values: Any, place: int) -> int:
        count = 0
        for k in range(many):
            count += 1 if values[place + k] > 0.0 else 0
        return count

    @inlined
    def negative(values: Any, place: int) -> int:
        count = 0
        for k in range(many):
            count += 1 if values[place + k] < 0.0 else 0
        return count

    return {">": positive, "<": negative}[relation]


def see_place(places: Any, n: int, x: float, unit: Any) -> None:
    """Set ``places[n]`` to the last 32 bits of x in whole units; nothing where `places` is x itself."""


@overload(see_place, jit_options=_INLINED)
def _see_place(places: Any, n: Any, x: Any, unit: Any) -> Any:
    def count(places: Any, n: Any, x: Any, unit: Any) -> Any:
        places[n] = np.int32(np.int64(np.rint(x / np.float64(unit))))

    def leave(places: Any, n: Any, x: Any, unit: Any) -> Any:
        pass

    return count if isinstance(places.dtype, types.Integer) else leave


def see_velocity(velocities: Any, n: int, v: float) -> None:
    """Set ``velocities[n]`` to v in single precision; nothing where `velocities` is v itself."""


@overload(see_velocity, jit_options=_INLINED)
def _see_velocity(velocities: Any, n: Any, v: Any) -> Any:
    def round_off(velocities: Any, n: Any, v: Any) -> Any:
        velocities[n] = np.float32(v)

    def leave(velocities: Any, n: Any, v: Any) -> Any:
        pass

    return round_off if velocities.dtype == types.float32 else leave


@inlined
def maximum(a: float, b: float) -> float:
    """Return the larger of two numbers, NaN if either is."""
    return a if a > b or a != a else b


@inlined
def _read(values: Any, place: int) -> Any:
    return values[place]


@inlined
def _write(values: Any, place: int, value: Any) -> None:
    values[place] = value


read_scratch = read_state = _read
write_scratch = write_state = _write


# A single thread waits for no other; `stemcal.fem.threads` starts no more of them.
@inlined
def add_together(numbers: Any, more: int) -> int:
    """Add to ``numbers[0]`` and return what it was."""
    before = numbers[0]
    numbers[0] = before + more
    return int(before)


@inlined
def read_together(numbers: Any) -> int:
    """Return ``numbers[0]``."""
    return int(numbers[0])


@inlined
def give_way() -> None:
    """Go on."""
