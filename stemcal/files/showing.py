"""Text of others made fit to be shown: no character that commands a terminal, no cell that a spreadsheet executes."""

import csv
import io
import re
from collections.abc import Iterable

# C0 and C1 controls but tab and line feed, surrogates, and what turns the direction of writing or ends a line unseen.
_COMMANDS = [*range(0x20), *range(0x7F, 0xA0), *range(0xD800, 0xE000)]
_COMMANDS += [0x061C, 0x200E, 0x200F, 0x2028, 0x2029, *range(0x202A, 0x202F), *range(0x2066, 0x206A), 0xFEFF, 0xFFFE]
_SPELLED = {code: f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" for code in _COMMANDS if code not in (9, 10)}

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?( ?\*{1,2})?")
_FORMULA = re.compile(r"\s*[=+\-@\uFF1D\uFF0B\uFF0D\uFF20\u2212]|[\t\r\n]")
_WITHIN = re.compile(r"([;|\t\r\n]\s*)(?=[=+\-@\uFF1D\uFF0B\uFF0D\uFF20\u2212])")


def visible(text: str) -> str:
    r"""Return a text with its control characters spelled out; tabs and line ends stay.

    >>> print(visible("\x1b[31mred\0"))
    \x1b[31mred\x00
    """
    return text.translate(_SPELLED)


def in_a_line(text: str) -> str:
    r"""Return a text without control characters in one line.

    >>> in_a_line("a\n b\tc")
    'a b c'
    """
    return visible(re.sub(r"\s*[\t\r\n]\s*", " ", text))


def unprintable(text: str) -> str | None:
    r"""Return the first character that is none to be read, spelled out; None if there is none.

    >>> unprintable("x\x1b"), unprintable("切割 °")
    ('\\x1b', None)
    """
    return next((_SPELLED.get(ord(c), repr(c)[1:-1]) for c in text if ord(c) in _SPELLED or c in "\t\n"), None)


def csv_text(rows: Iterable[Iterable[object]], newline: str = "\n") -> str:
    """Return rows as CSV; cells of None are empty, texts that a spreadsheet would execute begin with an apostrophe.

    >>> print(csv_text([["-2+3+cmd|' /C calc'!A0", "-4.75 **", -1.5, None]]), end="")
    '-2+3+cmd|' /C calc'!A0,-4.75 **,-1.5,
    """
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
