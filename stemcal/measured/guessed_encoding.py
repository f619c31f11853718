"""Which encoding a file of a laboratory is written in."""

import re
from collections.abc import Iterator
from pathlib import Path

from stemcal.errors import UsageError
from stemcal.files import encodings
from stemcal.measured.numerals import shown
from stemcal.measured.vocabulary import familiarity

_BEGINNING = 20_000  # bytes by whose words an encoding is judged
_EASTERN = ("gb18030", "cp949", "cp932", "cp1251", "cp1254", "cp866", "cp1252")
_WESTERN = ("cp1252", "cp1254", "gb18030", "cp1251")


def decoded(content: bytes, encoding: str | None, path: Path) -> tuple[str, str]:
    """Return a text and its encoding.

    It is that of the byte order mark, or UTF-8, or UTF-16; else, of the encodings of Chinese, Korean, Japanese,
    Russian, Turkish and Western machines, the one in which most words are known.

    >>> decoded("力/N".encode("gbk"), None, Path("a.csv"))
    ('力/N', 'gb18030')
    >>> decoded("Сила, Н".encode("cp1251"), None, Path("a.csv"))
    ('Сила, Н', 'cp1251')
    """
    try:
        found = encodings.decoded(content, [encoding] if encoding else _guesses(content))
    except (LookupError, ValueError):
        raise UsageError(
            f"--encoding {shown(encoding or '')[1:-1]}: unknown; take utf-8, utf-16, gbk or another of Python's"
        ) from None
    if found is None:
        named = encoding or next(_guesses(content))
        raise UsageError(f"{path} is not written in {named}; leave out --encoding or name another")
    return found


def _guesses(content: bytes) -> Iterator[str]:
    """Yield Unicode, then, unless it is UTF-16, the encodings of one or two bytes a letter, the likeliest first."""
    yield from (unicode := list(encodings.unicodes(content)))
    if unicode != ["utf-8"]:
        return
    begin = content[:_BEGINNING]
    # letters of Western Europe stand alone among ASCII, Chinese and Cyrillic ones come together
    usual = _EASTERN if re.search(rb"[\x80-\xff]{2}", begin) else _WESTERN
    yield from sorted(usual, key=lambda encoding: -familiarity(begin.decode(encoding, "ignore")))
    yield "latin-1"
