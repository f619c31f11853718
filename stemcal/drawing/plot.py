"""Figures that are drawn on demand, and their conversion to compact SVG for the report page, in light and dark mode.

Matplotlib repeats the style with every path, writes millionths of a point, and defines the same markers in each figure.
Here, the figures of a page share styles and markers, and coordinates have tenths of a point: a quarter of the size.
"""

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from typing import Any
from xml.etree.ElementTree import Element, fromstring

from markupsafe import escape

from stemcal.drawing.style import COLOURS, Figure, png, svg

_HREF = "{http://www.w3.org/1999/xlink}href"
_ROUNDED = ("x", "y", "width", "height", "transform")


@dataclass(frozen=True)
class Plot:
    """A figure: its caption, where it is shown, and the function `make` that draws it."""

    name: str
    section: str  # name of the stage, or "runs"
    caption: str
    make: Callable[[], Figure]
    on_page: bool = True
    wide: bool = False  # whether it uses the full width of the page
    detail: bool = False  # whether the page shows it folded
    claims: bool = False  # whether it is shown only if the study is calibrated

    @cached_property
    def figure(self) -> Figure:
        """The figure, drawn on first use; page and files share it."""
        return self.make()

    @cached_property
    def document(self) -> str:
        """The figure as SVG."""
        return svg(self.figure)

    @cached_property
    def readings(self) -> list[dict[str, Any]]:
        """The data of the lines and bars for the page; first creates `document`, which fixes the layout."""
        return readings(self.figure) if self.document else []

    @cached_property
    def pixels(self) -> bytes:
        """The figure as PNG."""
        return png(self.figure)


@dataclass
class Shared:
    """Definitions that the figures of a page share: CSS classes by style; ids of markers and clip paths by SVG text."""

    styles: dict[str, str] = field(default_factory=dict)
    marks: dict[tuple[str, str], str] = field(default_factory=dict)

    @property
    def css(self) -> str:
        return "\n".join(f".{name} {{ {style} }}" for style, name in self.styles.items())

    @property
    def defs(self) -> str:
        """The SVG definitions of the markers and clip paths, which the page contains once."""
        return "".join(f'<{tag} id="{name}"{rest}' for (tag, rest), name in self.marks.items())


def inline_svg(document: str, description: str, shared: Shared, values: Sequence[Any] = ()) -> str:
    """Return the SVG of a figure for the page; add its styles, markers and clip paths to `shared`.

    `document` is the SVG of Matplotlib. `values` is the output of `readings`; the page shows it at the mouse pointer.
    """
    root, ids = fromstring(document), dict[str, str]()
    for node in root.iter():
        node.tag = node.tag.rpartition("}")[2]
    for defs in root.iter("defs"):
        for mark in defs.iter():
            if name := mark.attrib.pop("id", ""):
                tag, rest = mark.tag, _written(mark, shared, ids).removeprefix(f"<{mark.tag}")
                ids[name] = shared.marks.setdefault((tag, rest), f"m{len(shared.marks)}")
    inside = "".join(_written(node, shared, ids) for node in root)
    read = f' data-read="{escape(json.dumps(values, separators=(",", ":")))}"' if values else ""
    view = root.attrib["viewBox"]
    return f'<svg role="img" aria-label="{escape(description)}" viewBox="{view}"{read}>{inside}</svg>'


def _written(node: Element, shared: Shared, ids: dict[str, str]) -> str:
    if node.tag in ("defs", "metadata"):
        return ""
    inside = str(escape((node.text or "").strip())) + "".join(_written(child, shared, ids) for child in node)
    attributes = "".join(f' {name}="{escape(value)}"' for name, value in _attributes(node, shared, ids))
    if node.tag == "g" and not (inside and attributes):  # this group has no effect
        return inside
    return f"<{node.tag}{attributes}>{inside}</{node.tag}>" if inside else f"<{node.tag}{attributes}/>"


