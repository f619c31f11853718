"""The seal of stage files and run records: the SHA-256 of their content, so that a changed digit is seen."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stemcal.storage.canonical import as_json, digest
from stemcal.storage.plain import MIB, read_plain, unreadable

SEAL = "sha256"
MAX_BYTES = 64 * MIB
# SHA-256 of the bytes that agreed with their seal: a file is read many times in a command, but worked out anew once.
_AGREED: set[bytes] = set()


class Broken(Exception):
    """A file that contains no JSON object, or not the one that was sealed; the message is the reason."""


def sealed(content: Mapping[str, Any]) -> str:
    """Return the text of a file with its seal."""
    return as_json({SEAL: digest(content), **content})


def read_sealed(path: Path) -> dict[str, Any]:
    """Return a sealed file's content without its seal; `Broken` if it has changed or never had one."""
    try:
        blob = read_plain(path, MAX_BYTES)
    except FileNotFoundError:
        raise
    except OSError as error:  # a folder or a device in its place, a file that may not be read, or is too large
        raise Broken(unreadable(error)) from None
    try:
        content = json.loads(blob.decode("utf-8"))
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict):
        raise Broken("contains no JSON object")
    if SEAL not in content:
        raise Broken("has no SHA-256 checksum")
    if not _agrees(blob, content, content.pop(SEAL)):
        raise Broken("does not match its SHA-256 checksum")
    return content


def _agrees(blob: bytes, content: Mapping[str, Any], seal: object) -> bool:
    """Check that a seal matches a content and that the file has no further byte."""
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
