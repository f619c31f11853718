"""Numbers inside printed edits, and guards that only rare studies meet."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from fakes import make_study
from test_refining_there import spec_of

from stemcal.doe.calibration.observations import Observation, errors_of
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import SpecError
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.verdict.advice import more_runs, to_smooth
from stemcal.study.reading import load_study

RUNS = central_composite(2, centre_points=1)


def surface(runs: int, coefficients: int) -> SimpleNamespace:
    design = SimpleNamespace(runs=[None] * runs)
    return SimpleNamespace(names=("yield_stress", "failure_strain"), coefficients=[0] * coefficients, design=design)


@pytest.mark.parametrize(("runs", "coefficients", "count"), [(9, 6, 24), (14, 6, 28), (30, 6, 60)])
def test_more_runs_are_four_a_coefficient_or_twice_the_runs(runs: int, coefficients: int, count: int) -> None:
    edit = yaml.safe_load(more_runs(surface(runs, coefficients)).edit)
    assert edit == {"rsm": {"design": "latin-hypercube", "runs": count, "extra_runs": 0}}


@pytest.mark.parametrize(("strain", "ends"), [(0.03, (0.02, 0.04)), (0.048, (0.03, 0.05)), (0.01, (0.01, 0.03))])
def test_halved_ranges_contain_the_solution_and_stay_within(
    tmp_path: Path, strain: float, ends: tuple[float, float]
) -> None:
    """Half of 0.01 to 0.05 is 0.02 wide, about the solution as far as the limits allow; so is 10 to 20 MPa."""
    study = make_study(tmp_path)
    edit = yaml.safe_load(to_smooth(study, surface(24, 6), {"yield_stress": 16.0, "failure_strain": strain}).edit)
    found = {factor["name"]: (factor["low"], factor["high"]) for factor in edit["factors"]}
    assert found["failure_strain"] == pytest.approx(ends) and found["yield_stress"] == pytest.approx((13.5, 18.5))


@pytest.mark.parametrize(("replicates", "advised"), [(1, 5), (3, 6), (80, 100)])
def test_replicates_are_doubled_up_to_the_limit(tmp_path: Path, replicates: int, advised: int) -> None:
    study = make_study(tmp_path)
    solver = study.solver.model_copy(update={"replicates": replicates})
    text = to_smooth(study.model_copy(update={"solver": solver}), surface(9, 6), None).text
    assert f"`replicates: {advised}`" in text


def test_two_kinds_of_means_of_which_one_has_no_scatter_share_it() -> None:
    """A force known to 4 % and a travel of unknown scatter: both get finite variances, the travel of like size."""
    plane = fit_surface(RUNS, 100.0 + RUNS @ np.array([10.0, 4.0]), ("x", "y"))
    force, travel = Observation(plane, 100.0, 4.0), Observation(plane, 2.0, kind="travel")
    variances = np.diagonal(errors_of([force, travel], 0).laboratory, axis1=1, axis2=2)
    assert np.isfinite(variances).all()
    assert variances[:, 0] == pytest.approx(16.0, rel=1e-9)
    assert 0.0016 < np.median(variances[:, 1]) < 0.16  # (4 % of 2 mm)² = 0.0064, known only roughly


def test_a_reversed_range_of_the_refinement_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"refine\.adjust\.failure_strain.*0\.3.*0\.001"):
        load_study(spec_of(tmp_path, adjust="{failure_strain: [0.3, 0.001]}"))


def test_a_reduced_surface_has_zeros_for_the_terms_left_out() -> None:
    """3 + 2b + 0.5a² from its rows alone, whatever their order."""
    rows = [SimpleNamespace(term=term, value=value) for term, value in (("a^2", 0.5), ("1", 3.0), ("b", 2.0))]
    reduced = SimpleNamespace(names=("a", "b"), axes=("a", "b"), coefficients=rows, over=None)
    reduced.beta = RsmResult.beta.func(reduced)
    found = RsmResult.response_at(reduced, {"a": np.array([0.0, 2.0]), "b": np.array([0.0, 1.0])})
    assert found.tolist() == [3.0, 7.0]
