"""How sentences are broken into the lines of a terminal."""

from io import StringIO

import pytest
from rich.console import Console
from rich.text import Text

from stemcal.cli import console
from stemcal.cli.console import Terminal


def printed(text: str | Text, width: int) -> list[str]:
    terminal = Terminal(stderr=False)
    terminal.file, terminal.width = StringIO(), width
    terminal.print(text)
    return [line.rstrip() for line in terminal.file.getvalue().splitlines()]


def test_a_command_is_not_broken() -> None:
    said = "Good at 8 mm. See `stemcal status SPEC --json` for the rest."
    assert printed(said, 30) == ["Good at 8 mm. See", "`stemcal status SPEC --json`", "for the rest."]
    assert " ".join(printed(said, 80)) == said


@pytest.mark.parametrize("said", ["a ` b", f"`{'word ' * 30}`", "``", "`a\nb`", "\ue000"])
def test_what_is_no_code_is_broken_as_any_text(said: str) -> None:
    assert all(len(line) <= 20 for line in printed(said, 20))


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
