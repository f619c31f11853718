"""The audit finds, by computation, what does not agree in the published study."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from fakes import make_study

from stemcal import workflow
from stemcal.errors import SpecError, UsageError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.store import StudyFolder
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def audit(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = StudyFolder(tmp_path_factory.mktemp("audit"))
    return workflow.audit(load_study(CONFIGS / "paper-replay.yaml"), folder, InlineExecutor()).to_json()


def found(audit: dict[str, Any], place: str) -> list[dict[str, Any]]:
    return [finding for finding in audit["findings"] if place in finding["place"]]


def follows(audit: dict[str, Any], words: str) -> list[dict[str, Any]]:
    """Return the findings that tell of something else with the same cause."""
    return [finding for finding in audit["findings"] if any(words in line for line in finding.get("follows", []))]


def test_the_weightiest_stand_first(audit: dict[str, Any]) -> None:
    places = [(finding["consequence"], finding["place"]) for finding in audit["findings"]]
    assert places[:4] == [
        ("result", "coefficients: strain_rate_c^2"),
        ("result", "design: yield_stress in 4 runs"),
        ("result", "surface against screening"),
        ("result", "validation: calibration diameter"),
    ]
    order = ["result", "conclusion", "method", "print"]
    assert [order.index(told) for told, _ in places] == sorted(order.index(told) for told, _ in places)
    assert len(places) == len({place for _, place in places}) == 17


def test_what_the_printed_numbers_say_of_each_other(audit: dict[str, Any]) -> None:
    (against,) = found(audit, "surface against screening")
    assert against["computed"] == "172 N" and against["printed"] == "101.4 to 105.8 N"
    assert found(audit, "equation: bounds")[0]["sentence"].endswith("it gives −25,561 N at the printed solution")
    assert "286 to 500 MPa" in found(audit, "factors: shear modulus")[0]["sentence"]
    assert "169 N where 159.2 N" in found(audit, "calibration diameter")[0]["sentence"]
    assert "rests on run 3 (112 N); without that run it is 0.017" in found(audit, "lack of fit")[0]["sentence"]
    assert found(audit, "law: strain rate")


def test_without_the_shipped_expectations(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The runs as printed, no expected signs, no second table of the design: the level is found by trying."""
    place = tmp_path_factory.mktemp("bare")
    shutil.copytree(CONFIGS / "data", place / "data")
    shutil.copy(place / "data" / "printed_design.csv", place / "data" / "rsm.csv")
    text = (CONFIGS / "paper-replay.yaml").read_text(encoding="utf-8")
    kept = [
        line
        for line in text.splitlines()
        if not line.strip().startswith(("expected_sign", "design: data", "levels:", "claims:", "runs: computed"))
        and not line.strip().startswith(("bounds:", "rate_law:", "called:"))
    ]
    (place / "study.yaml").write_text("\n".join(kept) + "\n", encoding="utf-8")
    found = workflow.audit(load_study(place / "study.yaml"), StudyFolder(place / "out"), InlineExecutor()).to_json()
    first, second = found["findings"][:2]
    assert first["place"] == "coefficients: strain_rate_c^2" and "the sign differs" in first["sentence"]
    assert "yield_stress 17.98 should read 17.97" in second["sentence"] and len(second["follows"]) > 40
    assert {finding["place"] for finding in found["findings"]} >= {"surface against screening", "lack of fit"}
    assert len(found["findings"]) < 15


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
    assert "17.98, the runs have 17.97" in found(audit, "design: yield_stress")[0]["follows"][0]
    assert levels["levels: yield_stress at coded 0"]["printed"] == "15.00"
    assert levels["levels: yield_stress at coded 0"]["computed"] == "14.995"
    finding = levels["levels: failure_strain at coded 1.682"]
    assert finding["computed"] == "0.0468179" and "far from" in finding["sentence"]
    assert "0.0131821" in finding["follows"][0] and "coded -2.00 to +2.00" in finding["follows"][1]


def test_only_17_97_reproduces_the_printed_anova(audit: dict[str, Any]) -> None:
    (finding,) = found(audit, "design: yield_stress")
    assert finding["printed"] == "17.98" and "with 17.97 63 of 63" in finding["sentence"]
    assert "with that 23 of 63" in finding["sentence"]


def test_replicates_box_signs_and_stroke(audit: dict[str, Any]) -> None:
    assert "112 to 124 N" in found(audit, "repeated runs")[0]["sentence"]
    (sign,) = found(audit, "screening: strain_rate_c")
    assert sign["printed"] == "+16.92 N" and "fall at every strain rate" in sign["sentence"]
    assert "surface: strain_rate_c acts with +4.22 N" in sign["follows"][0]
    assert found(audit, "loading")[0]["computed"] == "0.83 mm"
    # the interactions of Table 6, fitted beside all main effects, are not told apart from what is left
    assert not found(audit, "interaction")


def test_equation_at_the_printed_solution(audit: dict[str, Any]) -> None:
    (finding,) = follows(audit, "equation: at the printed solution")
    assert finding["place"] == "coefficients: strain_rate_c^2"
    assert "give 158.05 N, those of the data 159.26 N" in finding["follows"][0]


def test_needs_printed_runs(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="solver of kind table"):
        workflow.audit(make_study(tmp_path), StudyFolder(tmp_path / "out"), InlineExecutor())


def test_unknown_claim_is_named(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="did you mean predicted_r2"):
        make_study(tmp_path, 'published: {claims: {predicted_r: "0.92"}}\n')
