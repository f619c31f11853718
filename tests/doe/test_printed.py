from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stemcal.doe.regression.surface import Surface
from stemcal.stages.printed_numbers import agrees, compare_cells


@pytest.mark.parametrize(
    ("printed", "value"),
    [
        ("0.08", 0.0830526),
        ("34", 33.995),
        ("16,225.35", 16225.352),
        ("18,921.02", 18921.0208),
        ("0.0022 **", 0.002243),
        ("<0.0001", 5.3e-8),
        (">0.9", 0.95),
        ("−2.95", -2.95),
        ("2.5", 2.45),  # a half may have gone up …
        ("2.4", 2.45),  # … or to the even digit
        ("-6", -6.1558),
        ("7.8%", 7.8333),
        ("1.2e-3", 0.00123),
        ("0.001", 0.0005964710071),
    ],
)
def test_agreeing(printed, value):
    assert agrees(printed, value)


@pytest.mark.parametrize(
    ("printed", "value"),
    [
        ("2.88", -2.883),
        ("120.42", 120.4151 + 0.01),
        ("<0.0001", 0.0002),
        ("15.00", 14.9949),
        ("7.8", 7.8501),
        (">1", 1),
    ],
)
def test_disagreeing(printed, value):
    assert not agrees(printed, value)


@given(st.floats(-1e6, 1e6), st.integers(0, 6))
def test_a_number_agrees_with_its_own_rounding_and_not_with_the_next(value, digits):
    printed = f"{value:.{digits}f}"
    assert agrees(printed, value)
    assert not agrees(f"{value + 1.2 * 10.0**-digits:.{digits}f}", value)


def test_the_sign_error_of_equation_1(ccd: Surface, printed_rows):
    rows = printed_rows("eq1_coefficients_printed.csv")
    cells = [(row["term"], "", row["coefficient"], c.value) for row, c in zip(rows, ccd.coefficients, strict=True)]
    found = compare_cells(cells)
    assert [(d.term, d.printed, d.nature) for d in found] == [("X7^2", "-2.88", "sign")]
    assert found[0].value == pytest.approx(2.8831, abs=1e-4)


def test_natures():
    cells = [("a", "1.50", 1.55), ("b", "", 3.0), ("c", "n/a", 3.0), ("d", "3.0", None), ("e", "<0.01", 0.02)]
    cells += [("f", "0.05", 0.00001), ("g", "7", 7.2), ("h", "-2", 2.1)]
    found = compare_cells((term, "", printed, value) for term, printed, value in cells)
    assert [(d.term, d.nature) for d in found] == [
        ("a", "value"),
        ("c", "unreadable"),
        ("d", "value"),
        ("e", "value"),
        ("f", "value"),
        ("h", "sign"),
    ]
