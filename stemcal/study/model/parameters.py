"""The nine parameters of the plastic kinematic stem material (MAT_003), in the order X1…X9 of the paper, and what else
the embedded solver can vary.
"""

from typing import NamedTuple


class Parameter(NamedTuple):
    """What one parameter is, and which values make sense.

    Bounds and plausible values are in `unit`; `lowest_allowed` and `highest_allowed` say whether the bound
    itself may be taken.
    """

    label: str
    dimension: str
    unit: str
    lowest: float
    lowest_allowed: bool
    highest: float
    highest_allowed: bool
    plausible: tuple[float, float]

    def outside(self, value: float) -> str | None:
        """Return what is wrong with `value` (in `unit`), or None if physics allows it."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        if value < self.lowest or (value == self.lowest and not self.lowest_allowed):
            return f"must {'not be below' if self.lowest_allowed else 'be above'} {self.lowest:g}{unit}"
        if value > self.highest or (value == self.highest and not self.highest_allowed):
            return f"must {'not be above' if self.highest_allowed else 'be below'} {self.highest:g}{unit}"
        return None


_NO_LIMIT = float("inf")

PARAMETERS: dict[str, Parameter] = {
    "density": Parameter("density", "density", "kg/m3", 0, False, _NO_LIMIT, False, (100, 3000)),
    "elastic_modulus": Parameter("elastic modulus", "stress", "MPa", 0, False, _NO_LIMIT, False, (10, 1e5)),
    "poisson_ratio": Parameter("Poisson's ratio", "dimensionless", "1", 0, True, 0.5, False, (0, 0.5)),
    "yield_stress": Parameter("yield stress", "stress", "MPa", 0, False, _NO_LIMIT, False, (0.1, 1000)),
    "tangent_modulus": Parameter("tangent modulus", "stress", "MPa", 0, True, _NO_LIMIT, False, (0, 1e4)),
    "hardening_parameter": Parameter("hardening parameter", "dimensionless", "1", 0, True, 1, True, (0, 1)),
    "strain_rate_c": Parameter("strain rate parameter C", "rate", "1/s", 0, False, _NO_LIMIT, False, (1e-3, 1e6)),
    "strain_rate_p": Parameter("strain rate parameter P", "dimensionless", "1", 0, False, _NO_LIMIT, False, (0.1, 100)),
    "failure_strain": Parameter("failure strain", "dimensionless", "1", 0, False, _NO_LIMIT, False, (1e-3, 3)),
}

# What is no property of the material; each takes the place of the keys of a section.
AROUND: dict[str, tuple[Parameter, str, tuple[str, ...]]] = {
    "stem_friction": (
        Parameter("friction of the stem", "dimensionless", "1", 0, True, 2, True, (0.01, 1)),
        "contact",
        ("static_friction", "dynamic_friction", "decay"),
    ),
    "wall_thickness": (
        Parameter("wall thickness", "length", "mm", 0, False, _NO_LIMIT, False, (0.1, 20)),
        "specimen",
        ("diameter_ratio",),
    ),
}
EMBEDDED = {**PARAMETERS, **{name: parameter for name, (parameter, _, _) in AROUND.items()}}
