"""The calibrated material of a finished study (`material: {from: FOLDER}`), and materials that it also allows.

A spec takes all that the calibrated values depend on: the section of the stem, layers, friction, lengths, the law and
the mesh. A key that it sets itself must agree. The other materials are one standard deviation away, along the principal
axes of the covariance Σ = (JᵀWJ + D)⁻¹ of the calibration: JᵀWJ is the information of its likelihood at the solution,
and D that of the ranges (uniform, 12/width²), which ends what the measurements leave free.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from stemcal.errors import SpecError
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fitting import Surfaces, fit_of_study
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.stages.verdict.words import brief
from stemcal.storage.plain import read_plain
from stemcal.study.model.shear_test import MaterialSection
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types import units
from stemcal.study.types.factor import FRICTION, SETTINGS
from stemcal.study.types.strict_yaml import MAX_BYTES, Finding, NodePath, read_yaml

_FROM: NodePath = ("material", "from")
_TAKEN: dict[str, tuple[str, ...]] = {
    "specimen": ("diameter_ratio", "bore"),
    "blade": ("edge_spread",),
    "contact": ("static_friction", "dynamic_friction", "decay", "penalty"),
    "solver": ("rate_law", "element_size", "elements_through_wall", "edge_over", "hourglass", "nonlocal_failure"),
}
_OF_MATERIAL = ("material", "layers", "contact")
_CLOSE = 1e-6
_DIRECTIONS, _LEAST = 3, 0.01  # at most so many other materials; the part of the variance below which one is left out


@dataclass
class Taken:
    """The spec with its material, other materials as its sections, the mistakes, and what must be run before."""

    data: dict[str, Any]
    others: list[dict[str, Any]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    pending: str = ""

    def find(self, message: str, remedy: str, path: NodePath = _FROM) -> None:
        """Add a mistake."""
        self.findings.append(Finding(path, message, remedy))


def completed(data: Mapping[str, Any], folder: Path) -> Taken:
    """Return the tree of a spec in `folder` with the material of the study that it names."""
    taken, given = Taken({**data, "material": dict(data["material"])}), data["material"]["from"]
    if not isinstance(given, str) or not given.strip():
        taken.find("the value is not a folder", "write the folder of a study, such as `../runs/wild-chrysanthemum`")
        return taken
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
    tree = read_yaml(read_plain(spec, MAX_BYTES)).data
    levels = source.midlevels()
    if not place.path.is_dir():
        taken.pending = (
            f"material.from: {given} does not exist. Run `stemcal run {_shown(spec)}` first; until then, `check` uses "
            "the middle of its ranges."
        )
    elif (results := _finished(taken, source, place, _shown(spec))) is not None:
        levels = {**levels, **results.parameters}
        taken.others = [_sections(source, tree, other) for other in _other_levels(source, results)]
    if not taken.findings:
        _take(taken, source, tree, levels)
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


# ---- the sections


def _sections(source: Study, tree: Mapping[str, Any], levels: Mapping[str, float]) -> dict[str, Any]:
    """Return the sections of the material of a study at these levels, as a spec has them."""
    found = {"material": {}, **{name: copy.deepcopy(tree[name]) for name in _OF_MATERIAL if name in tree}}
    found["material"].pop("from", None)
    known = {one.name: _written(levels[one.name], one.unit) for one in source.factors}
    for name, place in source.places.items():
        if name in known and name not in SETTINGS:
            *above, key = (step for step in place.path if name != FRICTION)
            section: Any = found
            for step in above:
                section = section.setdefault(step, {}) if isinstance(section, dict) else section[step]
            old = section.get(key)
            section[key] = {**old, "value": known[name]} if isinstance(old, dict) else known[name]
    if FRICTION in known:
        found["contact"] = {**found.get("contact", {}), "static_friction": known[FRICTION], "decay": "0 s/m"}
        found["contact"]["dynamic_friction"] = known[FRICTION]
    return {name: _with_exponents(part, known) for name, part in found.items()}


def _written(level: float, unit: str) -> Any:
    return float(f"{level:.12g}") if unit == "1" else f"{level:.12g} {unit}"


def _with_exponents(part: Any, known: Mapping[str, Any]) -> Any:
    """Return a part of a spec with the levels of exponents that were factors."""
    if isinstance(part, list):
        return [_with_exponents(one, known) for one in part]
    if not isinstance(part, dict):
        return part
    each = {key: _with_exponents(value, known) for key, value in part.items()}
    return each | ({"exponent": known[each["exponent"]]} if each.get("exponent") in known else {})


def _take(taken: Taken, source: Study, tree: Mapping[str, Any], levels: Mapping[str, float]) -> None:
    """Add the material to a spec; find keys that differ from those of the calibration."""
    kind = (taken.data.get("solver") or {}).get("kind", "embedded")
    if not source.kind.parameters or kind != source.solver.kind:
        message = f"the material is calibrated with `kind: {source.solver.kind}`, but this study has `kind: {kind}`"
        taken.find(message, f"use `solver: {{kind: {source.solver.kind}}}`, or calibrate with this solver")
        return
    sections = _sections(source, tree, levels)
    keys = {"material": {**dict.fromkeys(MaterialSection.model_fields), **sections["material"]}}
    for name, names in _TAKEN.items():
        part = {**(tree.get(name) or {}), **(sections.get(name) or {})}
        keys[name] = {key: part.get(key) for key in names}
    varied = {str(one.get("name")) for one in taken.data.get("factors") or () if isinstance(one, dict)}
    for name, each in keys.items():
        own = taken.data[name] if isinstance(taken.data.get(name), dict) else {}
        for key, value in each.items():
            if key in own and not _same(source, name, key, own[key], value):
                usual = value if value is not None else getattr(getattr(source, name), key, None)
                message = f"{own[key]} differs from the calibration ({key}: {usual})"
                taken.find(message, "remove this key", (name, key))
        kept = {key: value for key, value in each.items() if value is not None and key not in varied}
        taken.data[name] = {**kept, **own} if kept or own else {}
    if "layers" in taken.data and taken.data["layers"] != tree.get("layers"):
        taken.find("the layers differ from those of the calibration", "remove this section", ("layers",))
    taken.data |= {name: sections[name] for name in ("layers",) if name in sections}
    _check_diameter(taken, source)


def _same(source: Study, section: str, key: str, own: Any, value: Any) -> bool:
    """Compare a key of a spec with that of the calibration, both as they are read."""
    kind, context = type(getattr(source, section)), {"spec": source.source.parent}
    base = {"kind": source.solver.kind} if section == "solver" else {}
    if section == "solver" and source.solver.kind == "deck":
        base["program"] = source.solver.program_name
    try:
        mine, theirs = (
            getattr(kind.model_validate({**base, **({} if one is None else {key: one})}, context=context), key)
            for one in (own, value)
        )
    except (ValidationError, TypeError):
        return True  # the reader of the section finds the mistake
    return bool(mine == theirs)


def _check_diameter(taken: Taken, source: Study) -> None:
    """Find a stem outside the calibrated diameters; by default it is the one of the calibration."""
    measured = [target.condition for target in source.targets.means]
    specimen = taken.data.setdefault("specimen", {})
    given = specimen.setdefault("outer_diameter", f"{source.targets.calibrate_at:g} mm")
    try:
        diameter = units.parse(given, "length")
    except (units.UnitError, AttributeError, TypeError):
        return
    if not (1.0 - _CLOSE) * min(measured) <= diameter <= (1.0 + _CLOSE) * max(measured):
        message = f"{given} is outside the diameters of the calibration ({min(measured):g} to {max(measured):g} mm)"
        taken.find(message, "use a diameter within them", ("specimen", "outer_diameter"))


# ---- other materials that the calibration allows


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
            ends = [best + sign * variance**0.5 * axis for sign in (1.0, -1.0)]
            x = min(
                (np.clip(end, region.low, region.high) for end in ends), key=lambda end: -np.linalg.norm(end - best)
            )
            yield {**source.midlevels(), **results.parameters, **surface.scales.levels(x)}
