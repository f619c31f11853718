"""A strict reader of YAML: plain trees, YAML 1.2 numbers, every node with its line and column.

PyYAML parses the text into nodes; this module converts the nodes into values. Tags, anchors, aliases, duplicate keys,
numbers that are not finite and large files are errors. ``1e9`` is a number, ``010`` is ten, ``190:20:30`` and ``no``
are texts. Errors in a file are reported; no file raises an exception.

>>> document = read_yaml(b"low: 1e3\\nunits: [mm, no]")
>>> document.data, document.place(("units", 1))
({'low': 1000.0, 'units': ['mm', 'no']}, Position(line=2, column=13))
"""

import math
import re
from dataclasses import dataclass, field
from typing import Any, NamedTuple, NoReturn

import yaml

from stemcal.storage.encodings import decode
from stemcal.study.types.units import with_point

MAX_BYTES = 1 << 20
_MAX_PROBLEMS = 100

# values of unquoted scalars by the core schema of YAML 1.2
_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_LONGEST_INTEGER = 16  # longer numbers become floats, because int() raises an exception for thousands of digits
_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}

NodePath = tuple[str | int, ...]
"""The keys and list indices from the top of the tree to a node."""


class Position(NamedTuple):
    """A place in the file; lines and columns are counted from 1."""

    line: int
    column: int


_TOP = Position(1, 1)


class Finding(NamedTuple):
    """A mistake at `path` in a spec; with `at_key`, the key itself is wrong, not its value."""

    path: NodePath
    message: str
    remedy: str = ""
    at_key: bool = False


@dataclass
class Document:
    """The tree of a file, the positions of its keys and values, and its errors; `complete` if read to the end."""

    data: Any = None
    keys: dict[NodePath, Position] = field(default_factory=dict)
    values: dict[NodePath, Position] = field(default_factory=dict)
    problems: list[tuple[Position, Finding]] = field(default_factory=list)
    complete: bool = False

    def place(self, path: NodePath, at_key: bool = False) -> Position:
        """Return the position of the value at `path`; with `at_key`, or for a list or mapping, that of its key.

        For a path that is not in the file, return the position of the nearest node above.
        """
        if at_key and path in self.keys:
            return self.keys[path]
        if path in self.values:
            return self.values[path]
        for end in range(len(path) - 1, 0, -1):
            above = self.keys.get(path[:end]) or self.values.get(path[:end])
            if above:
                return above
        return self.values.get((), _TOP)

    def note(self, place: Position, message: str, remedy: str, path: NodePath = ()) -> None:
        self.problems.append((place, Finding(path, message, remedy)))


def read_yaml(content: bytes) -> Document:
    """Return the tree of a file and all errors in it; never raises an exception."""
    document = Document()
    text = decode(content)
    if len(content) > MAX_BYTES:
        document.note(_TOP, "the file is larger than 1 MiB", "check whether this file is a spec")
    elif text is None:
        document.note(_TOP, "the file is not encoded in UTF-8, UTF-16 or GBK", "save the file as UTF-8")
    else:
        _read_text(document, text)
    return document


def _read_text(document: Document, text: str) -> None:
    loader = None
    try:
        loader = _Loader(text, document)
        if loader.check_node():
            document.data = loader.value_of(loader.get_node(), ())
        if loader.check_node():
            second: Any = loader.peek_event()  # type: ignore[no-untyped-call]
            remedy = "keep one study per file, and remove the `---` line"
            loader.stop(second, "a second YAML document begins here", remedy)
        document.complete = True
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        place = Position(before.count("\n") + 1, error.position - before.rfind("\n"))
        code = error.character if isinstance(error.character, int) else ord(error.character[:1] or "\0")
        remedy = "remove the character; save the file as plain text in UTF-8"
        document.note(place, f"character U+{code:04X} is not allowed", remedy)
    except yaml.MarkedYAMLError as error:
        problem = (error.problem or error.context or "no YAML").replace("\n", " ")[:200]
        remedy = next((remedy for part, remedy in _REMEDIES.items() if part in problem), "check this line")
        # a missing colon is reported at the key (context mark), not at the text after the key (problem mark)
        places = error.problem_mark, error.context_mark
        first, second = places[::-1] if _NO_COLON in problem else places
        document.note(_place(first or second), f"the file is not valid YAML: {problem}", remedy)
    except RecursionError:
        document.note(_TOP, "the file is nested too deeply", "a spec has up to four nesting levels; check the brackets")
    except (yaml.YAMLError, ValueError, OverflowError):
        remedy = "check the escape sequences and the lines that begin with `%`"
        here = _place(loader.get_mark() if loader else None)
        document.note(here, "the file is not valid YAML at this position", remedy)
    except _Stopped:
        pass


class _Stopped(Exception):
    """Raised after an error that makes further reading useless."""


