"""Sealed files: stage files and run records contain the SHA-256 of their content, which reveals any later change."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stemcal.storage.canonical import as_json, digest
from stemcal.storage.plain import MIB, read_plain, unreadable

SEAL = "sha256"
MAX_BYTES = 64 * MIB
# SHA-256 of the bytes of files whose seal was correct: a command reads a file many times but verifies it only once.
_VERIFIED: set[bytes] = set()


class Broken(Exception):
    """Raised for a sealed file that was changed or contains no sealed JSON object; the message is the reason."""


def sealed(content: Mapping[str, Any]) -> str:
    """Return the JSON text of a file with its seal as the first key."""
    return as_json({SEAL: digest(content), **content})


def read_sealed(path: Path) -> dict[str, Any]:
    """Return the content of a sealed file without the seal; raise `Broken` if the seal is wrong or missing."""
    try:
        blob = read_plain(path, MAX_BYTES)
    except FileNotFoundError:
        raise
    except OSError as error:  # a folder or a device, a file without read permission, or too large
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
    """Check that the seal matches the content, and that the file has exactly the bytes that `sealed` would write."""
    checksum = hashlib.sha256(blob).digest()
    if checksum in _VERIFIED:
        return True
    try:
        agrees = digest(content) == seal and as_json({SEAL: seal, **content}).encode("utf-8") == blob
    except (ValueError, RecursionError):
        return False
    if agrees:
        _VERIFIED.add(checksum)
    return agrees
