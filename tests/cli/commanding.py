"""How tests give commands: in this process, or in one of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner, Result

from stemcal.cli.app import app

ROOT = Path(__file__).parents[2]
REPLAY = ROOT / "configs" / "paper-replay.yaml"
SMOKE = ROOT / "configs" / "smoke.yaml"
BAD_SPEC = ROOT / "tests" / "cases" / "bad" / "many-at-once.yaml"
COMMANDS = (
    *("run", "screen", "climb", "rsm", "invert", "refine", "validate", "enter"),
    *("optimise", "report", "init", "check", "simulate", "measure", "status", "export", "doctor", "explain"),
)
STAGES = ("screen", "rsm", "invert", "validate")


def command(*args: object) -> Result:
    """Run stemcal in this process."""
    return CliRunner().invoke(app, [str(arg) for arg in args])


def process(folder: Path, *args: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run stemcal as a process of its own in `folder`."""
    return subprocess.run(
        [sys.executable, "-m", "stemcal", *map(str, args)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1", **environment},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=120,
    )


def undrawn(folder: Path, to: Path) -> Path:
    """Copy a study folder without its pictures; returns the copy."""
    drawn = shutil.ignore_patterns("figures", "tables", "report.html")
    return Path(shutil.copytree(folder, to, ignore=drawn))
