"""Contents as JSON: for files, in canonical form for hashes, and in types that JSON has."""

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def as_json(content: Any) -> str:
    """Return JSON for files: keys in the order given, two spaces, a newline at the end."""
    return json.dumps(jsonable(content), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def canonical(content: Any) -> str:
    """Return the JSON text of a content, which does not depend on the order of its keys."""
    return json.dumps(jsonable(content), ensure_ascii=True, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(content: Any) -> str:
    """Return the SHA-256 of a content's canonical JSON."""
    return hashlib.sha256(canonical(content).encode("ascii")).hexdigest()


def key_of(identity: Mapping[str, Any]) -> str:
    """Return the name of the record of a run: a hash of what determines the answer."""
    return digest(identity)[:32]


def jsonable(content: Any) -> Any:
    """Return a content in types of JSON: numpy numbers and arrays unpacked, NaN and infinity as None."""
    if isinstance(content, float):  # numpy's float64 too
        return float(content) if math.isfinite(content) else None
    if isinstance(content, str):  # what UTF-8 cannot hold is spelled out
        return content.encode("utf-8", "backslashreplace").decode("utf-8")
    if content is None or isinstance(content, bool | int):
        return content
    if isinstance(content, Mapping):
        return {str(key): jsonable(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [jsonable(value) for value in content]
    if isinstance(content, Path):
        return content.as_posix()
    if hasattr(content, "tolist"):  # numpy
        return jsonable(content.tolist())
    raise TypeError(f"{type(content).__name__} cannot be written as JSON")
