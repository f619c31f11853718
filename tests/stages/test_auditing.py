"""The audit finds, by computation, what does not agree in the published study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fakes import make_study

from stemcal import workflow
from stemcal.errors import SpecError, UsageError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.store import StudyFolder
from stemcal.study.spec import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def audit(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = StudyFolder(tmp_path_factory.mktemp("audit"))
    return workflow.audit(load_study(CONFIGS / "paper-replay.yaml"), folder, InlineExecutor()).to_json()


def found(audit: dict[str, Any], place: str) -> list[dict[str, Any]]:
    return [finding for finding in audit["findings"] if place in finding["place"]]


def test_cells(audit: dict[str, Any]) -> None:
    assert audit["tables"]["screening"] == {"agree": 45, "of": 45}
    assert audit["tables"]["anova"] == {"agree": 63, "of": 63}
    assert (audit["agree"], audit["of"]) == (121, 123)
    assert found(audit, "strain_rate_c^2")[0]["kind"] == "sign"
    assert found(audit, "error at 11 mm")[0]["kind"] == "sign"


def test_claim_of_the_largest_error(audit: dict[str, Any]) -> None:
    (claim,) = found(audit, "claim")
    assert claim["printed"] == "<7.8" and float(claim["computed"]) == pytest.approx(7.833, abs=1e-3)


def test_levels(audit: dict[str, Any]) -> None:
    levels = {finding["place"]: finding for finding in found(audit, "levels")}
    assert levels["levels: yield_stress at coded 1"]["computed"] == "17.97"
    assert levels["levels: yield_stress at coded 1"]["printed"] == "17.98"
    assert levels["levels: yield_stress at coded 0"]["printed"] == "15.00"
    assert levels["levels: yield_stress at coded 0"]["computed"] == "14.995"
    for coded, run in (("1.682", "0.0468179"), ("-1.682", "0.0131821")):
        finding = levels[f"levels: failure_strain at coded {coded}"]
        assert finding["computed"] == run and "far from" in finding["sentence"]


def test_only_17_97_reproduces_the_printed_anova(audit: dict[str, Any]) -> None:
    (finding,) = found(audit, "design: yield_stress")
    assert finding["printed"] == "17.98" and "with 17.97 63 of 63" in finding["sentence"]
    assert "with that 23 of 63" in finding["sentence"]


def test_replicates_box_signs_and_stroke(audit: dict[str, Any]) -> None:
    assert "112 to 124 N" in found(audit, "repeated runs")[0]["sentence"]
    (box,) = found(audit, "search box")
    assert box["place"].endswith("failure_strain") and box["computed"] == "coded -2.00 to +2.00"
    signs = [finding for finding in audit["findings"] if finding["kind"] == "law"]
    assert [finding["printed"] for finding in signs] == ["+16.92 N", "+4.22 N"]
    assert all("fall at every strain rate" in finding["sentence"] for finding in signs)
    assert found(audit, "loading")[0]["computed"] == "0.83 mm"
    assert found(audit, "interaction")[0]["kind"] == "sign"


def test_equation_at_the_printed_solution(audit: dict[str, Any]) -> None:
    (finding,) = found(audit, "equation")
    assert finding["computed"] == "158.05 N" and "159.26 N" in finding["sentence"]


def test_needs_printed_runs(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="solver of kind table"):
        workflow.audit(make_study(tmp_path), StudyFolder(tmp_path / "out"), InlineExecutor())


def test_unknown_claim_is_named(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="did you mean predicted_r2"):
        make_study(tmp_path, 'published: {claims: {predicted_r: "0.92"}}\n')
