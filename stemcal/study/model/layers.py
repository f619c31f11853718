"""Layers of the stem and properties across its axis: their keys in a spec, and their values for a simulation."""

from collections.abc import Mapping
from math import sqrt
from typing import Annotated, Any, NamedTuple

from stemcal.study.model.growth import Growth, Interpolated, OverDiameter, value_at
from stemcal.study.model.shear_test import MaterialSection, Relative, TransverseSection
from stemcal.study.types import units
from stemcal.study.types.factor import EMBEDDED, PARAMETERS, SETTINGS, THICKNESS, TRANSVERSE, Parameter
from stemcal.study.types.field_types import ColumnName, Frozen, Length, StemLength, field_or_none
from stemcal.study.types.strict_yaml import NodePath

MOST_LAYERS = 3


class LayerSection(MaterialSection):
    """One layer of the stem, with the material keys whose values differ from those in the `material` section.

    A material parameter of a layer can be a factor: for the layer `skin`, the factor is named `skin_yield_stress`, and
    its thickness `skin_thickness`.
    """

    name: ColumnName
    """Name of the layer, such as `skin`; the names of its factors begin with this name."""
    thickness: Annotated[Length | Growth | Interpolated, OverDiameter(StemLength)] | None = None
    """Thickness of the layer; omit the key for the innermost layer. The thickness is a length, a fraction of the
    diameter such as d/16, a power of it such as `{value: 0.5 mm, at: 8 mm, exponent: 2}`, or measured, such as
    `{7 mm: 0.41 mm, 11 mm: 0.9 mm}`: values in between are interpolated."""


class Place(NamedTuple):
    """A parameter, its section in a spec (None if the spec has no such section), and the path of its key."""

    parameter: Parameter
    section: Frozen | None
    path: NodePath

    @property
    def value(self) -> Any:
        """Value of the key in the spec; None if the spec has none."""
        return field_or_none(self.section, str(self.path[-1]))


def places(material: MaterialSection | None, layers: tuple[LayerSection, ...]) -> dict[str, Place]:
    """Return all parameters of a stem and its layers with their places in the spec, by their names as factors."""
    by_name = stem_places(EMBEDDED, material)
    across = field_or_none(material, "transverse")
    if across is not None:
        by_name |= _across("transverse_", across, ("material",))
    for index, layer in enumerate(layers):
        for name, parameter in (PARAMETERS | {"thickness": THICKNESS}).items():
            own_parameter = parameter._replace(label=f"{parameter.label} of {layer.name}")
            by_name[f"{layer.name}_{name}"] = Place(own_parameter, layer, ("layers", index, name))
        own = field_or_none(layer, "transverse")
        if own is not None or (across is not None and "transverse" not in layer.model_fields_set):
            by_name |= _across(f"{layer.name}_transverse_", own, ("layers", index))
    return by_name


def stem_places(parameters: Mapping[str, Parameter], material: MaterialSection | None) -> dict[str, Place]:
    """Return parameters of the whole stem, and settings of its test, with their places in the spec."""
    of_material = {name: Place(parameter, material, ("material", name)) for name, parameter in parameters.items()}
    settings = {name: Place(each.parameter, None, (each.section, name)) for name, each in SETTINGS.items()}
    return of_material | {name: place for name, place in settings.items() if name in parameters}


def _across(prefix: str, section: TransverseSection | None, path: NodePath) -> dict[str, Place]:
    return {f"{prefix}{name}": Place(each, section, (*path, "transverse", name)) for name, each in TRANSVERSE.items()}


NO_RATE = {"strain_rate_c": 0.0, "strain_rate_p": 1.0}
"""Rate parameters for a yield stress that does not depend on the strain rate."""


class LayerValues(NamedTuple):
    """A layer of a stem in internal units: thickness (0 for the innermost layer) and internal length in mm.

    `along` has the nine material parameters, `across` the properties across the axis (None for an isotropic layer).
    """

    thickness: float
    along: dict[str, float]
    across: dict[str, float] | None
    internal_length: float

    @property
    def flaw(self) -> str | None:
        """Reason why the properties across the axis are impossible, with a remedy; None if they are possible."""
        if self.across is None:
            return None
        nu, ratio = self.along["poisson_ratio"], self.across["elastic_modulus"] / self.along["elastic_modulus"]
        if self.across["poisson_ratio"] + 2.0 * nu * nu * ratio >= 1.0:
            return "the elastic law across the axis is not positive definite; reduce the Poisson's ratios"
        if self.across["yield_stress"] >= 2.0 * self.along["yield_stress"]:
            return "the yield stress across the axis must be less than twice that along the axis; reduce it"
        return None


