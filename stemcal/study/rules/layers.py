"""Rules on layers, fibres, and a geometry that depends on the stem diameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import sqrt
from operator import itemgetter
from typing import Any

from stemcal.formats import series
from stemcal.study.model.growth import Interpolated
from stemcal.study.model.layers import MOST_LAYERS, LayerSection
from stemcal.study.model.shear_test import Relative
from stemcal.study.rules import Draft
from stemcal.study.rules.factors import extremes_of, possible_values, values_in
from stemcal.study.types.factor import PARAMETERS, TRANSVERSE
from stemcal.study.types.strict_yaml import Finding, NodePath

# Minimum number of elements through a layer; maximum ratio of the scaled mass of an element to its true mass.
_ELEMENTS, _MOST_MASS = 3, 100.0


def _solver_has_layers(draft: Draft) -> Iterator[Finding]:
    there = draft.study.there
    if draft.kind.has_layers and not there.kind.writes_decks:
        return
    sections: dict[NodePath, object] = {
        ("layers",): draft.study.layers,
        ("material", "transverse"): draft.study.material.transverse,
    }
    for path, section in sections.items():
        if section:
            message = f"the {there.solver.title} solver does not simulate layers and fibres"
            yield Finding(path, message, "remove this key, or use only the embedded solver", at_key=True)


def _layers_are_complete(draft: Draft) -> Iterator[Finding]:
    layers, seen = draft.study.layers, set[str]()
    if len(layers) == 1:
        message = "one layer is not enough"
        yield Finding(("layers",), message, f"remove this key, or list 2 to {MOST_LAYERS} layers from the outside")
    for index, layer in enumerate(layers):
        path: NodePath = ("layers", index)
        if layer.name in seen:
            message = f"another layer has the name {layer.name!r}"
            yield Finding((*path, "name"), message, "use a different name for each layer")
        if layer.name.endswith("transverse"):
            message = f"a layer cannot be named {layer.name!r}, because its factors would be those across the axis"
            yield Finding((*path, "name"), message, "choose another name")
        seen.add(layer.name)
        has_thickness = layer.thickness is not None or f"{layer.name}_thickness" in draft.names
        if index + 1 < len(layers) and not has_thickness:
            message = f"the layer {layer.name!r} has no thickness"
            remedy = f"add a line `thickness: …`, or add the factor `{layer.name}_thickness`"
            yield Finding(path, message, remedy)
        elif index + 1 == len(layers) > 1 and has_thickness:
            message = "the thickness of the innermost layer follows from those of the others"
            if layer.thickness is not None:
                yield Finding((*path, "thickness"), message, "remove this key", at_key=True)
            for at, factor in draft.factors.items():
                if factor.name == f"{layer.name}_thickness":
                    yield Finding(("factors", at, "name"), message, "remove this factor")


def _factors_act_in_a_layer(draft: Draft) -> Iterator[Finding]:
    for index, factor in draft.factors.items() if draft.layers and draft.kind.has_layers else ():
        each = [f"{layer.name}_{factor.name}" for layer in draft.layers]
        follow = [name for name in each if name in draft.places and draft.places[name].value is None]
        acts = factor.name in draft.places and factor.name.removeprefix("transverse_") in (*PARAMETERS, *TRANSVERSE)
        if acts and not {*follow} - {*draft.names}:
            message = f"{factor.name} has no effect, because no layer uses the value of the whole stem"
            remedy = f"remove this factor, or remove {series(each, 'or')} from its layer or from the factors"
            yield Finding(("factors", index, "name"), message, remedy)


def _bore_is_set_once(draft: Draft) -> Iterator[Finding]:
    specimen = draft.study.specimen
    if {"bore", "diameter_ratio"} <= specimen.model_fields_set:
        message = "`diameter_ratio` also sets the bore"
        yield Finding(("specimen", "bore"), message, "remove this key, or `diameter_ratio`", at_key=True)
    key = "diameter_ratio" if specimen.bore is None else "bore"
    for diameter in _diameters(draft):
        if _is_covered(getattr(specimen, key), diameter) and not 0.0 <= (ratio := specimen.ratio_at(diameter)) < 1.0:
            message = f"at a diameter of {diameter:g} mm, the bore is {ratio * diameter:.3g} mm"
            yield Finding(("specimen", key), message, "use a bore smaller than the diameter")
            return


def _measured_values_cover_the_diameters(draft: Draft) -> Iterator[Finding]:
    specimen = draft.study.specimen
    values: dict[NodePath, object] = {("specimen", key): getattr(specimen, key) for key in ("diameter_ratio", "bore")}
    values |= {("layers", i, "thickness"): layer.thickness for i, layer in enumerate(draft.layers)}
    for path, value in values.items():
        beyond = [f"{d:g} mm" for d in _diameters(draft) if not _is_covered(value, d)]
        if isinstance(value, Interpolated) and beyond:
            message = f"the value is measured at {value.range} only, but the study also uses {', '.join(beyond)}"
            lines = series(f"a line `{end}: …`" for end in dict.fromkeys((beyond[0], beyond[-1])))
            yield Finding(path, message, f"add {lines}, or use a power of the diameter")


def _layers_fit_the_wall(draft: Draft) -> Iterator[Finding]:
    specimen, outer = draft.study.specimen, draft.study.layers[:-1]
    size, thick, thin = specimen.bore or specimen.diameter_ratio, False, dict[NodePath, tuple[float, str]]()
    ratios = [value for _, value in possible_values(draft, "diameter_ratio")]
    for diameter in _diameters(draft) if outer else ():
        covered = all(_is_covered(each, diameter) for each in (size, *(layer.thickness for layer in outer)))
        each = [[*possible_values(draft, f"{layer.name}_thickness", diameter)] for layer in outer] if covered else []
        if not each or not all(each):
            return  # other rules report the missing values
        wall = 0.5 * diameter * (1.0 - max(ratios or [specimen.ratio_at(diameter)]))
        place, most = f"at a diameter of {diameter:g} mm, the", sum(max(mm for _, mm in values) for values in each)
        if most >= wall and not thick:
            thick, (path, _) = True, max(each[0], key=itemgetter(1))
            message = f"{place} layers are {most:.3g} mm thick, but the wall {wall:.3g} mm"
            yield Finding(path, message, "use thinner layers, or a smaller bore")
        for layer, values in zip(outer, each, strict=True):
            path, thinnest = min(values, key=itemgetter(1))
            least = _least_thickness(draft, layer, diameter)
            if thinnest < least * thin.get(path, (1.0,))[0]:
                message = f"{place} layer is {thinnest:.3g} mm thick, but {_ELEMENTS} elements require {least:.2g} mm"
                thin[path] = thinnest / least, f"{message} with the time step of the solver"
    for path, (_, message) in thin.items():
        step = 0.95 * draft.study.solver.time_step * min(thin.values())[0]  # type: ignore[attr-defined]
        yield Finding(path, message, f"write `time_step: {step:.2g} s` in the `solver` section")


def _least_thickness(draft: Draft, layer: LayerSection, diameter: float) -> float:
    """Return the thickness (mm) of a layer at which the solver's time step requires `_MOST_MASS` times the true mass.

    The stable time step of an element of size h is h √(ρ/C), with the modulus C of waves, which is at least E.
    """
    solver: Any = draft.study.solver
    if hasattr(solver, "at_speed"):
        solver = solver.at_speed(min(extremes_of(draft.study, draft.factors.values(), "speed")))
    names = ("elastic_modulus", "density")
    moduli, densities = ([value for _, value in values_in(draft, layer, name, diameter)] for name in names)
    if (step := getattr(solver, "time_step", None)) is None or not moduli or not densities:
        return 0.0
    speed = sqrt(max(moduli) / (min(densities) * solver.mass_scaling))
    return float(_ELEMENTS * speed * step / sqrt(_MOST_MASS))


def _is_covered(value: object, diameter: float) -> bool:
    return not isinstance(value, Interpolated) or value.covers(diameter)


def _diameters(draft: Draft) -> list[float]:
    if any(path[0] == "factors" for path in draft.diameters):  # the diameter is a factor
        return sorted(d for path, d in draft.diameters.items() if path[0] == "factors")
    written = "outer_diameter" in draft.study.specimen.model_fields_set
    all_ = draft.diameters
    targets = {d for path, d in all_.items() if path[0] == "targets"}
    return sorted(targets | {d for path, d in all_.items() if path[0] == "specimen" and (written or not targets)})


def _laws_are_possible(draft: Draft) -> Iterator[Finding]:
    for layer in draft.study.layers or (None,):
        prefix = "" if layer is None else f"{layer.name}_"
        if f"{prefix}transverse_yield_stress" not in draft.places:
            continue
        for diameter in _diameters(draft):
            findings = [*_stiffness(draft, layer, diameter), *_surface(draft, layer, diameter)]
            where = "" if layer is None else f"in the layer {layer.name!r}, "
            yield from (finding._replace(message=f"{where}{finding.message}") for finding in findings)
            if findings:
                break


def _surface(draft: Draft, layer: LayerSection | None, diameter: float) -> Iterator[Finding]:
    """Check that Hill's yield surface is closed: the yield stress across the axis is below twice that along it."""
    for path, ratio in _ratios(draft, layer, "yield_stress", diameter)[-1:]:
        if ratio >= 2.0:
            message = f"the yield stress across the axis is {ratio:.3g} times that along the axis"
            remedy = "reduce the yield stress across the axis to less than twice that along the axis"
            yield Finding(path, message, remedy)


