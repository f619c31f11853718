"""Single values from Python and from the command line, checked as those of a spec are."""

import re
from numbers import Real
from os import PathLike, fspath
from pathlib import Path
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from stemcal.errors import UsageError
from stemcal.study.model import Factor
from stemcal.study.reading.messages import finding_of
from stemcal.study.types.field_types import Number, Quantity, Size
from stemcal.study.types.units import from_internal, parse_unit

_TYPED = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?", re.ASCII)


def checked(kind: Any, given: object, name: str) -> Any:
    """Return a value of a type of the model, such as `Size` for ``8`` or ``"8 mm"``.

    Raises
    ------
    UsageError
        With what is wrong with it, and the remedy.
    """
    try:
        return TypeAdapter(kind).validate_python(given)
    except ValidationError as error:
        wrong = finding_of(error.errors(include_url=False)[0], (name,), (name,))
        raise UsageError(f"{name}: {wrong.message}; {wrong.remedy}") from None


def checked_number(given: object, name: str) -> float:
    """Return a number of any of Python's kinds, a truth value excepted; raise `UsageError` for another thing."""
    is_number = isinstance(given, Real) and not isinstance(given, bool)
    return float(checked(Number, float(given) if is_number else given, name))  # type: ignore[arg-type]


def checked_path(given: object, name: str) -> Path:
    """Return a path that Python gives; raise `UsageError` for what names no file or folder."""
    text = fspath(given) if isinstance(given, str | PathLike) else None
    if not isinstance(text, str):
        raise UsageError(f"{name}: {type(given).__name__} is not a path; pass a string or a pathlib.Path")
    if not text.strip() or "\0" in text:
        raise UsageError(f"{name}: {text!r} is not a path; give a file or a folder")
    return Path(text)


def level_of(factor: Factor, given: float | str) -> float:
    """Return a level in the unit of its factor: a number, or a quantity such as ``"18 MPa"``."""
    if not isinstance(given, str):
        return checked_number(given, factor.name)
    inside = checked(Annotated[float, Quantity(parse_unit(factor.unit).dimension)], given, factor.name)
    return from_internal(inside, factor.unit)


def typed_level(factor: Factor, text: str) -> float:
    """Return a level typed on the command line; a number has the unit of the factor."""
    return level_of(factor, _number_or_text(text))


def typed_size(text: str, name: str) -> float:
    """Return a length typed on the command line, mm."""
    return float(checked(Size, _number_or_text(text), name))


def _number_or_text(text: str) -> float | str:
    return float(text) if _TYPED.fullmatch(text) else text
