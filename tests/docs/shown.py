"""What pages show: files to save, commands to give; and a place to give them in."""

import contextlib
import re
import shlex
import shutil
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path

from typer.testing import CliRunner

from stemcal.cli.app import app

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
GENERATED = {DOCS / "reference" / name for name in ("commands.md", "spec.md", "stages.md", "glossary.md")}
# what the continuous integration itself does, in an environment of its own
INSTALLING = ("python3 -m venv", ".venv/bin/pip", ".venv/bin/python -m pytest")


def pages() -> list[Path]:
    """Return the READMEs and the written pages of the documentation."""
    readmes = [ROOT / "README.md", *sorted((ROOT / "examples").rglob("README.md"))]
    return [*readmes, *sorted(set(DOCS.rglob("*.md")) - GENERATED - set((DOCS / "_build").rglob("*.md")))]


def commands(page: Path) -> list[str]:
    """Return the shell commands of a page, those that install left out, each on a line of its own."""
    blocks = re.findall(r"```sh\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
    parts = [part.strip() for block in blocks for line in block.splitlines() for part in line.split("&&")]
    shown = [part for part in parts if part and not part.startswith(("#", *INSTALLING))]
    return [part.removeprefix(".venv/bin/") for part in shown]


def inline(page: Path) -> list[str]:
    """Return the commands that stand in the running text."""
    text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
    return re.findall(r"`(stemcal [a-z][^`]*)`", text)


def save_files(page: Path, folder: Path) -> None:
    """Save the files of a page under their captions."""
    pattern = r"```{code-block} \w+\n:caption: (\S+)\n\n(.*?)```"
    for name, text in re.findall(pattern, page.read_text("utf-8"), re.DOTALL):
        (folder / name).write_text(text, encoding="utf-8")


def outputs(page: Path) -> list[str]:
    """Return the lines that a page shows as printed by its commands: its `text` blocks that follow commands."""
    blocks = re.findall(r"```(sh|text)\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
    following = [block for (kind, _), (after, block) in pairwise(blocks) if (kind, after) == ("sh", "text")]
    return [line for block in following for line in block.splitlines() if line.strip()]


def are_printed(lines: Iterable[str], printed: Iterable[str]) -> None:
    """Assert that lines were printed, whatever the blanks between their words."""
    there = {tuple(line.split()) for text in printed for line in text.splitlines()}
    missing = [line for line in lines if tuple(line.split()) not in there]
    assert missing == []


def give(lines: Iterable[str], folder: Path, replaced: dict[str, str] | None = None, code: int = 0) -> dict[str, str]:
    """Give commands of stemcal in a folder, each of which ends with a code; return what they printed."""
    printed = {}
    for line in lines:
        for old, new in (replaced or {}).items():
            line = line.replace(old, new)
        words = shlex.split(line, comments=True)
        if words[0] == "cp":
            shutil.copy(folder / words[1], folder / words[2])
            continue
        *words, file = [*words[:-2], words[-1]] if ">" in words else [*words, ""]
        assert words[0] == "stemcal", line
        with contextlib.chdir(folder):
            done = CliRunner().invoke(app, words[1:])
        if file:
            (folder / file).write_text(done.stdout, encoding="utf-8")
        assert done.exit_code == code, f"{line}\n{done.stderr}"
        assert "internal error" not in done.stderr, line
        printed[line] = done.stdout + done.stderr
    return printed
