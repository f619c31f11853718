"""Plain English in pages and messages: no words that have a plainer one, short sentences, no misspelt words."""

import ast
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from sentences import length, of_docs, pages

ROOT = Path(__file__).parents[2]

# Clipped, personifying or vague words; each has a plainer one: fix, shows, is, next to, the caller, the number of …
WORDS = re.compile(
    r"\b(mend(s|ed|ing)?|told|tells?|sa(id|ys)|comes? to|beside|whoever|nobody|so (many|much)|as many as|dear(er)?|"
    r"stands?|bears|borne|resting|goes? on|what else|whatever|of (its|their|your|one's) own|is to (give|be)|sways?|"
    r"leans on|as (chosen|asked)|per cent|knows?|belongs?|lets?|feels?|in place of|lies)\b",
    re.IGNORECASE,
)
LONGEST = 30  # words in a sentence


def words_of_page(page: Path) -> list[str]:
    """Return the words of a page without code, links and the messages that it quotes."""
    text = re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", " ", page.read_text("utf-8"), flags=re.DOTALL)
    text = re.sub(r'"[^"\n]*"', " ", text) if page.name == "bad-result.md" else text
    return [match[0].lower() for match in WORDS.finditer(text)]


def literals(path: Path) -> list[str]:
    """Return the literals of a module with at least two words; docstrings are those of commands and keys of a spec."""
    tree = ast.parse(path.read_text("utf-8"))
    hidden = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", [])
        texts = [one.value for one in body if isinstance(one, ast.Expr)] if isinstance(body, list) else []
        command = path.parent.name == "cli" and isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
        keys = path.parent.name == "model" and isinstance(node, ast.ClassDef)
        hidden |= set() if command or keys else {id(text) for text in texts}
    texts = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in hidden]
    return [without_names(node.value) for node in texts if isinstance(node.value, str) and len(node.value.split()) > 1]


def test_pages_have_plain_words() -> None:
    found = {page.relative_to(ROOT).as_posix(): words for page in pages(ROOT) if (words := words_of_page(page))}
    assert found == {}


def without_names(text: str) -> str:
    return re.sub(r"`[^`]*`", " ", text)


def test_messages_help_and_keys_have_plain_words() -> None:
    paths = sorted((ROOT / "stemcal").rglob("*.py"))
    found = {
        path.relative_to(ROOT).as_posix(): words
        for path in paths
        if (words := [match[0] for text in literals(path) for match in WORDS.finditer(text)])
    }
    assert found == {}


def test_sentences_of_pages_are_short() -> None:
    assert [f"{file}: {text}" for file, text in of_docs(ROOT) if length(text) > LONGEST] == []


@pytest.mark.skipif(shutil.which("codespell") is None, reason="codespell is part of the extra `dev`")
def test_no_word_is_misspelt() -> None:
    done = subprocess.run(["codespell"], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout + done.stderr == ""
