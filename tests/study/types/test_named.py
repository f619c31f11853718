"""Values with their units, and placeholders in templates."""

from stemcal.study.types.factor import in_unit
from stemcal.study.types.named import as_written, fill, placeholders


def test_values_with_units() -> None:
    assert (in_unit(1100, "kg/m3"), in_unit(0.3, "1")) == ("1100 kg/m3", "0.3")
    assert (as_written(0.07, "%"), as_written(2.0, "N")) == (7.0, 2.0)


def test_placeholders() -> None:
    found = list(placeholders(b"E = {{elastic_modulus}}\nb = {{ width }}"))
    assert found == [(1, "elastic_modulus"), (2, "width")]
    assert fill(b"E = {{E}} \\ $(rm)", {"E": "10.5"}) == b"E = 10.5 \\ $(rm)"
