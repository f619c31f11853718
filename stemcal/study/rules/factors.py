"""Rules on factors, on fixed material values, and on values that depend on the diameter."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import inf
from operator import itemgetter
from typing import Any

from stemcal.formats import did_you_mean, listed, nearest
from stemcal.study.model.growth import MOST_EXPONENT, Growth, Interpolated
from stemcal.study.model.layers import LayerSection, layers_at
from stemcal.study.model.shear_test import Relative
from stemcal.study.model.study import Study
from stemcal.study.rules import Draft
from stemcal.study.types import units
from stemcal.study.types.factor import EMBEDDED, FRICTION, PARAMETERS, SETTINGS, Factor, in_unit
from stemcal.study.types.field_types import Length, field_or_none, has_fields
from stemcal.study.types.strict_yaml import Finding, NodePath

_WIDEST = 1000.0  # largest plausible diameter of a stem, mm
_RATE = ("strain_rate_c", "strain_rate_p")
_OF_LAYERS = (*PARAMETERS, "thickness")


def _names_differ(draft: Draft) -> Iterator[Finding]:
    for key in ("name", "symbol"):
        seen: dict[str, Factor] = {}
        for index, factor in draft.factors.items():
            value = getattr(factor, key)
            first = seen.setdefault(value, factor)
            if first is not factor:
                other = "" if key == "name" else f" ({first.name})"
                message = f"another factor{other} already has the {key} {value!r}"
                yield Finding(("factors", index, key), message, f"use a different {key} for each factor")


def _ranges_rise(draft: Draft) -> Iterator[Finding]:
    for index, factor in draft.factors.items():
        low, high = in_unit(factor.low, factor.unit), in_unit(factor.high, factor.unit)
        if factor.low > factor.high:
            message = f"`low` ({low}) is above `high` ({high})"
            yield Finding(("factors", index, "low"), message, "swap `low` and `high`")
        elif factor.low == factor.high:
            message = f"`low` and `high` are both {low}"
            remedy = "widen the range, or move the parameter to the `material` section"
            yield Finding(("factors", index, "low"), message, remedy)


def _priors_fit(draft: Draft) -> Iterator[Finding]:
    for index, factor in draft.factors.items():
        if (prior := factor.prior) is None:
            continue
        if not factor.low - 3 * prior.sd <= prior.mean <= factor.high + 3 * prior.sd:
            distribution, ends = f"{prior.mean:g} ± {prior.sd:g}", f"{factor.low:g} to {factor.high:g}"
            message = f"the prior distribution ({distribution}) does not overlap the range from {ends}"
            remedy = "correct the prior or the range; both are in the unit of the factor"
            yield Finding(("factors", index, "prior", "mean"), message, remedy)


def _factors_are_known(draft: Draft) -> Iterator[Finding]:
    if not draft.kind.parameters:
        return
    exponents, known = {growth.exponent for growth in draft.growing.values()}, draft.places
    for index, factor in draft.factors.items():
        place, name = known.get(factor.name), factor.name
        if place is None and (name in exponents or _may_be_of_wrong_section(draft, name)):
            continue
        if place is None:
            message, near = f"the {draft.study.solver.title} solver has no parameter {name!r}", nearest(name, known)
            twice = f"remove this factor because {near} is already a factor"
            remedy = twice if near in draft.names else did_you_mean(name, known)
            layer = next((name.removesuffix(f"_{key}") for key in _OF_LAYERS if name.endswith(f"_{key}")), "")
            if name in EMBEDDED:
                remedy = "remove this factor, or use `solver: {kind: embedded}`"
            elif "transverse_" in name and draft.kind.has_layers:
                remedy = "for a stem with fibres, write `transverse: {}` under `material`"
            elif name == "shear_modulus":
                remedy = "use tangent_modulus (the slope beyond yield), or transverse_shear_modulus (of fibres)"
            elif layer and draft.kind.has_layers:
                message, names = f"no layer is named {layer!r}", [each.name for each in draft.layers]
                remedy = did_you_mean(layer, names) if names else "remove this factor, or add the section `layers`"
            yield Finding(("factors", index, "name"), message, remedy)
            continue
        parameter = place.parameter
        if parameter.relative and units.fits(factor.unit, "dimensionless"):
            continue
        try:
            units.parse_unit(factor.unit, parameter.dimension)
        except units.UnitError as error:
            message = f"the {parameter.label} requires a unit" if factor.unit == "1" else error.message
            yield Finding(("factors", index, "unit"), message, error.remedy)


def _may_be_of_wrong_section(draft: Draft, name: str) -> bool:
    """Check that an invalid section, whose mistakes are already reported, may define the parameter."""
    material = field_or_none(draft.study, "material")
    across = material is None or not has_fields(material, "transverse")
    return not has_fields(draft.study, "layers") or (across and "transverse_" in name)


def _values_are_physical(draft: Draft) -> Iterator[Finding]:
    """Check levels and fixed values against the physical limits of the parameter, at every diameter of the study."""
    for name, place in draft.places.items() if draft.kind.parameters else ():
        parameter, reported = place.parameter, set[NodePath]()
        for path, value in possible_values(draft, name):
            if isinstance(value, Relative):
                continue  # a ratio was already checked to be above 0
            shown = units.from_internal(value, parameter.unit)
            if path not in reported and (wrong := parameter.outside(shown)):
                reported.add(path)
                message = f"{in_unit(shown, parameter.unit)} {wrong}"
                remedy = f"the usual range{'' if name in SETTINGS else ' for plants'} is {parameter.usual}"
                if name in _growing(draft):
                    message = f"at one of the diameters in this study, the value {message}"
                    remedy = "correct the value, the exponent or the factor ranges"
                yield Finding(path, message, remedy)


def wrong_levels(study: Study, levels: Mapping[str, float], diameter: float | None = None) -> Iterator[str]:
    """Yield the mistakes in levels (units of the spec) and a diameter (mm) from the command line or from Python."""
    if study.pending:
        yield study.pending
    if not study.kind.parameters:
        return
    if diameter is not None and diameter > _WIDEST:
        yield f"diameter: {diameter:g} mm is not a plausible stem diameter; use at most {_WIDEST:g} mm"
        return
    if "outer_diameter" in study.names:
        own, usual = study.stem_at(levels, 0.0), (study.specimen.outer_diameter, study.targets.calibrate_at)
        if diameter not in (None, own, *usual):
            yield f"diameter: {diameter:g} mm, but `outer_diameter` is a factor; set the level of the factor"
        diameter = own
    parameters, around_stem = study.parameters(levels, diameter), (FRICTION, *SETTINGS)
    around = {each.name: each.internal(levels[each.name]) for each in study.factors if each.name in around_stem}
    growing = [name for name, place in study.places.items() if isinstance(place.value, Growth)]
    chosen = {**study.midlevels(), **levels}
    names = study.places.keys() - EMBEDDED.keys()
    further = [each for each in study.factors if each.name in names and not units.fits(each.unit, "dimensionless")]
    of_layers = {factor.name: factor.internal(chosen[factor.name]) for factor in further}
    for name, value in (parameters | around | of_layers).items():
        parameter = study.places[name].parameter
        shown = units.from_internal(value, parameter.unit)
        if name in (*study.names, *growing) and (wrong := parameter.outside(shown)):
            yield f"{name} ({in_unit(shown, parameter.unit)}) {wrong}; the usual range is {parameter.usual}"
    diameter, study = study.targets.calibrate_at if diameter is None else diameter, study.at(levels)
    stem = layers_at(study, levels, diameter)
    if sum(layer.thickness for layer in stem) >= 0.5 * diameter * (1.0 - study.specimen.ratio_at(diameter)):
        yield f"the layers are thicker than the wall at a diameter of {diameter:g} mm; use thinner layers"
    yield from dict.fromkeys(flaw for layer in stem if (flaw := layer.flaw) is not None)
    if any(layer.along["tangent_modulus"] >= layer.along["elastic_modulus"] for layer in stem):
        yield "`tangent_modulus` must be below `elastic_modulus`; reduce `tangent_modulus`"


def _material_is_set_once(draft: Draft) -> Iterator[Finding]:
    for name, place in draft.places.items():
        value = place.value
        if name in draft.names and value is not None and not (isinstance(value, Growth) and value.value is None):
            remedy = "remove this value, or remove the factor if the value is known"
            yield Finding(place.path, f"{name} is also a factor", remedy, at_key=True)
        elif isinstance(value, Growth) and name not in draft.names and value.value is None:
            remedy = f"add `value: …` (usual range: {place.parameter.usual}), or add {name} to `factors`"
            yield Finding(place.path, f"{name} has no value for the reference diameter", remedy, at_key=True)


def _settings_are_set_once(draft: Draft) -> Iterator[Finding]:
    for name in settings_varied(draft):
        section = field_or_none(draft.study, SETTINGS[name].section)
        if section is not None and name in section.model_fields_set:
            path = (SETTINGS[name].section, name)
            yield Finding(path, f"{name} is also a factor", "remove this key, or remove the factor", at_key=True)
    for key in ("static_friction", "dynamic_friction", "decay") if FRICTION in draft.names else ():
        if key in draft.study.contact.model_fields_set:
            message = f"this value is set by the `{FRICTION}` factor"
            yield Finding(("contact", key), message, "remove this key, or remove the factor", at_key=True)
    if {"duration", "stroke"} <= draft.study.loading.model_fields_set:
        message = "`duration` also sets the stroke"
        yield Finding(("loading", "stroke"), message, "remove `duration` or `stroke`", at_key=True)


def settings_varied(draft: Draft) -> dict[str, int]:
    """Return the index of each factor that is a setting of the test and has a valid unit, by name."""
    known, each = SETTINGS.keys() & draft.kind.parameters.keys(), draft.factors.items()
    return {factor.name: index for index, factor in each if factor.name in known and _unit_fits(draft, factor)}


def extremes_of(study: Study, factors: Iterable[Factor], name: str) -> list[float]:
    """Return the limits of a setting of the test if it is a factor, otherwise its value; internal units."""
    setting = SETTINGS[name]
    varied = [each for each in factors if each.name == name and units.fits(each.unit, setting.parameter.dimension)]
    levels = [each.internal(end) for each in varied for end in (each.low, each.high) if study.kind.parameters]
    return levels or [getattr(getattr(study, setting.section), name)]


def _settings_act(draft: Draft) -> Iterator[Finding]:
    study, settings = draft.study, settings_varied(draft)
    if "speed" in settings and study.loading.chosen_stroke is None:
        message = f"the stroke ({study.loading.duration:g} s times the speed) would follow the factor `speed`"
        yield Finding(("loading",), message, "set `stroke: d/2` instead of `duration`")
    if "diameter_ratio" in settings and study.specimen.bore is not None:
        message = "`bore` also sets the diameter ratio, which is a factor"
        yield Finding(("specimen", "bore"), message, "remove this key, or remove the factor", at_key=True)
    if "outer_diameter" in settings and len(study.targets.means) > 1:
        path: NodePath = ("factors", settings["outer_diameter"], "name")
        message = f"the diameters of {len(study.targets.means)} targets also set the diameter of the stem"
        yield Finding(path, message, "remove this factor, or keep one target")


def _rate_parameters_are_used(draft: Draft) -> Iterator[Finding]:
    if draft.study.solver.rate != "none":
        return
    places: dict[NodePath, str] = {("factors", i, "name"): factor.name for i, factor in draft.factors.items()}
    places |= {place.path: name for name, place in draft.places.items() if place.value is not None}
    for path, name in places.items():
        if name.endswith(_RATE):
            remedy = "remove the parameter, or choose another `solver.rate_law`"
            yield Finding(path, f"{name} has no effect with `rate_law: none`", remedy)


def _material_is_complete(draft: Draft) -> Iterator[Finding]:
    if not draft.kind.parameters or not draft.names or draft.study.material.from_ is not None:
        return
    meant = {nearest(name, PARAMETERS) for name in draft.names if name not in SETTINGS}
    wrong = {name for name in PARAMETERS if not has_fields(draft.study.material, name)}  # already reported
    defined = {*draft.study.material.fixed(), *draft.growing, *wrong, *draft.names, *meant}
    defined |= set(_RATE if draft.study.solver.rate == "none" else ())
    for name, parameter in PARAMETERS.items():
        in_layers = [getattr(each, name) is not None or f"{each.name}_{name}" in draft.names for each in draft.layers]
        if name in defined or (in_layers and all(in_layers)):
            continue
        message = f"the {draft.study.solver.title} solver requires `{name}` (usual range: {parameter.usual})"
        remedy = "set the parameter in the `material` section, or add the parameter to `factors`"
        if name in _RATE and draft.study.solver.rate is not None:
            remedy = f"{remedy}; to neglect strain-rate effects, write `rate_law: none` in the `solver` section"
        yield Finding(("material",), message, remedy)


def _tangent_stays_below_elastic(draft: Draft) -> Iterator[Finding]:
    if not draft.kind.parameters:
        return
    for diameter in sorted({*draft.diameters.values()}):
        for layer in draft.layers or (None,):
            both = ("tangent_modulus", "elastic_modulus")
            tangents, elastics = (values_in(draft, layer, name, diameter) for name in both)
            path, tangent = max(tangents, key=itemgetter(1), default=((), 0.0))
            elastic = min((value for _, value in elastics), default=inf)
            if tangent >= elastic:
                message = f"the tangent modulus ({tangent:g} MPa) is not below the elastic modulus ({elastic:g} MPa)"
                yield Finding(path, message, "reduce `tangent_modulus`, or increase `elastic_modulus`")
                return


def values_in(
    draft: Draft, layer: LayerSection | None, name: str, diameter: float | None = None
) -> list[tuple[NodePath, Any]]:
    """Return (place in the spec, value) of each extreme value of a parameter in a layer, or else in the whole stem."""
    own = [] if layer is None else [*possible_values(draft, f"{layer.name}_{name}", diameter)]
    return own or [*possible_values(draft, name, diameter)]


def possible_values(draft: Draft, name: str, diameter: float | None = None) -> Iterator[tuple[NodePath, Any]]:
    """Yield the extreme values of a parameter (internal units or `Relative`) with their places in the spec.

    A value that depends on the diameter is evaluated at `diameter` (mm), or at all diameters of the study if None.
    """
    if (place := draft.places.get(name)) is None:
        return
    if name in _growing(draft):
        yield from ((place.path, value) for value in _reached(draft, name, diameter))
        return
    for index, factor in draft.factors.items():
        if factor.name == name and _unit_fits(draft, factor):
            for level in ("low", "high"):
                value = factor.internal(getattr(factor, level))
                is_ratio = place.parameter.relative and units.fits(factor.unit, "dimensionless")
                yield ("factors", index, level), Relative(value, is_ratio=True) if is_ratio else value
    if isinstance(fixed := place.value, int | float | Relative):
        yield place.path, fixed if not isinstance(fixed, Relative) or fixed.is_ratio else fixed.value
    elif diameter and isinstance(fixed, Length | Interpolated):
        yield place.path, fixed.at(diameter)


def _growing(draft: Draft) -> Mapping[str, Growth]:
    return draft.growing if has_fields(draft.study, "material") else {}


def _reached(draft: Draft, name: str, diameter: float | None = None) -> list[float]:
    """Return the values (internal units) of a `Growth` at the limits of its factors and all diameters of the study."""
    growth, at = draft.growing[name], {factor.name: factor for factor in draft.factors.values()}
    if name in at and not _unit_fits(draft, at[name]):
        return []
    levels = [at[name].internal(end) for end in (at[name].low, at[name].high)] if name in at else [None]
    exponents: list[dict[str, float]] = [{}]
    if isinstance(growth.exponent, str):
        factor = at.get(growth.exponent)
        if factor is None or max(abs(factor.low), abs(factor.high)) > MOST_EXPONENT:
            return []
        exponents = [{factor.name: factor.internal(end)} for end in (factor.low, factor.high)]
    if name not in at and growth.value is None:
        return []
    diameters = [diameter] if diameter else draft.diameters.values()
    return [growth.parameter_at(d, level, chosen) for d in diameters for level in levels for chosen in exponents]


def _unit_fits(draft: Draft, factor: Factor) -> bool:
    parameter = draft.places[factor.name].parameter
    fitting = (parameter.dimension, "dimensionless" if parameter.relative else parameter.dimension)
    return any(units.fits(factor.unit, dimension) for dimension in fitting)


def _exponents_are_factors(draft: Draft) -> Iterator[Finding]:
    known = {factor.name: index for index, factor in draft.factors.items()}
    for name, growth in draft.growing.items():
        path, exponent = (*draft.places[name].path, "exponent"), growth.exponent
        if not isinstance(exponent, str):
            continue
        if exponent in draft.places or exponent in EMBEDDED:
            pure = [name for name in draft.names if name not in {*EMBEDDED, *draft.places}]
            remedy = f"write a number, or the factor {listed(pure)}" if pure else "write a number, such as 0.5"
            yield Finding(path, f"the exponent cannot be the material parameter {exponent!r}", remedy)
        elif exponent not in draft.names:
            message = f"the exponent {exponent[:60]!r} is neither a number nor a factor of this study"
            yield Finding(path, message, f"add `{{name: {exponent[:40]}, low: -1, high: 2}}` to `factors`")
        elif exponent in known:
            factor, most = draft.factors[known[exponent]], f"{MOST_EXPONENT:g}"
            if factor.unit != "1":
                yield Finding(("factors", known[exponent]), "an exponent is dimensionless", "remove the unit")
            elif max(abs(factor.low), abs(factor.high)) > MOST_EXPONENT:
                message = f"the range of the exponent ({factor.low:g} to {factor.high:g}) exceeds ±{most}"
                yield Finding(("factors", known[exponent]), message, f"use values from -{most} to {most}")


RULES: tuple[Callable[[Draft], Iterator[Finding]], ...] = (
    _names_differ, _ranges_rise, _priors_fit, _factors_are_known, _values_are_physical, _material_is_set_once,
    _settings_are_set_once, _settings_act, _rate_parameters_are_used, _material_is_complete,
    _exponents_are_factors, _tangent_stays_below_elastic,
)  # fmt: skip
