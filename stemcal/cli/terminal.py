"""A rich console for texts of others. Imported only when something is printed."""

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from stemcal.files.showing import visible


class Terminal(Console):
    """At most 80 columns, text printed as it stands."""

    WIDEST = 80

    def __init__(self, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)
        if self.width > self.WIDEST:
            self.width = self.WIDEST

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield what is printed; control characters that a text brings along command nothing, they are spelled out."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)
