"""Numbers as programs write them: in ASCII, with Fortran's exponents, or saying that they are none."""

import re

# 1.5, -.5E+3, 1.5D-3, 1.5-101 (an exponent of three digits takes the letter's place). Not what Python reads beside:
# 1_000, digits of other scripts.
NUMBER = r"[-+]?(?:[0-9]{1,400}\.?[0-9]{0,400}|\.[0-9]{1,400})(?:[EeDd]?[-+][0-9]{1,9}|[EeDd][0-9]{1,9})?"
_NUMBER = re.compile(rf"({NUMBER})", re.ASCII)
_PARTS = re.compile(r"([-+]?[0-9.]+)[EeDd]?([-+]?[0-9]*)", re.ASCII)
_NONE = re.compile(r"[-+]?(nan|inf|infinity)|\*+", re.IGNORECASE | re.ASCII)


def number_of(text: str) -> float | None:
    """Return the number that a text is, NaN where it says that there is none or it did not fit; None for any other.

    >>> [number_of(text) for text in ("1.5-101", " -2.5D+01", "****", "1_000", "12 N")]
    [1.5e-101, -25.0, nan, None, None]
    """
    text = text.strip()
    if _NUMBER.fullmatch(text):
        parts = _PARTS.fullmatch(text)
        assert parts is not None
        return float(f"{parts[1]}e{parts[2] or 0}")
    return float("nan") if _NONE.fullmatch(text) else None
