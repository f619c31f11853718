"""Definitive screening in two stages: a published example, an independent search, and what the analysis finds."""

from itertools import combinations

import numpy as np
import pytest
import statsmodels.api as sm

from stemcal.doe.designs.catalogue import plackett_burman
from stemcal.doe.designs.definitive_screening import OneSpareColumn, definitive_screening, spare_column_note
from stemcal.doe.screening.analysis import analyse_screening
from stemcal.doe.screening.two_stage_analysis import Mirrored, two_stages
from stemcal.errors import UsageError

FIVE = list("ABCDE")
# Five factors in ten mirrored runs and three at the centre, as the R package daewr has them (FitDefSc).
HALF = np.array([[0, 1, 1, -1, -1], [1, 0, -1, -1, 1], [1, -1, 0, 1, -1], [1, -1, 1, 0, 1], [1, 1, 1, 1, 0]], float)
DESIGN = np.vstack([np.stack([HALF, -HALF], axis=1).reshape(-1, 5), np.zeros((3, 5))])
YIELD = np.array([241, 295, 260, 338, 320, 265, 275, 248, 92.5, 383, 313, 305, 304])


def left_by(columns: list[np.ndarray]) -> float:
    """Residual sum of squares over all 13 runs of mean, A, B, D, E and further columns."""
    matrix = np.column_stack([np.ones(13), DESIGN[:, [0, 1, 3, 4]], *columns])
    return float(sm.OLS(YIELD, matrix).fit().ssr) if np.linalg.matrix_rank(matrix) == matrix.shape[1] else np.inf


def test_published_main_effects_and_pure_error() -> None:
    """daewr prints A −42.803, B −76.030, D −26.609, E −21.459 and a pure error of 48.66667 with 2 df."""
    found = two_stages(DESIGN, YIELD, FIVE)
    pairs = Mirrored.of(DESIGN, YIELD)
    assert found is not None and pairs is not None
    assert pairs.repeats == (pytest.approx(48.66667, abs=5e-6), 2)
    assert found.first.active == ("A", "B", "D", "E")
    printed = {"A": -42.803, "B": -76.030, "D": -26.609, "E": -21.459}
    assert {t.term: t.coefficient for t in found.terms[:4]} == pytest.approx(printed, abs=5e-4)
    # C joins the error: the column's sum of squares in the regression of all runs on five main effects
    whole = sm.OLS(YIELD, sm.add_constant(DESIGN)).fit()
    c = whole.params[3] ** 2 / whole.normalized_cov_params[3, 3]
    assert (found.first.df, found.first.mean_square) == (3, pytest.approx((48.66667 + c) / 3.0, rel=1e-6))


def test_second_order_terms_are_those_of_an_independent_search() -> None:
    """No set of fewer terms is enough; among those of four ours leaves least, daewr's stepwise D², BE, BD, B² 84.1."""
    found = two_stages(DESIGN, YIELD, FIVE)
    assert found is not None
    a, b, d, e = (DESIGN[:, i] for i in (0, 1, 3, 4))
    every = {"A^2": a * a, "A:B": a * b, "A:D": a * d, "A:E": a * e, "B^2": b * b, "B:D": b * d, "B:E": b * e,
             "D^2": d * d, "D:E": d * e, "E^2": e * e}  # fmt: skip
    left = {names: left_by([every[name] for name in names]) for names in combinations(sorted(every), 4)}
    assert left["B:D", "B:E", "B^2", "D^2"] == pytest.approx(4 * 4.586**2, rel=1e-3)
    assert tuple(sorted(found.second_order)) == min(left, key=lambda names: left[names])
    assert found.equals > 0


