"""Conversion of validation errors of pydantic into plain messages with a remedy."""

import re
from collections.abc import Mapping
from numbers import Real
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from stemcal.errors import UsageError
from stemcal.formats import listed, nearest
from stemcal.study.reading.json_schema import keys_of, meaning_of, section_with
from stemcal.study.types.factor import Factor
from stemcal.study.types.field_types import Number, Quantity, Size
from stemcal.study.types.strict_yaml import Finding, NodePath, resolve
from stemcal.study.types.units import from_internal, parse_unit, with_point

_KINDS = {
    "string_type": ("text", "enclose the value in quotes"),
    "float_type": ("a number", "write a plain number, such as 0.3"),
    "int_type": ("a whole number", "write a whole number without a decimal point or unit"),
    "tuple_type": ("a list", "write each entry on a separate line that begins with `-`"),
    **dict.fromkeys(("dict_type", "model_type"), ("a mapping", "write lines of the form `key: value` below this key")),
}
_BOUNDS = {
    "greater_than": ("must be above", "gt", "write a number above {:g}"),
    "greater_than_equal": ("must not be below", "ge", "write {:g} or more"),
    "less_than": ("must be below", "lt", "write a number below {:g}"),
    "less_than_equal": ("must not be above", "le", "write {:g} or less"),
}
_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?(?=$|\s*[A-Za-z%°/]+[0-9]?$)")


def finding_of(error: Mapping[str, Any], path: NodePath, shown_path: NodePath) -> Finding:
    """Return an entry of pydantic's `errors()` as a finding at `path`.

    `shown_path` is `path` with the kinds of solvers and tests, as in the JSON schema, to look up known keys.
    """
    kind, value, context = error["type"], error["input"], error.get("ctx", {})
    if kind == "stemcal":
        return Finding(path, context["message"], context["remedy"])
    if kind == "missing":
        key, meaning = str(path[-1]), meaning_of(shown_path)
        return Finding(path[:-1], f"{key!r} is missing", f"add a line {key}: …{meaning and f'  # {meaning}'}")
    if kind == "extra_forbidden":
        return _unknown_key(path, shown_path)
    if kind == "literal_error":
        choices = [part.strip().strip("'") for part in context["expected"].replace(" or ", ", ").split(", ")]
        near = nearest(value, choices) if isinstance(value, str) else None
        remedy = f"did you mean {near}?" if near else f"write {listed(choices)}"
        return Finding(path, f"{_show(value)} is not an allowed value", remedy)
    if kind in ("too_short", "string_too_short"):
        return _too_short(value.strip() if isinstance(value, str) else value, path)
    if kind in ("too_long", "string_too_long"):
        remedy = f"shorten the value to a length of at most {context.get('max_length')}"
        return Finding(path, f"the value is too long (length {len(value)})", remedy)
    if kind in _KINDS:
        return Finding(path, *_wrong_kind(value, *_KINDS[kind]))
    if kind in _BOUNDS:
        words, key, remedy = _BOUNDS[kind]
        return Finding(path, f"{_show(value)} {words} {context[key]:g}", remedy.format(context[key]))
    return Finding(path, f"{_show(value)}: {error['msg']}", "correct the value")


def _wrong_kind(value: Any, wanted: str, remedy: str) -> tuple[str, str]:
    if value is None:
        return "the value is empty", f"write {wanted}"
    if isinstance(value, str) and re.match(r"\s*[-+]?[0-9]*,[0-9]", value):
        return f"{_show(value)} has a decimal comma", f"write {with_point(value)}"
    if isinstance(value, str) and wanted.endswith("number") and (number := _NUMBER.match(value.strip())):
        return f"{_show(value)} is not {wanted}", f"write {number[0]} without quotes or a unit"
    return f"{_show(value)} is not {wanted}", remedy


def _unknown_key(path: NodePath, shown_path: NodePath) -> Finding:
    key = str(path[-1])
    known = keys_of(shown_path[:-1]) or keys_of(path[:-1])  # `shown_path` is not in the schema if `kind` is wrong
    near = nearest(key, known)
    section = None if key == "kind" else section_with(key)  # a `kind` cannot be moved to another section
    if near:
        remedy = f"did you mean {near}?"
    elif section:
        remedy = f"move the key to the `{section}` section"
    else:
        remedy = f"remove the key, or use {listed(known)}"
    return Finding(path, f"unknown key {key[:60]!r}", remedy, at_key=True)


def _too_short(value: Any, path: NodePath) -> Finding:
    if value:
        return Finding(path, f"{_show(value)} is too short", "write a longer value")
    several = isinstance(value, list | tuple)
    remedy = "write at least one entry, on a line that begins with `-`" if several else "write a value"
    return Finding(path, "the value is empty", remedy)


def _show(value: Any) -> str:
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return "a list"
    if value is None:
        return "an empty value"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    text = repr(value)
    return text if len(text) <= 62 else text[:59] + "..."


def checked(kind: Any, value: object, name: str) -> Any:
    """Validate a value from Python or the command line, such as ``"8 mm"``, by a type of the model, such as `Size`.

    Raises `UsageError` if the value is invalid; the message calls the value `name`.
    """
    try:
        return TypeAdapter(kind).validate_python(value)
    except ValidationError as error:
        wrong = finding_of(error.errors(include_url=False)[0], (name,), (name,))
        raise UsageError(f"{name}: {wrong.message}; {wrong.remedy}") from None


def checked_number(value: object, name: str) -> float:
    """Return a number of any numeric type as a float; raise `UsageError` for other values and for bool."""
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    return float(checked(Number, float(value) if is_number else value, name))  # type: ignore[arg-type]


def level_of(factor: Factor, level: float | str) -> float:
    """Return a level in the unit of its factor, from a number or a quantity such as ``"18 MPa"``."""
    level = _number_or_text(level) if isinstance(level, str) else level
    if not isinstance(level, str):
        return checked_number(level, factor.name)
    inside = checked(Annotated[float, Quantity(parse_unit(factor.unit).dimension)], level, factor.name)
    return from_internal(inside, factor.unit)


def typed_size(text: str, name: str) -> float:
    """Return a length typed on the command line, mm."""
    return float(checked(Size, _number_or_text(text), name))


def _number_or_text(text: str) -> float | str:
    value = resolve(text)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else text
