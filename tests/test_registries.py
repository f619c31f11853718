"""A new built-in stage, solver, design or laboratory test is one file or folder and one line of a registry."""

import ast
from collections import Counter
from pathlib import Path

from stemcal.doe.designs import SURFACES
from stemcal.registry import described
from stemcal.stages.stage import STAGES
from stemcal.study.model.laboratory_kind import TESTS
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.version import __version__, code_version

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "stemcal"

MENTIONS = {
    "stemcal.stages": {"screen": 2, "climb": 2, "rsm": 3, "invert": 1, "validate": 2},
    "stemcal.solvers": {"embedded": 1, "command": 1, "python": 4, "deck": 1},
    "stemcal.designs": {"central-composite": 2, "box-behnken": 1, "latin-hypercube": 1},
    "stemcal.tests": {"cutting": 5},
}
"""How often the name of a built-in is a text outside its file or folder, keys of a spec included; may only shrink."""


def texts() -> list[tuple[str, str]]:
    """Return each text in the sources that is no docstring, with its module."""
    found = []
    for path in PACKAGE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        constants = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in said]
        found += [(module, node.value) for node in constants if isinstance(node.value, str)]
    return found


def test_no_list_of_names_grows() -> None:
    """Of kinds of solvers those in their package do not count: their options are one file for all."""
    everywhere = texts()
    for registry in (STAGES, SOLVERS, SURFACES, TESTS):
        found = Counter[str]()
        for one in registry.built_in:
            module = type(one).__module__
            home = module.rpartition(".")[0] if registry is SOLVERS else module
            outside = [module for module, text in everywhere if text == one.name and not module.startswith(home)]
            found.update({one.name: len(outside)} if outside else {})
        assert found <= Counter(MENTIONS[registry.group]), (registry.group, found)


def test_code_has_a_version_and_errors_are_one_line() -> None:
    assert code_version().startswith(f"{__version__}+")
    assert described(ValueError("not\na number")) == "ValueError: not a number"
