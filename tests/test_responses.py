"""The table of responses: a new one is one entry, from the spec to the page, and its values are in its unit."""

import json
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
import workflow
from fakes import TWO_FACTORS, SpecSolver

from stemcal.errors import SpecError, UsageError
from stemcal.report.outcome import tables_of
from stemcal.responses import (
    CUT,
    FURTHER_CUT,
    PIECE,
    RESPONSES,
    TABLE,
    ForceTravel,
    Response,
    response_of,
    responses_in,
)
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import outcome_of
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.results import fresh_results
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.vocabulary import CUTTING, TRAVEL, Variable

SHARE = Response(
    *("relative_travel", "Relative travel at maximum force", "u/d", "%"),
    of=lambda test: 100.0 * test.peak_travel / test.diameter,
    meaning="Mean travel to the maximum force as a share of the diameter.",
    noun="relative travel",
)
"""All that a new response takes."""


@pytest.fixture(params=["in the table", "of another package"])
def share(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Add the entry to the table of stemcal, or as an entry point of a package."""
    if request.param == "in the table":
        monkeypatch.setitem(RESPONSES.__dict__, "built_in", (*TABLE, SHARE))
    else:
        entry = EntryPoint(SHARE.name, f"{__name__}:SHARE", "stemcal.responses")
        monkeypatch.setitem(RESPONSES.__dict__, "_entries", {SHARE.name: entry})
        monkeypatch.setitem(RESPONSES.__dict__, "_loaded", {})


@dataclass(frozen=True)
class Cut(SpecSolver):
    """F = (100 + 20a)·(d/8), travel u = (1 + 0.2b)·(d/8): relative travel 12.5·(1 + 0.2b) %."""

    def solve(self, request: Request) -> Answer:
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        size = request.condition / 8.0
        force, travel = size * (100.0 + 20.0 * a), size * (1.0 + 0.2 * b)
        curve = {"travel": [0.0, travel, 2.0 * travel], "force": [0.0, force, 0.0]}
        return Answer("ok", response=force, details={"peak_force": force, "peak_travel": travel, "curve": curve})


RSM = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"
ROWS = """\
targets:
  - {diameter: 8 mm, force: 104 N, relative_travel: 13.25 %, sd: {force: 2 N, relative_travel: 0.25 %}, n: 4}
  - {diameter: 10 mm, force: 130 N, relative_travel: 0.14 1, sd: {force: 2 N, relative_travel: 0.0025 1}, n: 4}
"""


def study_of(folder: Path, more: str) -> Study:
    path = folder / "study.yaml"
    path.write_text(TWO_FACTORS + more, encoding="utf-8")
    return load_study(path)


def test_means_are_in_the_unit_of_the_response(share: None, tmp_path: Path) -> None:
    """13.25 % stay 13.25 %, and 0.14 are 14 %: not 0.1325 % and 0.14 %."""
    study = study_of(tmp_path, ROWS)
    first, second = (target.further["relative_travel"] for target in study.targets.means)
    assert (first.value, first.sd, second.value, second.sd) == (13.25, 0.25, 14.0, 0.25)
    assert study.naming.further == (*CUTTING.further, Variable.of(SHARE)) and study.naming.is_cutting
    assert study.naming.others == () and Variable.of(SHARE).noun == "relative travel"


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("13.25", 'relative_travel: 13.25 has no unit; write "13.25 %"'),
        ('"13.25"', 'relative_travel: 13.25 has no unit; write "13.25 %"'),
        ("13.25 mm", "relative_travel: mm is a unit of length, not of a dimensionless quantity; use 1 or %"),
        ("0 %", "relative_travel: 0 % must be above 0 1; write a larger value"),
    ],
)
def test_a_mean_without_its_unit_is_refused(share: None, tmp_path: Path, written: str, message: str) -> None:
    """A share of 0.14 written for 14 % would be a hundred times too small, so neither is guessed."""
    with pytest.raises(SpecError) as caught:
        study_of(tmp_path, ROWS.replace("13.25 %", written))
    assert message in str(caught.value)


def test_it_is_fitted_validated_and_shown(share: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """F = 104 N and 13.25 % at 8 mm: yield 16 MPa, failure strain 0.036; the mean of 14 % at 10 mm is 5.4 % higher."""
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: Cut())
    study, folder = study_of(tmp_path, ROWS + RSM + "invert: {responses: all}\n"), StudyFolder(tmp_path / "out")
    workflow.calibrate(study, folder, InlineExecutor())
    results = fresh_results(study, folder)
    assert results.parameters["yield_stress"] == pytest.approx(16.0, rel=1e-3)
    assert results.parameters["failure_strain"] == pytest.approx(0.036, rel=1e-3)
    stages = {
        name: json.loads((tmp_path / "out" / f"{name}.json").read_text("utf-8")) for name in ("invert", "validate")
    }
    (row,) = stages["invert"]["joint"]["further"]
    assert (row["response"], row["unit"], row["measured"]) == ("relative_travel", "%", 13.25)
    assert row["predicted"] == pytest.approx(13.25, rel=1e-4)
    eight, ten = (row["further"][0] for row in stages["validate"]["rows"])
    assert eight["simulated"] == pytest.approx(13.25, rel=1e-3) and eight["unit"] == "%"
    assert ten["error_percent"] == pytest.approx(100.0 * (14.0 - 13.25) / 14.0, rel=1e-2)
    table = tables_of(results.of(ValidateResult))[1]
    cells = [dict(zip(table.heads, row, strict=True)) for row in table.cells]
    assert [(row["Response"], row["Measured"], row["Unit"]) for row in cells] == [
        ("relative travel", "13.25", "%"),
        ("relative travel", "14", "%"),
    ]


def test_all_means_all_that_was_measured(share: None, tmp_path: Path) -> None:
    study = study_of(tmp_path, ROWS + "invert: {responses: all}\n")
    assert study.fitted_responses == ("response", "relative_travel")
    rows = ROWS.replace(", relative_travel: 0.0025 1", "").replace("relative_travel: 0.14 1, ", "travel: 1.4 mm, ")
    with pytest.raises(SpecError, match="no `sd` is given for travel"):
        study_of(tmp_path, rows + "invert: {responses: all}\n")
    only = "targets: [{diameter: 8 mm, force: 104 N}]\ninvert: {responses: all}\n"
    assert study_of(tmp_path, only).fitted_responses == ("response",)


def test_a_laboratory_test_has_it_too(share: None, tmp_path: Path) -> None:
    """A piece of 8 mm whose force peaks at 2 mm: 25 %, measured and simulated."""
    rows = "  - {test: bend, diameter: 8 mm, relative_travel: 25 %, sd: 1 %}\n"
    tests = "tests: [{name: bend, kind: three-point-bending, span: 56 mm, stroke: 3 mm}]\n"
    study = study_of(tmp_path, ROWS + rows + tests)
    (bend,) = study.tests
    assert bend.measured == ("relative_travel",) and bend.means_at(8.0)["relative_travel"].value == 25.0
    named = study.naming.named("bend_relative_travel")
    assert (named.label, named.unit) == ("Bend relative travel", "%")
    assert Variable.of(SHARE) in study.naming.further and named in study.naming.others
    curve = ForceTravel.until_break(np.array([0.0, 2.0, 3.0]), np.array([0.0, 40.0, 30.0]), 8.0, bend.kind)
    found = {one.name: one.value(curve) for one in bend.responses}
    assert found == pytest.approx({"slope": None, "force": 40.0, "travel": 2.0, "work": 75.0, "relative_travel": 25.0})


def test_a_solver_reports_a_response_by_its_name(share: None) -> None:
    """What the details call `relative_travel` is that response, whatever the curve shows."""
    request = Request("rsm", 0, {}, 8.0).as_record()
    record = {"status": "ok", "response": 1.0, "reason": "", "message": "", "key": "", "request": request}
    naming = CUTTING.measuring(["relative_travel"])
    told = outcome_of({**record, "details": {"peak_travel": 1.0, "relative_travel": 99.0}}, naming)
    assert told.of("relative_travel") == 99.0 and told.travel == 1.0 and told.work is None
    assert outcome_of({**record, "details": {"peak_travel": 1.0}}, naming).of("relative_travel") == 12.5
    assert outcome_of({**record, "details": {"peak_travel": 1.0}}).of("relative_travel") is None


def test_a_response_of_a_package_that_fails_is_named() -> None:
    wrong = replace(SHARE, of=lambda test: test.numbers["torque"])
    curve = ForceTravel.until_break(np.array([0.0, 1.0]), np.array([0.0, 1.0]), 8.0, CUT)
    with pytest.raises(UsageError, match=r"the response relative_travel cannot be calculated from a run: KeyError"):
        wrong.value(curve)


def test_known_answers() -> None:
    """A triangle of 40 N over 2 mm, and 10 N·mm behind its maximum: the work until it is 40 mJ, of a test 50 mJ."""
    travel, force = np.array([0.0, 2.0, 2.5]), np.array([0.0, 40.0, 0.0])
    cut = ForceTravel.until_break(travel, force, 8.0, CUT)
    found = {one.name: one.value(cut) for one in responses_in(CUT)}
    assert (found["force"], found["travel"], found["work"]) == (40.0, 2.0, 40.0)
    again = ForceTravel.until_break(travel, force, 8.0, FURTHER_CUT)
    assert {one.name: one.value(again) for one in responses_in(FURTHER_CUT)}["work"] == 50.0
    line = ForceTravel.until_break(np.linspace(0.0, 2.0, 21), np.linspace(0.0, 40.0, 21), 8.0, PIECE)
    assert next(one for one in responses_in(PIECE) if one.name == "slope").value(line) == pytest.approx(20.0)
    assert response_of("slope", CUT) is None and response_of("nothing") is None


def test_names_are_those_of_the_table() -> None:
    assert [one.name for one in TABLE] == sorted({one.name for one in TABLE}, key=[one.name for one in TABLE].index)
    assert Variable("travel", "Travel at maximum force", "u", "mm") == TRAVEL and TRAVEL.noun == "travel"


def test_the_response_of_the_example_of_a_laboratory_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """20 N/mm up to 100 N, then 2 N/mm: 10 % below the line where 100 + 2(u − 5) = 18u, at u = 5.625 mm and 101.25 N.

    It is a response of four-point bending alone, and its entry point loads the object itself.
    """
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "examples" / "plugins" / "four_point")
    entry = EntryPoint("proportional_limit", "stemcal_four_point:PROPORTIONAL_LIMIT", "stemcal.responses")
    monkeypatch.setitem(RESPONSES.__dict__, "_entries", {entry.name: entry})
    monkeypatch.setitem(RESPONSES.__dict__, "_loaded", {})
    travel = np.linspace(0.0, 20.0, 20001)
    force = np.where(travel < 5.0, 20.0 * travel, 100.0 + 2.0 * (travel - 5.0))
    curve = ForceTravel.until_break(travel, force, 8.0, "four-point-bending")
    (limit,) = responses_in(PIECE, "four-point-bending", measured=[entry.name])[len(responses_in(PIECE)) :]
    assert limit.value(curve) == pytest.approx(101.25, abs=0.01)
    assert response_of(entry.name, PIECE) is None and response_of(entry.name, CUT) is None
    assert limit.value(ForceTravel.until_break(travel[:4000], force[:4000], 8.0, "four-point-bending")) is None
