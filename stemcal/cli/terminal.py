"""A rich console that leaves broken pipes to the guard. Imported only when something is printed."""

from __future__ import annotations

from typing import NoReturn

from rich.console import Console


class Terminal(Console):
    """At most 80 columns, text printed as it stands, no leaving of its own on a closed pipe."""

    WIDEST = 80

    def __init__(self, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)
        if self.width > self.WIDEST:
            self.width = self.WIDEST

    def on_broken_pipe(self) -> NoReturn:
        """Raise instead of leaving with exit code 1."""
        raise BrokenPipeError
