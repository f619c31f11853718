"""Frozen dataclasses as JSON and back: a key per field, in the order of the fields.

Dictionaries exist only at this border. What a field's type does not say, its metadata does: `absent` fields have no
key where they hold nothing, `inline` ones spread the keys of a dataclass of their own in place.
"""

from __future__ import annotations

import dataclasses
import functools
import re
import types
import typing
from collections.abc import Callable, Hashable, Mapping
from typing import Any, ClassVar, TypeVar, Union, get_args, get_origin

T = TypeVar("T")


@typing.dataclass_transform(frozen_default=True)
class Tagged:
    """A frozen dataclass of which there are several kinds: in JSON `kind` tells which one, beside its fields."""

    kind: ClassVar[str]
    kinds: ClassVar[dict[str, type[Tagged]]] = {}
    """Every kind of the modules that are imported, by its name."""

    def __init_subclass__(cls, kind: str = "") -> None:
        """Make a frozen dataclass of it, its kind named after its class if not otherwise: ``flat_response``."""
        dataclasses.dataclass(frozen=True)(cls)
        cls.kind = kind or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()
        Tagged.kinds[cls.kind] = cls

    def tags(self) -> dict[str, str]:
        """Return the keys that come before those of the fields."""
        return {"kind": self.kind}


def absent(default: Any = None) -> Any:
    """Return a field that has no key in JSON where it holds None or nothing."""
    return dataclasses.field(default=default, metadata={"absent": True})


def inline(default: Any = dataclasses.MISSING) -> Any:
    """Return a field whose own fields are keys beside those of the others; none of them where it holds None."""
    return dataclasses.field(default=default, metadata={"inline": True})


def key(name: str) -> Any:
    """Return a field whose key in JSON is called otherwise."""
    return dataclasses.field(metadata={"key": name})


def to_json(thing: Any) -> Any:
    """Return dataclasses as dictionaries, tuples as lists, all the way down."""
    if dataclasses.is_dataclass(thing) and not isinstance(thing, type):
        tags = thing.tags() if isinstance(thing, Tagged) else {}
        return tags | {key: value for field in dataclasses.fields(thing) for key, value in _keys(field, thing)}
    if isinstance(thing, Mapping):
        return {key: to_json(value) for key, value in thing.items()}
    if isinstance(thing, list | tuple):
        return [to_json(value) for value in thing]
    return thing


def _keys(field: dataclasses.Field[Any], thing: Any) -> list[tuple[str, Any]]:
    value = getattr(thing, field.name)
    if field.metadata.get("inline"):
        return [] if value is None else list(to_json(value).items())
    if field.metadata.get("absent") and _is_nothing(value):
        return []
    return [(_key(field), to_json(value))]


def _is_nothing(value: Any) -> bool:
    return value is None or value is False or (isinstance(value, tuple | Mapping) and not value)


def _key(field: dataclasses.Field[Any]) -> str:
    return str(field.metadata.get("key", field.name))


def from_json(kind: type[T], given: Any) -> T:
    """Return what was written by `to_json`; keys that the type does not know are passed over.

    Raises
    ------
    ValueError
        If a key is missing, or holds something else than its field; the message has the path to it.
    """
    read: Reader = _reader(kind)
    return typing.cast(T, read(given, ""))


Reader = Callable[[Any, str], Any]


def _reader(kind: Any) -> Reader:
    known: Hashable = kind
    return _made_reader(known)


@functools.cache
def _made_reader(kind: Any) -> Reader:
    """Return what reads a value of some type, given the value and the path to it."""
    if kind is Any:
        return lambda given, _path: given
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        return _tagged_reader(kind) if issubclass(kind, Tagged) else _dataclass_reader(kind)
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return _optional_reader(inner)
    if origin is typing.Literal:
        return _reader(type(inner[0]))
    if isinstance(origin, type) and issubclass(origin, tuple):
        return _tuple_reader(origin, inner)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _mapping_reader(inner[1])
    accepted: Any = (int, float) if kind is float else (kind,)
    return functools.partial(_plain, accepted)


def _plain(accepted: tuple[type, ...], given: Any, path: str) -> Any:
    if not isinstance(given, accepted) or (isinstance(given, bool) and bool not in accepted):
        raise ValueError(f"{path} should be {accepted[-1].__name__}, not {given!r:.60}")
    return given


def _optional_reader(kinds: tuple[Any, ...]) -> Reader:
    (inner,) = (kind for kind in kinds if kind is not type(None))
    read = _reader(inner)
    return lambda given, path: None if given is None else read(given, path)


def _tuple_reader(origin: type, inner: tuple[Any, ...]) -> Reader:
    """Read a list of any length (`tuple[X, ...]`, `Rows[X]`), or one of as many as there are types."""
    if len(inner) == 1 or inner[-1] is Ellipsis:
        one = _reader(inner[0])
        return lambda given, path: origin(
            one(x, f"{path}[{i}]") for i, x in enumerate(_plain((list, tuple), given, path))
        )
    each = [_reader(kind) for kind in inner]
    return lambda given, path: tuple(
        read(x, path) for read, x in zip(each, _plain((list, tuple), given, path), strict=True)
    )


def _mapping_reader(inner: Any) -> Reader:
    read = _reader(inner)
    return lambda given, path: {key: read(x, f"{path}.{key}") for key, x in _plain((dict,), given, path).items()}


def _dataclass_reader(kind: type) -> Reader:
    hints = typing.get_type_hints(kind)
    fields = [(field, _reader(hints[field.name]), _key(field)) for field in dataclasses.fields(kind)]

    def read(given: Any, path: str) -> Any:
        _plain((dict,), given, path)
        values = {}
        for field, reader, name in fields:
            place = f"{path}.{name}".lstrip(".")
            if field.metadata.get("inline"):
                if field.default is dataclasses.MISSING or _has_keys(hints[field.name], given):
                    values[field.name] = reader(given, path)
            elif name in given:
                values[field.name] = reader(given[name], place)
            elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
                raise ValueError(f"{place} is missing")
        return kind(**values)

    return read


def _tagged_reader(base: type[Tagged]) -> Reader:
    """Read one of the kinds of `base`; the kind is looked up when a value is read, since modules declare their own."""

    def read(given: Any, path: str) -> Any:
        name = _plain((dict,), given, path).get("kind")
        found = Tagged.kinds.get(name) if isinstance(name, str) else None
        if found is None or not issubclass(found, base):
            raise ValueError(f"{path}.kind is not a known one: {name!r:.60}")
        return _dataclass_reader(found)(given, path)

    return read


def _has_keys(kind: Any, given: Mapping[str, Any]) -> bool:
    """Tell whether a mapping has keys of an optional dataclass."""
    (inner,) = (part for part in get_args(kind) if part is not type(None))
    return any(_key(field) in given for field in dataclasses.fields(inner))
