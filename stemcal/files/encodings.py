"""Text in files that others wrote: which encoding it is in."""

import codecs
from collections.abc import Iterable, Iterator


def decode(content: bytes) -> str | None:
    """Return the text of UTF-8, UTF-16 or GBK bytes, with or without a byte order mark; None if none fits.

    >>> decode("力/N".encode("gbk")), decode("力/N".encode("utf-16-le")), decode(b"\\xff\\xff\\xff")
    ('力/N', '力/N', None)
    """
    found = decoded(content, [*unicodes(content), "gbk"])
    return None if found is None else found[0]


def decoded(content: bytes, encodings: Iterable[str]) -> tuple[str, str] | None:
    """Return the text in the first of the encodings that fits, and that encoding; None if none does."""
    for encoding in encodings:
        try:
            return content.decode(encoding).removeprefix("\ufeff"), encoding
        except UnicodeDecodeError:
            continue
    return None


def unicodes(content: bytes) -> Iterator[str]:
    """Yield the encoding of Unicode that a text may be in: by its byte order mark, its zeros, or else UTF-8."""
    begin = content[:4000]
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        yield "utf-16"
    elif 0 in begin[:2] or begin.count(0) > len(begin) // 4:
        yield "utf-16-le" if begin[1::2].count(0) >= begin[::2].count(0) else "utf-16-be"
    else:
        yield "utf-8"


def lenient(content: bytes) -> str:
    """Return the text of a program, which should be UTF-8; what is not becomes the replacement character."""
    return content.decode("utf-8", "replace").removeprefix("\ufeff")