def _stiffness(draft: Draft, layer: LayerSection | None, diameter: float) -> Iterator[Finding]:
    """Check that the elastic law is positive definite: ν_TT + 2 ν² E_T/E < 1."""
    axial = max((value for _, value in values_in(draft, layer, "poisson_ratio", diameter)), default=0.0)
    along: tuple[NodePath, float] = ("material",), axial
    path, plane = max(_across(draft, layer, "poisson_ratio", diameter), key=itemgetter(1), default=along)
    ratios = _ratios(draft, layer, "elastic_modulus", diameter)
    path, ratio = ratios[-1] if ratios else (path, 1.0)
    if plane + 2.0 * axial * axial * ratio >= 1.0:
        message = (
            f"the elastic law is not positive definite (Poisson's ratio {axial:g} along the axis and {plane:g} across, "
            f"modulus ratio {ratio:.3g})"
        )
        yield Finding(path, message, "reduce the Poisson's ratios or the modulus across the axis")


def _ratios(draft: Draft, layer: LayerSection | None, name: str, diameter: float) -> list[tuple[NodePath, float]]:
    """Return [(place in the spec, ratio)] of the largest ratio of a stress across the axis to that along it, or []."""
    along = [value for _, value in values_in(draft, layer, name, diameter)]
    each = [
        (path, value.value if isinstance(value, Relative) else value / min(along))
        for path, value in _across(draft, layer, name, diameter)
        if isinstance(value, Relative) or along
    ]
    return sorted(each, key=itemgetter(1))[-1:]


def _across(draft: Draft, layer: LayerSection | None, name: str, diameter: float) -> list[tuple[NodePath, Any]]:
    own = [] if layer is None else [*possible_values(draft, f"{layer.name}_transverse_{name}", diameter)]
    return own or [*possible_values(draft, f"transverse_{name}", diameter)]


RULES: tuple[Callable[[Draft], Iterator[Finding]], ...] = (
    _solver_has_layers, _layers_are_complete, _factors_act_in_a_layer, _bore_is_set_once,
    _measured_values_cover_the_diameters, _layers_fit_the_wall, _laws_are_possible,
)  # fmt: skip
