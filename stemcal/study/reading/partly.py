"""What is good of a section that has something wrong in it, so that rules find every mistake at once."""

from collections.abc import Mapping, Sequence
from typing import Any, get_args, get_origin, get_type_hints

from pydantic import AliasChoices, BaseModel, TypeAdapter, ValidationError


def partly(kind: Any, given: Any, context: Mapping[str, Any]) -> Any:
    """Return a section without the fields that are wrong or missing; None if nothing of it can be read.

    Who asks for such a field gets an `AttributeError`, not its default: a rule that needs it has nothing to say.
    """
    if not (isinstance(kind, type) and issubclass(kind, BaseModel) and isinstance(given, dict)):
        return None
    if "kind" in kind.model_fields and given.get("kind") != kind.model_fields["kind"].default:
        return None  # another solver
    hints = get_type_hints(kind, include_extras=True)
    keys = {name: key for name in kind.model_fields for key in _keys(kind, name) if key in given}
    read = {name: _field(hints[name], given[key], context) for name, key in keys.items()}
    good = {name: value for name, value in read.items() if value is not None}
    section = kind.model_construct(_fields_set={*good}, **good)
    for name, field in kind.model_fields.items():
        if name not in good and (name in keys or field.is_required()):
            section.__dict__.pop(name, None)
    return section


def _keys(kind: type[BaseModel], name: str) -> Sequence[str]:
    """Return the keys that a field may have in a spec."""
    alias = kind.model_fields[name].validation_alias
    return [str(choice) for choice in alias.choices] if isinstance(alias, AliasChoices) else [str(alias or name)]


def _field(hint: Any, given: Any, context: Mapping[str, Any]) -> Any:
    """Return the value of a field, None if it is wrong; of a list the entries as far as they can be read."""
    try:
        return TypeAdapter(hint).validate_python(given, context=context)
    except ValidationError:
        entries = _entries(hint)
        if entries is None or not isinstance(given, list):
            return None
        read = [partly(entries, one, context) for one in given]
        return tuple(read) if read and None not in read else None


def _entries(hint: Any) -> Any:
    """Return the type of the entries of a list, None if it is none."""
    while hasattr(hint, "__metadata__"):
        hint = hint.__origin__
    return get_args(hint)[0] if get_origin(hint) is tuple else None
