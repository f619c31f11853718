"""The calibrated material of a finished study (`material: {from: FOLDER}`), and other materials that fit as well.

The spec uses all settings on which the calibrated values depend: cross-section of the stem, layers, friction, lengths,
material law and mesh. If the spec itself sets such a key, the value must be that of the calibration. The other
materials are one standard deviation away along the principal axes of the covariance Σ = (JᵀWJ + D)⁻¹ of the
calibration. JᵀWJ is the information of the likelihood at the solution; D is the information of the ranges (uniform,
12/width²), which limits directions that the measurements do not determine.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stemcal.errors import SpecError
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fitting import Surfaces, fit_of_study
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.stages.verdict.words import brief
from stemcal.study.model.shear_test import ContactSection, MaterialSection, Relative, TransverseSection
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.factor import FRICTION, PARAMETERS, SETTINGS, in_unit
from stemcal.study.types.field_types import field_or_none
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.study.types.units import fits, from_internal

_FROM: NodePath = ("material", "from")
_SHARED: dict[str, tuple[str, ...]] = {
    "specimen": ("diameter_ratio", "bore"),
    "blade": ("edge_spread",),
    "contact": tuple(ContactSection.model_fields),
    "material": tuple(MaterialSection.model_fields),
    "solver": ("rate_law", "element_size", "elements_through_wall", "edge_over", "hourglass", "nonlocal_failure"),
}
_CLOSE = 1e-6  # relative tolerance of diameters
_FASTER = 100.0  # with a blade faster by this factor, strain rates can exceed the C of the rate law
_DIRECTIONS, _LEAST = 3, 0.01  # at most this number of principal axes of Σ, each with at least this share of its trace


@dataclass
class Borrowed:
    """Sections of a spec with the material of a calibration, and the mistakes found in spec and calibration."""

    sections: dict[str, Any] = field(default_factory=dict)
    others: list[dict[str, Any]] = field(default_factory=list)  # sections that each other material changes
    findings: list[Finding] = field(default_factory=list)
    pending: str = ""  # message if the calibration has not been run

    def add(self, message: str, remedy: str, path: NodePath = _FROM) -> None:
        self.findings.append(Finding(path, message, remedy))


def completed(own: Mapping[str, Any], data: Mapping[str, Any], folder: Path) -> Borrowed:
    """Return the sections of a spec, completed by the calibrated material of the study that `material.from` names.

    `folder` is the folder of the spec, `own` are its sections as read, `data` the values as written.
    """
    borrowed, name = Borrowed(), own["material"].from_
    place, alongside = StudyFolder((folder / name).resolve()), folder / f"{Path(name).name}.yaml"
    spec = place.remembered_spec()
    spec = alongside if (spec is None or not spec.is_file()) and alongside.is_file() else spec
    if spec is None or not spec.is_file():
        message = f"{name[:100]} does not exist" if not place.path.is_dir() else f"{name[:100]} has no spec"
        borrowed.add(message, "run the calibration that writes this folder with `stemcal run SPEC`")
        return borrowed
    try:
        source = load_study(spec)
    except SpecError as error:
        borrowed.add(f"the spec of the study has mistakes: {error.problems[0]}", "correct them")
        return borrowed
    if own.get("name") == source.name:  # both studies would have the same folder
        borrowed.add("the calibration has the same name and would be overwritten", "write another name", ("name",))
    levels = source.midlevels()
    if not place.path.is_dir():
        borrowed.pending = (
            f"material.from: {name} does not exist. Run `stemcal run {_shown(spec)}` first; until then, `check` uses "
            "the middle of its ranges."
        )
    elif (results := _finished(borrowed, source, place, _shown(spec))) is not None:
        levels = {**levels, **results.parameters}
        borrowed.others = [calibrated_sections(source, other) for other in _other_levels(source, results)]
    if not borrowed.findings:
        _add_sections(borrowed, source, levels, own, data)
        loading = own.get("loading", source.loading)
        speeds = [each.internal(each.high) for each in own.get("factors", {}).values() if each.name == "speed"]
        fastest = max([*speeds, loading.speed])
        if source.solver.rate == "paper" and fastest > _FASTER * source.loading.speed:
            message = (
                f"`rate_law: paper` is valid near the speed of the calibration ({source.loading.speed:.3g} mm/s), but "
                f"the blade has up to {fastest:g} mm/s, at which the law multiplies the yield stress"
            )
            borrowed.add(message, "calibrate the material with `solver: {rate_law: none}`")
    return borrowed


def _shown(spec: Path) -> str:
    here = Path.cwd()
    return spec.relative_to(here).as_posix() if spec.is_relative_to(here) else str(spec)


def _finished(borrowed: Borrowed, source: Study, place: StudyFolder, spec: str) -> Results | None:
    """Return the results of a study that is finished, fresh and calibrated; otherwise add a mistake and return None."""
    results = fresh_results(source, place)
    again = f"run `stemcal run {spec}`"
    if results.stale:
        why = re.split("[.;] run ", results.stale[0], flags=re.IGNORECASE)[0]  # one stage, without the remedy
        borrowed.add(f"the study is out of date: {why}", again)
    elif not results.calibrated:
        borrowed.add("the study is not calibrated yet", again)
    elif not (verdict := verdict_of(source, place, results)).holds:
        borrowed.add(f"the study is not calibrated: {brief(verdict.reasons[0])}", f"correct it, then {again}")
    return None if borrowed.findings else results


def calibrated_sections(source: Study, levels: Mapping[str, float]) -> dict[str, Any]:
    """Return the sections `material`, `layers` and `contact` of a study with these levels of its factors."""
    study = source.at(levels)  # sets the friction
    internal = {factor.name: factor.internal(levels[factor.name]) for factor in source.factors}
    for name, place in source.places.items():
        if name in internal and name not in (*SETTINGS, FRICTION):
            value: Any = internal[name]
            if place.parameter.relative:
                value = Relative(value, is_ratio=fits(source.factor(name).unit, "dimensionless"))
            study = _with(study, place.path, value)
    for index, part in enumerate((study.material, *study.layers)):
        for name, growth in part.growing().items():
            path: NodePath = ("material", name) if index == 0 else ("layers", index - 1, name)
            if isinstance(growth.exponent, str):
                study = _with(study, (*path, "exponent"), internal[growth.exponent])
    return {name: getattr(study, name) for name in ("material", "layers", "contact")}


def _with(part: Any, path: NodePath, value: Any) -> Any:
    """Return a section, or a tuple of sections, with a new value at a path; a growth law gets it as its `value`."""
    step, rest = path[0], path[1:]
    old = part[step] if isinstance(step, int) else getattr(part, step)
    if rest:
        value = _with(TransverseSection() if old is None else old, rest, value)
    elif hasattr(old, "exponent"):
        value = old.model_copy(update={"value": value})
    if isinstance(step, int):
        return (*part[:step], value, *part[step + 1 :])
    return part.model_copy(update={step: value})


def _add_sections(
    borrowed: Borrowed, source: Study, levels: Mapping[str, float], own: Mapping[str, Any], data: Mapping[str, Any]
) -> None:
    """Add the `material` and other sections of the calibration; add a mistake for each key that differs in the spec."""
    kind = own["solver"].kind if "solver" in own else source.solver.kind
    if not source.kind.parameters or kind != source.solver.kind:
        message = f"the material is calibrated with `kind: {source.solver.kind}`, but this study has `kind: {kind}`"
        borrowed.add(message, f"use `solver: {{kind: {source.solver.kind}}}`, or calibrate with this solver")
        return
    theirs = {name: getattr(source, name) for name in _SHARED} | calibrated_sections(source, levels)
    varied = {factor.name for factor in own.get("factors", {}).values()}
    for name in (name for name in _SHARED if name in own):
        section, other = own[name], theirs[name]
        keys = [key for key in _SHARED[name] if key in type(section).model_fields and key not in varied]
        for key in (key for key in keys if key in section.model_fields_set):
            if getattr(section, key) != (value := getattr(other, key)):
                shown = "not set" if value is None else f"{value:g}" if isinstance(value, float) else value
                if isinstance(value, float) and key in PARAMETERS:
                    shown = in_unit(from_internal(value, PARAMETERS[key].unit), PARAMETERS[key].unit)
                message = f"{data[name][key]} differs from the calibration ({key}: {shown})"
                borrowed.add(message, "remove this key", (name, key))
        changes = {key: getattr(other, key) for key in keys if key in other.model_fields_set}
        if name == "solver":
            set_here = {key: getattr(section, key) for key in section.model_fields_set}
            section, changes = other, {**set_here, **changes}
        if name != "contact" or FRICTION not in varied:
            borrowed.sections[name] = section.model_copy(update=changes)
    if own.get("layers") and own["layers"] != source.layers:
        borrowed.add("the layers differ from those of the calibration", "remove this key", ("layers",))
    for sections in (theirs, *borrowed.others):  # keys that are factors of this spec are not set
        by_factor = [{f"{layer.name}_{key}": key for key in (*PARAMETERS, "thickness")} for layer in sections["layers"]]
        unset = [{each[name]: None for name in each.keys() & varied} for each in by_factor]
        both = zip(sections["layers"], unset, strict=True)
        sections["layers"] = tuple(layer.model_copy(update=changes) for layer, changes in both)
    borrowed.sections["layers"] = theirs["layers"]
    measured = [target.condition for target in source.targets.means]
    diameters: dict[NodePath, float | None] = {}  # stem diameters in the spec; None: the calibration diameter
    diameters["specimen", "outer_diameter"] = field_or_none(own.get("specimen"), "outer_diameter")
    for index, factor in own.get("factors", {}).items():
        if factor.name == "outer_diameter":
            diameters |= {("factors", index, end): factor.internal(getattr(factor, end)) for end in ("low", "high")}
    for path, mm in diameters.items():
        if mm is not None and not (1.0 - _CLOSE) * min(measured) <= mm <= (1.0 + _CLOSE) * max(measured):
            ends = f"{min(measured):g} to {max(measured):g} mm"
            message = f"{mm:g} mm is outside the diameters of the calibration ({ends})"
            borrowed.add(message, "use a diameter within them", path)


def _other_levels(source: Study, results: Results) -> Iterator[dict[str, float]]:
    """Yield levels at one standard deviation from the calibrated ones, along the widest principal axes of Σ."""
    if (surface := next((result for result in results.done if isinstance(result, Surfaces)), None)) is None:
        return  # calibrated without a surface, so the uncertainty is unknown
    region = surface.region
    ranges = 12.0 / (region.high - region.low) ** 2
    sizes, axes = np.linalg.eigh(fit_of_study(source, surface).tangents.information + np.diag(ranges))
    variances = 1.0 / sizes
    best = surface.scales.to_coded([results.parameters[name] for name in surface.names])
    for variance, axis in list(zip(variances, axes.T, strict=True))[:_DIRECTIONS]:
        if variance >= _LEAST * variances.sum():
            both = (best + sign * variance**0.5 * axis for sign in (1.0, -1.0))
            ends = [np.clip(end, region.low, region.high) for end in both]
            x = min(ends, key=lambda end: -np.linalg.norm(end - best))
            yield {**source.midlevels(), **results.parameters, **surface.scales.levels(x)}
