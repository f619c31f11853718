"""Files that are no longer what they were, and clocks that jump."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any
from unittest import mock

from fakes import lines
from of_disks import finished
from of_processes import results
from tally import Fault, Tally, each

from stemcal.errors import StemcalError
from stemcal.folder import study_folder

# ---- what lies on the disk is damaged


def damaged_records(place: Path, times: int, rng: random.Random) -> Tally:
    """Flip bits of records, cut them short, and let the study go on from time to time."""
    place.mkdir(parents=True, exist_ok=True)
    witness, tally = place / "witness", Tally()
    folder = finished(place, "out", witness)
    whole = results(folder.path)
    while tally.tried < times:
        hit = rng.sample(folder.keys(), min(20, times - tally.tried))
        for key in hit:
            tally.tried += 1
            path = folder.record_path(key)
            path.write_bytes(_damaged(path.read_bytes(), rng))
            if folder.peek(key) is not None:
                tally.broken.append(f"{key}: not seen")
        before = len(lines(witness))
        finished(place, "out", witness)
        if len(lines(witness)) - before != len(hit):
            tally.broken.append(f"{len(lines(witness)) - before} runs done again for {len(hit)} damaged ones")
        if results(folder.path) != whole:
            tally.broken.append("the tables differ")
    aside = len(list((folder.runs / "damaged").iterdir()))
    tally.remark = f"{aside} set aside and computed again, no other run"
    return tally


def _damaged(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content))
    match rng.randrange(4):
        case 0:
            return content[:at]
        case 1:
            return content[:at] + b"\0" * (len(content) - at)
        case 2:
            return content + rng.randbytes(5)
    changed = bytearray(content)
    changed[at] ^= 1 << rng.randrange(8)
    return bytes(changed)


def damaged_stage(folder: Path, _number: int, rng: random.Random) -> None:
    """A stage's own file cut short: told, and made again from the records alone."""
    witness = folder / "witness"
    study = finished(folder, "out", witness)
    whole, begun = results(study.path), len(lines(witness))
    name = rng.choice(["screen", "rsm", "invert", "validate"])
    content = whole[f"{name}.json"]
    (study.path / f"{name}.json").write_bytes(content[: rng.randrange(len(content) - 1)])
    try:
        study.read_stage(name)
    except StemcalError as error:
        assert "is damaged" in str(error) and f"stemcal {name}" in str(error), str(error)
    else:
        raise AssertionError(f"{name}.json was read")
    finished(folder, "out", witness)
    assert results(study.path) == whole, "the tables differ"
    assert len(lines(witness)) == begun, "a run was done again"


# ---- clocks


def clock_jumps(folder: Path, _number: int, rng: random.Random) -> None:
    """The time of day jumps by years, back and forth, between any two looks at it."""

    class Jumping(study_folder.datetime):  # type: ignore[misc, valid-type]
        @classmethod
        def now(cls, tz: Any = None) -> Any:
            return cls.fromtimestamp(rng.uniform(0.0, 4e9), tz)

    whole = results(finished(folder, "whole").path)
    with mock.patch.object(study_folder, "datetime", Jumping), mock.patch("time.time", lambda: rng.uniform(0.0, 4e9)):
        study = finished(folder)
        finished(folder)
    assert results(study.path) == whole, "the tables differ"
    assert all(study.peek(key) for key in study.keys())  # noqa: SIM118


FAULTS = (
    Fault(
        "damaged records",
        "bits flipped, cut short, filled with zeros, bytes added",
        "each seen, set aside, its run alone computed again, same tables",
        damaged_records,
        40,
        800,
    ),
    Fault(
        "damaged stage files",
        "cut short at a random byte",
        "told with the command that mends it; no run computed",
        each(damaged_stage),
        1,
        25,
    ),
    Fault(
        "the clock jumps",
        "a random time between 1970 and 2096 at every look",
        "same tables, records whole",
        each(clock_jumps),
        1,
        15,
    ),
)
