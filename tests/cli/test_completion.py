"""The shell completes commands, options, their values and terms; the script to install is printed for four shells."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from commanding import ROOT


def as_installed(folder: Path, *args: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Give the command by its own name, as pip installs it."""
    program = "import sys; sys.argv[0] = 'stemcal'; from stemcal.__main__ import main; main()"
    return subprocess.run(
        [sys.executable, "-c", program, *args], cwd=folder, capture_output=True, encoding="utf-8", timeout=60,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", **environment},
    )  # fmt: skip


def completed(folder: Path, line: str) -> list[str]:
    """Return what bash offers after a line, as its completion script asks for it."""
    asked = {"_STEMCAL_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1)}
    return as_installed(folder, **asked).stdout.split("\n")[:-1]


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("stemcal me", ["measure"]),
        ("stemcal measure ", ["diameters", "shear"]),
        ("stemcal export tables study.yaml --format ", ["csv", "md", "tex", "docx"]),
        ("stemcal measure shear data --travel", ["--travel-and-work"]),
        ("stemcal explain lent", ["lenth"]),
    ],
)
def test_what_bash_offers(tmp_path: Path, line: str, offered: list[str]) -> None:
    found = completed(tmp_path, line)
    assert set(offered) <= set(found), found
    assert "Traceback" not in "".join(found)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell"])
def test_a_script_for_every_shell(tmp_path: Path, shell: str) -> None:
    shown = as_installed(tmp_path, "--show-completion", shell, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    assert shown.returncode == 0, shown.stderr
    assert "stemcal" in shown.stdout.lower()
