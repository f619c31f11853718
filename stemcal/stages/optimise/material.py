"""The calibrated material of a finished study (`material: {from: FOLDER}`), and materials that it also allows.

A spec takes all that the calibrated values depend on: the section of the stem, layers, friction, lengths, the law and
the mesh. A key that it sets itself must agree. The other materials are one standard deviation away, along the principal
axes of the covariance Σ = (JᵀWJ + D)⁻¹ of the calibration: JᵀWJ is the information of its likelihood at the solution,
and D that of the ranges (uniform, 12/width²), which ends what the measurements leave free.
"""

from __future__ import annotations

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
from stemcal.study.types.factor import FRICTION, SETTINGS
from stemcal.study.types.field_types import field_or_none
from stemcal.study.types.strict_yaml import Finding, NodePath

_FROM: NodePath = ("material", "from")
_TAKEN: dict[str, tuple[str, ...]] = {
    "specimen": ("diameter_ratio", "bore"),
    "blade": ("edge_spread",),
    "contact": tuple(ContactSection.model_fields),
    "material": tuple(MaterialSection.model_fields),
    "solver": ("rate_law", "element_size", "elements_through_wall", "edge_over", "hourglass", "nonlocal_failure"),
}
_CLOSE = 1e-6
_DIRECTIONS, _LEAST = 3, 0.01  # at most so many other materials; the part of the variance below which one is left out


