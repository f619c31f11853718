"""A folder of sheets for each test of a spec: what they come to, and how it gets into the spec.

A sheet is a straight line of known slope k up to a known maximum, then the break: work until it, F²/2k.
"""

import json
from pathlib import Path
from statistics import fmean, stdev

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from stemcal.cli.app import app
from stemcal.errors import UsageError
from stemcal.measured.shear_curves import CurveOptions
from stemcal.overview.measured_tests import break_at, measure_tests
from stemcal.study.reading import load_study
from stemcal.study.reading.read import with_rows

THREE = Path(__file__).parents[2] / "configs" / "three-tests.yaml"
MAXIMA = {"8mm-1": 600.0, "8mm-2": 640.0, "8mm-3": 650.0, "9mm-1": 700.0, "9mm-2": 720.0}
STIFFNESS = 400.0
AT_ONCE = CurveOptions(preload=0.0)


def sheet(maximum: float) -> str:
    rows = [(i * 0.01 * maximum / STIFFNESS, i * 0.01 * maximum) for i in range(101)]
    rows += [(maximum / STIFFNESS + 0.01, 0.3 * maximum), (maximum / STIFFNESS + 1.0, 0.0)]
    return "Displacement (mm),Load (N)\n" + "".join(f"{travel:.9f},{force:.6f}\n" for travel, force in rows)


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    (tmp_path / "pull").mkdir()
    for name, maximum in MAXIMA.items():
        (tmp_path / "pull" / f"{name}.csv").write_text(sheet(maximum), encoding="utf-8")
    return tmp_path