def layers_at(study: Any, levels: Mapping[str, float], diameter: float) -> tuple[LayerValues, ...]:
    """Return the layers of a stem of a `Study` from the outside, in internal units; every stem has at least one."""
    chosen = {**study.midlevels(), **levels}
    internal = {factor.name: factor.internal(chosen[factor.name]) for factor in study.factors}
    ratios = {factor.name for factor in study.factors if units.parse_unit(factor.unit).dimension == "dimensionless"}
    base, material = study.parameters(levels, diameter), study.material
    values_of_layers = []
    for layer in study.layers or (None,):
        prefix = "" if layer is None else f"{layer.name}_"
        own = own_values(layer, diameter, internal)
        along = {**base, **own, **(NO_RATE if study.solver.rate == "none" else {})}
        length = material if layer is None or "internal_length" not in layer.model_fields_set else layer
        across = [("transverse_", material.transverse)]
        if layer is not None and "transverse" in layer.model_fields_set:
            across = [*across, (f"{prefix}transverse_", layer.transverse)] if layer.transverse is not None else []
        elif layer is not None:
            across.append((f"{prefix}transverse_", None))
        thickness = layer and value_at(layer.thickness, diameter, internal.get(f"{prefix}thickness"), internal)
        fibrous = any(section is not None for _, section in across)
        values = _resolved(across, internal, ratios, along) if fibrous else None
        values_of_layers.append(LayerValues(thickness or 0.0, along, values, length.internal_length.at(diameter)))
    return tuple(values_of_layers)


def own_values(layer: LayerSection | None, diameter: float, internal: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters of a layer that its keys or the levels of its factors set, in internal units."""
    if layer is None:
        return {}
    levels = {name: internal.get(f"{layer.name}_{name}") for name in PARAMETERS}
    each = {name: value_at(getattr(layer, name), diameter, level, internal) for name, level in levels.items()}
    return {name: value for name, value in each.items() if value is not None}


def _resolved(
    sections: list[tuple[str, TransverseSection | None]],
    internal: Mapping[str, float],
    ratios: set[str],
    along: Mapping[str, float],
) -> dict[str, float]:
    """Return the properties across the axis (MPa) in `sections` or their factors; a later section has precedence."""
    values: dict[str, Any] = {}
    for prefix, section in sections:
        for name in TRANSVERSE:
            if (value := field_or_none(section, name)) is not None:
                values[name] = value
            if (factor := f"{prefix}{name}") in internal:
                level = internal[factor]
                values[name] = level if name == "poisson_ratio" else Relative(level, factor in ratios)
    return _across_from(values, along)


def _across_from(values: Mapping[str, Any], along: Mapping[str, float]) -> dict[str, float]:
    """Return the properties across the axis, MPa: `values`, and defaults that follow from the values along the axis.

    The default shear modulus is de Saint-Venant's 1/G = 1/E_T + (1 + 2ν)/E with ν for tension along the axis; it is
    exact for isotropic materials.
    """
    E, nu, sigma = along["elastic_modulus"], along["poisson_ratio"], along["yield_stress"]
    E_t = values["elastic_modulus"].of(E) if "elastic_modulus" in values else E
    across = values["yield_stress"].of(sigma) if "yield_stress" in values else sigma
    estimate = 1.0 / (1.0 / E_t + (1.0 + 2.0 * nu) / E)
    shear, shear_yield = values.get("shear_modulus"), values.get("shear_yield_stress")
    return {
        "elastic_modulus": E_t,
        "shear_modulus": estimate if shear is None else shear.of(E),
        "poisson_ratio": values.get("poisson_ratio", nu),
        "yield_stress": across,
        "shear_yield_stress": across / sqrt(3.0) if shear_yield is None else shear_yield.of(sigma),
    }
