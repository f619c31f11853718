"""A figure before it is drawn."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stemcal.report.figures.inline import readings
from stemcal.report.figures.style import Figure, png, svg


@dataclass(frozen=True)
class Plot:
    """A figure: its name, its section, its caption, and what draws it.

    Figures that are not `on_page` are drawn by `stemcal export figures` alone; a `detail` is folded on the page. One
    that `claims` intervals is shown of a calibrated study only.
    """

    name: str
    section: str
    caption: str
    make: Callable[[], Figure]
    on_page: bool = True
    wide: bool = False
    detail: bool = False
    claims: bool = False

    def draw(self) -> Figure:
        """Return the figure, made once: page and files share it."""
        if "figure" not in self.__dict__:
            self.__dict__["figure"] = self.make()
        figure: Figure = self.__dict__["figure"]
        return figure

    @cached_property
    def document(self) -> str:
        """The figure as SVG."""
        return svg(self.draw())

    @cached_property
    def readings(self) -> list[dict[str, Any]]:
        """What its lines and bars show, where they are in its `document`."""
        return readings(self.draw()) if self.document else []

    @cached_property
    def pixels(self) -> bytes:
        """The figure as PNG."""
        return png(self.draw())
