"""Advice for a model that is isotropic although tests along and across the axis require different elastic moduli.

While a piece is elastic its slope is proportional to E, so that a test requires E times measured over simulated slope.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import exp, hypot, inf, log

from stemcal.doe.comparison import standard_error
from stemcal.formats import outwards, series, short
from stemcal.notes import Note, Remedy
from stemcal.stages.fitting import Surfaces, fitted_surfaces, measured_means
from stemcal.stages.verdict.verdict_rules import Evidence
from stemcal.study.model.study import Study
from stemcal.vocabulary import DIAMETER

_E, _ACROSS = "elastic_modulus", "transverse_elastic_modulus"
_NORMAL = 1.96
_WIDER = 2.0  # the ranges of both moduli reach from half to twice the required ones


@dataclass(frozen=True)
class Required:
    """What the tests in one direction require: their names, the factor on E, and its relative standard error."""

    tests: tuple[str, ...]
    factor: float
    error: float | None


def direction_reason(evidence: Evidence, surface: Surfaces, solution: Mapping[str, float]) -> Iterator[Note]:
    """Yield the moduli that the slopes along and across the axis require, if one modulus cannot give both."""
    study = evidence.study
    if study.naming.condition != DIAMETER or not study.tests or study.is_layered:
        return
    each = _required(study, surface, solution)
    if len(each) < 2:
        return
    along, across = each[False], each[True]
    apart = abs(log(along.factor / across.factor))
    known = None if along.error is None or across.error is None else hypot(along.error, across.error)
    if apart < 2.0 * log(1.0 + 0.01 * evidence.equivalent_percent) or (known is not None and apart < _NORMAL * known):
        return
    modulus = study.parameters(solution, study.calibration_target.condition)[_E]
    first, second = (f"{short(modulus * one.factor, 3)} MPa" for one in (along, across))
    text = (
        f"The tests require different elastic moduli: {series(along.tests)} requires {first}, {series(across.tests)} "
        f"{second}. The model is isotropic, so no value of its elastic modulus reproduces both slopes."
    )
    remedy = _to_transverse(study, surface, solution, along.factor * modulus, across.factor * modulus)
    yield Note("anisotropy", "error" if evidence.mostly_off else "warning", text, remedy)


def _required(study: Study, surface: Surfaces, solution: Mapping[str, float]) -> dict[bool, Required]:
    """Return what the slopes require, across the axis (True) and along it: the geometric mean over tests, diameters."""
    point, found = surface.scales.to_coded([solution[name] for name in surface.names]), dict[bool, Required]()
    pairs = list(zip(measured_means(study), fitted_surfaces(study, surface), strict=True))
    for across in (False, True):
        tests = {test.called("slope"): test.name for test in study.tests if test.across_axis is across}
        rows = [
            (tests[mean.response], log(mean.value / slope), standard_error(mean.value, mean.sd, mean.n))
            for mean, fitted in pairs
            if mean.response in tests and mean.value > 0.0 and (slope := float(fitted.predict(point)[0])) > 0.0
        ]
        if rows:
            names, logs, errors = zip(*rows, strict=True)
            known = None if None in errors else 0.01 * hypot(*errors) / len(rows)
            found[across] = Required(tuple(dict.fromkeys(names)), exp(sum(logs) / len(rows)), known)
    return found


def _to_transverse(
    study: Study, surface: Surfaces, solution: Mapping[str, float], along: float, across: float
) -> Remedy:
    """Return the YAML of `material.transverse` with the modulus across as a factor; `along` and `across` in MPa."""
    levels, ratio = {**study.midlevels(), **solution}, "poisson_ratio"
    nu = study.factor(ratio).high if ratio in study.names else study.parameters(levels)[ratio]
    most = 0.95 * (1.0 - nu) / (2.0 * nu * nu) * along / _WIDER if nu else inf  # positive definite in all ranges
    if not study.kind.has_layers or across > most:
        return Remedy("Check the units of both slopes, and the specimens of both tests.")
    factors, material = [f"{{name: {_ACROSS}, unit: MPa, {_range(across, most)}}}"], "transverse: {}"
    if varied := [_E] if _E in study.names else []:
        level = levels[_E] * along / study.parameters(levels)[_E]
        factors.append(f"{{name: {_E}, {_range(level)}}}")
    else:
        value = f"{along:.3g} MPa"
        grows = _E in study.material.growing()
        material += f", {_E}: {f'{{value: {value}}}' if grows else value}"
    varied = list(dict.fromkeys([*surface.names, *varied, _ACROSS]))
    edit = [
        f"material: {{{material}}}",
        f"factors: [{', '.join(factors)}]",
        "screen: {design: none}",
        f"rsm: {{factors: [{', '.join(varied)}]}}",
    ]
    text = "Calibrate the modulus across the axis as well. Merge into the spec:"
    return Remedy(f"{text} `{{{', '.join(edit)}}}`.", "\n".join(edit))


def _range(value: float, most: float = inf) -> str:
    """Return half and twice a value as the range of a factor in YAML."""
    return f"low: {outwards(value / _WIDER, False):g}, high: {min(outwards(value * _WIDER, True), most):.4g}"
