"""A study may call its own responses and condition as the shear test calls its: force, travel, work, diameter."""

from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import pytest
import workflow

from stemcal.errors import SpecError
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

PLANTED = {"strength": 3.2, "friction": 0.14}
UNITS = {"force": "N", "travel": "mm", "work": "mJ", "curve_1": "N", "slope": "N/mm", "diameter": "mm", "angle": "deg"}
SPEC = """\
name: own
factors:
  - {name: strength, unit: MPa, low: 2, high: 5}
  - {name: friction, low: 0.05, high: 0.2}
responses: [{name: FIRST, unit: FIRST_UNIT}, {name: SECOND, unit: SECOND_UNIT}]
conditions: [{name: AT, unit: AT_UNIT}]
solver:
  kind: command
  command: [python, program.py, "{{strength}}", "{{friction}}", "{{AT}}"]
  result:
    FIRST: {file: out.json, path: one}
    SECOND: {file: out.json, path: two}
targets: [VALUES]
screen: {design: none}
rsm: {factors: [strength, friction], design: central-composite}
invert: {diameters: all}
"""


def one(levels: dict[str, float], at: float) -> float:
    return 20.0 * levels["strength"] + 100.0 * levels["friction"] * at / 8.0


def two(levels: dict[str, float], at: float) -> float:
    return (5.0 * levels["strength"] - 30.0 * levels["friction"] + 20.0) * at / 8.0


@dataclass(frozen=True)
class Known(Solver):
    """Two known responses at a condition."""

    immediate = True

    study: Study

    def identity(self, request: Request) -> dict[str, Any]:
        return request.as_record()

    def solve(self, request: Request) -> Answer:
        levels, at = dict(request.levels), request.condition
        second = self.study.naming.responses[1].name
        return Answer("ok", one(levels, at), details={RESPONSES: {second: two(levels, at)}})


def spec_of(folder: Path, first: str, second: str, at: str, *, units: bool = True, declared: bool = True) -> Study:
    """Write a study with these names; without `units` its values are bare numbers, or none is `declared`."""
    unit = UNITS.get if declared else lambda _name, _default: "1"
    named = {name: unit(name, "1") for name in (first, second, at)}
    shown = {name: f" {text}" if units and text != "1" else "" for name, text in named.items()}
    values = ", ".join(
        f"{{{at}: {d}{shown[at]}, {first}: {one(PLANTED, d):.6f}{shown[first]}, n: 6, "
        f"{second}: {two(PLANTED, d):.6f}{shown[second]}, "
        f"sd: {{{first}: 1{shown[first]}, {second}: 1{shown[second]}}}}}"
        for d in (7, 8, 9)
    )
    text = SPEC.replace("VALUES", values)
    for word, name in (("FIRST", first), ("SECOND", second), ("AT", at)):
        text = text.replace(f"{word}_UNIT", named[name]).replace(word, name)
    (folder / "own.yaml").write_text(text, encoding="utf-8")
    return load_study(folder / "own.yaml")


NAMES = [*permutations(("force", "travel", "work"), 2), ("diameter", "angle"), ("slope", "curve_1")]


@pytest.mark.parametrize(("first", "second"), NAMES)
@pytest.mark.parametrize("at", ["diameter", "moisture", "speed", "travel", "force"])
def test_targets_are_read_with_and_without_units(tmp_path: Path, first: str, second: str, at: str) -> None:
    if at in (first, second):
        with pytest.raises(SpecError, match="is already the name of another response or condition"):
            spec_of(tmp_path, first, second, at)
        return
    for units, declared in ((True, True), (False, True), (False, False)):
        study = spec_of(tmp_path, first, second, at, units=units, declared=declared)
        assert [mean.condition for mean in study.targets.means] == [7.0, 8.0, 9.0]
        (seven, _, _) = study.targets.means
        assert (seven.response, seven.mean_of(second)[0]) == pytest.approx((one(PLANTED, 7), two(PLANTED, 7)), abs=1e-5)
        assert [named.name for named in study.naming.responses] == [first, second]


def test_the_units_are_converted(tmp_path: Path) -> None:
    spec_of(tmp_path, "force", "work", "diameter")
    text = (tmp_path / "own.yaml").read_text("utf-8").replace("diameter: 7 mm", "diameter: 0.7 cm")
    (tmp_path / "own.yaml").write_text(text.replace("sd: {force: 1 N", "sd: {force: 0.001 kN"), encoding="utf-8")
    first = load_study(tmp_path / "own.yaml").targets.means[0]
    assert (first.condition, first.sd) == (7.0, 1.0)


def test_a_unit_that_was_not_declared_is_refused(tmp_path: Path) -> None:
    spec_of(tmp_path, "force", "work", "diameter", declared=False)
    text = (tmp_path / "own.yaml").read_text("utf-8").replace("diameter: 7,", "diameter: 7 mm,")
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(SpecError, match=r"targets\[1\]\.diameter"):
        load_study(tmp_path / "own.yaml")


def test_a_condition_that_is_not_declared_is_named(tmp_path: Path) -> None:
    spec_of(tmp_path, "force", "work", "diameter")
    text = (tmp_path / "own.yaml").read_text("utf-8").replace("conditions: [{name: diameter, unit: mm}]\n", "")
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(SpecError) as told:
        load_study(tmp_path / "own.yaml")
    remedy = "declare the condition with `conditions: [{name: diameter, unit: …}]`"
    assert remedy in str(told.value) and "has two" not in str(told.value)


@pytest.mark.parametrize(
    ("first", "second", "at"),
    [
        ("diameter", "angle", "travel"),
        pytest.param("force", "work", "diameter", marks=pytest.mark.slow),
        ("values", "sha256", "inputs"),  # words that files use themselves, as these
        pytest.param("status", "naming", "run", marks=pytest.mark.slow),
    ],
)
def test_the_planted_parameters_are_found(tmp_path: Path, first: str, second: str, at: str) -> None:
    study, folder = spec_of(tmp_path, first, second, at), StudyFolder(tmp_path / "out")
    validation = workflow.calibrate(study, folder, InlineExecutor(), solver=Known(study))
    assert folder.read_stage("invert")["solution"] == pytest.approx(PLANTED, rel=1e-4)
    for row in validation.rows:
        assert row.compared.error_percent == pytest.approx(0.0, abs=1e-3)
        assert [(further.response, round(further.error_percent or 9.0, 3)) for further in row.further] == [
            (second, 0.0)
        ]
    for path in folder.path.glob("*.csv"):
        headings = path.read_text("utf-8").partition("\n")[0].split(",")
        assert len(set(headings)) == len(headings), path.name