class _Loader(yaml.SafeLoader):
    """Parses nodes, converts them into values, and adds errors to the document."""

    def __init__(self, text: str, document: Document) -> None:
        super().__init__(text)
        self._document = document

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Return the next node; report anchors, tags and aliases (an alias becomes an empty scalar)."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent):
            self._complain(event, f"*{str(event.anchor)[:40]} is an alias", "write the value itself")
            self.get_event()  # type: ignore[no-untyped-call]
            marks: tuple[Any, Any] = event.start_mark, event.end_mark
            return yaml.ScalarNode("", "", *marks)
        if event.anchor is not None:
            self._complain(event, f"&{str(event.anchor)[:40]} is an anchor", "remove the anchor")
        if event.tag is not None:
            self._complain(event, f"{event.tag[:40]} is a tag", "remove the tag")
        if any("\ud800" <= letter <= "\udfff" for letter in getattr(event, "value", "")):
            self._complain(event, "an unpaired surrogate is not a valid character", "write the character itself")
        self.anchors.clear()  # otherwise PyYAML would stop at a repeated anchor
        return super().compose_node(parent, index)

    def value_of(self, node: Any, path: NodePath) -> Any:
        """Return the value of a node, and store its position."""
        place = _place(node.start_mark)
        if isinstance(node, yaml.ScalarNode):
            self._document.values[path] = place
            value = node.value if node.style else resolve(node.value)
            if isinstance(value, float) and not math.isfinite(value):
                shown = node.value if len(node.value) <= 40 else node.value[:37] + "..."
                self._complain(node, f"{shown} is not a finite number", "write a number below 1e308", path)
                return 0.0
            return value
        self._document.values[path] = self._document.keys.get(path, place)
        if isinstance(node, yaml.SequenceNode):
            return [self.value_of(entry, (*path, index)) for index, entry in enumerate(node.value)]
        content: dict[str, Any] = {}
        for key_node, value in self._with_points(node, path):
            if not isinstance(key_node, yaml.ScalarNode):
                remedy = "use a plain word as a key; enclose `{braces}` in quotes"
                self.stop(key_node, "a list or mapping cannot be a key", remedy)
            key, below = key_node.value, (*path, key_node.value)
            first = self._document.keys.setdefault(below, _place(key_node.start_mark))
            if key in content:
                message = f"the key {key[:60]!r} is already used in line {first.line}"
                self._complain(key_node, message, "merge the two entries under one key", below)
            else:
                content[key] = self.value_of(value, below)
        return content

    def _with_points(self, node: yaml.MappingNode, path: NodePath) -> list[tuple[Any, Any]]:
        """Return the keys and values of a mapping; in braces, join the numbers that YAML split at a decimal comma."""
        pairs: list[tuple[Any, Any]] = []
        for key, value in node.value if node.flow_style else ():
            last = pairs[-1][1] if pairs else None
            rest = isinstance(key, yaml.ScalarNode) and not (key.style or value.value) and key.value[:1].isdigit()
            if rest and isinstance(last, yaml.ScalarNode) and not last.style and _INTEGER.fullmatch(last.value):
                written = f"{last.value},{key.value}"
                below = (*path, pairs[-1][0].value)
                self._complain(last, f"{written[:60]!r} has a decimal comma", f"write {with_point(written)}", below)
                whole = yaml.ScalarNode(last.tag, written.replace(",", "."), last.start_mark, key.end_mark)
                pairs[-1] = pairs[-1][0], whole
            else:
                pairs.append((key, value))
        return pairs if node.flow_style else node.value

    def stop(self, at: yaml.Event | yaml.Node, message: str, remedy: str) -> NoReturn:
        """Add an error and stop reading."""
        self._complain(at, message, remedy)
        raise _Stopped

    def _complain(self, at: yaml.Event | yaml.Node, message: str, remedy: str, path: NodePath = ()) -> None:
        self._document.note(_place(at.start_mark), message, remedy, path)
        if len(self._document.problems) >= _MAX_PROBLEMS:
            raise _Stopped


def resolve(text: str) -> str | int | float | bool | None:
    """Return the value of an unquoted scalar; infinity for all numbers that are not finite."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text) and len(text) <= _LONGEST_INTEGER:
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return math.inf
    return text


def _place(mark: Any) -> Position:
    return Position(mark.line + 1, mark.column + 1) if mark is not None else _TOP


_NO_COLON = "could not find expected ':'"
_REMEDIES = {
    r"'\t' that cannot start": "replace each tab by spaces",
    "cannot start any token": "enclose the text in quotes",
    "mapping values": "put quotes around text that contains a colon; check the indentation",
    _NO_COLON: "a colon and a space are missing here: write `key: value`",
    "expected <block end>": "check the indentation of this line and of the lines above",
    "expected ',' or": "add the missing closing bracket",
    "sequence entries": "enclose a single `-` in quotes",
    "unexpected end of stream": "add the missing closing quotation mark",
}
