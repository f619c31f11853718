"""Replicates, which are numbered simulations at the same levels, and the seed of each."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

from stemcal.solvers.protocol import Request
from stemcal.storage.typed import absent
from stemcal.study.types.named import REPLICATE, SEED
from stemcal.vocabulary import CUTTING, FIRST, Vocabulary

MOST_SEED = 900_000_000  # the largest seed that LAMMPS accepts


def repeated(requests: Sequence[Request], times: int) -> list[Request]:
    """Return each request `times` times, as numbered replicates; unchanged for 0, a deterministic program."""
    if not times:
        return list(requests)
    return [replace(request, replicate=n) for request in requests for n in range(1, times + 1)]


@dataclass(frozen=True)
class Replicates:
    """The replicates of a design point.

    values    the first response of each replicate that succeeded
    keys      the record keys of all replicates
    further   the values of the other responses, by name
    """

    values: tuple[float, ...]
    keys: tuple[str, ...]
    further: dict[str, tuple[float, ...]] | None = absent()

    def of(self, response: str) -> tuple[float, ...]:
        """Return the values of a response by its name; `FIRST` means the first response."""
        return self.values if response == FIRST else (self.further or {}).get(response, ())


def values_of(request: Request, seed: int = 0, naming: Vocabulary = CUTTING) -> dict[str, str]:
    """Return the text for each placeholder; a factor has priority over a built-in placeholder of the same name."""
    built_in = {SEED: str(seed), REPLICATE: str(request.replicate)}
    levels = {name: repr(float(value)) for name, value in request.levels.items()}
    at = {} if naming.condition is None else {naming.condition.name: repr(float(request.condition))}
    return {**built_in, **at, **levels}


def seed_of(request: Request) -> int:
    """Return the seed of a run, 1 to 900 000 000, which depends on stage, row, replicate, condition and levels.

    >>> run = Request("screen", 0, {"friction": 0.3}, 1.0, replicate=1)
    >>> seed_of(run)
    409313303
    """
    run = (request.stage, request.row, request.replicate, repr(float(request.condition)), values_of(request))
    digest = hashlib.sha256(json.dumps([0, *run], sort_keys=True).encode()).digest()
    return 1 + int.from_bytes(digest[:8], "big") % MOST_SEED
