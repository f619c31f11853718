"""A strict reader of YAML: plain trees, YAML 1.2 numbers, every node with its line and column.

PyYAML turns text into events; everything after that is done here, in one loop without recursion:
no tags, anchors or aliases, no duplicate keys, finite numbers only, and limits on size, depth and events.
So ``1e9`` is a number, ``010`` is ten, ``190:20:30`` and ``no`` are texts, and no file can make it crash.

>>> document = read_yaml(b"low: 1e3\\nunits: [mm, no]")
>>> document.data, document.place(("units", 1))
({'low': 1000.0, 'units': ['mm', 'no']}, Position(line=2, column=13))
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

from stemcal.files.reading import decode

MAX_BYTES = 1 << 20
MAX_DEPTH = 32
MAX_EVENTS = 50_000
MAX_PROBLEMS = 100

# what unquoted scalars mean: the core schema of YAML 1.2
_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_LONGEST_INTEGER = 16  # beyond about 2**53 a float is as good, and int() of thousands of digits raises
_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}

NodePath = tuple[str | int, ...]
"""The way from the top to a node: keys and list indices."""


class Position(NamedTuple):
    """A place in the file, both from 1."""

    line: int
    column: int


class _YamlProblem(NamedTuple):
    """What the reader refuses."""

    place: Position
    path: NodePath
    message: str
    remedy: str


class Finding(NamedTuple):
    """Something wrong at `path`; `at_key` when the key itself is at fault."""

    path: NodePath
    message: str
    remedy: str = ""
    at_key: bool = False


@dataclass
class Document:
    """The tree of a file, the places of its keys and values, and the errors found.

    `complete` is false when reading stopped before the end, so that `data` lacks the rest.
    """

    data: Any = None
    keys: dict[NodePath, Position] = field(default_factory=dict)
    values: dict[NodePath, Position] = field(default_factory=dict)
    problems: list[_YamlProblem] = field(default_factory=list)
    complete: bool = False

    def place(self, path: NodePath) -> Position:
        """Return where `path` is: its value, its key if it holds more keys, or else the nearest above."""
        if path in self.values:
            return self.values[path]
        for end in range(len(path) - 1, 0, -1):
            found = self.keys.get(path[:end]) or self.values.get(path[:end])
            if found:
                return found
        return self.values.get((), Position(1, 1))


def read_yaml(content: bytes) -> Document:
    """Return the tree of a file with everything that is wrong with it; never raises."""
    if len(content) > MAX_BYTES:
        return _unread("the file is larger than 1 MiB", "is this the right file?")
    text = decode(content)
    if text is None:
        return _unread("the file is neither UTF-8 nor UTF-16 nor GBK text", "save it as UTF-8")
    builder = _Builder()
    try:
        _feed(builder, text)
    except yaml.reader.ReaderError as error:
        before = text[: error.position]
        place = Position(before.count("\n") + 1, error.position - before.rfind("\n"))
        code = error.character if isinstance(error.character, int) else ord(error.character[:1] or "\0")
        builder.note(
            place,
            f"character U+{code:04X} is not allowed",
            "remove the character; save the file as plain text in UTF-8",
        )
    except yaml.MarkedYAMLError as error:
        problem = (error.problem or error.context or "this is not YAML").replace("\n", " ")[:200]
        remedy = next((remedy for part, remedy in _REMEDIES.items() if part in problem), "check this line")
        builder.note(_place(_mark(error)), f"not readable as YAML: {problem}", remedy)
    except (yaml.YAMLError, ValueError, OverflowError):
        builder.note(builder.here, "this is not readable as YAML", "check escapes and % lines after this place")
    except _Stopped:
        pass
    return builder.document


def _unread(message: str, remedy: str) -> Document:
    return Document(problems=[_YamlProblem(Position(1, 1), (), message, remedy)])


def _feed(builder: _Builder, text: str) -> None:
    for count, event in enumerate(yaml.parse(text, Loader=yaml.SafeLoader)):
        builder.here = _place(event.start_mark)
        if count >= MAX_EVENTS:
            builder.stop(f"the file has more than {MAX_EVENTS} elements", "is this the right file?")
        builder.take(event)
    builder.document.complete = True


class _Stopped(Exception):
    """Raised to leave the event loop once a problem has been noted that makes going on useless."""


@dataclass
class _Open:
    """A mapping or list being filled; `key` awaits its value, `again` if it is a duplicate."""

    node: dict[str, Any] | list[Any]
    path: NodePath
    key: str | None = None
    again: bool = False

    @property
    def wants_key(self) -> bool:
        return isinstance(self.node, dict) and self.key is None


class _Builder:
    """Turns events into a `Document`, noting problems on the way."""

    def __init__(self) -> None:
        self.document = Document()
        self.here = Position(1, 1)
        self._stack: list[_Open] = []
        self._documents = 0
        self._takers: dict[type[yaml.Event], Callable[[Any], None]] = {
            yaml.DocumentStartEvent: lambda event: self._begin_document(),
            yaml.AliasEvent: self._alias,
            yaml.ScalarEvent: self._scalar,
            yaml.MappingStartEvent: lambda event: self._begin(event, {}),
            yaml.SequenceStartEvent: lambda event: self._begin(event, []),
            yaml.MappingEndEvent: lambda event: self._end(),
            yaml.SequenceEndEvent: lambda event: self._end(),
        }

    def take(self, event: yaml.Event) -> None:
        """Add one event to the tree."""
        taker = self._takers.get(type(event))
        if taker is not None:
            taker(event)

    def note(self, place: Position, message: str, remedy: str) -> None:
        """Note a problem at the node being read."""
        self.document.problems.append(_YamlProblem(place, self._path(), message, remedy))

    def stop(self, message: str, remedy: str) -> None:
        """Note a problem and read no further."""
        self.note(self.here, message, remedy)
        raise _Stopped

    def _complain(self, message: str, remedy: str) -> None:
        self.note(self.here, message, remedy)
        if len(self.document.problems) >= MAX_PROBLEMS:
            raise _Stopped

    def _begin_document(self) -> None:
        self._documents += 1
        if self._documents > 1:
            self.stop("a second document begins here", "keep one study per file and remove the line ---")

    def _alias(self, event: yaml.AliasEvent) -> None:
        if self._stack and self._stack[-1].wants_key:
            self.stop("an alias cannot be a key", "use a plain word")
        self._complain(f"*{str(event.anchor)[:40]} is an alias", "write the value out")
        self._put(None)
        self._close()

    def _scalar(self, event: yaml.ScalarEvent) -> None:
        self._refuse_extras(event)
        text = self._without_surrogates(event.value)
        if self._stack and self._stack[-1].wants_key:
            self._take_key(self._stack[-1], text)
            return
        self._put(text if event.style else self._resolved(text))
        self._close()

    def _begin(self, event: yaml.CollectionStartEvent, node: dict[str, Any] | list[Any]) -> None:
        self._refuse_extras(event)
        if len(self._stack) >= MAX_DEPTH:
            self.stop(f"nested more than {MAX_DEPTH} deep", "a spec needs at most four levels; check the brackets")
        if self._stack and self._stack[-1].wants_key:
            self.stop("a list or mapping cannot be a key", "use a plain word; enclose {braces} in quotes")
        path = self._path()
        self._put(node)
        self._stack.append(_Open(node, path))

    def _end(self) -> None:
        self._stack.pop()
        self._close()

    def _path(self) -> NodePath:
        if not self._stack:
            return ()
        top = self._stack[-1]
        if isinstance(top.node, list):
            return (*top.path, len(top.node))
        if top.key is None:
            return top.path
        return (*top.path, top.key, f"(again in line {self.here.line})") if top.again else (*top.path, top.key)

    def _take_key(self, top: _Open, key: str) -> None:
        path = (*top.path, key)
        first = self.document.keys.setdefault(path, self.here)
        top.key, top.again = key, False
        if key in top.node:
            self._complain(f"key {key[:60]!r} is repeated; line {first.line} already has this key", "keep one of them")
            top.again = True

    def _put(self, value: Any) -> None:
        if not self._stack:
            self.document.data = value
            self.document.values[()] = self.here
            return
        top = self._stack[-1]
        path = self._path()
        place = self.document.keys.get(path, self.here) if isinstance(value, dict | list) else self.here
        self.document.values.setdefault(path, place)
        if isinstance(top.node, list):
            top.node.append(value)
        elif not top.again and top.key is not None:
            top.node[top.key] = value

    def _close(self) -> None:
        if self._stack:
            self._stack[-1].key = None

    def _refuse_extras(self, event: yaml.ScalarEvent | yaml.CollectionStartEvent) -> None:
        if event.anchor is not None:
            self._complain(f"&{str(event.anchor)[:40]} is an anchor", "remove it")
        if event.tag is not None:
            self._complain(f"{event.tag[:40]} is a tag", "remove it")

    def _without_surrogates(self, text: str) -> str:
        if any("\ud800" <= letter <= "\udfff" for letter in text):
            self._complain("half a surrogate pair is not a character", "write the character itself")
            return "?"
        return text

    def _resolved(self, text: str) -> Any:
        value = resolve(text)
        if isinstance(value, float) and not math.isfinite(value):
            shown = text if len(text) <= 40 else text[:37] + "..."
            self._complain(f"{shown} is not a finite number", "write a number below 1e308")
            return 0.0
        return value


def resolve(text: str) -> str | int | float | bool | None:
    """Return the value of an unquoted scalar; what is not finite comes as infinity.

    >>> [resolve(text) for text in ("1e9", "010", "190:20:30", "no", "~")]
    [1000000000.0, 10, '190:20:30', 'no', None]
    """
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
    return Position(mark.line + 1, mark.column + 1) if mark is not None else Position(1, 1)


def _mark(error: yaml.MarkedYAMLError) -> Any:
    """Return where the error is: of a key without its colon the key, not what comes after it."""
    first, second = error.problem_mark, error.context_mark
    return second or first if _NO_COLON in (error.problem or "") else first or second


_NO_COLON = "could not find expected ':'"
_REMEDIES = {
    "cannot start any token": "enclose the text in quotes; indent with spaces, not tabs",
    "mapping values are not allowed": "enclose a text with a colon in quotes; check the indentation",
    _NO_COLON: "a colon and a space are missing here: write key: value",
    "expected <block end>": "check the indentation of this line and the ones above",
    "expected ',' or": "close the bracket opened before",
    "sequence entries are not allowed": "enclose a lone - in quotes",
    "unexpected end of stream": "close the quote opened before",
}