def _attributes(node: Element, shared: Shared, ids: dict[str, str]) -> Iterator[tuple[str, str]]:
    for name, value in node.attrib.items():
        if name == "style":  # the page determines fonts and colours
            style = re.sub(r"\bfont: [^;]*?([\d.]+px)[^;]*", r"font-size: \1", value)
            style = re.sub(r"font-family: [^;]*;? ?", "", style)
            for colour, variable in COLOURS.items():
                style = style.replace(colour, variable)
            yield "class", shared.styles.setdefault(style, f"s{len(shared.styles)}")
        elif name == "d":
            yield name, _shorter_path(value)
        elif name == _HREF:
            yield "href", f"#{ids[value[1:]]}" if value.startswith("#") else re.sub(r"\s", "", value)
        elif name == "clip-path":
            yield name, f"url(#{ids[value[5:-1]]})"
        elif name in _ROUNDED and "scale" not in value:
            if not value.startswith("rotate(-0 "):
                yield name, _shorter_path(value)
        elif name != "id":
            yield name, value


def _shorter_path(text: str) -> str:
    """Shorten an SVG path: round numbers to one decimal, and remove blanks around commands.

    >>> _shorter_path("M 10.04 20 L 13.333 20.96 z")
    'M10 20L13.3 21z'
    """
    tenths = re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.1f}".removesuffix(".0"), text)
    return re.sub(r"\s*([MLQCz])\s*", r"\1", tenths)


_DENSE = 60  # the page shows no values of a line that has no name and more points than this
_SCALED = ("linear", "log")


def readings(figure: Figure) -> list[dict[str, Any]]:
    """Return the data of the lines and bars in each two-dimensional panel of a figure.

    A panel has the axes `x` and `y` (see `_axis`), and `series`: name and points of each line and bar.
    """
    wide, high = (72.0 * inches for inches in figure.get_size_inches())
    data: list[dict[str, Any]] = []
    panels: list[Any] = figure.axes  # two- and three-dimensional
    for axes in panels:
        if axes.name != "3d" and axes.get_xscale() in _SCALED and (series := list(_series(axes))):
            box = axes.get_position()
            x = _axis(axes.xaxis, [box.x0 * wide, box.x1 * wide], axes.get_xlim())
            y = _axis(axes.yaxis, [(1.0 - box.y0) * high, (1.0 - box.y1) * high], axes.get_ylim())
            data.append({"x": x, "y": y, "series": series})
    return data


def _axis(axis: Any, ends: list[float], limits: tuple[float, float]) -> dict[str, Any]:
    """Return an axis: both ends in SVG coordinates (points) and in its unit, the scale, the name and the unit."""
    label = "" if _words(axis) else axis.get_label_text().replace("\n", " ").replace("\\$", "$")
    name, comma, unit = label.rpartition(", ")
    heading = {"name": name if comma else label, "unit": f" {unit}" if comma else ""}
    return {"ends": [_rounded(end) for end in ends], "from": limits[0], "to": limits[1],
            "log": axis.get_scale() == "log"} | heading  # fmt: skip


def _words(axis: Any) -> dict[float, str]:
    """Return the tick labels of an axis by position if they are words; empty if all are numbers."""
    texts = {float(at): label.get_text() for at, label in zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=False)}
    return {} if all(re.fullmatch(r"[\d.,−+e-]*", text) for text in texts.values()) else texts


def _series(axes: Any) -> Iterator[tuple[str, list[tuple[float, float]]]]:
    """Yield name and points of each line that has a name or few points, and the end point of each bar."""
    words = {**_words(axes.xaxis), **_words(axes.yaxis)}
    for line in axes.lines:
        label, points = str(line.get_label()), [(float(x), float(y)) for x, y in line.get_xydata()]
        known = not label.startswith("_")
        if label != "_nolegend_" and line.get_transform() == axes.transData and (known or len(points) <= _DENSE):
            yield from _named(label.replace("\\$", "$") if known else "", points, words)
    for bars in axes.containers:
        for bar in getattr(bars, "patches", ()):
            (left, low), (right, top) = bar.get_bbox().get_points().tolist()
            flat = bars.orientation == "horizontal"
            yield from _named("", [(right, (low + top) / 2) if flat else ((left + right) / 2, top)], words)


def _named(
    label: str, points: list[tuple[float, float]], words: dict[float, str]
) -> Iterator[tuple[str, list[tuple[float, float]]]]:
    """Yield the points as one series; without a `label`, name each point by its tick label if that is a word."""
    kept = [(_rounded(x), _rounded(y)) for x, y in points if isfinite(x) and isfinite(y)]
    if words and not label:
        yield from ((words.get(x) or words.get(y) or "", [(x, y)]) for x, y in kept)
    elif kept:
        yield label, kept


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