@dataclass
class Taken:
    """Sections of a spec with its material, the same of other materials, the mistakes, and what must be run before."""

    sections: dict[str, Any] = field(default_factory=dict)
    others: list[dict[str, Any]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    pending: str = ""

    def find(self, message: str, remedy: str, path: NodePath = _FROM) -> None:
        """Add a mistake."""
        self.findings.append(Finding(path, message, remedy))


def completed(own: Mapping[str, Any], data: Mapping[str, Any], folder: Path) -> Taken:
    """Return the sections of a spec in `folder`, which has `own` ones, with the material of the study that it names."""
    taken, given = Taken(), own["material"].from_
    place, beside = StudyFolder(folder / given), folder / f"{Path(given).name}.yaml"
    spec = place.remembered_spec()
    spec = beside if (spec is None or not spec.is_file()) and beside.is_file() else spec
    if spec is None or not spec.is_file():
        message = f"{given[:100]} does not exist" if not place.path.is_dir() else f"{given[:100]} has no spec"
        taken.find(message, "run the calibration that writes this folder with `stemcal run SPEC`")
        return taken
    try:
        source = load_study(spec)
    except SpecError as error:
        taken.find(f"the spec of the study has mistakes: {error.problems[0]}", "correct them")
        return taken
    levels = source.midlevels()
    if not place.path.is_dir():
        taken.pending = (
            f"material.from: {given} does not exist. Run `stemcal run {_shown(spec)}` first; until then, `check` uses "
            "the middle of its ranges."
        )
    elif (results := _finished(taken, source, place, _shown(spec))) is not None:
        levels = {**levels, **results.parameters}
        taken.others = [calibrated_sections(source, other) for other in _other_levels(source, results)]
    if not taken.findings:
        _take(taken, source, levels, own, data)
    return taken


def _shown(spec: Path) -> str:
    """Return a path as one types it here."""
    here = Path.cwd()
    return spec.relative_to(here).as_posix() if spec.is_relative_to(here) else str(spec)


def _finished(taken: Taken, source: Study, place: StudyFolder, spec: str) -> Results | None:
    """Return the results of a study that is finished, up to date and calibrated; find what it is not."""
    results = fresh_results(source, place)
    again = f"run `stemcal run {spec}`"
    if results.stale:
        taken.find(f"the study is out of date: {results.stale[0]}", again)
    elif not results.calibrated:
        taken.find("the study is not calibrated yet", again)
    elif not (verdict := verdict_of(source, place, results)).holds:
        taken.find(f"the study is not calibrated: {brief(verdict.reasons[0])}", f"correct it, then {again}")
    return None if taken.findings else results


def calibrated_sections(source: Study, levels: Mapping[str, float]) -> dict[str, Any]:
    """Return the sections of the material of a study at these levels."""
    found = source.at(levels)  # with the friction
    internal = {one.name: one.internal(levels[one.name]) for one in source.factors}
    for name, place in source.places.items():
        if name in internal and name not in (*SETTINGS, FRICTION):
            value: Any = internal[name]
            if place.parameter.relative:
                value = Relative(value, is_ratio=source.factor(name).unit == "1")
            found = _with(found, place.path, value)
    for index, part in enumerate((found.material, *found.layers)):
        for name, growth in part.growing().items():
            path: NodePath = ("material", name) if index == 0 else ("layers", index - 1, name)
            if isinstance(growth.exponent, str):
                found = _with(found, (*path, "exponent"), internal[growth.exponent])
    return {name: getattr(found, name) for name in ("material", "layers", "contact")}


def _with(part: Any, path: NodePath, value: Any) -> Any:
    """Return a section, or a tuple of sections, with a value at a path; a growing parameter has it as its `value`."""
    step, rest = path[0], path[1:]
    old = part[step] if isinstance(step, int) else getattr(part, step)
    if rest:
        value = _with(TransverseSection() if old is None else old, rest, value)
    elif hasattr(old, "exponent"):
        value = old.model_copy(update={"value": value})
    if isinstance(step, int):
        return (*part[:step], value, *part[step + 1 :])
    return part.model_copy(update={step: value})


def _take(
    taken: Taken, source: Study, levels: Mapping[str, float], own: Mapping[str, Any], data: Mapping[str, Any]
) -> None:
    """Add the sections; find keys of the spec that differ from the calibration."""
    kind = own["solver"].kind if "solver" in own else source.solver.kind
    if not source.kind.parameters or kind != source.solver.kind:
        message = f"the material is calibrated with `kind: {source.solver.kind}`, but this study has `kind: {kind}`"
        taken.find(message, f"use `solver: {{kind: {source.solver.kind}}}`, or calibrate with this solver")
        return
    theirs = {name: getattr(source, name) for name in _TAKEN} | calibrated_sections(source, levels)
    varied = {factor.name for factor in own.get("factors", {}).values()}
    for name in (name for name in _TAKEN if name in own):
        section, other = own[name], theirs[name]
        keys = [key for key in _TAKEN[name] if key in type(section).model_fields and key not in varied]
        for key in (key for key in keys if key in section.model_fields_set):
            if getattr(section, key) != (value := getattr(other, key)):
                shown = f"{value:g}" if isinstance(value, float) else value
                message = f"{data[name][key]} differs from the calibration ({key}: {shown})"
                taken.find(message, "remove this key", (name, key))
        changes = {key: getattr(other, key) for key in keys if key in other.model_fields_set}
        if name == "solver":
            set_here = {key: getattr(section, key) for key in section.model_fields_set}
            section, changes = other, {**set_here, **changes}
        if name != "contact" or FRICTION not in varied:
            taken.sections[name] = section.model_copy(update=changes)
    if own.get("layers") and own["layers"] != source.layers:
        taken.find("the layers differ from those of the calibration", "remove this key", ("layers",))
    taken.sections["layers"] = theirs["layers"]
    measured = [target.condition for target in source.targets.means]
    diameter = field_or_none(own.get("specimen"), "outer_diameter")  # without one that of the calibration
    if diameter is not None and not (1.0 - _CLOSE) * min(measured) <= diameter <= (1.0 + _CLOSE) * max(measured):
        ends = f"{min(measured):g} to {max(measured):g} mm"
        message = f"{diameter:g} mm is outside the diameters of the calibration ({ends})"
        taken.find(message, "use a diameter within them", ("specimen", "outer_diameter"))


def _other_levels(source: Study, results: Results) -> Iterator[dict[str, float]]:
    """Yield the calibrated levels one standard deviation away along each principal axis, the widest first."""
    if (surface := next((one for one in results.done if isinstance(one, Surfaces)), None)) is None:
        return  # calibrated without a surface, and so without intervals
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
