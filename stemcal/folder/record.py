"""What the record of a run must hold: its version, what it answers, the answer, and that its key follows from it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stemcal.files.durable import digest
from stemcal.files.typed import NOWHERE, absent, from_json, to_json
from stemcal.naming import CUTTING, Naming

__all__ = [
    "KEY_LENGTH",
    "RECORD_VERSION",
    "is_key",
    "key_of",
    "naming_in",
    "problem_of",
    "under_inner_names",
    "under_own_names",
]

RECORD_VERSION = 1
KEY_LENGTH = 32
_KEY = re.compile(r"[0-9a-f]{32}")
_STATUSES = ("ok", "failed")

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class _Asked:
    stage: str
    row: int
    levels: dict[str, float]
    diameter: float
    pictured: bool = False
    phases: int | None = absent()
    element_size: str | None = absent()


@dataclass(frozen=True)
class _Curve:
    travel: Numbers
    force: Numbers


@dataclass(frozen=True)
class _Told:
    """What of a solver's details others read; a solver may tell more."""

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
    warnings: tuple[str, ...] | None = absent()
    responses: dict[str, float] | None = absent()
    block: str | None = absent()
    weight: float | None = absent()


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
    force: float | None
    reason: str
    message: str
    details: _Told
    provenance: _Circumstances


def is_key(text: str) -> bool:
    """Tell whether a text may be the name of a record.

    >>> is_key("0123456789abcdef" * 2), is_key("../x"), is_key("")
    (True, False, False)
    """
    return _KEY.fullmatch(text) is not None


def key_of(identity: Mapping[str, Any]) -> str:
    """Return the name of the record of a run: a hash of what determines the answer."""
    return digest(identity)[:KEY_LENGTH]


def naming_in(content: object) -> Naming:
    """Return the naming that a file tells; raise `ValueError` if it tells something else."""
    told = content.get("naming") if isinstance(content, dict) else None
    return CUTTING if told is None else from_json(Naming, told)


def under_own_names(record: Mapping[str, Any], naming: Naming) -> dict[str, Any]:
    """Return a record as the file of a study of its own words holds it, which also tells these words."""
    if naming.is_cutting:
        return dict(record)
    own, request = dict(naming.called), _renamed(record["request"], dict(naming.called))
    return {**_renamed(record, own), "request": request, "naming": to_json(naming)}


def under_inner_names(content: dict[str, Any]) -> dict[str, Any]:
    """Return what a record's file holds with force and diameter called so again."""
    naming = naming_in(content)
    if naming.is_cutting:
        return content
    inner: dict[str, str | None] = {own: name for name, own in naming.called if own is not None}
    return {**_renamed(content, inner), "request": {"diameter": NOWHERE, **_renamed(content["request"], inner)}}


def _renamed(content: Mapping[str, Any], names: Mapping[str, str | None]) -> dict[str, Any]:
    """Return a mapping with other keys; those of None are left out."""
    keys = {key: names.get(key, key) for key in content}
    return {name: content[key] for key, name in keys.items() if name is not None}


def problem_of(content: Mapping[str, Any], key: str) -> str:
    """Return what is wrong with a record that lies under a key, "" if nothing is.

    Its seal tells that nobody has changed it since, not that it was right when it was sealed.
    """
    if content.get("record_version") != RECORD_VERSION:
        return f"is of record version {content.get('record_version')!r:.20}, this stemcal reads {RECORD_VERSION}"
    try:
        naming = naming_in(content)
        record = from_json(_Record, content, naming.called)
    except ValueError as error:
        return f"is no record of a run: {error}"
    if record.status not in _STATUSES or (record.status == "ok") != (record.force is not None):
        return f"is no record of a run: status {record.status!r:.20} with {naming.response.noun} {record.force}"
    if record.key != key or key_of(record.identity) != key:
        return "its name does not follow from what it says it answers"
    return ""
