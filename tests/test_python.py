"""The Python face: what a notebook finds, and that nothing is printed on the way."""

import copy
import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes import ENVIRONMENT

import stemcal
from stemcal.errors import SpecError, UsageError

ROOT = Path(__file__).parents[1]
REPLAY = ROOT / "configs" / "paper-replay.yaml"
AT_SOLUTION = {"yield_stress": 17.96, "failure_strain": 0.0387, "strain_rate_c": 87.65}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> stemcal.StudyResults:
    return stemcal.calibrate(str(REPLAY), out=tmp_path_factory.mktemp("python"), workers=1)


def fresh(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run code in an interpreter of its own."""
    command = [sys.executable, "-c", code]
    return subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=120)


def test_the_import_loads_nothing_heavy(tmp_path: Path) -> None:
    code = "import sys, stemcal; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    loaded = fresh(code, tmp_path).stdout.split()
    assert not {"numpy", "scipy", "numba", "pydantic", "pandas", "matplotlib", "rich", "typer"} & set(loaded)
    assert {"calibrate", "load_study", "open_results", "simulate", "Study", "StudyResults"} <= set(dir(stemcal))


def test_the_lines_of_the_readme_run_in_a_plain_interpreter(tmp_path: Path) -> None:
    """As a script, without a guard about __main__, from the root of a copy of the project."""
    text = (ROOT / "README.md").read_text("utf-8")
    code = text.split("```python\n")[1].split("```")[0]
    assert len([line for line in code.splitlines() if line]) == 5
    (tmp_path / "configs").symlink_to(ROOT / "configs", target_is_directory=True)
    (tmp_path / "five.py").write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "five.py"], cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=300
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "yield_stress" in done.stdout and (tmp_path / "contour.png").stat().st_size > 5000


def test_results_are_pickled_and_copied(results: stemcal.StudyResults) -> None:
    """Those of each stage: `stemcal.testing` checks them."""
    for again in (lambda r: pickle.loads(pickle.dumps(r)), copy.copy, copy.deepcopy):
        found = again(results)
        assert found is not results and found.parameters == results.parameters and found.study == results.study
        assert again(results.verdict) == results.verdict


def test_frames_of_the_published_study(results: stemcal.StudyResults) -> None:
    anova = results.surface.anova.to_frame().set_index("source")
    assert anova.loc["Model", "sum_of_squares"] == pytest.approx(16225.35, abs=0.01)
    effects = results.screen.effects.to_frame().set_index("factor")
    assert effects.loc["yield_stress", "effect"] == pytest.approx(79.42, abs=0.01)
    runs = results.runs.to_frame()
    assert len(runs) == 12 + 20 + 5 and runs["levels.yield_stress"].notna().all()
    validated, rows = results.validation.to_frame(), results.validation.rows.to_frame()
    assert list(validated["diameter"]) == [7, 8, 9, 10, 11] and "error_percent" in validated
    assert list(rows["condition"]) == [7, 8, 9, 10, 11]


@pytest.mark.parametrize(
    "changed", [{"yield_stress": float("nan")}, {"yield_stress": "15"}, {"yield_stress": True}, {"yield_stress": None}]
)
def test_predictions_take_levels_that_a_spec_could_have(results: stemcal.StudyResults, changed: dict[str, Any]) -> None:
    with pytest.raises(UsageError, match="yield_stress: "):
        results.surface.predict({**AT_SOLUTION, **changed})
    with pytest.raises(UsageError, match="no level is given for failure_strain, strain_rate_c"):
        results.surface.predict({"yield_stress": 18.0})


def test_predictions(results: stemcal.StudyResults) -> None:
    """159.07 N at the printed solution; at the calibrated one the target."""
    found = results.surface.predict(AT_SOLUTION)
    assert found.response == pytest.approx(159.068, abs=1e-3)
    low, high = found.prediction_interval or (0.0, 0.0)
    assert low < found.response < high
    assert results.surface.predict(results.parameters).response == pytest.approx(159.2)


def test_every_figure_of_the_page(results: stemcal.StudyResults) -> None:
    from matplotlib.figure import Figure

    assert len(results.figure_names) == 11
    for name in (*results.figure_names, "contour"):
        assert isinstance(results.figure(name), Figure), name
    with pytest.raises(UsageError, match="did you mean pareto"):
        results.figure("praeto")


def test_opened_again(results: stemcal.StudyResults) -> None:
    again = stemcal.open_results(results.folder.path)
    assert again.parameters == results.parameters and again.study == results.study
    assert again.surface.anova == results.surface.anova


def test_what_is_not_there_says_what_to_do(results: stemcal.StudyResults, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="Run `stemcal refine SPEC` first"):
        _ = results.refinement
    with pytest.raises(UsageError, match="does not exist"):
        stemcal.open_results(tmp_path / "nowhere")
    with pytest.raises(UsageError, match="the folder contains no spec"):
        stemcal.open_results(tmp_path)
    with pytest.raises(UsageError, match="the solver kind is `sheet`"):
        stemcal.simulate(results.study)


def test_objects_show_themselves(results: stemcal.StudyResults) -> None:
    assert repr(results).splitlines()[0] == "Calibrated, with reservations."
    assert any("The sign of the effect of strain_rate_c" in line for line in repr(results).splitlines()[1:])
    assert results._repr_html_().startswith("<p><b>Calibrated, with reservations.")
    assert "<code>" in results._repr_html_() and "`" not in results._repr_html_()
    assert len(repr(results).splitlines()) == 10
    for thing in (results.screen, results.surface, results.inversion, results.validation):
        assert len(repr(thing)) < 600 and len(repr(thing).splitlines()) <= 6
    assert len(repr(results.surface.anova).splitlines()) <= 16
    assert "..." not in repr(results.screen.effects) and "lenth_t" in repr(results.screen.effects)
    assert "<iframe" in results.surface._repr_html_() and "<table" in results.runs._repr_html_()
    told = results.inversion.to_frame().set_index("factor").loc["yield_stress"]
    assert (told["range_low"], told["range_high"]) == results.inversion.certainty.intervals["yield_stress"]
    assert told["range_low"] == pytest.approx(15.35, abs=0.005) and told["exact_low"] == pytest.approx(17.63, abs=0.005)
    assert repr(results.study) == "Study paper-replay: 9 factors, 5 targets, solver sheet"


def test_a_factor_changed_without_editing_the_spec() -> None:
    study = stemcal.load_study(REPLAY)
    wider = stemcal.load_study(REPLAY, yield_stress={"high": 22}, screen={"alpha": 0.1}, density={"low": 900})
    assert wider.factor("yield_stress").high == 22 and wider.screen.alpha == 0.1
    assert study.factor("yield_stress").high == 20
    assert wider.factor("density").low == 900
    with pytest.raises(SpecError, match=r"`low` \(10 MPa\) is above `high` \(2 MPa\)"):
        stemcal.load_study(REPLAY, yield_stress={"high": 2})
    with pytest.raises(SpecError, match="unknown key 'yeild_stress'"):
        stemcal.load_study(REPLAY, yeild_stress={"high": 2})


def test_the_likelihood_is_that_of_the_fit(results: stemcal.StudyResults) -> None:
    """Lower away from the target, minus infinity outside the ranges, an array for arrays."""
    found = results.inversion
    best, apart = found.log_likelihood(found.point.solution), found.log_likelihood(AT_SOLUTION | {"yield_stress": 16.0})
    assert np.isfinite(best) and apart < best - 2.0
    levels = {name: np.array([value, value]) for name, value in found.point.solution.items()}
    several = found.log_likelihood(levels | {"yield_stress": np.array([16.0, 99.0])})
    assert several.shape == (2,) and np.isfinite(several[0]) and several[1] == -np.inf
    with pytest.raises(UsageError, match="log_likelihood: no level is given for failure_strain, strain_rate_c"):
        found.log_likelihood({"yield_stress": 18.0})


def test_one_simulation() -> None:
    study = stemcal.load_study(ROOT / "configs" / "smoke.yaml")
    found = stemcal.simulate(study, diameter=7, yield_stress=18)
    assert found.levels["yield_stress"] == 18 and found.diameter == 7.0
    assert max(found.curve.force) == pytest.approx(found.peak_force)
    assert found.curve.to_frame().columns.tolist() == ["travel", "force"]
    with pytest.raises(UsageError, match="did you mean yield_stress"):
        stemcal.simulate(study, yeild_stress=18)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"diameter": 0}, "diameter: 0 must be above 0 mm; write a larger value"),
        ({"diameter": "8 kg"}, "diameter: kg is a unit of mass, not of length"),
        ({"diameter": float("nan")}, "diameter: nan is not between -1e"),
        ({"diameter": True}, "diameter: the value is not a number with a unit"),
        ({"yield_stress": float("nan")}, "yield_stress: "),
        ({"yield_stress": -5}, "yield_stress (-5 MPa) must be above 0 MPa"),
        ({"yield_stress": "18 mm"}, "yield_stress: mm is a unit of length, not of stress"),
        ({"yield_stress": True}, "yield_stress: true is not a number"),
    ],
)
def test_values_from_python_are_checked_as_those_of_a_spec(given: dict[str, Any], said: str) -> None:
    study = stemcal.load_study(ROOT / "configs" / "smoke.yaml")
    with pytest.raises(UsageError, match=re.escape(said)):
        stemcal.simulate(study, **given)


def test_values_with_units_and_the_path_of_a_spec() -> None:
    smoke = ROOT / "configs" / "smoke.yaml"
    found = stemcal.simulate(smoke, diameter="0.7 cm", yield_stress="18000 kPa")
    assert found.diameter == pytest.approx(7.0)
    assert found.levels["yield_stress"] == pytest.approx(18.0)
    assert found.peak_force == pytest.approx(stemcal.simulate(str(smoke), np.float32(7), yield_stress=18).peak_force)


def test_calibrate_checks_what_it_is_given() -> None:
    with pytest.raises(UsageError, match="workers: 0 must not be below 1"):
        stemcal.calibrate(REPLAY, workers=0)
    with pytest.raises(UsageError, match="study: the type dict is not valid"):
        stemcal.calibrate({})  # type: ignore[arg-type]


def test_what_takes_too_much_is_refused(tmp_path: Path) -> None:
    """Elements of 0.02 mm: no machine has the memory, and no core the time."""
    study = stemcal.load_study(ROOT / "configs" / "smoke.yaml", solver={"element_size": "0.02 mm"})
    with pytest.raises(UsageError, match="this machine has"):
        stemcal.calibrate(study, out=tmp_path / "out")
    with pytest.raises(UsageError, match="this machine has"):
        stemcal.simulate(study)
    assert not (tmp_path / "out" / "runs").exists()
