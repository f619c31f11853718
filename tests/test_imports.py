"""The floors of the house: imports point down only, and each outside library has its place."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "stemcal"

FLOORS = {
    "stemcal.errors": 0,
    "stemcal.version": 0,
    "stemcal.registry": 0,
    "stemcal.words": 0,
    "stemcal.files": 1,
    "stemcal.outputs": 1,
    "stemcal.interrupts": 0,
    "stemcal.child": 1,
    "stemcal.naming": 0,
    "stemcal.names": 1,
    "stemcal.note": 0,
    "stemcal.numbers": 0,
    "stemcal.run_warnings": 2,
    "stemcal.power_law": 0,
    "stemcal.fem.kernels": 1,
    "stemcal.fem": 2,
    "stemcal.doe": 3,
    "stemcal.measured": 2,
    "stemcal.study": 3,
    "stemcal.cutting": 3,
    "stemcal.laboratory": 4,
    "stemcal.solvers": 5,
    "stemcal.executors": 6,
    "stemcal.folder": 7,
    "stemcal.runs": 8,
    "stemcal.stages": 9,
    "stemcal.overview": 10,
    "stemcal.by_hand": 11,
    "stemcal.workflow": 11,
    "stemcal.report": 13,
    "stemcal.python": 14,
    "stemcal.cli": 14,
    "stemcal.__main__": 15,
}
WORKFLOW = 11  # every other module at the top

PLACES = {
    "typer": ("stemcal.cli",),
    "rich": ("stemcal.cli", "stemcal.report"),
    "yaml": ("stemcal.study",),
    "pyDOE3": ("stemcal.doe",),
    "statsmodels": ("stemcal.measured.statistics",),
    "pandas": ("stemcal.doe", "stemcal.measured", "stemcal.files", "stemcal.report.export.formats"),
    "matplotlib": ("stemcal.report",),
    "jinja2": ("stemcal.report",),
    "numba": ("stemcal.fem",),
    "distributed": ("stemcal.executors",),
    "psutil": ("stemcal.child", "stemcal.executors.machine", "stemcal.solvers.time_limited_program"),
    "openpyxl": ("stemcal.measured",),
}
INSIDE_FUNCTIONS = (
    "statsmodels", "pandas", "pyDOE3", "matplotlib", "jinja2", "distributed",
)  # fmt: skip
LIGHT = ("numpy", "scipy", "numba", "pydantic", "yaml", "stemcal.study", "stemcal.fem", "stemcal.doe")

MODULES = sorted(path for path in PACKAGE.rglob("*.py") if "__pycache__" not in path.parts)


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def within(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


def floor_of(module: str) -> int:
    known = [package for package in FLOORS if within(module, package)]
    return FLOORS[max(known, key=len)] if known else WORKFLOW


def house_of(module: str) -> str:
    """Return the package within which modules may import each other."""
    known = [package for package in FLOORS if within(module, package)]
    return max(known, key=len) if known else "workflow"


def imports(path: Path, checked: bool = False) -> Iterator[tuple[str, bool]]:
    """Yield what a module imports, and whether at its top; with `checked` also what only type checkers see."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    yield from _walk(tree, name_of(path), path.name == "__init__.py", at_top=True, checked=checked)


def _walk(node: ast.AST, module: str, is_package: bool, at_top: bool, checked: bool) -> Iterator[tuple[str, bool]]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and ast.unparse(child.test).endswith("TYPE_CHECKING") and not checked:
            continue
        if isinstance(child, ast.Import):
            yield from ((alias.name, at_top) for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            base = child.module or ""
            if child.level:
                parts = module.split(".")
                base = ".".join([*parts[: len(parts) - child.level + is_package], *filter(None, [base])])
            yield from ((f"{base}.{alias.name}", at_top) for alias in child.names)
        else:
            inside = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from _walk(child, module, is_package, at_top and not inside, checked)


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_point_down(path: Path) -> None:
    module = name_of(path)
    for imported, _ in imports(path, checked=True):
        if not within(imported, "stemcal") or module == "stemcal":
            continue
        assert imported != "stemcal.__version__", f"{module} imports it from above; it stands in stemcal.version"
        if house_of(imported) != house_of(module):
            assert floor_of(imported) < floor_of(module), f"{module} imports {imported}"


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Inside packages too, inside functions, and for type checkers."""
    names = {name_of(path) for path in MODULES}
    graph = {name_of(path): {_module(found, names) for found, _ in imports(path, checked=True)} for path in MODULES}
    graph["stemcal"] = set()  # the names of the Python face, loaded when they are asked for
    for module, below in graph.items():
        below -= {"", module}
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(" → ".join(error.args[1]))


def test_the_parts_of_a_package_do_not_import_each_other_in_a_circle() -> None:
    """Of every package the modules and packages below it, each with all that lies in it."""
    names = {name_of(path) for path in MODULES}
    pairs = {(name_of(path), _module(found, names)) for path in MODULES for found, _ in imports(path, checked=True)}
    for package in (name_of(path) for path in MODULES if path.name == "__init__.py"):
        level, graph = len(package.split(".")) + 1, {}
        for module, imported in pairs:
            part, other = (".".join(name.split(".")[:level]) for name in (module, imported))
            if part != other and package not in (part, other) and within(part, package) and within(other, package):
                graph.setdefault(part, set()).add(other)
        try:
            tuple(TopologicalSorter(graph).static_order())
        except CycleError as error:
            pytest.fail(f"{package}: {' → '.join(error.args[1])}")


def _module(imported: str, names: set[str]) -> str:
    """Return the module that an imported name lies in."""
    while imported and imported not in names:
        imported = imported.rpartition(".")[0]
    return imported


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_libraries_in_their_places(path: Path) -> None:
    module = name_of(path)
    for imported, at_top in imports(path):
        library = imported.partition(".")[0]
        if library in PLACES:
            assert any(within(module, place) for place in PLACES[library]), f"{module} imports {imported}"
        if library in INSIDE_FUNCTIONS:
            assert not at_top, f"{module} imports {imported} at its top"


def test_cli_starts_light() -> None:
    """What `stemcal --help` imports at module level is light; heavy imports stand in functions."""
    for path in (PACKAGE / "cli").glob("*.py"):
        for imported, at_top in imports(path):
            heavy = any(within(imported, package) for package in LIGHT)
            assert not (heavy and at_top), f"{name_of(path)} imports {imported} at its top"


def test_this_test_sees_imports() -> None:
    found = dict(imports(PACKAGE / "cli" / "guard.py"))
    assert found["typer"] is True
    assert found["stemcal.errors.StemcalError"] is True
