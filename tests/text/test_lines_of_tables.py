"""Titles and feet of tables: each line is used, and knows the response by the study's own name."""

from __future__ import annotations

import re
from pathlib import Path

from stemcal.naming import Named, Naming
from stemcal.text import tables
from stemcal.text.names import Names
from stemcal.text.tables import LINES, failed, line

ANGLE = Naming(Named("moisture", "Moisture", "w", "%"), (Named("angle", "Angle of repose", "θ", "deg"),))
REPORT = Path(tables.__file__).parents[1] / "report"


def test_no_line_is_left_over() -> None:
    code = "".join(path.read_text("utf-8") for path in REPORT.rglob("*.py")) + Path(tables.__file__).read_text("utf-8")
    names = {name for name in LINES if code.count(f'"{name}"') > (f'"{name}": "' in code)}
    captions = {f"published {name}" for name in re.findall(r'"([a-z -]+)"', code)}  # by the names of tables in files
    assert set(LINES) <= names | captions


def test_a_line_speaks_of_the_studys_response() -> None:
    assert line("effects", ANGLE) == "Effects on the angle of repose"
    target = line("target at", Names(ANGLE), target=32.6, at=12.0)
    assert target == "Target 32.6° at moisture 12 %."


def test_a_growth_law_with_and_without_its_interval() -> None:
    """The law of the published forces, F = 0.78·d^2.59."""
    known = {"factor": 0.7801, "exponent": 2.594, "r2": 0.9987}
    assert line("growth", **known) == "F = 0.780·d^2.59, F in N, d in mm, R² 0.999 of the logarithms."
    assert "d^2.59 (95 % 2.41 to 2.78), F in N" in line("known growth", range="2.41 to 2.78", **known)


def test_a_failed_run_gives_its_reason() -> None:
    assert failed("time_limit") == "failed (time_limit)"
    assert failed("") == "failed"
