"""Which encoding a file of a laboratory is written in."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from stemcal.errors import UsageError
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
    guesses = [encoding] if encoding else _guesses(content)
    for guess in guesses:
        try:
            return content.decode(guess).removeprefix("\ufeff"), guess
        except UnicodeDecodeError:
            continue
        except (LookupError, UnicodeError, ValueError):
            raise UsageError(
                f"--encoding {shown(guess)[1:-1]}: unknown; take utf-8, utf-16, gbk or another of Python's"
            ) from None
    raise UsageError(f"{path} is not written in {guesses[0]}; leave out --encoding or name another")


def _guesses(content: bytes) -> list[str]:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return ["utf-16"]
    begin = content[:4000]
    if begin.count(0) > len(begin) // 4:
        return ["utf-16-le" if begin[1::2].count(0) >= begin[::2].count(0) else "utf-16-be"]
    if content.startswith(codecs.BOM_UTF8):
        return ["utf-8-sig"]
    return ["utf-8", *_legacy(content[:_BEGINNING]), "latin-1"]


def _legacy(begin: bytes) -> list[str]:
    """Return the encodings of one or two bytes a letter, the likeliest first."""
    # letters of Western Europe stand alone among ASCII, Chinese and Cyrillic ones come together
    usual = _EASTERN if re.search(rb"[\x80-\xff]{2}", begin) else _WESTERN
    return sorted(usual, key=lambda encoding: -familiarity(begin.decode(encoding, "ignore")))
