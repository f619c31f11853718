"""Figures as the page has them: one drawing for light and dark, with the styles and marks of all figures shared.

Matplotlib repeats the style with every path, writes a millionth of a point, and defines each mark once a figure: three
quarters of what it writes. The page keeps a tenth of a point.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element, fromstring

from markupsafe import escape

from stemcal.report.figures.style import COLOURS

_HREF = "{http://www.w3.org/1999/xlink}href"
_ROUNDED = ("x", "y", "width", "height", "transform")


@dataclass
class Shared:
    """What the figures of a page share: the class of each style; marks and clipping paths, each with its id."""

    styles: dict[str, str] = field(default_factory=dict)
    marks: dict[tuple[str, str], str] = field(default_factory=dict)

    @property
    def css(self) -> str:
        """The rules of all styles."""
        return "\n".join(f".{name} {{ {style} }}" for style, name in self.styles.items())

    @property
    def defs(self) -> str:
        """The marks and clipping paths, to be written once."""
        return "".join(f'<{tag} id="{name}"{rest}' for (tag, rest), name in self.marks.items())


def inline(document: str, description: str, shared: Shared) -> str:
    """Return the `svg` of a figure as an element for the page; what it shares with others goes to `shared`."""
    root, ids = fromstring(document), dict[str, str]()
    for node in root.iter():
        node.tag = node.tag.rpartition("}")[2]
    for defs in root.iter("defs"):
        for mark in defs.iter():
            if name := mark.attrib.pop("id", ""):
                tag, rest = mark.tag, _written(mark, shared, ids).removeprefix(f"<{mark.tag}")
                ids[name] = shared.marks.setdefault((tag, rest), f"m{len(shared.marks)}")
    inside = "".join(_written(node, shared, ids) for node in root)
    return f'<svg role="img" aria-label="{escape(description)}" viewBox="{root.attrib["viewBox"]}">{inside}</svg>'


def _written(node: Element, shared: Shared, ids: dict[str, str]) -> str:
    """Return an element as text; of a group that says nothing, what is in it."""
    if node.tag in ("defs", "metadata"):
        return ""
    inside = str(escape((node.text or "").strip())) + "".join(_written(child, shared, ids) for child in node)
    attributes = "".join(f' {name}="{escape(value)}"' for name, value in _attributes(node, shared, ids))
    if node.tag == "g" and not (inside and attributes):
        return inside
    return f"<{node.tag}{attributes}>{inside}</{node.tag}>" if inside else f"<{node.tag}{attributes}/>"


def _attributes(node: Element, shared: Shared, ids: dict[str, str]) -> Iterator[tuple[str, str]]:
    for name, value in node.attrib.items():
        if name == "style":
            style = _style(value)
            yield "class", shared.styles.setdefault(style, f"s{len(shared.styles)}")
        elif name == "d":
            yield name, shortened(value)
        elif name == _HREF:
            yield "href", f"#{ids[value[1:]]}" if value.startswith("#") else re.sub(r"\s", "", value)
        elif name == "clip-path":
            yield name, f"url(#{ids[value[5:-1]]})"
        elif name in _ROUNDED and "scale" not in value:
            if not value.startswith("rotate(-0 "):
                yield name, re.sub(r"-?\d+\.\d+", lambda number: _short(round(10 * float(number[0]))), value)
        elif name != "id":
            yield name, value


def _style(style: str) -> str:
    """Return a style in the colours and the font of the page."""
    style = re.sub(r"\bfont: [^;]*?([\d.]+px)[^;]*", r"font-size: \1", style)
    style = re.sub(r"font-family: [^;]*;? ?", "", style)
    for colour, variable in COLOURS.items():
        style = style.replace(colour, variable)
    return style


def shortened(path: str) -> str:
    """Return a path to a tenth of its unit, in steps.

    >>> shortened("M 10.04 20 L 13.333 20 L 13.333 16.7 z M 1 1 C 1 2 3 4 5 6")
    'M10 20h3.3v-3.3zM1 1c0 1 2 3 4 5'
    """
    written, at = [], (0, 0)
    for command, numbers in re.findall(r"([MLQCzZ])([^MLQCzZ]*)", path):
        tenths = [round(10 * float(number)) for number in numbers.split()]
        points = list(zip(tenths[::2], tenths[1::2], strict=True))
        if command in "QC":
            written.append(command.lower() + _pairs([(x - at[0], y - at[1]) for x, y in points]))
        elif command in "zZ":
            written.append("z")
        for point in points if command in "ML" else ():
            written.append(f"M{_pairs([point])}" if command == "M" else _line(point[0] - at[0], point[1] - at[1]))
            at = point
        at = points[-1] if points else at
    return "".join(written)


def _line(dx: int, dy: int) -> str:
    """Return a step; nothing where it is shorter than a tenth."""
    if dx and dy:
        return f"l{_pairs([(dx, dy)])}"
    return f"h{_short(dx)}" if dx else f"v{_short(dy)}" if dy else ""


def _pairs(points: list[tuple[int, int]]) -> str:
    return " ".join(f"{_short(x)} {_short(y)}" for x, y in points).replace(" -", "-")


def _short(tenths: int) -> str:
    """Return tenths as a number.

    >>> _short(33), _short(-5), _short(40)
    ('3.3', '-.5', '4')
    """
    whole, rest = divmod(abs(tenths), 10)
    return f"{'-' if tenths < 0 else ''}{whole or ('' if rest else 0)}{f'.{rest}' if rest else ''}"
