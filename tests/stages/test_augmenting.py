"""Designs that grow: what is there is kept, in the folder and in the spec."""

from __future__ import annotations

from pathlib import Path

import pytest
from fakes import FakeSolver, make_study

from stemcal import workflow
from stemcal.errors import UsageError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.augment import Augmentation, Growth, augment, growth
from stemcal.study.model import Study
from stemcal.study.reading import load_study
from stemcal.study.reading.amend import amended, rewrite

TWO = "# why two\nrsm:\n  factors: [yield_stress, failure_strain, strain_rate_c]  # these\n  centre_points: 1\n"


def grown(study: Study, added: Augmentation) -> Study:
    """Amend the spec on disk and read it again."""
    larger, changes = augment(study, added)
    rewrite(study.source, larger, changes)
    return load_study(study.source)


def test_extra_runs_keep_what_was_run(tmp_path: Path) -> None:
    """A composite of three factors has 15 runs; 3 and 4 more are computed once each, in two steps."""
    witness = tmp_path / "witness"
    study, folder, solver = make_study(tmp_path, TWO), StudyFolder(tmp_path / "out"), FakeSolver(witness)
    workflow.fit_surface(study, folder, InlineExecutor(), solver=solver)
    for count, rows, batches in ((3, 18, 3), (4, 22, (3, 4))):
        larger = grown(study, Augmentation(extra_runs=count))
        assert larger.rsm.extra_runs == batches
        (part,) = growth(study, larger, ("rsm",), folder, solver)
        assert part == Growth("rsm", rows - count, rows, count)
        workflow.fit_surface(larger, folder, InlineExecutor(), solver=solver)
        assert len(witness.read_bytes().splitlines()) == rows == len(folder.keys())
        study = larger
    text = study.source.read_text(encoding="utf-8")
    assert (
        "# why two\nrsm:\n  extra_runs: [3, 4]\n  factors: [yield_stress, failure_strain, strain_rate_c]  # these"
        in text
    )


def test_axial_points_join_another_design(tmp_path: Path) -> None:
    """A Box–Behnken design of 13 runs gets the six faces."""
    spec = TWO.replace("centre_points: 1", "centre_points: 1\n  design: box-behnken")
    study, folder, solver = make_study(tmp_path, spec), StudyFolder(tmp_path / "out"), FakeSolver()
    first = workflow.fit_surface(study, folder, InlineExecutor(), solver=solver).to_json()
    larger = grown(study, Augmentation(axial=1.0))
    second = workflow.fit_surface(larger, folder, InlineExecutor(), solver=solver).to_json()
    assert len(first["design"]["runs"]) == 13 and len(second["design"]["runs"]) == 19
    assert [run["key"] for run in second["design"]["runs"][:13]] == [run["key"] for run in first["design"]["runs"]]
    with pytest.raises(UsageError, match=r"rsm.axial is 1 already"):
        augment(larger, Augmentation(axial=0.5))


def test_a_fold_over_doubles_the_screening(tmp_path: Path) -> None:
    study, folder, solver = make_study(tmp_path), StudyFolder(tmp_path / "out"), FakeSolver()
    first = workflow.screen(study, folder, InlineExecutor(), solver=solver).to_json()
    larger = grown(study, Augmentation(fold_over=True))
    second = workflow.screen(larger, folder, InlineExecutor(), solver=solver).to_json()
    assert len(second["design"]["runs"]) == 24
    assert [run["key"] for run in second["design"]["runs"][:12]] == [run["key"] for run in first["design"]["runs"]]
    with pytest.raises(UsageError, match="true already"):
        augment(larger, Augmentation(fold_over=True))


def test_nothing_to_add_and_nothing_to_add_to(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO)
    with pytest.raises(UsageError, match="say what to add"):
        augment(study, Augmentation())
    larger, _ = augment(study, Augmentation(extra_runs=2))
    with pytest.raises(UsageError, match="rsm has not been run"):
        growth(study, larger, ("rsm",), StudyFolder(tmp_path / "out"), FakeSolver())


@pytest.mark.parametrize(
    ("text", "made"),
    [
        ("a: 1\nrsm:\n    alpha: face\n", "a: 1\nrsm:\n    axial: 1\n    alpha: face\n"),
        ("rsm: {alpha: face}  # note\nb: 2\n", "rsm: {alpha: face, axial: 1}  # note\nb: 2\n"),
        ("rsm: {}\n", "rsm: {axial: 1}\n"),
        ("rsm:\n  axial: 0.5  # was\n  alpha: face\n", "rsm:\n  axial: 1  # was\n  alpha: face\n"),
        ("rsm: {axial: [1,\n  2], b: 3}\n", "rsm: {axial: 1, b: 3}\n"),
        ("a: 1\r\nrsm:\r\n  b: 2\r\n", "a: 1\r\nrsm:\r\n  axial: 1\r\n  b: 2\r\n"),
        ("a: 1", "a: 1\n\nrsm:\n  axial: 1\n"),
    ],
)
def test_only_the_key_changes(text: str, made: str) -> None:
    assert amended(text, "rsm", "axial", "1") == made


def test_what_cannot_be_changed_safely_is_left(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO)
    before = study.source.read_bytes()
    other, changes = augment(study, Augmentation(extra_runs=2))
    with pytest.raises(UsageError, match=r"write by hand rsm.extra_runs: 2"):
        rewrite(study.source, other.model_copy(update={"title": "another"}), changes)
    study.source.write_bytes("name: \xe4".encode("latin-1"))
    with pytest.raises(UsageError, match="write by hand"):
        rewrite(study.source, other, changes)
    assert before != study.source.read_bytes()
