"""The form of a spec as JSON schema: for editors, and for knowing which keys stand where."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

from stemcal.study.model import StudyForm
from stemcal.study.spec.meanings import MEANINGS, TOP
from stemcal.study.spec.strict_yaml import NodePath

__all__ = ["RESULT_KINDS", "SOLVER_KINDS", "json_schema", "keys_of", "section_with"]

SOLVER_KINDS = ("embedded", "table", "command", "lsdyna", "openradioss")
RESULT_KINDS = ("json", "csv", "regex", "rcforc", "calculix")


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of the YAML form; quantities are texts with a unit.

    Put ``# yaml-language-server: $schema=FILE`` at the top of a spec for completion in editors.
    """
    schema = _form()
    own = {"type": "object", "description": "A measured mean under the names of the study's own responses."}
    of_own = {"values": {"type": "array", "items": own}, "calibrate_at": {"type": ["number", "string"]},
              "equivalent_within_percent": {"type": "number"}}  # fmt: skip
    targets = schema["properties"]["targets"]
    schema["properties"]["targets"] = {
        "description": targets.pop("description"),
        "anyOf": [
            targets,
            {"type": "array", "items": own},
            {"type": "object", "properties": of_own, "required": ["values"], "additionalProperties": False},
        ],
    }
    schema["$defs"]["InvertOptions"]["properties"]["conditions"] = {
        "description": MEANINGS["InvertOptions"]["conditions"],
        "anyOf": [{"const": "all"}, {"type": "array", "items": {"anyOf": [{"type": "number"}, {"type": "string"}]}}],
    }
    command = schema["$defs"]["CommandSolver"]["properties"]
    command["result"]["anyOf"] += [
        {"type": "object", "additionalProperties": command["results"]["additionalProperties"]}
    ]
    return schema


def _form() -> dict[str, Any]:
    """Return the schema of what stands inside the study, where the shear test's own words are the only ones."""
    schema = StudyForm.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "stemcal study"
    factor = schema["$defs"]["Factor"]
    factor["required"] = ["name", "low", "high"]
    _describe(schema["properties"], TOP)
    for name, section in schema["$defs"].items():
        _describe(section.get("properties", {}), MEANINGS[name])
    return schema


def _describe(keys: dict[str, Any], meanings: Mapping[str, str]) -> None:
    for key, node in keys.items():
        node["description"] = meanings[key]


def keys_of(path: NodePath) -> tuple[str, ...]:
    """Return the keys known at `path`; a solver's path goes through its kind."""
    node = _schema()
    for step in path:
        node = _below(node, step)
    return tuple(_resolved(node).get("properties", {}))


def section_with(key: str) -> str | None:
    """Return the section that has `key`, if exactly one has it."""
    sections = [name for name in _schema()["properties"] if key in keys_of((name,))]
    sections += ["solver"] if any(key in keys_of(("solver", kind)) for kind in SOLVER_KINDS) else []
    return sections[0] if len(sections) == 1 else None


@functools.cache
def _schema() -> dict[str, Any]:
    return _form()


def _below(node: dict[str, Any], step: str | int) -> dict[str, Any]:
    node = _resolved(node)
    if "discriminator" in node:
        return {"$ref": node["discriminator"]["mapping"].get(step, "")}
    if isinstance(step, int):
        found = node.get("items", {})
    else:
        found = node.get("properties", {}).get(step, node.get("additionalProperties", {}))
    return found if isinstance(found, dict) else {}


def _resolved(node: dict[str, Any]) -> dict[str, Any]:
    options = [option for option in node.get("anyOf", ()) if option.get("type") != "null"]
    if len(options) == 1:
        node = options[0]
    reference = node.get("$ref", "")
    found: dict[str, Any] = _schema()["$defs"].get(reference.removeprefix("#/$defs/"), {}) if reference else node
    return found
