"""Every note has its sentence, every sentence is one template, and nothing reads English back."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from string import Formatter

import pytest

import stemcal
from stemcal.files.typed import Tagged
from stemcal.notes import Note
from stemcal.stages.base import STAGES
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import sentence

PACKAGE = Path(stemcal.__file__).parent
TEXTS = sorted((PACKAGE / "text").glob("*.py"))

MAKING = [stage.function.rpartition(".")[0] for stage in STAGES]
for module in [*MAKING, *(f"stemcal.text.{path.stem}" for path in TEXTS)]:
    import_module(module)
KINDS = sorted(kind for kind, found in Tagged.kinds.items() if issubclass(found, Note) and found is not Note)
PACKAGE_KINDS = [kind for kind in KINDS if Tagged.kinds[kind].__module__.startswith("stemcal.")]


NAMED = re.compile(r"[^\W\d]\w*(\.\w+|\[\d\])*")  # a field of the fact, or of what it holds


@pytest.mark.parametrize("kind", PACKAGE_KINDS)
def test_every_kind_of_note_has_a_sentence(kind: str) -> None:
    assert sentence.dispatch(Tagged.kinds[kind]) is not sentence.dispatch(object)


@pytest.mark.parametrize("kind", sorted(kind for kind, found in Tagged.kinds.items() if found in sentence.registry))
def test_templates_speak_of_what_their_fact_has(kind: str) -> None:
    given = inspect.getclosurevars(sentence.dispatch(Tagged.kinds[kind])).nonlocals
    told = given.get("template", "")
    templates = [
        *([told] if isinstance(told, str) else told.values()),
        given.get("many", ""),
        given.get("otherwise", ""),
    ]
    known = {field.name for field in dataclasses.fields(Tagged.kinds[kind])} | {*given.get("derived", ()), "count"}
    for path in (name for text in templates for _, name, _, _ in Formatter().parse(text) if name):
        root, _, rest = path.partition(".")
        if root == "names" and root not in known:
            attrgetter(rest)(Names())
        else:
            assert root.partition("[")[0] in known, f"{kind}: {path}"
    by = given.get("by", "")
    if isinstance(by, str) and by:
        root, _, rest = by.partition(".")
        assert hasattr(attrgetter(rest)(Names()), "__bool__") if root == "names" else root in known, f"{kind}: {by}"


def test_one_and_many() -> None:
    assert say_number("{count} run", "{count} runs", 1) == "1 run"
    assert say_number("{count} run", "{count} runs", 3) == "3 runs"
    assert say("{value:+.2f} N", value=-1.5) == "−1.50 N"


def strings(path: Path) -> list[ast.Constant]:
    """Return the string constants of a module that are no docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documents = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documents
    ]


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: path.stem)
def test_sentences_are_whole_templates_never_glued(path: Path) -> None:
    """No f-string of these modules holds a word: words stand in templates, whose fields have names."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    spared = {id(part) for node in ast.walk(tree) if isinstance(node, ast.Raise) for part in ast.walk(node)}
    spared |= {id(node.format_spec) for node in ast.walk(tree) if isinstance(node, ast.FormattedValue)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr) and id(node) not in spared:
            words = "".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))
            assert not any(letter.isalpha() for letter in words), f"{path.name}:{node.lineno} glues {words!r}"
    for text in strings(path):
        fields = (
            [name for _, name, _, _ in Formatter().parse(text.value) if name is not None] if " " in text.value else []
        )
        assert all(NAMED.fullmatch(name) for name in fields), f"{path.name}:{text.lineno}: fields without names"
