import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stemcal.errors import UsageError
from stemcal.study.types import units

KNOWN = [
    *(("8 mm", "length", 8.0), ("1 in", "length", 25.4), ("0.8 cm", "length", 8.0), ("50 µm", "length", 0.05)),
    *(("−3 mm", "length", -3.0), ("1e3mm", "length", 1000.0)),
    *(("100 mm/min", "speed", 100 / 60), ("1 m/s", "speed", 1000.0), ("6 m/min", "speed", 100.0)),
    *(("10 ms", "time", 0.01), ("2 min", "time", 120.0)),
    *(("0.1592 kN", "force", 159.2), ("1 kgf", "force", 9.80665)),
    *(("207 GPa", "stress", 207_000.0), ("101325 Pa", "stress", 0.101325), ("1 N/mm2", "stress", 1.0)),
    *(("1100 kg/m3", "density", 1.1e-9), ("1100 kg/m³", "density", 1.1e-9), ("7.85 g/cm3", "density", 7.85e-9)),
    ("7.85e-9 tonne/mm^3", "density", 7.85e-9),
    *(("37.5°", "angle", 37.5), (f"{math.pi} rad", "angle", 180.0)),
    *(("90 1/s", "rate", 90.0), ("90 s⁻¹", "rate", 90.0), ("0.09 1/ms", "rate", 90.0)),
    ("5400 1/min", "rate", 90.0),
    ("1 s/m", "decay", 0.001),
    ("500 kg", "mass", 0.5),
    ("5 %", "dimensionless", 0.05),
]


@pytest.mark.parametrize(("text", "dimension", "internal"), KNOWN)
def test_known_quantities(text: str, dimension: str, internal: float) -> None:
    assert units.parse(text, dimension) == pytest.approx(internal, rel=1e-14)


def test_internal_system_is_consistent() -> None:
    """F = m·a and ρ = m/V hold between the internal units: N = t·mm/s², MPa = N/mm², t/mm³."""
    kilogram, metre, second = units.convert(1, "kg"), units.convert(1, "m"), units.convert(1, "s")
    assert kilogram * metre / second**2 == pytest.approx(units.convert(1, "N"), rel=1e-14)
    assert units.convert(1, "N") / metre**2 == pytest.approx(units.convert(1, "Pa"), rel=1e-14)
    assert kilogram / metre**3 == pytest.approx(units.convert(1, "kg/m3"), rel=1e-14)


@given(
    value=st.floats(min_value=-1e12, max_value=1e12),
    name=st.sampled_from([name for table in units._TABLE.values() for name in table]),
)
def test_conversion_goes_there_and_back(value: float, name: str) -> None:
    assert units.from_internal(units.convert(value, name), name) == pytest.approx(value, rel=1e-14, abs=1e-290)


@given(value=st.floats(allow_nan=False, allow_infinity=False), name=st.sampled_from(["mm", "um", "m"]))
def test_written_quantities_read_back(value: float, name: str) -> None:
    try:
        assert units.parse(f"{value!r} {name}", "length") == units.convert(value, name)
    except units.UnitError:
        assert math.isinf(units.convert(value, name))


@given(st.text(max_size=80))
def test_any_text_is_a_quantity_or_a_unit_error(text: str) -> None:
    try:
        assert math.isfinite(units.parse(text, "length"))
    except units.UnitError as error:
        assert error.message


@pytest.mark.parametrize(
    ("text", "dimension", "message", "remedy"),
    [
        ("8", "length", "8 has no unit", 'write "8 mm"'),
        ("8 N", "length", "N is a unit of force, not of length", "use mm, um, cm, m or in"),
        ("8 Mpa", "stress", "unknown unit 'Mpa'", "did you mean MPa?"),
        ("8 mmm", "length", "unknown unit 'mmm'", "did you mean mm?"),
        ("8 furlong", "length", "unknown unit 'furlong'", "use mm, um, cm, m or in"),
        ("37,5 deg", "angle", "'37,5 deg' has a decimal comma", "write 37.5 deg"),
        ("eight mm", "length", "'eight mm' is not a number with a unit", 'such as "1 mm"'),
        ("9**9**9 mm", "length", "unknown unit '**9**9 mm'", "use mm"),
        ("1e400 mm", "length", "'1e400 mm' is too large", "check the exponent"),
        ("nan mm", "length", "'nan mm' is not a number with a unit", "write a number"),
        ("1_0 mm", "length", "unknown unit '_0 mm'", "did you mean mm?"),
        ("٣ mm", "length", "'٣ mm' is not a number with a unit", "write a number"),
    ],
)
def test_errors_name_the_remedy(text: str, dimension: str, message: str, remedy: str) -> None:
    with pytest.raises(units.UnitError) as caught:
        units.parse(text, dimension)
    assert caught.value.message == message
    assert remedy in caught.value.remedy
    assert isinstance(caught.value, UsageError)


def test_very_long_texts_are_cut_in_messages() -> None:
    with pytest.raises(units.UnitError) as caught:
        units.parse("x" * 100_000, "length")
    assert len(str(caught.value)) < 200


def test_every_dimension_begins_with_its_internal_unit() -> None:
    for dimension, name in units.INTERNAL.items():
        assert units.convert(1.0, name, dimension) == 1.0


def test_remedies_for_numbers_without_a_unit_or_with_a_comma() -> None:
    assert units.with_unit("8", "length", "mm") == 'write "8 mm"'
    assert units.with_unit("0.01", "length", "mm") == 'write "0.01 m" (10 mm), or "0.01 mm"'
    assert units.with_unit("1e9", "stress", "MPa") == 'write "1e9 Pa" (1000 MPa), or "1e9 MPa"'
    assert units.with_point("152,5 N") == "152.5 N"
    assert units.with_point("1,234 N") == "1.234 N (or 1234 N, if the comma separates thousands)"
