"""The reference pages that are made from the code: commands, spec, stage files, glossary."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

NOTICE = "<!-- Generated from the code by docs/generated.py; do not edit. -->\n"


def write(folder: Path) -> None:
    """Write the pages; one that would not change is left alone."""
    pages = {"commands.md": commands(), "spec.md": spec(), "stages.md": stages(), "glossary.md": glossary()}
    for name, text in pages.items():
        path = folder / name
        text = f"{NOTICE}\n{text}\n"
        if not path.is_file() or path.read_text("utf-8") != text:
            path.write_text(text, encoding="utf-8", newline="\n")


def commands() -> str:
    """Return every command with its arguments and options."""
    from typer.main import get_command

    from stemcal.cli.app import app

    root: Any = get_command(app)
    parts = [
        "# Commands",
        "For users of the command line, this page lists all commands and options. Results are printed to stdout; "
        "progress and notes are printed to stderr.",
    ]
    for name, command in sorted(root.commands.items()):
        parts += _command(name, command)
    return "\n\n".join(parts)


def _command(name: str, command: Any) -> Iterator[str]:
    yield f"## stemcal {name}"
    yield _marked_up(command.help or "")
    rows = [_parameter(p) for p in command.params if not getattr(p, "hidden", False) and p.name != "help"]
    if rows:
        yield _table(("Argument or option", "Meaning", "Default"), rows)
    for below, child in sorted(getattr(command, "commands", {}).items()):
        yield from _command(f"{name} {below}", child)


def _parameter(parameter: Any) -> tuple[str, str, str]:
    option = parameter.param_type_name == "option"
    names = ", ".join(f"`{text}`" for text in (*parameter.opts, *parameter.secondary_opts)) if option else ""
    default = getattr(parameter, "show_default", None)
    shown = default if isinstance(default, str) else parameter.default
    known = shown is not None and not callable(shown) and shown not in (False, "") and "Sentinel" not in repr(shown)
    label = parameter.metavar or parameter.name.upper()
    return names or f"`{label}`", _marked_up(parameter.help or ""), f"{shown}" if known else ""


def _marked_up(text: str) -> str:
    """Turn rich's markup into Markdown's."""
    return re.sub(r"\[/?bold\]", "`", text).strip()


def spec() -> str:
    """Return every section and key of a spec."""
    from stemcal.study.reading.json_schema import json_schema, section_places

    schema = json_schema()
    head = ("Key", "Meaning", "Value", "Default")
    parts = [
        "# Spec",
        "For users who write a study, this page lists all sections and keys of a spec. Quantities have a unit (`8 "
        "mm`); pure numbers have no unit. `stemcal check` lists every mistake with its line number. `stemcal explain "
        "--schema` prints the schema of a spec for editors. Defaults of quantities are in mm, s, N, MPa and degrees. "
        "The symbol `[]` denotes each entry of a list.",
        _table(head, _keys_of(schema)),
    ]
    for name, place in section_places().items():
        node = schema["$defs"][name]
        parts += [f"({_anchor(name)})=\n## {place}", _marked(node.get("description", "")), _table(head, _keys_of(node))]
    return "\n\n".join(part for part in parts if part)


def _keys_of(node: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return a row per key of a section."""
    return [
        (f"`{key}`", _marked(value["description"]), _kind(value), _default(value))
        for key, value in node.get("properties", {}).items()
    ]


def _anchor(name: str) -> str:
    return f"spec-{name.removesuffix('Section').lower()}"


def _marked(text: str) -> str:
    """Replace the code marks of reStructuredText by those of Markdown."""
    return text.replace("``", "`")


def _kind(node: Mapping[str, Any]) -> str:
    """Return the kind of value of a key in words."""
    if "$ref" in node:
        from stemcal.study.reading.json_schema import section_places

        name = node["$ref"].rpartition("/")[2]
        return f"section [{section_places()[name]}](#{_anchor(name)})"
    options = [option for word in ("anyOf", "oneOf") for option in node.get(word, ())]
    if options:
        return " or ".join(_kind(option) for option in options if option.get("type") != "null")
    if "const" in node or "enum" in node:
        return ", ".join(f"`{value}`" for value in node.get("enum", [node.get("const")]))
    if node.get("type") == "array":
        return f"list of {_kind(node.get('items', {}))}"
    if "examples" in node:
        return f"quantity such as `{node['examples'][0]}`"
    return str(
        {"string": "text", "object": "mapping", "integer": "whole number"}.get(kind := node.get("type", "value"), kind)
    )


def _default(node: Mapping[str, Any]) -> str:
    default = node.get("default")
    return "" if default in (None, "", [], {}) or isinstance(default, dict) else f"`{default}`"


def glossary() -> str:
    """Return the terms of `stemcal explain`."""
    from stemcal.report.glossary import glossary as terms

    rows = [
        (entry.term, entry.chinese, entry.meaning, entry.source)
        for entry in sorted(terms(), key=lambda e: e.term.lower())
    ]
    return "\n\n".join(
        [
            "# Glossary",
            "For readers of reports, this page explains terms in English and Chinese. The command `stemcal explain "
            "TERM` explains a term or a key of a [spec](spec.md).",
            _table(("Term", "Chinese", "Meaning", "Source"), rows),
        ]
    )


def stages() -> str:
    """Return every key and column of the files of a study."""
    import stagefiles

    parts = [
        "# Stage files",
        "For developers of programs that read results, this page lists the keys of the stage files of the published "
        "study (`configs/paper-replay.yaml`). The symbol `[]` denotes each element of a list, and `*` "
        "denotes the name of a factor. "
        "Forces are in N, lengths in mm, and factors in the unit of the spec. A value that could not be computed is "
        "`null`. The files of joint fits, climbs and refinements have additional keys. `schema_version` increases "
        "when a key changes or is removed.",
    ]
    for title, head, rows in stagefiles.stage_files():
        parts += [f"## {title}", _table(head, rows)]
    return "\n\n".join(parts)


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(cell) for cell in line) + " |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())
