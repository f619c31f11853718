"""How sentences are broken into the lines of a terminal."""

from io import StringIO

import pytest
from rich.console import Console

from stemcal.cli import console


def test_notes_break_between_words_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch) -> None:
    sentence = "word " * 30
    for terminal, lines in ((True, 2), (False, 1)):
        out = StringIO()
        made = Console(file=out, width=80, force_terminal=terminal, color_system=None, highlight=False)
        monkeypatch.setattr(console, "stderr", lambda made=made: made)
        console.note(sentence)
        printed = out.getvalue().rstrip("\n").split("\n")
        assert len(printed) == lines
        assert all(line.strip().replace("word", "").strip() == "" for line in printed)