def command(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_means_of_what_the_targets_have_already(lab: Path) -> None:
    """The pull of the shipped spec has maximum force and work; its bending has no folder here."""
    found = measure_tests(load_study(THREE), lab, AT_ONCE)
    means = {(one.diameter, one.response): one.summary for one in found.means}
    assert list(means) == [(8.0, "force"), (8.0, "work"), (9.0, "force"), (9.0, "work")]
    forces = [600.0, 640.0, 650.0]
    works = [force**2 / (2.0 * STIFFNESS) for force in forces]
    assert means[8.0, "force"].mean == pytest.approx(fmean(forces), rel=1e-6)
    assert means[8.0, "work"].mean == pytest.approx(fmean(works), rel=1e-6)
    assert means[8.0, "work"].sd == pytest.approx(stdev(works), rel=1e-6)
    assert found.targets["pull"][0] == (
        "{test: pull, diameter: 8 mm, force: 630 N, work: 496.7 mJ,\n     sd: {force: 26.46 N, work: 41.25 mJ}, n: 3}"
    )


def test_a_piece_that_settles_before_its_maximum_is_not_broken() -> None:
    """It gives way from 30 to 12 N on its rollers, and breaks behind 200 N; by a smaller drop a row earlier."""
    force = np.array([4.0, 30.0, 12.0, 60.0, 120.0, 200.0, 190.0, 60.0])
    assert break_at(force) == 7


def test_without_targets_what_such_a_test_usually_tells(lab: Path) -> None:
    study = load_study(THREE)
    pull = study.tests[1].model_copy(update={"targets": ()})
    found = measure_tests(study.model_copy(update={"tests": (pull,)}), lab, AT_ONCE, exclude=["pull/8mm-3"])
    means = {one.response: one.summary for one in found.means if one.diameter == 8.0}
    assert {name: one.n for name, one in means.items()} == {"slope": 2, "force": 2, "work": 2}
    assert means["slope"].mean == pytest.approx(STIFFNESS, rel=1e-6)


def test_they_get_into_the_spec_and_nothing_else_changes(lab: Path) -> None:
    """9 mm has no cutting force, so the spec stays as it was; without it only the entry of the pull changes."""
    spec = lab / "study.yaml"
    text = THREE.read_text(encoding="utf-8")
    spec.write_text(text, encoding="utf-8")
    refused = command("measure", "tests", spec, lab, "--write", "--preload", 0)
    assert refused.exit_code == 2
    assert "no cutting force is given for a diameter of 9 mm" in " ".join(refused.stderr.split())
    assert spec.read_text(encoding="utf-8") == text
    for name in ("9mm-1", "9mm-2"):
        (lab / "pull" / f"{name}.csv").unlink()
    done = command("measure", "tests", spec, lab, "--write", "--preload", 0)
    assert done.exit_code == 0, done.stderr
    entry = measure_tests(load_study(THREE), lab, AT_ONCE).targets["pull"][0]
    assert len(entry) > 80
    assert f"targets:\n  - {entry}\n" in done.stdout
    before, after = text.splitlines(), spec.read_text(encoding="utf-8").replace(",\n     ", ", ").splitlines()
    changed = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
    assert len(changed) == 1
    assert changed[0][1].startswith(
        "  - {test: pull, diameter: 8 mm, force: 630 N, work: 496.7 mJ, sd: {force: 26.46 N,"
    )
    assert load_study(spec).tests[1].targets[0].means["work"].value == pytest.approx(496.7)


def test_a_note_names_the_test_that_it_is_about(lab: Path) -> None:
    for name in ("9mm-1", "9mm-2"):
        (lab / "pull" / f"{name}.csv").unlink()
    done = command("measure", "tests", THREE, lab, "--preload", 100, "--exclude", "pull/8mm-1")
    assert "note: pull: Specimen 8mm-1 is excluded by `--exclude`." in done.stderr


def test_folders_go_by_the_name_of_a_test_and_others_are_told(lab: Path) -> None:
    (lab / "bend").mkdir()
    found = measure_tests(load_study(THREE), lab, AT_ONCE)
    assert list(found.targets) == ["pull"]
    (note,) = found.notes
    assert note.kind == "folder_skipped" and "'bend'" in note.text


def test_json_tells_means_and_targets(lab: Path) -> None:
    told = json.loads(command("measure", "tests", THREE, lab, "--json", "--preload", 0).stdout)["result"]
    assert told["stage"] == "measure-tests"
    assert told["means"][0] | {"mean_interval": None, "sd_interval": None, "cv_percent": None, "sd": None} == {
        **{"test": "pull", "diameter": 8.0, "response": "force", "n": 3, "mean": pytest.approx(630.0)},
        **dict.fromkeys(("mean_interval", "sd_interval", "cv_percent", "sd")),
    }


def test_a_folder_without_tests_and_an_unknown_specimen_are_refused(lab: Path) -> None:
    study = load_study(THREE)
    with pytest.raises(UsageError, match=r"the tests of three-tests: bending, pull"):
        measure_tests(study, lab / "pull")
    with pytest.raises(UsageError, match=r"does not exist; specify a folder"):
        measure_tests(study, lab / "nowhere")
    with pytest.raises(UsageError, match=r"smoke has no `tests` section; add it, or use `stemcal measure shear`"):
        measure_tests(load_study(THREE.with_name("smoke.yaml")), lab)
    with pytest.raises(UsageError, match=r"write TEST/SPECIMEN, as in `pull/8mm-1`"):
        measure_tests(study, lab, exclude=["8mm-1"])
    with pytest.raises(UsageError, match=r"no such specimen"):
        measure_tests(study, lab, exclude=["pull/8mm-9"])


@pytest.mark.parametrize(
    ("text", "known"),
    [
        (
            "targets:\n- {diameter: 8 mm}\n- test: pull\n  force: 3 N\n# end\n",
            "targets:\n- {diameter: 8 mm}\n- {a: 1}\n# end\n",
        ),
        ("targets:\r\n- {b: 2}\r\n", "targets:\r\n- {b: 2}\r\n- {a: 1}\r\n"),
        ("targets: [{b: 2}, {test: pull}]  # old\n", "targets:\n  - {b: 2}\n  - {a: 1}  # old\n"),
        ("targets:\n  - {b: 2}", "targets:\n  - {b: 2}\n  - {a: 1}"),
    ],
)
def test_however_a_spec_is_laid_out(text: str, known: str) -> None:
    assert with_rows(text, {"pull": ["{a: 1}"]}) == known


def test_only_the_rows_of_targets_change() -> None:
    spec = "targets:\n  - {test: pull, diameter: 7 mm}\n  - {diameter: 8 mm}\nname: a\n"
    changed = "targets:\n  - {diameter: 8 mm}\n  - {test: pull, diameter: 9 mm}\nname: a\n"
    assert with_rows(spec, {"pull": ["{test: pull, diameter: 9 mm}"]}) == changed
    row = {"": ["{diameter: 8 mm}"]}
    assert with_rows("targets: [{diameter: 7 mm}]\n", row) == "targets:\n  - {diameter: 8 mm}\n"
    assert with_rows("name: a\n", row) == "name: a\n\ntargets:\n  - {diameter: 8 mm}\n"
