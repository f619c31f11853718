"""Texts made fit to be shown; what is harmless stays as it is."""

import csv
import io

import pytest

from stemcal.storage.encodings import csv_text, visible

HARMLESS = (
    *("yield_stress", "-4.75", "+1.5e-3", "-4.75 **", ".5", "<0.0001", "屈服应力"),
    *("σy · 2", "8 mm", "a - b", "x=1", "a@b", ""),
)


@pytest.mark.parametrize("cell", HARMLESS)
def test_what_is_harmless_stays(cell: str) -> None:
    assert next(csv.reader(io.StringIO(csv_text([[cell, 1]])))) == [cell, "1"]


@pytest.mark.parametrize("cell", ["-", "-2+3", "=1", "@x", "+1 mm", "\t1", "  =1", "＝1", "−1 mm"])
def test_what_may_be_a_formula_is_a_text(cell: str) -> None:
    assert next(csv.reader(io.StringIO(csv_text([[cell, 1]]), newline=""))) == [f"'{cell}", "1"]


def test_numbers_are_never_texts() -> None:
    assert csv_text([[-1.5, None, True, -0.0]]) == "-1.5,,True,-0.0\n"


def test_joiners_that_writing_needs_stay() -> None:
    text = "नि\u200dम्न می\u200cخواهم 👩\u200d🔬 切割\n\t"
    assert visible(text) == text
