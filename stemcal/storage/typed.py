"""Convert frozen dataclasses to JSON and back with pydantic: one key per field, in the order of the fields.

Two kinds of fields differ from this. An `absent` field has no key while it is empty. An `inline` field, which contains
another dataclass, has no key either: the keys of that dataclass are written in its place.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
import typing
from collections.abc import Mapping
from operator import methodcaller
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from pydantic import TypeAdapter

T = TypeVar("T")
_INLINE = "<"  # first character of the alias of a field made by `inline()`
_count = itertools.count()


def absent(default: Any = None) -> Any:
    """Return a dataclass field that is left out of the JSON while its value is None, False or empty."""
    return dataclasses.field(default=default, metadata={"exclude_if": lambda value: value in (None, False, (), {})})


def inline() -> Any:
    """Return a field of a `Spread` dataclass: the fields of its value are written in its place, without nesting."""
    return dataclasses.field(metadata={"alias": f"{_INLINE}{next(_count)}"})


class Spread:
    """Base class of dataclasses with `inline` fields."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        flat = core_schema.wrap_serializer_function_ser_schema(_flat)
        aliases = [field.metadata.get("alias", "") for field in dataclasses.fields(source)]
        nest = functools.partial(_nested, [alias for alias in aliases if alias.startswith(_INLINE)])
        inner = dict(handler.resolve_ref_schema(handler(source)))
        ref = inner.pop("ref")  # the outer schema gets the name (reference) of the inner one
        return core_schema.no_info_before_validator_function(nest, inner, ref=ref, serialization=flat)


def _nested(inlined: list[str], value: Any) -> Any:
    """Copy all keys of a mapping to each inline field, which reads its part; turn lists into tuples for validation."""
    if not isinstance(value, Mapping):
        return value
    content = _tuples(value)
    return content | dict.fromkeys(inlined, content)


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tuples(item) for key, item in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _flat(thing: Any, handler: Any) -> dict[str, Any]:
    content: dict[str, Any] = {}
    for name, value in handler(thing).items():
        content |= value if name.startswith(_INLINE) else {name: value}
    return content


@functools.cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def to_json(thing: Any) -> Any:
    """Convert dataclasses to dictionaries and tuples to lists, at all levels of nesting."""
    if dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        of_numpy = methodcaller("tolist")
        return _adapter(type(thing)).dump_python(thing, mode="json", by_alias=True, warnings=False, fallback=of_numpy)
    if isinstance(thing, Mapping):
        return {key: to_json(value) for key, value in thing.items()}
    if isinstance(thing, list | tuple):
        return [to_json(value) for value in thing]
    return thing


def from_json(kind: type[T], content: Any) -> T:
    """Return an object of class `kind` from its JSON; extra keys are ignored, `ValueError` names a wrong key."""
    from pydantic import ValidationError

    try:
        reader = _adapter(kind)  # type: ignore[arg-type]  # a type is hashable
        return typing.cast(T, reader.validate_json(json.dumps(content), strict=True))
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
        keys = (key for key in wrong["loc"] if not str(key).startswith(_INLINE))
        path = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")  # rows[0].x
        value = "" if wrong["type"] == "missing" else f" (found {wrong['input']!r:.60})"
        raise ValueError(f"{path}: {wrong['msg']}{value}".removeprefix(": ")) from None
