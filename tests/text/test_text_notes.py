"""Every kind of note that is not yet a plain `Note` has its sentence."""

from __future__ import annotations

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