def drawn(effects: dict[str, float], sd: float, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Six factors in 17 runs, two columns without a factor."""
    design = definitive_screening(6, 17)
    column = {"a": 0, "b": 1, "c": 2, "d": 3, "e": 4, "f": 5}
    y = 100.0 + sd * random.standard_normal(len(design))
    for term, size in effects.items():
        y += size * np.prod([design[:, column[n]] for n in term], axis=0)
    return design, y


def test_what_is_there_is_found() -> None:
    """Effects of three times the scatter and more: two main effects, their interaction and a square."""
    random, right, clear = np.random.default_rng(12), 0, 0
    for _ in range(80):
        design, y = drawn({"a": 5.0, "d": -4.0, "ad": 4.0, "aa": 5.0}, 1.0, random)
        found = two_stages(design, y, list("abcdef"))
        assert found is not None
        clear += {"a", "d"} <= set(found.first.active)
        right += set(found.second_order) >= {"a:d", "a^2"}
    assert clear >= 78
    assert right >= 68


def test_what_is_not_there_is_rarely_found() -> None:
    """With two error degrees of freedom the first stage calls one factor in ten active, as it is meant to; that, and
    p > 0.2 in the second stage, leaves a square or an interaction in about a quarter of studies of nothing.
    """
    random, false, bent = np.random.default_rng(13), 0, 0
    for _ in range(300):
        found = two_stages(*drawn({}, 1.0, random), list("abcdef"))
        assert found is not None
        false, bent = false + len(found.first.active), bent + bool(found.second_order)
    assert false / (300 * 6) == pytest.approx(0.10, abs=0.03)
    assert bent <= 0.30 * 300


def test_main_effects_are_tested_clear_of_squares() -> None:
    """A large square does not enter the error of the main effects, as it does a residual."""
    random, errors, squares = np.random.default_rng(5), [], 0
    for _ in range(25):
        found = analyse_screening(*drawn({"a": 5.0, "aa": 40.0}, 1.0, random), list("abcdef"))
        assert found.error.df == 2 and found.two_stages is not None
        errors.append(found.error.mean_square)
        squares += "a" in found.significant and "a^2" in found.two_stages.second_order
    assert np.mean(errors) == pytest.approx(1.0, abs=0.4)
    assert squares >= 24


def test_a_failed_run_or_another_design_is_left_to_one_stage() -> None:
    design, y = drawn({"a": 5.0}, 1.0, np.random.default_rng(6))
    y[3] = np.nan
    assert analyse_screening(design, y, list("abcdef")).two_stages is None
    two_level = np.vstack([np.sign(design[:-1] + 0.5), np.zeros(6)])
    assert two_stages(two_level, np.arange(17.0), list("abcdef")) is None


def test_more_runs_make_columns_without_a_factor_then_centre_runs() -> None:
    for runs, order, centre in ((13, 6, 1), (15, 6, 3), (17, 8, 1), (21, 10, 1)):
        design = definitive_screening(6, runs)
        at_centre = int((~design.any(axis=1)).sum())
        assert (len(design), at_centre, (len(design) - at_centre) // 2) == (runs, centre, order)
    with pytest.raises(UsageError, match="13 runs or more for 6 factors, not 12"):
        definitive_screening(6, 12)


def test_one_spare_column_is_warned_of_and_two_centre_runs_mend_it() -> None:
    """Five factors in 13 runs: of 300 null studies about 30 % end with a square or an interaction, in 15 runs 10 %."""
    assert spare_column_note(definitive_screening(5)) == [OneSpareColumn(13, 5, 15, 17)]
    for runs in (15, 17):
        assert spare_column_note(definitive_screening(5, runs)) == []
    assert spare_column_note(definitive_screening(6)) == []
    assert spare_column_note(np.vstack([plackett_burman(5, runs=12), np.zeros((1, 5))])) == []
    random, shares = np.random.default_rng(6), []
    for runs in (13, 15):
        design = definitive_screening(5, runs)
        studies = [two_stages(design, random.standard_normal(runs), FIVE) for _ in range(300)]
        shares.append(sum(bool(found and found.second_order) for found in studies) / 300)
    assert shares[0] > 0.22 and shares[1] < 0.16
