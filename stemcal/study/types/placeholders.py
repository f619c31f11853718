"""``{{factor}}`` in text files: the one thing that templates can do."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from stemcal.files.reading import MIB, read_plain

DIAMETER = "diameter"
SEED, REPLICATE = CHANCE = ("seed", "replicate")
MAX_BYTES = 50 * MIB

_PLACEHOLDER = re.compile(rb"\{\{([^{}\r\n]{0,200})\}\}")


def template_bytes(path: Path) -> bytes:
    """Return the content of a template; raise `OSError` if it is not a plain file, or too large."""
    return read_plain(path, MAX_BYTES)


def placeholders(content: bytes) -> Iterator[tuple[int, str]]:
    """Yield (line, name) of every placeholder.

    >>> list(placeholders(b"E = {{elastic_modulus}}\\nb = {{ width }}"))
    [(1, 'elastic_modulus'), (2, 'width')]
    """
    for match in _PLACEHOLDER.finditer(content):
        yield content.count(b"\n", 0, match.start()) + 1, match[1].decode("utf-8", "replace").strip()


def fill(content: bytes, values: Mapping[str, str]) -> bytes:
    """Return the content with each placeholder replaced; every other byte stays.

    >>> fill(b"E = {{E}} \\\\ $(rm)", {"E": "10.5"})
    b'E = 10.5 \\\\ $(rm)'
    """
    return _PLACEHOLDER.sub(lambda match: values[match[1].decode("utf-8", "replace").strip()].encode(), content)


def number(value: float) -> str:
    """Return the shortest text that reads back as the same number.

    >>> number(17.96), number(1.1e-09), number(1000.0)
    ('17.96', '1.1e-09', '1000.0')
    """
    return repr(float(value))
