"""The scripts in benchmarks/ start, and none hides a package by its name: a script's folder is searched first."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


def test_every_script_finds_what_it_imports() -> None:
    names = [path.stem for path in sorted(BENCHMARKS.glob("*.py"))]
    code = f"import sys; sys.path.insert(0, {str(BENCHMARKS)!r}); import {', '.join(names)}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
