"""The kernels in double precision, which known answers are compared with; studies never use them."""

from __future__ import annotations

from dataclasses import replace

from filelock import FileLock

from stemcal.fem.kernels.compile import CACHE
from stemcal.fem.model import Integration
from stemcal.fem.stepper import simulate
from stemcal.fem.warm import smallest_model, warm


def warm_double() -> None:
    """Have the kernels compiled: of several test processes one compiles, the others wait and load."""
    warm()
    with FileLock(CACHE.parent / ".double"):
        simulate(replace(smallest_model(), integration=Integration(outputs=1)), 1.0e-6)
