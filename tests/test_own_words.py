"""A study that names its own responses: each screened, fitted, inverted and validated, files under its own words."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
from edits import accepted
from fakes import PYTHON
from workflow import calibrate

from stemcal.doe.coding import term_columns
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.vocabulary import FIRST

CASES = Path(__file__).parent / "cases" / "repose"


def studied(folder: Path, name: str, more: str = "") -> tuple[Study, StudyFolder]:
    """Run a study of the made-up heap in a folder of its own."""
    shutil.copytree(CASES, folder, dirs_exist_ok=True)
    spec = folder / name
    spec.write_text(spec.read_text("utf-8").replace("[python,", f"[{PYTHON},") + more, "utf-8")
    study = load_study(spec)
    store = StudyFolder(folder / "runs" / study.name)
    calibrate(study, store, InlineExecutor())
    return study, store


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, StudyFolder, Results]:
    study, store = studied(tmp_path_factory.mktemp("two"), "two.yaml", "screen: {alpha: 0.01}\n")
    return study, store, fresh_results(study, store)


def test_units_are_those_declared(two: tuple[Study, StudyFolder, Results]) -> None:
    (target,) = two[0].targets.means
    assert (target.response, target.sd, target.n) == (32.6, 0.8, 5)
    assert target.further["bulk"].value == pytest.approx(741.0) and target.further["bulk"].sd == pytest.approx(6.0)


def test_effects_of_each_response(two: tuple[Study, StudyFolder, Results]) -> None:
    """An effect is the mean at high less the mean at low of that response."""
    screen = two[2].of(ScreenResult)
    assert screen is not None and screen.responses is not None
    for one, name in zip(screen.all_responses, (FIRST, "bulk"), strict=True):
        for effect in one.effects:
            values = {
                sign: np.mean([run.number(name) for run in screen.design.runs if run.coded[effect.factor] == sign])
                for sign in (-1.0, 1.0)
            }
            assert effect.effect == pytest.approx(values[1.0] - values[-1.0], rel=1e-9)
    assert [one.naming.response.name for one in screen.all_responses] == ["angle", "bulk"]


def test_a_factor_matters_that_moves_any_response(two: tuple[Study, StudyFolder, Results]) -> None:
    screen, surface = two[2].of(ScreenResult), two[2].of(RsmResult)
    assert screen is not None and surface is not None and screen.responses is not None
    assert "grain_density" in screen.responses["bulk"].significant and "rolling" in screen.significant
    assert set(surface.names) >= {"static", "rolling", "grain_density"}
    assert screen.shares["grain_density"] == screen.screening_of("bulk").effect("grain_density").contribution_percent


def test_surface_of_each_response(two: tuple[Study, StudyFolder, Results]) -> None:
    surface = two[2].of(RsmResult)
    assert surface is not None
    (at,) = surface.conditions
    coded = np.array([[run.coded[name] for name in surface.names] for run in surface.design.runs])
    bulk = np.array([run.outcome.of("bulk") for run in at.runs], dtype=float)
    coded, first = np.unique(np.round(coded, 9), axis=0, return_index=True)  # copies count once
    bulk = bulk[first]
    beta, *_ = np.linalg.lstsq(term_columns(coded), bulk, rcond=None)
    fit = (at.responses or {})["bulk"]
    assert [row.value for row in fit.coefficients] == pytest.approx(beta.tolist(), rel=1e-8, abs=1e-8 * abs(beta[0]))
    residual = bulk - term_columns(coded) @ beta
    row = next(row for row in fit.anova if row.source == "Residual")
    assert row.sum_of_squares == pytest.approx(float(residual @ residual), rel=1e-6)


def test_inverted_together(two: tuple[Study, StudyFolder, Results]) -> None:
    """The made-up program without its chance gives both targets at the solution, within what its chance allows."""
    inversion = two[2].of(InvertResult)
    assert inversion is not None and inversion.joint is not None
    assert [row.response for row in inversion.joint.rows] == ["angle", "bulk"]
    static, rolling = inversion.parameters["static"], inversion.parameters["rolling"]
    angle = 12.0 + 28.0 * static + 90.0 * rolling - 60.0 * static * rolling - 0.6 + 0.2
    bulk = 0.62 * inversion.parameters["grain_density"] * (1.0 - 0.12 * static - 0.2 * rolling)
    assert angle == pytest.approx(32.6, abs=1.0) and bulk == pytest.approx(741.0, abs=6.0)


def test_each_response_is_validated(two: tuple[Study, StudyFolder, Results]) -> None:
    validation = two[2].of(ValidateResult)
    assert validation is not None
    (row,) = validation.rows
    (bulk,) = row.further
    assert (bulk.measured, bulk.sd, bulk.n) == (741.0, 6.0, 5) and bulk.judged
    assert validation.worst_percent == pytest.approx(
        max(abs(row.compared.error_percent or 0.0), abs(bulk.error_percent or 0.0))
    )


def test_a_response_left_out_of_the_fit_checks_it(tmp_path: Path) -> None:
    """The bulk density is off by a third where only the angle is fitted: the verdict names it, and what fits it."""
    shutil.copytree(CASES, tmp_path, dirs_exist_ok=True)
    spec = tmp_path / "two.yaml"
    text = spec.read_text("utf-8").replace("[python,", f"[{PYTHON},").replace("0.741 g", "1.1 g")
    spec.write_text(text + "rsm: {factors: [static, rolling]}\ninvert: {responses: [angle]}\n", "utf-8")
    study, store = load_study(spec), StudyFolder(tmp_path / "out")
    calibrate(study, store, InlineExecutor())
    verdict = verdict_of(study, store)
    (reason,) = [reason for reason in verdict.reasons if reason.kind == "validation"]
    worst = verdict.use.worst
    assert worst.response == "bulk" and 30.0 < worst.error_percent < 40.0
    assert "bulk density" in reason.text and reason.remedy.edit == "invert: {responses: all}"
    accepted(spec.read_text("utf-8"), verdict, spec)
    assert verdict.use.good == () and verdict.use.held_out == worst and not worst.fitted


def test_a_column_with_the_name_of_a_response_has_its_values(two: tuple[Study, StudyFolder, Results]) -> None:
    """Names of responses are in a column `response`: in the CSV files of every stage."""
    names, seen = [named.name for named in two[0].naming.responses], []
    for path in sorted(two[1].path.glob("*.csv")):
        head, *rows = csv.reader(path.read_text("utf-8").splitlines())
        columns = {key: [row[place] for row in rows] for place, key in enumerate(head)}
        assert all(value == "" or float(value) > 0.0 for name in names for value in columns.get(name, ()))
        if "response" in columns:
            seen.append(path.stem)
            assert set(columns["response"]) <= set(names)
    assert {"invert_responses", "validate_responses"} <= set(seen)
