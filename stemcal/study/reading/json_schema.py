"""The JSON schema of a spec, with which editors check specs, and stemcal looks up keys and their meanings."""

import ast
import functools
from collections.abc import Iterator
from inspect import getsource
from itertools import pairwise
from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from stemcal.study.model.study import StudyForm
from stemcal.study.types.field_types import Frozen
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.study.types.stage_kind import STAGES
from stemcal.study.types.strict_yaml import NodePath

_DEFS = "#/$defs/"


@functools.cache
def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a spec in YAML; quantities are texts with a unit."""
    schema = StudyForm.model_json_schema(schema_generator=_Described)
    rows = schema["$defs"].pop("Targets")
    schema["properties"]["targets"] |= {"type": "array", "items": rows["items"], "minItems": 1}
    del schema["properties"]["targets"]["$ref"]
    schema["required"].remove("targets")
    schema["anyOf"] = [{"required": ["targets"]}, {"required": ["goal"]}]
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "stemcal study"
    results = schema["$defs"]["CommandSolver"]["properties"]["result"]
    several = {key: results.pop(key) for key in ("type", "additionalProperties", "maxProperties")}
    results["anyOf"] = [several["additionalProperties"], several]
    schema["$defs"]["Factor"]["required"] = ["name", "low", "high"]
    schema["$defs"]["TargetRow"]["additionalProperties"] = {"anyOf": [{"type": "string"}, {"type": "number"}]}
    for stage in STAGES.external:
        if (further := stage.section()) is not None:
            own = further.model_json_schema(schema_generator=_Described)
            schema["$defs"] = {**own.pop("$defs", {}), further.__name__: own, **schema["$defs"]}
            schema["properties"][stage.name] = {"$ref": f"{_DEFS}{further.__name__}"}
    for stage in STAGES.all:
        if stage.name in schema["properties"]:
            schema["properties"][stage.name]["description"] = " ".join((stage.purpose or f"{stage.title}.").split())
    return schema


class _Described(GenerateJsonSchema):
    """Adds the docstring of each field to the schema; pydantic's own option would read all sources in every command."""

    def model_schema(self, schema: core_schema.ModelSchema) -> dict[str, Any]:
        """Return the schema of a class with the descriptions of its keys."""
        described, model = super().model_schema(schema), schema["cls"]
        meanings = _meanings_of_fields(model)
        for name, field in model.__pydantic_fields__.items():
            if (node := described.get("properties", {}).get(field.validation_alias or name)) is not None:
                meaning = field.description or meanings.get(name) or node.get("description", "")
                node["description"] = " ".join(meaning.split())
        return described


def _meanings_of_fields(model: type) -> dict[str, str]:
    meanings = {}
    for kind in (kind for kind in reversed(model.__mro__) if issubclass(kind, Frozen)):
        try:
            section = ast.parse(getsource(kind)).body[0]
        except (OSError, TypeError):  # the class was created by a function, or its source is not available
            continue
        assert isinstance(section, ast.ClassDef)
        for field, below in pairwise(section.body):
            match field, below:
                case ast.AnnAssign(target=ast.Name(name)), ast.Expr(value=ast.Constant(str(text))):
                    meanings[name] = text
    return meanings


def section_places() -> dict[str, str]:
    """Return the place in a spec of each class of the model, such as ``targets[]``, by the name of the class."""
    uses: dict[str, dict[str, dict[str, list[str]]]] = {}
    for path, name in _classes():
        place = "".join(step if step == "[]" else f".{step}" for step in path if step[0] != "=").removeprefix(".")
        of_section = uses.setdefault(name, {}).setdefault(place.rpartition(".")[0], {})
        of_section.setdefault(place, []).extend(step[1:] for step in path if step[0] == "=")
    place_of_class = {}
    for name, sections in uses.items():
        # prefer a section that is no list, then the one with most keys of this class: `material` for `Growth`
        above, places = max(sections.items(), key=lambda section: (not section[0].endswith("]"), len(section[1])))
        (place, kinds), *others = places.items()
        place = f"{above}.*" if others and above else place
        place_of_class[name] = place + (f", kind: {', '.join(dict.fromkeys(kinds))}" if kinds else "")
    return place_of_class


@functools.cache
def _classes() -> tuple[tuple[tuple[str, ...], str], ...]:
    """Return (path, class name) of each class in a spec; in a path, [] is any list entry, =x the kind x, * any name."""
    return tuple(entry for key, node in json_schema()["properties"].items() for entry in _below(node, (key,)))


def _below(node: dict[str, Any], path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str]]:
    if "$ref" in node:
        name = node["$ref"].removeprefix(_DEFS)
        yield path, name
        for key, value in json_schema()["$defs"][name].get("properties", {}).items():
            yield from _below(value, (*path, key))
    kinds = {reference: f"={kind}" for kind, reference in node.get("discriminator", {}).get("mapping", {}).items()}
    for option in (*node.get("anyOf", ()), *node.get("oneOf", ()), *node.get("allOf", ())):
        yield from _below(option, (*path, kinds[option["$ref"]]) if kinds else path)
    for key, step in (("items", "[]"), ("additionalProperties", "*")):
        if isinstance(node.get(key), dict):
            yield from _below(node[key], (*path, step))


def _properties(path: NodePath) -> dict[str, Any]:
    """Return the schemas of the keys below `path`, by key; the path of a solver has its kind, ("solver", "deck")."""
    if not path:
        return dict(json_schema()["properties"])
    steps = ["[]" if isinstance(step, int) else step for step in path]
    names = [
        name
        for known, name in _classes()
        if len(known) == len(steps) and all(a.removeprefix("=") in (b, "*") for a, b in zip(known, steps, strict=True))
    ]
    return {key: node for name in names for key, node in json_schema()["$defs"][name]["properties"].items()}


def keys_of(path: NodePath) -> tuple[str, ...]:
    """Return the keys that the schema has below `path`."""
    return tuple(_properties(path))


def meaning_of(path: NodePath) -> str:
    """Return the description of the key at `path`, empty if it has none."""
    return str(_properties(path[:-1]).get(str(path[-1]), {}).get("description", ""))


def meanings() -> dict[str, str]:
    """Return the description of each key of a spec by its place, such as ``solver.files, kind: command``."""
    texts = {key: node["description"] for key, node in json_schema()["properties"].items()}
    for name, place in section_places().items():
        path, comma, kind = place.partition(",")
        keys = json_schema()["$defs"][name]["properties"]
        texts |= {f"{path}.{key}{comma}{kind}": node["description"] for key, node in keys.items()}
    return texts


def section_with(key: str) -> str | None:
    """Return the only section that has a key, None if there are several or none."""
    sections = [name for name in json_schema()["properties"] if key in keys_of((name,))]
    sections += ["solver"] if any(key in keys_of(("solver", kind.name)) for kind in SOLVERS.built_in) else []
    return sections[0] if len(sections) == 1 else None
