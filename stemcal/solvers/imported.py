"""Find the source files that a Python file imports from some folders, without running them."""

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path

_DYNAMIC = frozenset({"import_module", "__import__"})
_COMPILED = ("so", "*.so", "pyd", "*.pyd")  # modules such as law.cpython-312-x86_64-linux-gnu.so


def imported_files(file: Path, roots: Sequence[Path]) -> list[Path]:
    """Return the files of all modules below `roots` that a file imports, directly or indirectly, sorted.

    Imports inside functions and the `__init__.py` of each package are included, imports by a computed name are not.
    """
    imported: set[Path] = set()
    waiting = [file]
    while waiting:
        further = set(_imported_by(waiting.pop(), roots)) - {file} - imported
        imported |= further
        waiting += further
    return sorted(imported)


def _imported_by(file: Path, roots: Sequence[Path]) -> Iterator[Path]:
    if file.suffix != ".py":
        return
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError, RecursionError):
        return  # Python reports the reason when the program imports this file
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _files_of(alias.name, roots)
        elif isinstance(node, ast.ImportFrom):
            folders = [file.parents[node.level - 1]] if 0 < node.level <= len(file.parents) else roots
            for alias in node.names:
                yield from _files_of(f"{node.module or ''}.{alias.name}".lstrip("."), folders)
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) in _DYNAMIC:
            for name in node.args[:1]:
                if isinstance(name, ast.Constant) and isinstance(name.value, str):
                    yield from _files_of(name.value.lstrip("."), [file.parent, *roots])


def _files_of(name: str, folders: Sequence[Path]) -> Iterator[Path]:
    """Yield the files that Python runs to import a dotted name: a module or the `__init__.py` for each part of it."""
    for folder in folders:
        place = folder
        for part in name.split("."):
            if not part.isidentifier():
                break
            compiled = (path for end in _COMPILED for path in place.glob(f"{part}.{end}"))
            for path in (place / f"{part}.py", place / part / "__init__.py", *compiled):
                if path.is_file():
                    yield path
            place = place / part
