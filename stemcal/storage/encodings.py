"""Detect the encoding of text files, and make text of unknown origin safe to print and to write to CSV."""

import codecs
import csv
import io
import re
from collections.abc import Iterable, Iterator


def decode(content: bytes) -> str | None:
    """Decode UTF-8, UTF-16 or GBK bytes, with or without a byte order mark; None if no encoding fits."""
    match = decoded(content, [*_unicodes(content), "gbk"])
    return None if match is None else match[0]


def decoded(content: bytes, encodings: Iterable[str]) -> tuple[str, str] | None:
    """Decode `content` with the first encoding that fits; return the text and the encoding, None if none fits."""
    for encoding in encodings:
        try:
            return content.decode(encoding).removeprefix("\ufeff"), encoding
        except UnicodeDecodeError:
            continue
    return None


def _unicodes(content: bytes) -> Iterator[str]:
    """Yield the most likely Unicode encoding: UTF-16 for a byte order mark or many zero bytes, otherwise UTF-8."""
    begin = content[:4000]
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        yield "utf-16"
    elif 0 in begin[:2] or begin.count(0) > len(begin) // 4:
        yield "utf-16-le" if begin[1::2].count(0) >= begin[::2].count(0) else "utf-16-be"
    else:
        yield "utf-8"


def guesses(content: bytes) -> Iterator[str]:
    """Yield possible encodings, the most likely first: UTF-16 alone if the content looks like it; otherwise UTF-8, then
    Chinese and Western European encodings, because the content may not be valid UTF-8.
    """
    yield from (unicode := list(_unicodes(content)))
    if unicode == ["utf-8"]:
        # Chinese text has pairs of bytes beyond ASCII; in Western European text, such bytes are isolated letters
        yield from ("gb18030", "cp1252") if re.search(rb"[\x80-\xff]{2}", content) else ("cp1252",)
        yield "latin-1"


def lenient(content: bytes) -> str:
    """Decode a program's output as UTF-8; invalid bytes become the replacement character."""
    return content.decode("utf-8", "replace").removeprefix("\ufeff")


# C0 and C1 control characters except tab and line feed, surrogates, characters that change the writing direction or
# end a line invisibly, and invisible characters without a function (the joiners U+200C and U+200D have one).
_RANGES = "00-08 0b-1f 7f-9f ad 34f 61c 115f-1160 17b4-17b5 180e 200b 200e-200f 2028-202e 2060-206f 2800 3164 "
_RANGES += "d800-dfff feff ffa0 fff0-fffb fffe-ffff"
_ENDS = [[int(end, 16) for end in part.split("-")] for part in _RANGES.split()]
_COMMANDS = [code for ends in _ENDS for code in range(ends[0], ends[-1] + 1)]
_SPELLED = {code: f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" for code in _COMMANDS}

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?( ?\*{1,2})?")
_FORMULA = re.compile(r"\s*[=+\-@\uFF1D\uFF0B\uFF0D\uFF20\u2212]|[\t\r\n]")
_WITHIN = re.compile(r"([;|\t\r\n]\s*)(?=[=+\-@\uFF1D\uFF0B\uFF0D\uFF20\u2212])")


def visible(text: str) -> str:
    r"""Escape control and invisible characters (``\x1b``, ``\u200b``); tabs and line ends are kept."""
    return text.translate(_SPELLED)


def in_a_line(text: str) -> str:
    """Join the lines of a text with spaces and escape its control characters."""
    return visible(re.sub(r"\s*[\t\r\n]\s*", " ", text))


def unprintable(text: str) -> str | None:
    """Return the first control or invisible character, escaped; None if there is none."""
    return next((_SPELLED.get(ord(c), repr(c)[1:-1]) for c in text if ord(c) in _SPELLED or c in "\t\n"), None)


def csv_text(rows: Iterable[Iterable[object]], newline: str = "\n") -> str:
    """Return CSV text of rows; None becomes an empty cell, and text that could run as a formula gets an apostrophe."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator=newline)
    writer.writerows([_harmless(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    return text.getvalue()


def _harmless(cell: str) -> str:
    if _NUMBER.fullmatch(cell):
        return cell
    # some spreadsheets split a cell at semicolons, tabs or bars: text behind these is protected as well
    cell = _WITHIN.sub(r"\1'", visible(cell))
    return f"'{cell}" if _FORMULA.match(cell) else cell
