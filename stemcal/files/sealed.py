"""JSON objects that carry the SHA-256 of their own content, so that a changed digit is seen."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stemcal.files.durable import as_json, digest
from stemcal.files.plain import MIB, read_plain

SEAL = "sha256"
MAX_BYTES = 64 * MIB
# SHA-256 of the bytes that agreed with their seal: a file is read many times in a command, but worked out anew once.
_AGREED: set[bytes] = set()


class Broken(Exception):
    """A file that holds no JSON object, or not the one that was sealed; the message says what is wrong."""


def sealed(content: Mapping[str, Any]) -> str:
    """Return the text of a file with its seal.

    >>> sealed({"a": 1}).splitlines()[1][:20]
    '  "sha256": "015abd7'
    """
    return as_json({SEAL: digest(content), **content})


def opened(path: Path) -> tuple[dict[str, Any], bool]:
    """Return the content of a file without its seal, and whether it had one.

    Raises
    ------
    FileNotFoundError
        If there is no file.
    Broken
        If a bit of it has changed since it was sealed, or it never held a JSON object.
    """
    try:
        blob = read_plain(path, MAX_BYTES)
    except FileNotFoundError:
        raise
    except OSError as error:  # a folder or a device in its place, a file that may not be read, or is too large
        why = error.strerror or ""
        raise Broken(why if why.startswith("is ") else f"cannot be read: {why}") from None
    content = _parsed(blob)
    if SEAL not in content:
        return content, False
    if not _agrees(blob, content, content.pop(SEAL)):
        raise Broken("does not agree with its SHA-256")
    return content, True


def _parsed(blob: bytes) -> dict[str, Any]:
    try:
        content = json.loads(blob.decode("utf-8"))
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict):
        raise Broken("holds no JSON object")
    return content


def _agrees(blob: bytes, content: Mapping[str, Any], seal: object) -> bool:
    """Return whether a seal belongs to a content, and the file has no byte more or less than the two need."""
    same = hashlib.sha256(blob).digest()
    if same in _AGREED:
        return True
    try:
        agrees = digest(content) == seal and as_json({SEAL: seal, **content}).encode("utf-8") == blob
    except (ValueError, RecursionError):
        return False
    if agrees:
        _AGREED.add(same)
    return agrees
