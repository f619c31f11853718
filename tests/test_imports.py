"""The floors of the house: imports point down only, and each outside library has its place."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "stemcal"

LAYERS = (
    (
        *(
            "arrays",
            "errors",
            "formats",
            "notes",
            "power_law",
            "registry",
            "version",
            "responses",
            "vocabulary",
            "storage",
        ),
        "processes",
    ),
    ("fem.kernels", "fem", "cutting", "doe", "measured"),
    ("study",),
    ("laboratory", "solvers"),
    ("runs.executors", "runs"),
    ("drawing",),
    ("stages", "overview", "by_hand"),
    ("report", "python", "testing", "cli", "__main__", ""),
)
"""The layers from the bottom, and in each its packages and modules: one may import from those before it."""
ORDER = [f"stemcal.{name}".rstrip(".") for layer in LAYERS for name in layer]
SLICES = {path.parent.name for path in (PACKAGE / "stages").glob("*/__init__.py")} - {"verdict"}
"""The folders of `stemcal.stages`, one for each stage; the verdict is no stage, it judges all of them."""
OF_OTHERS = ("result", "options")
"""What others may import of a slice; all else of it they reach through `stemcal.stages.stage.STAGES`."""
LIGHT_HERE = ("stemcal.stages.stage", "stemcal.registry")

PLACES = {
    "typer": ("stemcal.cli",),
    "rich": ("stemcal.cli", "stemcal.report", "stemcal.drawing.style"),
    "yaml": ("stemcal.study",),
    "pyDOE3": ("stemcal.doe",),
    "statsmodels": ("stemcal.measured.statistics",),
    "pandas": ("stemcal.doe", "stemcal.measured", "stemcal.storage", "stemcal.drawing.table", "stemcal.report.export"),
    "matplotlib": ("stemcal.drawing", "stemcal.report", "stemcal.stages"),
    "jinja2": ("stemcal.report",),
    "numba": ("stemcal.fem",),
    "distributed": ("stemcal.runs.executors",),
    "psutil": ("stemcal.processes", "stemcal.runs.executors"),
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


def slice_of(module: str) -> tuple[str, str]:
    """Return the stage that a module belongs to, and which file of it; nothing of any other module."""
    parts = [*module.split("."), ""]
    return (parts[2], parts[3]) if parts[:2] == ["stemcal", "stages"] and parts[2] in SLICES else ("", "")


def house_of(module: str) -> str:
    """Return the package of `ORDER` that a module belongs to."""
    return max((package for package in ORDER if within(module, package)), key=len)


@cache
def imports(path: Path, checked: bool = False) -> tuple[tuple[str, bool], ...]:
    """Return what a module imports, and whether at its top; with `checked` also what only type checkers see."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return tuple(_walk(tree, name_of(path), path.name == "__init__.py", at_top=True, checked=checked))


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


NAMES = {name_of(path) for path in MODULES}


def test_imports_point_down() -> None:
    found = [(name_of(path), imported) for path in MODULES for imported, _ in imports(path, checked=True)]
    for module, imported in found:
        if not within(imported, "stemcal") or module == "stemcal":
            continue
        assert imported != "stemcal.__version__", f"{module} imports it from above; it stands in stemcal.version"
        place, below = house_of(module), house_of(imported)
        if place != below:
            assert ORDER.index(below) < ORDER.index(place), f"{module} imports {imported}"


def test_layers() -> None:
    """Eight at most, and every folder and module of the package has its place in one."""
    found = {name_of(path) for path in PACKAGE.iterdir() if path.is_dir() and any(path.glob("*.py"))}
    found |= {name_of(path) for path in PACKAGE.glob("*.py")}
    assert len(LAYERS) <= 8
    assert found == {name for name in ORDER if name.count(".") < 2}


def test_a_stage_is_reached_through_the_list_of_stages() -> None:
    """Others import its result and its options only, itself nobody, and its entry point imports its own folder."""
    found = {(name_of(path), _module(one, NAMES)) for path in MODULES for one, _ in imports(path, checked=True)}
    between = {pair for pair in found if slice_of(pair[1])[0] not in ("", slice_of(pair[0])[0])}
    wrong = {pair for pair in between if slice_of(pair[1])[1] not in OF_OTHERS}
    assert not wrong
    for stage in SLICES:
        entry = f"stemcal.stages.{stage}"
        heavy = [one for one, at_top in imports(PACKAGE / "stages" / stage / "__init__.py") if at_top]
        wrong = [one for one in heavy if within(one, "stemcal") and _module(one, NAMES) not in LIGHT_HERE]
        assert not wrong, f"{entry} imports {wrong} at its top"


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


def test_the_chain_of_packages_is_short() -> None:
    """At most eleven packages import each other in a row, so that data does not climb through more."""
    below: dict[str, set[str]] = {}
    for path in MODULES:
        module = ".".join(name_of(path).split(".")[:2])
        found = {".".join(_module(one, NAMES).split(".")[:2]) for one, _ in imports(path, checked=True)}
        below.setdefault(module, set()).update(found - {module, "", "stemcal"})
    lengths: dict[str, int] = {}
    for module in TopologicalSorter(below).static_order():
        lengths[module] = 1 + max((lengths[one] for one in below.get(module, ())), default=0)
    assert max(lengths.values()) <= 11, lengths


def test_a_public_name_means_one_thing() -> None:
    """Few classes and functions have the name of another module's: parts of stages, rules of a kind, commands."""
    places: dict[str, list[str]] = {}
    for path in MODULES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                places.setdefault(node.name, []).append(name_of(path))
    shared = {name: modules for name, modules in places.items() if len(modules) > 1}
    assert len(shared) <= 15, shared


def test_the_parts_of_a_package_do_not_import_each_other_in_a_circle() -> None:
    """Of every package the modules and packages below it, each with all that lies in it."""
    pairs = {(name_of(path), _module(found, NAMES)) for path in MODULES for found, _ in imports(path, checked=True)}
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


def test_libraries_in_their_places() -> None:
    for module, imported, at_top in ((name_of(path), *one) for path in MODULES for one in imports(path)):
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
    found = dict(imports(PACKAGE / "cli" / "exit_codes.py"))
    assert found["typer"] is True
    assert found["stemcal.errors.StemcalError"] is True
