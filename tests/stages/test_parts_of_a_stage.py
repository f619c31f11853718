"""The parts of a stage are found by their names in its package; a stage of a single file has them there."""

import sys
from types import ModuleType

import pytest

from stemcal.drawing.showing import Showing
from stemcal.stages.stage import STAGES, Stage
from stemcal.study.types.field_types import Frozen

METHODS = ("section", "result", "making", "reasons", "showing", "seen", "foresee", "later")
PARTS = {
    "screen": "foresee",
    "climb": "later",
    "rsm": "foresee reasons",
    "invert": "reasons",
    "refine": "later reasons seen",
    "validate": "foresee reasons",
    "optimise": "foresee reasons",
}
"""What a stage has in addition to its options, result, analysis and showing."""


@pytest.mark.parametrize("stage", STAGES.built_in, ids=lambda stage: stage.name)
def test_every_stage_has_its_parts_where_the_base_class_looks(stage: Stage) -> None:
    package = type(stage).__module__
    assert package == f"stemcal.stages.{stage.name}"
    assert not set(METHODS) & set(vars(type(stage)))
    title = stage.name.capitalize()
    for module, found, name in (
        ("options", stage.section(), f"{title}Options"),
        ("result", stage.result(), f"{title}Result"),
        ("analysis", stage.making(), stage.name),
        ("showing", type(stage.showing()), f"{title}Showing"),
    ):
        assert (found.__module__, found.__name__) == (f"{package}.{module}", name)
    assert issubclass(stage.section(), Frozen) and isinstance(stage.showing(), Showing)
    assert stage.result().name == stage.name
    places = {"foresee": ("analysis", "foresee"), "later": ("analysis", "later")}
    places |= {"reasons": ("verdict_rules", "RULES"), "seen": ("options", "seen")}
    has = {part for part, (module, name) in places.items() if stage._part(module, name) is not None}
    assert has == set(PARTS[stage.name].split())


def test_a_stage_in_one_module_has_its_parts_there() -> None:
    module = sys.modules["one_file_stage"] = ModuleType("one_file_stage")
    try:
        module.OneFileOptions = OneFileOptions = type("OneFileOptions", (Frozen,), {})
        stage = type("OneFile", (Stage,), {"name": "one-file", "__module__": "one_file_stage"})()
        assert stage.section() is OneFileOptions
        assert stage.reasons() == ()
        with pytest.raises(NotImplementedError, match="OneFileResult"):
            stage.result()
    finally:
        del sys.modules["one_file_stage"]


def test_an_error_inside_a_part_is_not_a_missing_part(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    package = tmp_path / "broken_stage"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "options.py").write_text("import a_module_that_does_not_exist\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    __import__("broken_stage")
    stage = type("Broken", (Stage,), {"name": "broken", "__module__": "broken_stage"})()
    with pytest.raises(ModuleNotFoundError, match="a_module_that_does_not_exist"):
        stage.section()
