"""A rich console for texts of others. Imported only when something is printed."""

import re
from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from stemcal.files.showing import visible

# A command or key between grave accents is not broken, so that it can be copied; while lines are broken, a letter that
# no language uses stands for its blanks.
_CODE, _BLANK = re.compile(r"`[^`\n]{1,40}`"), "\ue000"


class Terminal(Console):
    """At most 80 columns, text printed as it stands."""

    WIDEST = 80

    def __init__(self, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)
        if self.width > self.WIDEST:
            self.width = self.WIDEST

    def render_str(self, text: str, **how: Any) -> Text:
        """Return a text whose codes stay whole."""
        return super().render_str(_CODE.sub(lambda code: code[0].replace(" ", _BLANK), text), **how)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield what is printed; control characters that a text brings along command nothing, they are spelled out."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text.replace(_BLANK, " ")), segment.style)
