"""Chains beyond screening and surface by hand: a climb on one sheet, several diameters together, sheets of twins."""

import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from sheets import Cells, awaited, entered, text_of

from stemcal.errors import UsageError
from stemcal.runs.study_folder import StudyFolder
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

EXAMPLES = Path(__file__).parents[2] / "examples"


def begun(folder: Path, example: str, *changes: tuple[str, str]) -> Study:
    """Begin a study with an example and change its text."""
    text = (EXAMPLES / example).read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    shutil.copy(EXAMPLES / "ls-dyna-window" / "parameters.k", folder)
    (folder / "mine.yaml").write_text(text, encoding="utf-8")
    return load_study(folder / "mine.yaml")


def rows_filled(study: Study, sheet: Cells, response: Callable[[dict[str, float]], float]) -> Cells:
    """Fill in what a function of the levels gives; those of a row are known by factor and condition."""
    head, *rows = sheet
    count = next(i for i, title in enumerate(head) if title.startswith(study.naming.response.name))
    names = [title.split(" (")[0] for title in head[1:count]]
    done = []
    for row in rows:
        levels = dict(zip(names, map(float, row[1:count]), strict=True))
        done.append([*row[:count], f"{response(levels):.6f}", *row[count + 1 :]])
    return [head, *done]


def stages_of_sheets(
    study: Study, folder: StudyFolder, response: Callable[[dict[str, float]], float], before: str = ""
) -> list[tuple[str, int]]:
    """Enter every sheet that is asked for before a stage, in two parts of which the second repeats the first."""
    seen = []
    while (sheet := awaited(study, folder)) and sheet[1][0].split()[0] != before:
        head, *rows = rows_filled(study, sheet, response)
        seen.append((rows[0][0].split()[0], len(rows)))
        random.Random(3).shuffle(rows)
        first = rows[: len(rows) // 2]
        assert len(entered(study, folder, text_of([head, *first])).taken) == len(first)
        again = entered(study, folder, text_of([head, *rows]))
        assert (len(again.known), len(again.taken), again.refused) == (len(first), len(rows) - len(first), ())
    return seen


def angle(levels: dict[str, float]) -> float:
    """Return the angle of a heap that nobody has made, deg; restitution and stiffness do not matter."""
    return 14.0 + 12.0 * levels["pp_static"] + 40.0 * levels["pp_rolling"] + 18.0 * levels["pw_rolling"]


def test_the_path_of_a_climb_stands_on_one_sheet(tmp_path: Path) -> None:
    """By the example for EDEM: 12 + 3 + 6 + 15 runs, then the solution; without `at_once` a sheet for each step."""
    study, folder = begun(tmp_path, "edem/edem-heap.yaml"), StudyFolder(tmp_path / "out")
    sheets = stages_of_sheets(study, folder, angle)
    assert [one for one in sheets if one[0] != "refine"] == [("screen", 15), ("climb", 6), ("rsm", 15), ("validate", 1)]
    rows = folder.read_stage("climb")["rows"]
    assert [row["step"] for row in rows] == [0, 1, 2, 3, 4, 5]
    found = folder.read_stage("climb")["best_step"]
    assert found == min(range(6), key=lambda i: abs(rows[i]["response"] - 32.6))
    assert angle(folder.read_stage("validate")["parameters"]) == pytest.approx(32.6, rel=0.02)
    (tmp_path / "other").mkdir()
    walking = begun(tmp_path / "other", "edem/edem-heap.yaml", (", at_once: true", ""))
    sheets = stages_of_sheets(walking, StudyFolder(tmp_path / "walk"), angle, before="rsm")
    steps = [count for stage, count in sheets if stage == "climb"]
    assert steps == [1] * len(steps) and len(steps) < 6
    walked = StudyFolder(tmp_path / "walk").read_stage("climb")
    assert walked["rows"] == [row | {"key": one["key"]} for row, one in zip(rows, walked["rows"], strict=False)]


def test_several_diameters_are_fitted_together_by_hand(tmp_path: Path) -> None:
    """F = (6·σy + 20·Et + 500·εf)·(d/8)²: the forces of a hidden stem are met at every diameter."""

    def force(levels: dict[str, float]) -> float:
        stem = 6.0 * levels["yield_stress"] + 20.0 * levels["tangent_modulus"] + 500.0 * levels["failure_strain"]
        return stem * (levels["diameter"] / 8.0) ** 2

    hidden = {"yield_stress": 16.0, "tangent_modulus": 0.52, "failure_strain": 0.034}
    targets = [
        (f"{old} N", f"{force(hidden | {'diameter': d}):.4f} N") for old, d in ((120, 7), (159.2, 8), (213.8, 9))
    ]
    study = begun(
        tmp_path,
        "ls-dyna-window/ls-dyna-window.yaml",
        *targets,
        ("refine: {tol", "invert: {diameters: all}\nrefine: {tol"),
    )
    folder = StudyFolder(tmp_path / "out")
    assert stages_of_sheets(study, folder, force)[0] == ("rsm", 39)
    rows = folder.read_stage("validate")["rows"]
    assert [row["condition"] for row in rows] == [7.0, 8.0, 9.0]
    assert all(abs(row["error_percent"]) < 0.1 for row in rows)


def test_a_twin_s_sheet_is_refused(tmp_path: Path) -> None:
    """The same factors, ranges and runs, another study: only the last column tells; without it rows are taken."""
    study = begun(tmp_path, "by-hand/heap.yaml")
    folder, twin = StudyFolder(tmp_path / "out"), StudyFolder(tmp_path / "twin")
    other = study.model_copy(update={"name": "Heu (2. Sorte)"})
    sheet = rows_filled(other, awaited(other, twin), lambda levels: 20.0 + 10.0 * levels["sliding"] + levels["wall"])
    with pytest.raises(UsageError, match=r"study 'Heu \(2\. Sorte\)', not for 'heap'"):
        entered(study, folder, text_of(sheet))
    assert list(folder.keys()) == []
    assert len(entered(other, twin, text_of(sheet)).taken) == 15
    assert len(entered(study, folder, text_of([row[:-1] for row in sheet])).taken) == 15


def test_a_factor_may_be_called_as_a_column_of_the_sheet(tmp_path: Path) -> None:
    study = begun(tmp_path, "by-hand/heap.yaml", ("name: wall", "name: study"), ("rolling, wall]", "rolling, study]"))
    folder = StudyFolder(tmp_path / "out")
    sheet = rows_filled(study, awaited(study, folder), lambda levels: 20.0 + 10.0 * levels["study"])
    assert sheet[0] == ["run", "sliding", "rolling", "study", "angle (deg)", "who", "when", "remark"]
    assert len(entered(study, folder, text_of(sheet)).taken) == 15
