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
from stemcal.folder.study_folder import StudyFolder
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def audit_folder(tmp_path_factory: pytest.TempPathFactory) -> StudyFolder:
    return StudyFolder(tmp_path_factory.mktemp("audit"))


@pytest.fixture(scope="module")
def audit(audit_folder: StudyFolder) -> dict[str, Any]:
    return workflow.audit(load_study(CONFIGS / "paper-replay.yaml"), audit_folder, InlineExecutor()).to_json()


def found(audit: dict[str, Any], kind: str, **values: Any) -> list[dict[str, Any]]:
    """Return the findings of a kind with these values."""
    return [one for one in audit["findings"] if one["kind"] == kind and values.items() <= one.items()]


def test_the_weightiest_stand_first(audit: dict[str, Any]) -> None:
    kinds = [(finding["consequence"], finding["kind"]) for finding in audit["findings"]]
    assert kinds[:4] == [
        ("result", "difference"),
        ("result", "design_differs"),
        ("result", "surface_contradicts_screening"),
        ("result", "solver_misses_target"),
    ]
    order = ["result", "conclusion", "method", "print"]
    assert [order.index(weight) for weight, _ in kinds] == sorted(order.index(weight) for weight, _ in kinds)
    assert len(kinds) == 17


def test_what_the_printed_numbers_say_of_each_other(audit: dict[str, Any]) -> None:
    (against,) = found(audit, "surface_contradicts_screening")
    assert against["surface"] == pytest.approx(172.22, abs=0.01)
    assert (against["low"], against["high"]) == (101.4, 105.8)
    (bounds,) = found(audit, "natural_bounds", at_solution=True)
    assert bounds["response"] == pytest.approx(-25561, abs=1)
    (modulus,) = found(audit, "impossible_shear_modulus", called="shear modulus")
    assert modulus["possible"] == pytest.approx([285.71, 500.0], abs=0.01)
    (missed,) = found(audit, "solver_misses_target", simulated=169.0, target=159.2, outside=False)
    assert missed["percent"] == pytest.approx(6.156, abs=1e-3)
    (lack,) = found(audit, "lack_of_fit_rests_on_run", run=3, response=112.0)
    assert (lack["p"], lack["p_without"]) == pytest.approx((0.31895, 0.01728), abs=1e-5)
    (law,) = found(audit, "inverted_exponent")
    assert law["usual_percent"] == pytest.approx(100.0 / 90.0**0.125)


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
    whole = workflow.audit(load_study(place / "study.yaml"), StudyFolder(place / "out"), InlineExecutor()).to_json()
    first, second = whole["findings"][:2]
    assert (first["kind"], first["term"], first["nature"]) == ("difference", "strain_rate_c^2", "sign")
    assert (second["kind"], second["printed"], second["level"]) == ("misprinted_level", 17.98, 17.97)
    assert len(second["follows"]) > 40
    assert {one["kind"] for one in whole["findings"]} >= {"surface_contradicts_screening", "lack_of_fit_rests_on_run"}
    assert len(whole["findings"]) < 15


def test_cells(audit: dict[str, Any]) -> None:
    assert audit["tables"]["screening"] == {"agree": 45, "of": 45}
    assert audit["tables"]["anova"] == {"agree": 63, "of": 63}
    assert (audit["agree"], audit["of"]) == (121, 123)
    assert found(audit, "difference", table="coefficients", term="strain_rate_c^2")[0]["nature"] == "sign"
    assert found(audit, "difference", table="validation", term="11")[0]["nature"] == "sign"


def test_claim_of_the_largest_error(audit: dict[str, Any]) -> None:
    (claim,) = found(audit, "difference", table="claims", term="max_abs_error_percent")
    assert claim["printed"] == "<7.8" and claim["value"] == pytest.approx(7.833, abs=1e-3)


def test_levels(audit: dict[str, Any]) -> None:
    (design,) = found(audit, "design_differs")
    assert [(one["printed"], one["level"]) for one in design["follows"]] == [("17.98", 17.97)]
    (centre,) = found(audit, "level_differs", factor="yield_stress", coded=0.0)
    assert (centre["printed"], centre["level"], centre["rounded"], centre["far"]) == ("15.00", 14.995, True, False)
    (star,) = found(audit, "level_differs", factor="failure_strain", coded=1.682)
    assert (star["level"], star["far"], star["consequence"]) == (0.0468179, True, "method")
    lower, box = star["follows"]
    assert lower["level"] == 0.0131821
    assert (box["kind"], box["reach"]) == ("box_leaves_design", pytest.approx(1.682, abs=1e-3))
    assert (box["coded_low"], box["coded_high"]) == pytest.approx((-2.0, 2.0), abs=1e-3)


def test_only_17_97_reproduces_the_printed_anova(audit: dict[str, Any]) -> None:
    (finding,) = found(audit, "design_differs", factor="yield_stress", runs=4, printed=17.98, used=17.97)
    assert finding["with_used"] == {"agree": 63, "of": 63}
    assert finding["with_printed"] == {"agree": 23, "of": 63}


def test_replicates_signs_and_stroke(audit: dict[str, Any]) -> None:
    assert found(audit, "repeats_differ", stage="rsm", runs=6, low=112.0, high=124.0)
    (sign,) = found(audit, "sign_defies_law", stage="screen", factor="strain_rate_c", falls_over=[80.0, 100.0])
    assert sign["effect"] == pytest.approx(16.917, abs=1e-3)
    assert [(one["stage"], round(one["effect"], 2)) for one in sign["follows"]] == [("rsm", 4.22)]
    assert found(audit, "blade_stops_short")[0]["travel"] == pytest.approx(100.0 / 60.0 * 0.5)
    # the interactions of Table 6, fitted beside all main effects, are not told apart from what is left
    assert not found(audit, "interactions_disagree")


def test_equation_at_the_printed_solution(audit: dict[str, Any]) -> None:
    """The one wrong cell of the equation explains that it misses the target."""
    (finding,) = found(audit, "difference", table="coefficients")
    (missed,) = finding["follows"]
    assert missed["kind"] == "equation_misses_target"
    assert (missed["by_equation"], missed["by_data"]) == pytest.approx((158.05, 159.26), abs=0.005)


def test_what_the_audit_leaves_as_csv(audit: dict[str, Any], audit_folder: StudyFolder) -> None:
    header, first = (audit_folder.path / "audit.csv").read_text("utf-8").splitlines()[:2]
    assert header == "number,consequence,kind,values,cause"
    assert first.startswith("1,result,difference,table coefficients; term strain_rate_c^2;")


def test_needs_printed_runs(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="solver of kind table"):
        workflow.audit(make_study(tmp_path), StudyFolder(tmp_path / "out"), InlineExecutor())


def test_unknown_claim_is_named(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="did you mean predicted_r2"):
        make_study(tmp_path, 'published: {claims: {predicted_r: "0.92"}}\n')
