"""A figure before it is drawn, and as an element of the page: one drawing for light and dark."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from markupsafe import escape

from stemcal.report.figures.style import COLOURS, Figure, png, svg


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

    @cached_property
    def figure(self) -> Figure:
        """The figure, made once: page and files share it."""
        return self.make()

    @cached_property
    def document(self) -> str:
        """The figure as SVG."""
        return svg(self.figure)

    @cached_property
    def pixels(self) -> bytes:
        """The figure as PNG."""
        return png(self.figure)


# ---- on the page


def inline(document: str, description: str, name: str, styles: dict[str, str]) -> str:
    """Return the `svg` of a figure as an element for the page, its identifiers beginning with its name.

    The policy of the page forbids styles of elements: each becomes a class, which is added to `styles`. Matplotlib
    writes a millionth of a point, half of all it writes; the page keeps a tenth.
    """
    view = document.partition('viewBox="')[2].partition('"')[0]
    inside = document.partition("</defs>")[2].rpartition("</svg>")[0]  # behind matplotlib's own style
    inside = re.sub(r'\s*\n\s*| id="\w+_\d+"', "", inside).replace("xlink:href", "href")
    inside = re.sub(r' (d|x|y|width|height|transform)="[^"]*"', lambda found: _rounded(found[0]), inside)
    inside = re.sub(r'(id="|href="#|url\(#)', rf"\g<1>{name}-", inside)

    def coded(found: re.Match[str]) -> str:
        return f'class="{styles.setdefault(_style(found[1]), f"s{len(styles)}")}"'

    inside = re.sub(r'style="([^"]*)"', coded, inside)
    return f'<svg role="img" aria-label="{escape(description)}" viewBox="{view}">{inside}</svg>'


def _style(style: str) -> str:
    """Return a style in the colours and the font of the page."""
    style = re.sub(r"\bfont: [^;]*?([\d.]+px)[^;]*", r"font-size: \1", style)
    style = re.sub(r"font-family: [^;]*;? ?", "", style)
    for colour, variable in COLOURS.items():
        style = style.replace(colour, variable)
    return style


def _rounded(text: str) -> str:
    """Return an attribute with its numbers to a tenth, except those of a change of scale.

    >>> _rounded(' d="M 10.04 20 L 13.333 20.96 z"')
    ' d="M10 20L13.3 21z"'
    """
    if "scale" in text:
        return text
    tenths = re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.1f}".removesuffix(".0"), text)
    return re.sub(r"\s*([MLQCz])\s*", r"\1", tenths)
