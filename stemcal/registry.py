"""Registries of named objects (stages, solvers, responses, …): built-in ones, and entry points of other packages.

Built-in classes are imported on first use. Entry points are read only if a name is not built in, or all names are
listed. An entry point that cannot be loaded, or has an existing name, is skipped with a warning.
"""

from __future__ import annotations

import difflib
import logging
import os
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NoReturn, TypeVar

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

logger = logging.getLogger(__name__)


T = TypeVar("T", bound=Any)  # an object with a `name`


class Checked:
    """Base of interfaces. Further public names in a subclass are errors: a misspelled method would never be called."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if Checked in cls.__bases__:  # the class is itself an interface
            return
        interface = next(base for base in cls.__mro__[1:] if Checked in base.__bases__)
        known = [name for name in dir(interface) if not name.startswith("_")]
        for name in vars(cls):
            if name in known and callable(getattr(interface, name)) and not callable(getattr(cls, name)):
                raise TypeError(f"{cls.__name__}.{name} must be a method")
            if not name.startswith("_") and name not in known:
                near = difflib.get_close_matches(name, known, n=1)
                remedy = f"did you mean {near[0]}?" if near else f"use one of {', '.join(known)}"
                raise TypeError(f"{cls.__name__}.{name} is never used: {remedy}")


class Registry(Generic[T]):
    """All objects of one kind, by name.

    kind       the base class of the objects
    group      the group of entry points; the name of an entry point is the name of an object, and its value is the
               object or its class, which is called without arguments
    built_in   the built-in objects, or the import paths of their classes (``module:class``), in order
    """

    def __init__(self, kind: type[T], group: str, built_in: tuple[str | T, ...]) -> None:
        self.kind, self.group, self._places = kind, group, built_in
        self.broken: dict[str, str] = {}
        """The reason for each skipped entry point, by its name (``NAME of PACKAGE`` if the name already exists)."""
        self._loaded: dict[str, T] = {}

    @cached_property
    def built_in(self) -> tuple[T, ...]:
        """The built-in objects, in order."""
        return tuple(_instance_at(place) if isinstance(place, str) else place for place in self._places)

    @cached_property
    def _entries(self) -> dict[str, EntryPoint]:
        if not _may_declare(self.group):
            return {}
        entries: dict[str, EntryPoint] = {}
        own = {member.name for member in self.built_in}
        for entry in sorted(_declared(self.group), key=lambda entry: (entry.name, entry.value)):
            if entry.name in own or entry.name in entries:
                self._leave_out(entry, f"{entry.name} already exists", f"{entry.name} of {_package(entry)}")
            else:
                entries[entry.name] = entry
        return entries

    @property
    def external(self) -> tuple[T, ...]:
        """The objects of other packages that can be loaded, sorted by name."""
        return tuple(member for name in self._entries if (member := self._external(name)) is not None)

    @property
    def all(self) -> tuple[T, ...]:
        """The built-in objects in order, then those of other packages by name."""
        return (*self.built_in, *self.external)

    def with_(self, names: Iterable[str]) -> tuple[T, ...]:
        """Return the built-in objects in order, then those of other packages with these names."""
        return (*self.built_in, *(member for name in names if (member := self._external(name)) is not None))

    def named(self, name: str) -> T | None:
        """Return the object with this name; None if it does not exist or cannot be loaded."""
        return next((member for member in self.built_in if member.name == name), None) or self._external(name)

    def version_of(self, name: str) -> str:
        """Return the package of an object, its version and a hash of its code; empty if the object is built in."""
        if name in {member.name for member in self.built_in} or self._external(name) is None:
            return ""
        entry = self._entries[name]
        return f"{_package(entry)}+{_package_hash(entry.module)}"

    def _external(self, name: str) -> T | None:
        if name not in self._loaded and name in self._entries and name not in self.broken:
            entry = self._entries[name]
            try:
                with contained():  # no error of another package may end a command
                    loaded = entry.load()
                    member = loaded if isinstance(loaded, self.kind) else loaded()
                    fits = isinstance(member, self.kind) and member.name == name
            except ForeignError as error:
                self._leave_out(entry, f"cannot be loaded: {error}")
            else:
                if fits:
                    self._loaded[name] = member
                else:
                    self._leave_out(entry, f"{entry.value} must be a {self.kind.__name__} named {name}")
        return self._loaded.get(name)

    def _leave_out(self, entry: EntryPoint, reason: str, name: str = "") -> None:
        self.broken[name or entry.name] = f"{_package(entry)}: {reason}"
        logger.warning("%s was skipped: %s: %s", entry.name, _package(entry), reason)


def _instance_at(place: str) -> Any:
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)()


def _may_declare(group: str) -> bool:
    """Search all entry point files for the name of the group: `importlib.metadata` slows short commands by 10 %."""
    for folder in sys.path:
        for file in Path(folder).glob("*-info/entry_points.txt"):
            with suppress(OSError):
                if group.encode() in file.read_bytes():
                    return True
    return False


def _declared(group: str) -> Iterator[EntryPoint]:
    """Yield the entry points of a group; skip packages with damaged metadata."""
    from importlib.metadata import distributions

    seen: set[str] = set()
    for package in distributions():
        try:
            name, entries = package.name, package.entry_points.select(group=group)
        except Exception as error:  # a file of any installed package may be damaged
            logger.info("the entry points of %s cannot be read: %s", getattr(package, "_path", ""), described(error))
            continue
        if name not in seen:  # of several installed versions, Python imports the first on the path
            seen.add(name)
            yield from entries


def _package(entry: EntryPoint) -> str:
    return entry.value if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


@cache
def code_of(module: str) -> str:
    """Return a hash of the code of the package that contains a module; empty for stemcal itself."""
    return "" if module.partition(".")[0] == "stemcal" else _package_hash(module)


def _package_hash(module: str) -> str:
    """Return a hash of the package or the single file of an imported module; empty if the module has no file."""
    top, own = (sys.modules.get(name) for name in (module.partition(".")[0], module))
    whole = top if getattr(top, "__file__", None) else own  # a namespace package has no file, so use the module itself
    place = Path(getattr(whole, "__file__", None) or "")
    return hash_of(place.parent if hasattr(whole, "__path__") else place) if place.is_file() else ""


def hash_of(place: Path) -> str:
    """Return a hash of a Python file, or of all Python files in a folder; the same on every operating system."""
    import hashlib

    root, digest = place.parent if place.is_file() else place, hashlib.sha256()
    files = [place] if place.is_file() else place.rglob("*.py")
    for path in sorted(files, key=lambda path: path.relative_to(root).as_posix()):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:12]


# ---- running code of users and of other packages, which may print, exit, or raise any exception


_MOST_SHOWN = 500  # largest number of characters of an error's text


class ForeignError(Exception):
    """Code of a user or of another package failed; the message contains the type and the text of the error."""


def described(error: BaseException) -> str:
    """Return the type and the text of an error in one line of limited length."""
    text = "(its text cannot be read)"
    with suppress(Exception):  # `__str__` is code of the user, too
        text = str(error)
    return f"{type(error).__name__}: {cut(text)}".removesuffix(": ")


def cut(text: str, most: int = _MOST_SHOWN) -> str:
    """Return the first `most` characters of a text in one line, and the number of characters left out."""
    more = f" … ({len(text) - most:,} more characters)" if len(text) > most else ""
    return " ".join(text[:most].split()) + more


@contextmanager
def contained() -> Iterator[None]:
    """Contain code of users and other packages: its output goes to stderr, and `os._exit` raises an exception.

    Every exception of this code except `KeyboardInterrupt` becomes a `ForeignError`, even `SystemExit`.
    """
    try:
        with _without_exit(), _printing_to_stderr():
            yield
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise ForeignError(described(error)) from error


@contextmanager
def _without_exit() -> Iterator[None]:
    """Make `os._exit` raise `SystemExit` in this thread instead of ending the process without a message."""
    original, thread = os._exit, threading.get_ident()

    def refuse(status: int) -> NoReturn:
        if threading.get_ident() != thread:
            original(status)
        raise SystemExit(status)

    os._exit = refuse
    try:
        yield
    finally:
        os._exit = original


@contextmanager
def _printing_to_stderr() -> Iterator[None]:
    """Redirect output of Python, native code and child processes to stderr, because stdout is for data."""
    original = None
    with suppress(OSError, AttributeError, ValueError):  # the process may have no standard output
        sys.stdout.flush()
        original = os.dup(1)
        os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if original is not None:
            os.dup2(original, 1)
            os.close(original)
