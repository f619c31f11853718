"""Lengths that may follow the stem: ``1 mm``, or ``d/8``, an eighth of its outer diameter."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, InstanceOf, PlainSerializer, TypeAdapter, WithJsonSchema
from pydantic_core import core_schema

from stemcal.study.types.field_types import Quantity, complain

_SHARE = re.compile(r"d\s*/\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)", re.ASCII)
_SHARE_IN_SCHEMA = r"d */ *([0-9]+(\.[0-9]*)?|\.[0-9]+)"


@dataclass(frozen=True)
class Length:
    """So many mm, or one part in `divisor` of the stem's outer diameter.

    >>> Length(0.5).at(8.0), Length(divisor=8.0).at(11.0)
    (0.5, 1.375)
    >>> str(Length(0.5)), str(Length(divisor=8.0))
    ('0.5 mm', 'd/8')
    """

    mm: float = 0.0
    divisor: float | None = None

    @classmethod
    def of(cls, text: str) -> Length:
        """Read a length as it is written.

        >>> Length.of("d/24"), Length.of("0.5 mm")
        (Length(mm=0.0, divisor=24.0), Length(mm=0.5, divisor=None))
        """
        return TypeAdapter(StemLength).validate_python(text)

    def at(self, condition: float) -> float:
        """Return the length at a stem of this outer diameter, mm."""
        return self.mm if self.divisor is None else condition / self.divisor

    def __str__(self) -> str:
        return f"{self.mm:g} mm" if self.divisor is None else f"d/{self.divisor:g}"


def _reader(millimetres: Quantity) -> BeforeValidator:
    def read(given: Any, info: core_schema.ValidationInfo) -> Any:
        if isinstance(given, Length):
            return given
        share = _SHARE.fullmatch(given.strip()) if isinstance(given, str) else None
        if share is None:
            return Length(millimetres.read(given, info))
        if not 0.1 <= float(share[1]) <= 1000.0:
            raise complain(f"{given} is no sensible part of a diameter", "divide by 0.1 to 1000, such as d/8")
        return Length(divisor=float(share[1]))

    return BeforeValidator(read)


def _schema(millimetres: Quantity) -> WithJsonSchema:
    pattern = str(millimetres.json_schema()["pattern"])
    return WithJsonSchema({"type": "string", "pattern": f"{pattern}|^{_SHARE_IN_SCHEMA}$", "examples": ["1 mm", "d/8"]})


_ABOVE_ZERO, _FROM_ZERO = Quantity("length", above=0), Quantity("length", at_least=0)
_AS_TEXT = PlainSerializer(str, return_type=str)

StemLength = Annotated[InstanceOf[Length], _reader(_ABOVE_ZERO), _AS_TEXT, _schema(_ABOVE_ZERO)]
StemLengthOrZero = Annotated[InstanceOf[Length], _reader(_FROM_ZERO), _AS_TEXT, _schema(_FROM_ZERO)]
