"""Advice if tests along and across the axis require different elastic moduli of an isotropic model.

In the elastic range the slope of a test is proportional to E, so the required modulus is E times measured over
simulated slope.
"""

from collections.abc import Iterator, Mapping
from math import exp, hypot, inf, log, nan

from stemcal.doe.comparison import NORMAL, standard_error
from stemcal.formats import outwards, series, significant
from stemcal.notes import Note, Remedy
from stemcal.stages.fitting import Surfaces, fitted_surfaces, measured_means
from stemcal.stages.verdict.verdict_rules import Evidence
from stemcal.study.model.study import Study
from stemcal.vocabulary import DIAMETER

_E, _ACROSS = "elastic_modulus", "transverse_elastic_modulus"
_WIDER = 2.0  # the ranges of both moduli reach from half to twice the required ones


def direction_reason(evidence: Evidence, surface: Surfaces, solution: Mapping[str, float]) -> Iterator[Note]:
    """Yield a note with the moduli that the slopes along and across the axis require, if they differ."""
    study = evidence.study
    if study.naming.condition != DIAMETER or not study.tests or study.is_layered:
        return
    along, across = (_required(study, surface, solution, across) for across in (False, True))
    if along is None or across is None:
        return
    apart, known = abs(log(along[1] / across[1])), hypot(along[2], across[2])
    if apart < 2.0 * log(1.0 + 0.01 * evidence.equivalent_percent) or apart < NORMAL * known:
        return
    modulus = study.parameters(solution, study.calibration_target.condition)[_E]
    first, second = (f"{significant(modulus * times, 3)} MPa ({series(names)})" for names, times, _ in (along, across))
    text = (
        f"The tests require different elastic moduli: {first} and {second}. The model is isotropic, so no value of its "
        "elastic modulus reproduces both slopes."
    )
    remedy = _to_transverse(study, surface, solution, along[1] * modulus, across[1] * modulus)
    yield Note("anisotropy", "error" if evidence.mostly_off else "warning", text, remedy)


def _required(
    study: Study, surface: Surfaces, solution: Mapping[str, float], across: bool
) -> tuple[list[str], float, float] | None:
    """Return the tests along (or across) the axis, the mean ratio of required to present E, and its relative error."""
    point = surface.scales.to_coded([solution[name] for name in surface.names])
    tests = {test.called("slope"): test.name for test in study.tests if test.across_axis is across}
    rows = [
        (tests[mean.response], log(mean.value / slope), standard_error(mean.value, mean.sd, mean.n) or nan)
        for mean, fitted in zip(measured_means(study), fitted_surfaces(study, surface), strict=True)
        if mean.response in tests and mean.value > 0.0 and (slope := float(fitted.predict(point)[0])) > 0.0
    ]
    if not rows:
        return None
    names, logs, errors = zip(*rows, strict=True)
    return list(dict.fromkeys(names)), exp(sum(logs) / len(rows)), 0.01 * hypot(*errors) / len(rows)


def _to_transverse(
    study: Study, surface: Surfaces, solution: Mapping[str, float], along: float, across: float
) -> Remedy:
    """Return the remedy: `material.transverse` with the modulus across as a factor; `along` and `across` in MPa."""
    levels, ratio = {**study.midlevels(), **solution}, "poisson_ratio"
    nu = study.factor(ratio).high if ratio in study.names else study.parameters(levels)[ratio]
    most = 0.95 * (1.0 - nu) / (2.0 * nu * nu) * along / _WIDER if nu else inf  # keeps the stiffness positive definite
    if not study.kind.has_layers or across > most:
        return Remedy("Check the units of both slopes, and the specimens of both tests.")
    factors, material = [f"{{name: {_ACROSS}, unit: MPa, {_range(across, most)}}}"], "transverse: {}"
    varied = [*surface.names, *({_E} & {*study.names} - {*surface.names}), _ACROSS]
    if _E in study.names:
        factors.append(f"{{name: {_E}, {_range(levels[_E] * along / study.parameters(levels)[_E])}}}")
    else:
        value = f"{along:.3g} MPa"
        material += f", {_E}: {f'{{value: {value}}}' if _E in study.material.growing() else value}"
    edit = [
        f"material: {{{material}}}",
        f"factors: [{', '.join(factors)}]",
        "screen: {design: none}",
        f"rsm: {{factors: [{', '.join(varied)}]}}",
    ]
    text = "Calibrate the modulus across the axis as well. Merge into the spec:"
    return Remedy(f"{text} `{{{', '.join(edit)}}}`.", "\n".join(edit))


def _range(value: float, most: float = inf) -> str:
    """Return a range from half of a value to twice it, as YAML keys of a factor."""
    return f"low: {outwards(value / _WIDER, False):g}, high: {min(outwards(value * _WIDER, True), most):.4g}"
