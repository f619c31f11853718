"""The shell completes commands, options and their values; the script to install is printed for four shells."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from commanding import ROOT
from typer.testing import CliRunner

from stemcal.cli.app import app


def completed(line: str) -> list[str]:
    """Return what bash offers after a line, as its completion script asks for it."""
    asked = {"_STEMCAL_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1)}
    return CliRunner().invoke(app, [], prog_name="stemcal", env=asked).stdout.split("\n")[:-1]


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("stemcal me", ["measure"]),
        ("stemcal measure ", ["diameters", "shear"]),
        ("stemcal export tables study.yaml --format ", ["csv", "md", "tex", "docx"]),
        ("stemcal measure shear data --wo", ["--work"]),
    ],
)
def test_what_bash_offers(line: str, offered: list[str]) -> None:
    assert set(offered) <= set(completed(line))


@pytest.mark.parametrize(
    "shell", ["bash", *(pytest.param(one, marks=pytest.mark.slow) for one in ("zsh", "fish", "powershell"))]
)
def test_a_script_for_every_shell(tmp_path: Path, shell: str) -> None:
    """By the command's own name, as pip installs it."""
    program = "import sys; sys.argv[0] = 'stemcal'; from stemcal.__main__ import main; main()"
    shown = subprocess.run(
        [sys.executable, "-c", program, "--show-completion", shell],
        cwd=tmp_path, capture_output=True, encoding="utf-8", timeout=60,
        env={**os.environ, "PYTHONPATH": str(ROOT), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "y"},
    )  # fmt: skip
    assert shown.returncode == 0, shown.stderr
    assert "_STEMCAL_COMPLETE" in shown.stdout
