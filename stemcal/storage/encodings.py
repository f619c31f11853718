"""Text from outside: its encoding is detected, and it is made fit to be shown."""

import codecs
import csv
import io
import re
from collections.abc import Iterable, Iterator


def decode(content: bytes) -> str | None:
    """Return the text of UTF-8, UTF-16 or GBK bytes, with or without a byte order mark; None if none fits."""
    found = decoded(content, [*_unicodes(content), "gbk"])
    return None if found is None else found[0]


def decoded(content: bytes, encodings: Iterable[str]) -> tuple[str, str] | None:
    """Return the text in the first of the encodings that fits, and that encoding; None if none does."""
    for encoding in encodings:
        try:
            return content.decode(encoding).removeprefix("\ufeff"), encoding
        except UnicodeDecodeError:
            continue
    return None


def _unicodes(content: bytes) -> Iterator[str]:
    """Yield the encoding of Unicode that a text may be in: by its byte order mark, its zeros, or else UTF-8."""
    begin = content[:4000]
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        yield "utf-16"
    elif 0 in begin[:2] or begin.count(0) > len(begin) // 4:
        yield "utf-16-le" if begin[1::2].count(0) >= begin[::2].count(0) else "utf-16-be"
    else:
        yield "utf-8"


def guesses(content: bytes) -> Iterator[str]:
    """Yield Unicode, then, unless it is UTF-16, GB18030 and the encodings of Western Europe."""
    yield from (unicode := list(_unicodes(content)))
    if unicode == ["utf-8"]:
        # letters of Western Europe are isolated among ASCII, Chinese ones come together
        yield from ("gb18030", "cp1252") if re.search(rb"[\x80-\xff]{2}", content) else ("cp1252",)
        yield "latin-1"


def lenient(content: bytes) -> str:
    """Return the text of a program, which should be UTF-8; what is not becomes the replacement character."""
    return content.decode("utf-8", "replace").removeprefix("\ufeff")


# ---- made fit to be shown: nothing that commands a terminal, no cell that a spreadsheet executes


# C0 and C1 controls but tab and line feed, surrogates, what turns the direction of writing or ends a line unseen, and
# what has neither width nor use (the joiners U+200C and U+200D have one).
_RANGES = (
    "00-08 0b-1f 7f-9f ad 34f 61c 115f-1160 17b4-17b5 180e 200b 200e-200f 2028-202e 2060-206f 2800 3164 d800-dfff "
)
_RANGES += "feff ffa0 fff0-fffb fffe-ffff"
_ENDS = [[int(end, 16) for end in part.split("-")] for part in _RANGES.split()]
_COMMANDS = [code for ends in _ENDS for code in range(ends[0], ends[-1] + 1)]
_SPELLED = {code: f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" for code in _COMMANDS}

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?( ?\*{1,2})?")
_FORMULA = re.compile(r"\s*[=+\-@\uFF1D\uFF0B\uFF0D\uFF20\u2212]|[\t\r\n]")
_WITHIN = re.compile(r"([;|\t\r\n]\s*)(?=[=+\-@\uFF1D\uFF0B\uFF0D\uFF20\u2212])")


def visible(text: str) -> str:
    """Return a text with its control and invisible characters spelled out; tabs and line ends stay."""
    return text.translate(_SPELLED)


def in_a_line(text: str) -> str:
    """Return a text without control characters in one line."""
    return visible(re.sub(r"\s*[\t\r\n]\s*", " ", text))


def unprintable(text: str) -> str | None:
    """Return the first character that is none to be read, spelled out; None if there is none."""
    return next((_SPELLED.get(ord(c), repr(c)[1:-1]) for c in text if ord(c) in _SPELLED or c in "\t\n"), None)


def csv_text(rows: Iterable[Iterable[object]], newline: str = "\n") -> str:
    """Return rows as CSV; cells of None are empty, texts that a spreadsheet would execute begin with an apostrophe."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator=newline)
    writer.writerows([_harmless(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    return text.getvalue()


def _harmless(cell: str) -> str:
    """Return a text that is one in every spreadsheet, also where those take another separator."""
    if _NUMBER.fullmatch(cell):
        return cell
    cell = _WITHIN.sub(r"\1'", visible(cell))
    return f"'{cell}" if _FORMULA.match(cell) else cell
