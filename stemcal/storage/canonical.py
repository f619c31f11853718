"""JSON text for files, canonical JSON for hashes, and conversion of Python objects to the types of JSON."""

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def as_json(content: Any) -> str:
    """Return the JSON text for a file: keys in the order of `content`, indented by two spaces, ending in a newline."""
    return json.dumps(jsonable(content), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def canonical(content: Any) -> str:
    """Return canonical JSON text: the same for equal content, whatever the order of its keys."""
    return json.dumps(jsonable(content), ensure_ascii=True, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(content: Any) -> str:
    """Return the SHA-256 of the canonical JSON of `content`, in hexadecimal digits."""
    return hashlib.sha256(canonical(content).encode("ascii")).hexdigest()


def key_of(identity: Mapping[str, Any]) -> str:
    """Return the key of a run record: a hash of everything that determines the result of the run."""
    return digest(identity)[:32]


def jsonable(content: Any) -> Any:
    """Convert `content` to types of JSON: numpy arrays become lists, NaN and infinity become None."""
    if isinstance(content, float):  # includes numpy.float64
        return float(content) if math.isfinite(content) else None
    if isinstance(content, str):  # lone surrogates, which UTF-8 cannot encode, are escaped
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
