"""The sentences of the pages, and the number of their words."""

import re
from collections.abc import Iterator
from pathlib import Path

CODE = re.compile(r"`[^`]*`|\$[^$]*\$")  # of any length it is one word
GENERATED = ("commands.md", "spec.md", "stages.md", "glossary.md")


def sentences(text: str) -> Iterator[str]:
    """Yield the sentences of plain text: each ends with a stop or question mark before a capital or a number."""
    code = iter(CODE.findall(text))
    hidden = CODE.sub("Ω\0", text)
    for part in re.split(r"(?<=[^.\s][.?!])[)*”\"]*\s+(?=[\"“(*]*(?:[A-ZÅ-ÞΑ-Ω0-9]|stemcal))", hidden):
        sentence = " ".join(re.sub("Ω\0", lambda _: next(code), part).split())
        if length(sentence) > 1:
            yield sentence


def length(sentence: str) -> int:
    """Return the number of words; signs and dashes are none."""
    return sum(bool(re.search(r"[^\W_]", word)) for word in CODE.sub("Code", sentence).split())


def words(markdown: str) -> int:
    """Return the number of words of a page with its tables, without blocks of code and equations."""
    text = re.sub(r"^---\n.*?\n---\n|<!--.*?-->|^```.*?^```|\$\$.*?\$\$", "", markdown, flags=re.DOTALL | re.MULTILINE)
    return length(re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text))


def prose(markdown: str) -> Iterator[str]:
    """Yield paragraphs and list items of a page without tables, blocks of code and equations."""
    text = markdown.partition("\n## Sources\n")[0]
    text = re.sub(r"\s*\$\$.*?\$\$\s*([a-z]?)", lambda m: f" $e$ {m[1]}" if m[1] else "\n\n", text, flags=re.DOTALL)
    text = re.sub(r"^---\n.*?\n---\n|<!--.*?-->|^```.*?^```", "\n\n", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"!\[(.*)\]\(.*\)\s+(?=\*\1\*)", "", text)  # the caption repeats the alternative text
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s)|\n(?=\||#)", text):
        if not re.match(r"\s*(\||#)", block):
            yield re.sub(r"^\s*(?:[-*]\s+|\d+\.\s+)?(?:\*\*[^*]+\.\*\*\s*)?", "", " ".join(block.split()))


def pages(root: Path) -> list[Path]:
    """Return README, contributing guide, examples and written pages of a checkout."""
    found = [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "examples").rglob("README.md"))]
    written = (page for page in sorted((root / "docs").rglob("*.md")) if "_build" not in page.parts)
    return [*found, *(page for page in written if page.name not in GENERATED)]


def of_docs(root: Path) -> list[tuple[str, str]]:
    """Return file and sentence of every sentence in running text and lists."""
    return [
        (page.relative_to(root).as_posix(), sentence)
        for page in pages(root)
        for part in prose(page.read_text("utf-8"))
        for sentence in sentences(part)
    ]
