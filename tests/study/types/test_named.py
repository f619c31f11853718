"""Values with their units, and placeholders in templates."""

from stemcal.study.model.growth import Interpolated
from stemcal.study.model.shear_test import Relative
from stemcal.study.types.factor import in_unit
from stemcal.study.types.field_types import Length
from stemcal.study.types.named import as_written, fill, placeholders


def test_values_with_units() -> None:
    assert (in_unit(1100, "kg/m3"), in_unit(0.3, "1")) == ("1100 kg/m3", "0.3")
    assert (as_written(0.07, "%"), as_written(2.0, "N")) == (7.0, 2.0)


def test_lengths_and_ratios() -> None:
    assert (Length(0.5).at(8.0), Length(divisor=8.0).at(11.0)) == (0.5, 1.375)
    assert (str(Length(0.5)), str(Length(divisor=8.0))) == ("0.5 mm", "d/8")
    ratio = Relative(0.1, is_ratio=True)
    assert (str(Relative(80.0)), str(ratio), ratio.of(800.0)) == ("80 MPa", "0.1", 80.0)
    assert Interpolated(((7.0, 0.4), (9.0, 0.6))).at(8.0) == 0.5


def test_placeholders() -> None:
    found = list(placeholders(b"E = {{elastic_modulus}}\nb = {{ width }}"))
    assert found == [(1, "elastic_modulus"), (2, "width")]
    assert fill(b"E = {{E}} \\ $(rm)", {"E": "10.5"}) == b"E = 10.5 \\ $(rm)"
