"""Mean number of words per sentence in help, docs and report.

    python benchmarks/sentence_length.py [ROOT]

ROOT is another checkout, whose docs are counted instead. Sentences of more than 30 words are listed with their file.
"""

import html
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import mean
from typing import Any

ROOT = Path(__file__).parents[1]
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


def of_help() -> list[str]:
    """Return the sentences of the help of all commands and options."""
    from typer.main import get_command

    from stemcal.cli.app import app

    todo: list[Any] = [get_command(app)]
    texts: list[str] = []
    while todo:
        command = todo.pop()
        todo += getattr(command, "commands", {}).values()
        texts += (command.help or "").split("\n\n") + [getattr(option, "help", "") or "" for option in command.params]
    return [found for text in texts for found in sentences(re.sub(r"\[/?bold\]", "", text)) if "Example:" not in found]


def of_report() -> list[str]:
    """Return the sentences on the page of the published study, computed from its printed forces."""
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "stemcal", "run", str(ROOT / "configs" / "paper-replay.yaml"), "--out", place]
        subprocess.run([*command, "--quiet"], check=True, capture_output=True)
        page = (Path(place) / "report.html").read_text("utf-8")
    page = re.sub(r"<(script|style|svg|table|pre|form|button|title)\b.*?</\1>", "\n\n", page, flags=re.DOTALL)
    blocks = re.sub(
        r"<[^>]+>",
        "",
        re.sub(r"</?(?:p|li|h\d|div|summary|figcaption|dt|dd|td|span|strong|label)\b[^>]*>", "\n\n", page),
    )
    return [found for block in html.unescape(blocks).split("\n\n") for found in sentences(block)]


def main() -> None:
    docs = of_docs(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)
    for name, found in (("docs", [text for _, text in docs]), ("help", of_help()), ("report", of_report())):
        print(f"{name:7s} {len(found):5d} sentences, {mean(map(length, found)):5.1f} words on average")
    for file, text in docs:
        if (words := length(text)) > 30:
            print(f"{file}: {words} words: {text}")


if __name__ == "__main__":
    main()
