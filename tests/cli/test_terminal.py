"""How sentences are broken into the lines of a terminal."""

from io import StringIO

import pytest
from rich.text import Text

from stemcal.cli.console import Terminal


def printed(text: str | Text, width: int) -> list[str]:
    console = Terminal(stderr=False)
    console.file, console.width = StringIO(), width
    console.print(text)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


def test_a_command_is_not_broken() -> None:
    said = "Good at 8 mm. See `stemcal status SPEC --json` for the rest."
    assert printed(said, 30) == ["Good at 8 mm. See", "`stemcal status SPEC --json`", "for the rest."]
    assert " ".join(printed(said, 80)) == said


@pytest.mark.parametrize("said", ["a ` b", f"`{'word ' * 30}`", "``", "`a\nb`", "\ue000"])
def test_what_is_no_code_is_broken_as_any_text(said: str) -> None:
    assert all(len(line) <= 20 for line in printed(said, 20))
