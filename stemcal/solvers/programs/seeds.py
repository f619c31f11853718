"""The random seed of a run, for programs with chance in them: each replicate draws from another."""

import hashlib
import json

from stemcal.solvers.programs.inputs import values_of
from stemcal.solvers.protocol import Request
from stemcal.study.types.placeholders import number

MOST_SEED = 900_000_000  # the largest that LAMMPS takes


def seed_of(request: Request) -> int:
    """Return the seed of a run, 1 to 900 000 000: another one for each stage, row, replicate, diameter and levels.

    >>> run = Request("screen", 0, {"friction": 0.3}, 1.0, replicate=1)
    >>> seed_of(run)
    409313303
    """
    run = (request.stage, request.row, request.replicate, number(request.condition), values_of(request))
    found = hashlib.sha256(json.dumps([0, *run], sort_keys=True).encode()).digest()
    return 1 + int.from_bytes(found[:8], "big") % MOST_SEED
