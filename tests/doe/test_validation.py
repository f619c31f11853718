import json
from dataclasses import asdict

import pytest
from printed import read_printed

from stemcal.doe.comparison import compare_conditions
from stemcal.errors import UsageError


@pytest.fixture(scope="module")
def table13():
    rows = read_printed("table13_validation.csv")
    columns = [[float(row[c]) for row in rows] for c in ("diameter_mm", "measured_N", "simulated_N")]
    return compare_conditions(*columns, 8.0)


def test_mean_error_and_roles_of_table_13(table13):
    assert sum(abs(row.error_percent) for row in table13.rows) / 5 == pytest.approx(6.7157, abs=5e-5)
    assert [row.role for row in table13.rows] == ["held_out", "fitted", *["held_out"] * 3]


def test_growth_with_diameter(table13):
    lab, model = table13.measured_exponent, table13.simulated_exponent
    assert (lab.value, lab.low, lab.high) == pytest.approx((2.59, 2.25, 2.93), abs=5e-3)
    assert model.value == pytest.approx(2.20, abs=5e-3)
    assert table13.error_slope_percent_per_unit == pytest.approx(4.307, abs=5e-4)


def test_the_error_is_a_trend_of_the_diameter(table13):
    (trend,) = table13.notes
    assert trend.kind == "error_trend" and "increases by 4.3 percentage points per mm" in trend.text


def test_a_failed_run_has_no_error():
    result = compare_conditions([7, 8, 9], [100.0, 150.0, 200.0], [110.0, None, float("nan")], 8)
    assert [row.error_percent for row in result.rows] == [pytest.approx(-10.0), None, None]
    assert result.simulated_exponent is None
    json.dumps(asdict(result), allow_nan=False)


def test_all_runs_failed():
    out = compare_conditions([7, 8], [100.0, 150.0], [None, None], None)
    assert [row.error_percent for row in out.rows] == [None, None] and out.worst_held_out_percent is None


def test_the_independent_maximum_leaves_the_calibration_diameter_out():
    result = compare_conditions([7, 8], [100.0, 100.0], [101.0, 120.0], 8)
    assert [row.error_percent for row in result.rows] == pytest.approx([-1.0, -20.0])
    assert result.worst_held_out_percent == pytest.approx(1.0)


def test_senseless_input_is_refused():
    with pytest.raises(UsageError, match="must be equal in number"):
        compare_conditions([7], [1.0, 2.0], [1.0], 7)
    with pytest.raises(UsageError, match="must be positive"):
        compare_conditions([7], [0.0], [1.0], 7)


def test_a_joint_fit_leaves_no_diameter_independent() -> None:
    result = compare_conditions([7.0, 8.0], [100.0, 130.0], [101.0, 131.0], [7.0, 8.0])
    assert [row.role for row in result.rows] == ["fitted", "fitted"]
    assert result.worst_held_out_percent is None
    assert result.notes == ()


@pytest.mark.parametrize(("measured", "simulated"), [([1.0, 2.0], [1.0]), ([1.0], [1.0, 2.0]), ([1.0], [1.0])])
def test_columns_of_unequal_length_are_refused(measured, simulated):
    with pytest.raises(UsageError, match="equal in number"):
        compare_conditions([7.0, 8.0], measured, simulated, 8.0)
