import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stemcal.doe.coding import Coding
from stemcal.errors import UsageError

size = st.floats(1e-6, 1e6)
place = st.floats(-1e6, 1e6)


@given(st.lists(st.tuples(place, size, st.floats(-10, 10)), min_size=1, max_size=6))
def test_coding_and_back_is_the_identity(factors):
    centre, half_step, coded = (tuple(column) for column in zip(*factors, strict=True))
    coding = Coding(tuple(f"f{i}" for i in range(len(factors))), centre, half_step)
    natural = coding.to_natural([coded, coded])
    rounding = 1e-12 * (np.abs(centre) / np.array(half_step) + 10.0)
    assert np.all(np.abs(coding.to_coded(natural) - coded) <= rounding)


def test_the_papers_half_step_puts_the_range_ends_near_the_axial_points():
    coding = Coding.from_ranges(["X4"], [10.0], [20.0], reach=8**0.25)
    assert coding.half_step[0] == pytest.approx(2.973017787506803, rel=1e-12)
    assert coding.to_natural([[8**0.25]])[0, 0] == pytest.approx(20.0, rel=1e-12)
    assert (coding.names, coding.centre) == (("X4",), (15.0,))


@pytest.mark.parametrize("half_step", [0.0, -1.0, float("nan")])
def test_a_half_step_must_be_positive(half_step):
    with pytest.raises(UsageError, match=r"coding\.X4"):
        Coding(("X4",), (15.0,), (half_step,))


def test_lengths_must_agree():
    with pytest.raises(UsageError, match="length"):
        Coding(("X4", "X9"), (15.0,), (1.0,))


def test_levels_have_twelve_digits_and_a_level_of_zero_is_zero():
    coding = Coding(("angle", "stress"), (15.0, 15.0), (15.0, 5.0))
    assert coding.levels([-1.0 + 2e-15, 1.0 - 1e-15]) == {"angle": 0.0, "stress": 20.0}
    assert coding.levels([-1.0 + 1e-9, 1.0])["angle"] == pytest.approx(1.5e-8, rel=1e-6)
