"""A new built-in stage, solver, design or laboratory test is one file or folder and one line of a registry."""

import ast
import subprocess
import sys
from collections import Counter
from pathlib import Path

from fakes import ENVIRONMENT

from stemcal.doe.designs.catalogue import SURFACES
from stemcal.stages.stage import STAGES
from stemcal.study.model import SOLVERS, TESTS

ROOT = Path(__file__).parents[1]
PACKAGE, PLUGINS = ROOT / "stemcal", ROOT / "examples" / "plugins"

MENTIONS = {
    "stemcal.stages": {"screen": 3, "climb": 2, "rsm": 3, "invert": 1, "validate": 3},
    "stemcal.solvers": {"embedded": 1, "command": 1, "python": 4, "deck": 1},
    "stemcal.designs": {"central-composite": 2, "box-behnken": 1, "full-factorial": 1, "latin-hypercube": 1},
    "stemcal.tests": {"cutting": 5},
}
"""How often the name of a built-in is a text outside its file or folder, keys of a spec included; may only shrink."""

LIGHT = """
from stemcal.stages.stage import Stage
from stemcal.study.types.field_types import Frozen

class Options(Frozen):
    positions: int = 3
    \"\"\"The number of positions.\"\"\"

class Light(Stage):
    name, title, help, purpose = "repeatability", "Repeatability", "Repeat the middle.", "Positions of the mesh."
    by_section = True

    def section(self):
        return Options

    def showing(self):
        from stemcal_repeatability import RepeatShowing

        return RepeatShowing()
"""
"""The entry point of a built-in stage imports nothing heavy, which that of another package may."""

ADDED = """
import sys
from stemcal.stages.stage import STAGES

STAGES._places += ("light_stage:Light",)  # first: the form of a spec is made of the stages

from stemcal.doe.designs.catalogue import SURFACES
from stemcal.study.model import SOLVERS, TESTS

for registry, place in (
    (SOLVERS, "stemcal_beam:Beam"),
    (SURFACES, "stemcal_doehlert:Doehlert"),
    (TESTS, "stemcal_four_point:FourPoint"),
):
    registry._places += (place,)
    vars(registry).pop("built_in", None)

from typer.main import get_command

from stemcal.cli.app import app
from stemcal.report.showing import Showing
from stemcal.stages.stage import stages_of
from stemcal.study.reading import load_study
from stemcal.study.reading.json_schema import json_schema, meanings

beam, piece = load_study(sys.argv[1]), load_study(sys.argv[2])
assert beam.kind is SOLVERS.built_in[-1] and beam.kind.make(beam).immediate
assert piece.tests[0].kind == "four-point-bending" and piece.rsm.design == "doehlert"
assert [stage.name for stage in stages_of(piece)][-1] == "repeatability"
assert "repeatability" not in [stage.name for stage in stages_of(beam)]
assert isinstance(STAGES.built_in[-1].showing(), Showing)
keys = {"repeatability.positions", "solver.span, kind: beam", "tests[].inner, kind: four-point-bending"}
assert keys <= set(meanings())
assert "doehlert" in json_schema()["$defs"]["RsmOptions"]["properties"]["design"]["enum"]
assert get_command(app).list_commands(None).count("repeatability") == 1
"""


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
    """Of kinds of solvers those in `stemcal.solvers` do not count: their options are one file for all."""
    everywhere = texts()
    for registry in (STAGES, SOLVERS, SURFACES, TESTS):
        found = Counter[str]()
        for one in registry.built_in:
            home = "stemcal.solvers" if registry is SOLVERS else type(one).__module__
            outside = [module for module, text in everywhere if text == one.name and not module.startswith(home)]
            found.update({one.name: len(outside)} if outside else {})
        assert found <= Counter(MENTIONS[registry.group]), (registry.group, found)


def test_a_line_of_a_registry_is_all_that_a_new_built_in_needs(tmp_path: Path) -> None:
    """The examples of other packages, listed as if they were built in: specs, schema, commands and stages have them."""
    from test_other_packages import PIECE

    (tmp_path / "piece.yaml").write_text(PIECE, encoding="utf-8")
    (tmp_path / "light_stage.py").write_text(LIGHT, encoding="utf-8")
    folders = [str(tmp_path), *(str(path.parent) for path in PLUGINS.glob("*/stemcal_*.py"))]
    script = f"import sys\nsys.path += {folders!r}\n{ADDED}"
    specs = (str(PLUGINS / "beam" / "beam.yaml"), str(tmp_path / "piece.yaml"))
    done = subprocess.run(
        [sys.executable, "-c", script, *specs], env=ENVIRONMENT, capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 0, done.stderr
