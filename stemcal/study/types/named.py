"""Responses and conditions declared in a spec, values in their units, and placeholders in template files."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationInfo
from pydantic_core import core_schema

from stemcal.storage.plain import MIB, read_plain
from stemcal.study.types import units
from stemcal.study.types.field_types import MOST, Quantity, complain
from stemcal.vocabulary import CUTTING, DIAMETER, FIRST, FORCE, NOWHERE, Variable, Vocabulary


def naming_of(responses: Sequence[Any], conditions: Sequence[Any] | None) -> Vocabulary:
    """Return the vocabulary of a study from the quantities (`OwnQuantity`) that it declares.

    A study that declares responses but no conditions has no condition. If it declares neither, it is a cutting study.
    """
    if not responses and conditions is None:
        return CUTTING
    condition = _named(conditions[0], "x") if conditions else None
    if not responses:
        return Vocabulary(condition=condition)
    return Vocabulary(condition, tuple(_named(response, "Y") for response in responses))


def _named(declared: Any, symbol: str) -> Variable:
    """Return the variable of a declared quantity: the built-in one if the declaration equals force or diameter."""
    for own in (FORCE, DIAMETER):
        if (declared.name, declared.unit, declared.label) == (own.name, own.unit, None):
            return own
    label = declared.label or declared.name.replace("_", " ").capitalize()
    return Variable(declared.name, label, declared.symbol or symbol, declared.unit)


def quantity(raw: Any, named: Variable) -> float:
    """Convert a number or a text with a unit to the unit of `named`; raise the error of `complain` for other values."""
    if not isinstance(raw, str):
        if isinstance(raw, bool) or not isinstance(raw, int | float):
            raise complain("the value is not a number", f"write a value such as {named.text(1.0)!r}")
        return float(raw)
    try:
        unit = units.parse_unit(named.unit)
    except units.UnitError:  # a unit unknown to stemcal: its name can only be removed from the text
        try:
            return float(raw.strip().removesuffix(named.unit).strip())
        except ValueError:
            remedy = f"write '1 {named.unit}'"
            raise complain(f"{raw[:60]!r} is not a value in {named.unit}", remedy) from None
    try:
        value = units.parse(raw, unit.dimension)
    except units.UnitError as error:
        raise complain(error.message, error.remedy) from None
    return as_written(value, unit.name)


def as_written(value: float, unit: str) -> float:
    """Convert an internal value to a unit, rounded to 12 digits: 0.25 to 25 %, not to 25.000000000000004 %."""
    internal = units.INTERNAL[units.parse_unit(unit).dimension] == units.parse_unit(unit).name
    return value if internal else float(f"{units.from_internal(value, unit):.12g}")


class OwnCondition(Quantity):
    """A value of the condition of a study: the stem diameter, or the condition that the spec declares."""

    def read(self, raw: Any, info: core_schema.ValidationInfo) -> float:
        """Return the value (a diameter in mm). From Python, any number is valid: the declared condition is unknown."""
        if info.context is None and isinstance(raw, int | float) and abs(raw) <= MOST:
            return float(raw)
        naming: Vocabulary = (info.context or {}).get("naming", CUTTING)
        if (condition := naming.condition) == DIAMETER:
            return super().read(raw, info)
        if condition is None and raw != NOWHERE:
            remedy = "declare a condition in the `conditions` section, or remove this key"
            raise complain("the study has no condition", remedy)
        return NOWHERE if condition is None else quantity(raw, condition)


def responses_by_name(raw: Any, info: ValidationInfo) -> Any:
    """Return the names in a list of responses, with `FIRST` for the first one; ``all`` means all measured responses."""
    if info.context is None:
        return raw
    naming: Vocabulary = info.context.get("naming", CUTTING)
    known = [response.name for response in naming.responses]
    if raw == "all":
        measured = info.context.get("measured")
        raw = [name for name in known if measured is None or name in measured]
    if not isinstance(raw, list | tuple) or not raw or any(name not in known for name in raw):
        raise complain("the value is neither `all` nor a list of responses", f"choose from {', '.join(known)}")
    return tuple(FIRST if name == naming.response.name else name for name in raw)


SEED, REPLICATE = CHANCE = ("seed", "replicate")
MAX_BYTES = 50 * MIB

_PLACEHOLDER = re.compile(rb"\{\{([^{}\r\n]{0,200})\}\}")


def template_bytes(path: Path) -> bytes:
    """Return the content of a template file; raise `OSError` if it is not a regular file, or too large."""
    return read_plain(path, MAX_BYTES)


def placeholders(content: bytes) -> Iterator[tuple[int, str]]:
    """Yield (line, name) of every placeholder ``{{name}}``."""
    for match in _PLACEHOLDER.finditer(content):
        yield content.count(b"\n", 0, match.start()) + 1, match[1].decode("utf-8", "replace").strip()


def fill(content: bytes, values: Mapping[str, str]) -> bytes:
    """Return the content with each placeholder replaced by its value; all other bytes are unchanged."""
    return _PLACEHOLDER.sub(lambda match: values[match[1].decode("utf-8", "replace").strip()].encode(), content)
