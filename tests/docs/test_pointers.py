"""Modules, names and files that docstrings, comments and pages mention exist."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from stemcal.stages.stage import STAGES
from stemcal.study.reading.read import StudyForm

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "stemcal"
FOLDERS = ("stemcal", "tests", "benchmarks", "docs", "configs", "examples")  # where a mentioned file may be
NAME = r"[A-Za-z_]\w*"
SUFFIXES = {
    "csv",
    "docx",
    "html",
    "json",
    "js",
    "jsonl",
    "k",
    "md",
    "pem",
    "py",
    "svg",
    "tex",
    "txt",
    "xlsx",
    "yaml",
    "zip",
    "F",
    "rad",
}
SECTIONS = {*StudyForm.model_fields, *(stage.name for stage in STAGES.built_in), "history", "levels"}
ALIASES = {"np", "pd", "plt"}
OTHERS = {"use_attribute_docstrings"}  # of pydantic
VARIABLES = {"study": "study.model.study"}  # `study.ask` is a method of a study


class Module:
    """The names that a module defines or imports, and those of its classes."""

    def __init__(self, path: Path) -> None:
        source = path.read_text("utf-8")
        tree = ast.parse(source)
        self.names = set(names_bound(tree.body))
        self.words = {word for node in ast.walk(tree) for word in words_of(node)}
        self.remarks = [*docstrings(tree), *comments(source)]


def names_bound(body: list[ast.stmt]) -> Iterator[str]:
    """Yield the names that statements bind, also inside `if` and `try`."""
    for statement in body:
        match statement:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.Import(names=names) | ast.ImportFrom(names=names):
                yield from (alias.asname or alias.name.partition(".")[0] for alias in names)
            case ast.Assign() | ast.AnnAssign():
                yield from (node.id for node in ast.walk(statement) if isinstance(node, ast.Name))
        for inner in ("body", "orelse", "handlers"):
            if not isinstance(statement, ast.FunctionDef | ast.ClassDef):
                yield from names_bound(getattr(statement, inner, []))


def words_of(node: ast.AST) -> Iterator[str]:
    """Yield the identifiers of a node: names, attributes, arguments, keywords, and words of its text."""
    for field in ("id", "attr", "arg", "name", "asname"):
        if isinstance(word := getattr(node, field, None), str):
            yield word
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " not in node.value:
        yield from (node.value, *re.findall(NAME, node.value))


def docstrings(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        for one in getattr(node, "body", []) if isinstance(getattr(node, "body", []), list) else []:
            if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant) and isinstance(one.value.value, str):
                yield one.value.value


def comments(source: str) -> Iterator[str]:
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    yield from (token.string for token in tokens if token.type == tokenize.COMMENT)


@cache
def modules() -> dict[str, Module]:
    """Return the modules by their dotted names, those of stemcal without `stemcal.`."""
    files = {path.relative_to(PACKAGE).with_suffix("").parts: path for path in PACKAGE.rglob("*.py")}
    return {".".join(parts).removesuffix("__init__").rstrip("."): Module(path) for parts, path in files.items()}


@cache
def all_words() -> set[str]:
    """Return the identifiers of the code and its tests, and the names of modules."""
    tests = [
        Module(path) for folder in ("tests", "examples", "benchmarks", "docs") for path in (ROOT / folder).rglob("*.py")
    ]
    parts = {part for name in modules() for part in name.split(".")}
    words = {word for module in (*modules().values(), *tests) for word in module.words}
    return words | parts | {path.stem for path in (ROOT / "tests").rglob("*.py")} | OTHERS


def is_in_package(pointer: str) -> bool:
    """Return whether a pointer is a module of stemcal or a name in one; attributes of a class may be those of any."""
    known, head, rest = modules(), pointer.removeprefix("stemcal."), list[str]()
    while head not in known and head:
        head, _, last = head.rpartition(".")
        rest = [last, *rest]
    module = known[head]
    in_folder = any(name.startswith(f"{pointer.removeprefix('stemcal.')}.") for name in known)
    return not rest or in_folder or (rest[0] in module.names and set(rest[1:]) <= all_words())


def homes(module: str) -> list[str]:
    """Return a module and the packages that it is in: a pointer may be relative to each of them."""
    parts = module.split(".")
    return [".".join(parts[:count]) for count in range(len(parts), 0, -1)]


def is_there(pointer: str, home: str = "") -> bool:
    """Return whether what a pointer in the module `home` names exists; pages have no home.

    >>> is_there("fem.kernels.march"), is_there("kernels.march", "fem.stepper"), is_there("fem.kernels.swim")
    (True, True, False)
    """
    first, *rest = pointer.split(".")
    if pointer in all_words() or "NAME" in rest:
        return True
    if any(is_in_package(f"{place}.{pointer}") for place in homes(home) if home) or is_in_package(pointer):
        return True
    if first in VARIABLES and len(rest) == 1:
        return rest[0] in modules()[VARIABLES[first]].words
    if any(first == name.partition(".")[0] for name in ("stemcal", *modules())):
        return False
    own = modules()[home].words | SECTIONS if home else all_words()
    known = first in own or (first[0].isupper() and first in all_words())
    return set(rest) <= all_words() if known else first in ALIASES or find_spec(first) is not None


def dead_pointers(text: str, home: str = "") -> list[str]:
    """Return the names between backticks in a text that do not exist.

    >>> dead_pointers("A `Mesh` of `fem.mesh`, a `swim_lane` of `fem.pool` and `RULES` of `fem.mesh`.")
    ['swim_lane', 'fem.pool', 'RULES of fem.mesh']
    """
    quoted = [word.removesuffix("()") for word in re.findall(rf"`({NAME}(?:\.{NAME})*(?:\(\))?)`", text)]
    dotted = [word for word in quoted if "." in word and word.rpartition(".")[2] not in SUFFIXES]
    simple = [word for word in quoted if re.fullmatch(r"_?[a-z]+_[a-z]\w*|[A-Z]+(_[A-Z]+)+|([A-Z][a-z]+){2,}", word)]
    pairs = re.findall(rf"`([A-Z]\w*)` (?:of|in) `({NAME}(?:\.{NAME})*)`", text)
    return [
        *(word for word in simple if word not in all_words()),
        *(word for word in dotted if not is_there(word, home)),
        *(f"{name} of {of}" for name, of in pairs if is_in_package(of) and not is_there(f"{of}.{name}", home)),
    ]


def dead_in_page(text: str) -> list[str]:
    """Return the dead pointers of a page; the names and variables of its examples exist."""
    examples = " ".join(re.findall(r"```.*?```", text, re.DOTALL))
    return [
        word
        for word in dead_pointers(re.sub(r"```.*?```", "", text, flags=re.DOTALL))
        if word not in examples and f"{word.partition('.')[0]} = " not in examples
    ]


def test_docstrings_and_comments_name_what_exists() -> None:
    dead = {name: dead for name, module in modules().items() if (dead := dead_pointers(" ".join(module.remarks), name))}
    assert dead == {}


def test_pages_name_what_exists() -> None:
    pages = [ROOT / "CONTRIBUTING.md", ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    dead = {page.name: words for page in pages if (words := dead_in_page(page.read_text("utf-8")))}
    assert dead == {}


def test_mentioned_files_exist() -> None:
    """A path from the root of the repository, in a page or in a Python file."""
    pattern = re.compile(rf"(?<![\w/.{{}}])(?:{'|'.join(FOLDERS)})(?:/[\w-]+)+\.(?:py|md|yaml|csv|png|gif)\b")
    texts = [
        path for folder in ("stemcal", "tests", "benchmarks", "docs") for path in (ROOT / folder).rglob("*.[pm][yd]")
    ]
    texts += ROOT.glob("*.md")
    found = {
        (path.relative_to(ROOT).as_posix(), word) for path in texts for word in pattern.findall(path.read_text("utf-8"))
    }
    assert [pair for pair in sorted(found) if not (ROOT / pair[1]).exists()] == []
