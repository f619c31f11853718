"""English stands in `text`; elsewhere only where something goes wrong, in help, and in what is written for programs."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import stemcal

PACKAGE = Path(stemcal.__file__).parent
ROOMS = ("cutting", "doe", "fem", "files", "folder", "measured", "overview", "runs", "stages", "solvers", "executors")
MODULES = sorted(path for room in (*ROOMS, "report") for path in (PACKAGE / room).rglob("*.py"))

SPARED = {
    "stages/base.py": "help of the commands",
    "solvers/deck/model.py": "comments in decks: what these cannot say of the study",
    "solvers/deck/writer.py": "comments in decks",
    "runs/outcome.py": "failures of runs",
    "runs/retries.py": "failures of runs",
    "executors": "failures of runs",
    "folder/study_folder.py": "what is wrong with a file",
    "folder/record.py": "what is wrong with a file",
    "solvers/deck/own_deck.py": "remedies of an error",
    "solvers/csv_table.py": "problems of a table, with their remedies",
    "doe/regression/surface.py": "remedies of an error",
    "stages/refine/stage.py": "an error",
    "stages/work.py": "remedies of an error",
    "report/export/latex.py": "a comment in the document",
}
_OF_ERRORS = re.compile("Error|Failed|Problem|NoResult|Broken|Broke|^say")
_SIX_WORDS = re.compile(r"(?:^|[\s(;'])(?:[A-Za-z][a-z'-]*[,;:]? ){5}[a-z]{2,}(?=[\s,;.:]|$)")


def is_sentence(text: str) -> bool:
    """Whether six words or more follow each other."""
    return _SIX_WORDS.search(text) is not None


def test_what_a_sentence_is() -> None:
    assert is_sentence("the force is largest at the end")
    assert is_sentence("_ rows without numbers for force or displacement are left out")
    assert not is_sentence("blade travel, mm") and not is_sentence("ij,jk,ik->i")


def texts(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the strings of a module, f-strings as one; not docstrings, templates, and what errors and the log say."""
    spared: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            spared |= {id(x.value) for x in node.body if isinstance(x, ast.Expr)}
        called = getattr(node.func, "attr", getattr(node.func, "id", "")) if isinstance(node, ast.Call) else ""
        logged = isinstance(node, ast.Call) and ast.unparse(node.func).startswith("logger.")
        if isinstance(node, ast.Raise) or logged or _OF_ERRORS.search(called):
            spared |= {id(part) for part in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr) and id(node) not in spared:
            spared |= {id(part) for part in node.values}
            yield node.lineno, "".join(str(x.value) if isinstance(x, ast.Constant) else "_" for x in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in spared:
            yield node.lineno, node.value


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_no_sentence_stands_outside_text(path: Path) -> None:
    name = path.relative_to(PACKAGE).as_posix()
    if not any(name.startswith(spared) for spared in SPARED):
        found = [(line, text) for line, text in texts(ast.parse(path.read_text("utf-8"))) if is_sentence(text)]
        assert not found


@pytest.mark.parametrize("name", SPARED)
def test_what_is_spared_needs_it(name: str) -> None:
    paths = [path for path in MODULES if path.relative_to(PACKAGE).as_posix().startswith(name)]
    trees = [ast.parse(path.read_text("utf-8")) for path in paths]
    assert any(is_sentence(text) for tree in trees for _, text in texts(tree))
