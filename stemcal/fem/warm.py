"""Compile the kernels ahead of use, and recover when what was compiled before cannot be read."""

from __future__ import annotations

import shutil
import time
from contextlib import suppress
from pathlib import Path

from stemcal.fem.contact import Tool
from stemcal.fem.kernels.compile import CACHE
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate

# A cache of other sources that nobody has used for so long is swept away.
_KEPT_DAYS = 30.0


def warm() -> None:
    """Compile every kernel of a simulation, or load it from the cache.

    A damaged cache entry makes numba raise all kinds of exceptions, so any failure empties the cache and tries once
    more; the second failure is real.
    """
    try:
        _smallest_simulation()
    except Exception:
        shutil.rmtree(CACHE, ignore_errors=True)
        CACHE.mkdir(mode=0o700, parents=True, exist_ok=True)
        _smallest_simulation()
    sweep(CACHE)


def sweep(cache: Path) -> None:
    """Remove what older sources left beside this cache; every use of a cache renews the time of its folder."""
    oldest = time.time() - _KEPT_DAYS * 86400.0
    for folder in cache.parent.glob("kernels-*-numba-*"):
        with suppress(OSError):  # somebody else may be sweeping
            if folder != cache and folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)


def _smallest_simulation() -> None:
    """Press a tool with an edge into one element for a few steps."""
    wedge = Tool(corners=((0.5, 0.1), (1.0, 2.0), (0.0, 2.0)), radius=0.1, height=1.0, speed=-1.0, edge=0.5)
    model = Model(
        mesh=brick((1.0, 1.0, 1.0), (1, 1, 1)),
        material=Material(1.0e-9, 1000.0, 0.3, yield_stress=10.0),
        tools=(wedge,),
        integration=Integration(outputs=1),
    )
    simulate(model, 1.0e-6)
