"""What a terminal shows while something is computed, and what it does not when nobody looks on."""

import io

import pytest
from rich.console import Console

from stemcal.cli import console
from stemcal.cli.simulate import live


class Status:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.text = ""

    def update(self, text: str) -> None:
        self.text = text


def test_travel_time_left_and_force() -> None:
    status = Status()
    watch = live(status, stroke=0.8, clock=iter([10.0, 14.0]).__next__)
    assert watch is not None
    watch(0.0001, 0.0)
    assert status.text.startswith("0.00 of 0.80 mm, … left, 0 N")
    watch(0.4, 100.0)
    assert status.text == "0.40 of 0.80 mm, 4 s left, 100 N"


def test_nobody_looks_on() -> None:
    assert live(object(), 1.0) is None


def test_notes_break_between_words_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch) -> None:
    sentence = "word " * 30
    for terminal, lines in ((True, 2), (False, 1)):
        out = io.StringIO()
        made = Console(file=out, width=80, force_terminal=terminal, color_system=None, highlight=False)
        monkeypatch.setattr(console, "stderr", lambda made=made: made)
        console.note(sentence)
        printed = out.getvalue().rstrip("\n").split("\n")
        assert len(printed) == lines
        assert all(line.strip().replace("word", "").strip() == "" for line in printed)
