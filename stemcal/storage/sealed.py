"""Sealed files: stage files and run records contain the SHA-256 of their content, which reveals any later change."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stemcal.storage.canonical import as_json, digest
from stemcal.storage.plain import MIB, read_plain, unreadable

_SEAL = "sha256"
MAX_BYTES = 64 * MIB
# SHA-256 of files whose seal was correct, so that a command that reads a file many times verifies the seal only once.
_VERIFIED: set[bytes] = set()


class Broken(Exception):
    """Raised for a sealed file that was changed or contains no sealed JSON object; the message has the reason."""


def sealed(content: Mapping[str, Any]) -> str:
    """Return the JSON text of a file with its seal as the first key."""
    return as_json({_SEAL: digest(content), **content})


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
    if _SEAL not in content:
        raise Broken("has no SHA-256 checksum")
    if not _agrees(blob, content, content.pop(_SEAL)):
        raise Broken("does not match its SHA-256 checksum")
    return content


def _agrees(blob: bytes, content: Mapping[str, Any], seal: object) -> bool:
    """Check that the seal matches the content, and that the file has exactly the bytes that `sealed` would write."""
    checksum = hashlib.sha256(blob).digest()
    if checksum in _VERIFIED:
        return True
    try:
        agrees = digest(content) == seal and as_json({_SEAL: seal, **content}).encode("utf-8") == blob
    except (ValueError, RecursionError):
        return False
    if agrees:
        _VERIFIED.add(checksum)
    return agrees
