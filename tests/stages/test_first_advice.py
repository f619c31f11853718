"""The first reason of a study with one planted trouble, and that no other reason contradicts its remedy."""

from pathlib import Path

import pytest
import yaml
from edits import merged
from test_advice_followed import ALL, KINDS, Law, Plant, judged

from stemcal.notes import Note
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS


@pytest.fixture
def reasons(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Calibrates a planted study; returns its reasons and spec."""

    def of(plant: Plant, *changes: tuple[str, str]) -> tuple[list[Note], str]:
        spec = plant.text()
        for old, new in changes:
            assert old in spec
            spec = spec.replace(old, new)
        monkeypatch.setattr(SOLVERS.named("command"), "make", lambda _study: plant.law)
        return list(judged(plant, spec, tmp_path / f"{len(list(tmp_path.iterdir()))}").reasons), spec

    return of


READER = "result: {file: out.json, path: force}"


@pytest.mark.parametrize(
    ("reader", "result"),
    [
        (READER, {"file": "out.json", "path": "force", "scale": -1}),
        (READER.replace("force}", "force, scale: 4}"), {"file": "out.json", "path": "force", "scale": -4}),
        (
            READER.replace("force}", "force, reduction: max}"),  # the maximum of a curve below zero is near zero
            {"file": "out.json", "path": "force", "reduction": "min", "scale": -1},
        ),
        (
            "result: {force: {file: out.json, path: force}}",
            {"force": {"file": "out.json", "path": "force", "scale": -1}},
        ),
    ],
)
def test_a_reversed_sign_is_named_alone(reasons, tmp_path: Path, reader: str, result: dict) -> None:
    """F = −(100 + 20a + …): no range, unit or measurement is wrong."""
    (reason,), spec = reasons(KINDS["reversed sign"], (READER, reader))
    assert (reason.kind, reason.severity) == ("reversed_sign", "error")
    scale = result.get("scale") or result["force"]["scale"]
    assert "13 runs" in reason.text and f"scale: {scale}" in reason.remedy.text
    followed = merged(spec, reason.remedy.edit)
    assert yaml.safe_load(followed)["solver"]["result"] == result
    (tmp_path / "followed.yaml").write_text(followed, encoding="utf-8")
    load_study(tmp_path / "followed.yaml")


@pytest.mark.parametrize("kind", ["unit, kN", "unit, kgf", "unit, g"])
def test_a_wrong_unit_is_named_alone(reasons, kind: str) -> None:
    """Until it is corrected, no other comparison of measured and simulated forces is advice."""
    (reason,), _ = reasons(KINDS[kind])
    assert reason.kind == "probable_unit"


def test_a_condition_that_is_a_length_has_a_trend(reasons) -> None:
    """Measured d^2.9, program d²: the trend comes first; of a temperature there is none."""
    steep = Plant("trend", growth=0.9)
    found, _ = reasons(steep)
    assert found[0].kind == "trend" and "increases more steeply than the simulated force" in found[0].text
    gap = "conditions: [{name: gap, unit: mm, symbol: g}]\nresponses: [{name: load, unit: N}]\ntargets:"
    own = (("targets:", gap), ("{diameter:", "{gap:"), ("force:", "load:"), ("diameters: all", "diameters: all"))
    found, _ = reasons(steep, *own, ("path: force", "path: load"))
    assert found[0].kind == "trend" and "depends on the gap g: the measured load" in found[0].text
    assert "diameter" not in found[0].text + found[0].remedy.text
    hot = (("unit: mm, symbol", "unit: degC, symbol"), (" mm, load", ", load"))
    found, _ = reasons(steep, *own, ("path: force", "path: load"), *hot)
    assert "trend" not in [reason.kind for reason in found]


@pytest.mark.parametrize(("truth", "word"), [(1.9, "Raise `high`"), (-2.2, "Lower `low`")])
def test_forces_that_are_all_out_of_reach_do_not_contradict_each_other(reasons, truth: float, word: str) -> None:
    found, _ = reasons(Plant("out_of_reach", truth=(truth, 0.0)))
    assert found[0].kind == "out_of_reach" and word in found[0].remedy.text
    assert not any("contradict" in reason.text for reason in found)


def test_the_level_above_which_runs_fail_is_named(reasons) -> None:
    """All runs above 19.5 MPa fail: of the first four those at 20 MPa. At levels of 15 ± 3.5 MPa none does."""
    (reason,), _ = reasons(KINDS["failed at one end"])
    assert reason.kind == "failed_runs" and "yield_stress of at least 20 MPa failed" in reason.text
    assert reason.remedy.edit == "factors: [{name: yield_stress, high: 15}]"
    scattered, _ = reasons(Plant("failed_runs", law=Law(rows=frozenset({0, 6}))))
    assert "of at least" not in scattered[0].text


def test_two_forces_that_disagree_still_contradict(reasons) -> None:
    found, _ = reasons(Plant("conflict", odd=(9.0, 1.22)))
    assert found[0].kind == "conflict" and "contradicts the other measurements" in found[0].text
    assert ALL in Plant("").text()
