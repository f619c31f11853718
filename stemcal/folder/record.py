"""What the record of a run must hold: its version, what it answers, the answer, and that its key follows from it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stemcal.files.durable import digest
from stemcal.files.typed import absent, from_json
from stemcal.note import Note

RECORD_VERSION = 4
KEY_LENGTH = 32
_KEY = re.compile(r"[0-9a-f]{32}")
_STATUSES = ("ok", "failed")

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class _Asked:
    stage: str
    row: int
    levels: dict[str, float]
    condition: float
    pictured: bool = False
    phases: int | None = absent()
    element_size: str | None = absent()


@dataclass(frozen=True)
class _Curve:
    travel: Numbers
    force: Numbers


@dataclass(frozen=True)
class _Details:
    """Details of a solver that others read; a solver may add more."""

    time_limit: float | None = absent()
    stroke_was_enough: bool | None = absent()
    peak_travel: float | None = absent()
    peak_sd: float | None = absent()
    break_travel: float | None = absent()
    phase_peaks: Numbers | None = absent()
    phase_travels: Numbers | None = absent()
    phase_works: Numbers | None = absent()
    curve: _Curve | None = absent()
    energies: dict[str, Numbers] | None = absent()
    shape: dict[str, Any] | None = absent()
    film: dict[str, Any] | None = absent()
    warnings: tuple[Note, ...] | None = absent()
    responses: dict[str, float] | None = absent()


@dataclass(frozen=True)
class _Circumstances:
    started: str | None = absent()
    finished: str | None = absent()
    wall_seconds: float | None = absent()
    tries: int | None = absent()
    host: str | None = absent()
    platform: str | None = absent()
    python: str | None = absent()
    numpy: str | None = absent()
    stemcal: str | None = absent()


@dataclass(frozen=True)
class _Record:
    record_version: int
    key: str
    identity: dict[str, Any]
    request: _Asked
    status: str
    response: float | None
    reason: str
    message: str
    details: _Details
    provenance: _Circumstances


def is_key(text: str) -> bool:
    """Return whether a text may be the name of a record.

    >>> is_key("0123456789abcdef" * 2), is_key("../x"), is_key("")
    (True, False, False)
    """
    return _KEY.fullmatch(text) is not None


def key_of(identity: Mapping[str, Any]) -> str:
    """Return the name of the record of a run: a hash of what determines the answer."""
    return digest(identity)[:KEY_LENGTH]


def problem_of(content: Mapping[str, Any], key: str) -> str:
    """Return what is wrong with a record that is under a key, "" if nothing is.

    Its seal proves that it was not changed since, not that it was correct when it was sealed.
    """
    if content.get("record_version") != RECORD_VERSION:
        return f"is of record version {content.get('record_version')!r:.20}, this stemcal reads {RECORD_VERSION}"
    try:
        record = from_json(_Record, content)
    except ValueError as error:
        return f"is not the record of a run: {error}"
    if record.status not in _STATUSES or (record.status == "ok") != (record.response is not None):
        return f"is not the record of a run: status {record.status!r:.20} with response {record.response}"
    if record.key != key or key_of(record.identity) != key:
        return "its name does not match the request that it contains"
    return ""
