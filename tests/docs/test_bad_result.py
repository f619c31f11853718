"""The page on bad results quotes sentences that the tool really says."""

import ast
import re
from collections.abc import Iterator

from shown import DOCS, ROOT

PAGE = DOCS / "howto" / "bad-result.md"


def quoted() -> list[str]:
    """Return the parts of all quoted sentences, between what stands for numbers and names."""
    rows = [line.split("|")[1] for line in PAGE.read_text("utf-8").splitlines() if line.startswith('| "')]
    sentences = [found for row in rows for found in re.findall(r'"([^"]+)"', row)]
    return [part.strip() for sentence in sentences for part in sentence.split("…") if len(part.strip()) > 2]


def said() -> Iterator[str]:
    """Yield every text in the sources, what is filled into it left out."""
    for path in (ROOT / "stemcal").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value
            elif isinstance(node, ast.JoinedStr):
                yield "".join(part.value for part in node.values if isinstance(part, ast.Constant))


def test_every_quoted_sentence_is_one_that_the_tool_says() -> None:
    texts = " ¦ ".join(said())
    parts = quoted()
    assert len(parts) > 30, parts
    missing = [part for part in parts if part not in texts]
    assert not missing
