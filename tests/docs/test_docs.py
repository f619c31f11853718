"""The documentation builds without a warning, and the tutorial's commands do what it says."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


def blocks(page: Path) -> list[str]:
    """Return the shell commands of a page."""
    text = page.read_text("utf-8")
    return [line for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) for line in block.splitlines() if line]


def test_reference_pages_are_up_to_date() -> None:
    sys.path.insert(0, str(DOCS))
    try:
        import generated
    finally:
        sys.path.remove(str(DOCS))
    text = generated.commands()
    for name in ("run", "measure shear", "export", "plot"):
        assert f"## stemcal {name}\n" in text
    assert "`--calibrate-at`" in text
    assert "| `edge_radius` | quantity such as `1 mm` | `0.1` |" in generated.spec()
    assert "| PRESS |" in generated.glossary()


def test_every_command_in_the_docs_exists() -> None:
    """Options too: what a page shows is what the command takes."""
    from typer.main import get_command

    from stemcal.cli.app import app

    root = get_command(app)
    shown = [command for page in DOCS.rglob("*.md") for command in blocks(page)]
    for line in (line for line in shown if line.startswith("stemcal ")):
        words = shlex.split(line)[1:]
        command = root.commands[words.pop(0)]  # type: ignore[attr-defined]
        if hasattr(command, "commands"):
            command = command.commands[words.pop(0)]
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        assert {word for word in words if word.startswith("-")} <= known, line


@pytest.mark.slow
def test_the_tutorial_word_by_word(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"}
    for line in blocks(DOCS / "tutorial.md"):
        words = shlex.split(line)
        if words[0] == "cp":
            shutil.copy(tmp_path / words[1], tmp_path / words[2])
            continue
        done = subprocess.run(
            [sys.executable, "-m", *words], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, f"{line}\n{done.stderr}"
        assert "Traceback" not in done.stderr
    results = tmp_path / "tutorial" / "results"
    expected = ["report.html", "tables/tables.md", "tables/tables.tex", "figures/fracture-8mm.svg"]
    assert all((results / name).is_file() for name in expected)
    assert (tmp_path / "tutorial" / "laboratory" / "diameters.svg").is_file()


@pytest.mark.slow
def test_the_pages_build_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx")
    pytest.importorskip("furo")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", str(DOCS), str(tmp_path)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr
    assert "stemcal measure shear" in (tmp_path / "reference" / "commands.html").read_text("utf-8")
