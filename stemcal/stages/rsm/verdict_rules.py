"""Rules of the verdict on runs and response surface: scatter, units, failed runs, reach, signs, roughness."""

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np

from stemcal.arrays import Mask
from stemcal.doe.calibration.search_region import extremes
from stemcal.doe.regression.surface import ROUGH_PERCENT
from stemcal.formats import counted, minus, series
from stemcal.notes import Note, Remedy
from stemcal.stages.fitting import fitted_surfaces, measured_means
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.stage import stages_of
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.physics import Doubt, for_physics
from stemcal.stages.verdict.verdict_rules import Evidence, Rank, ranked
from stemcal.stages.work import SAME
from stemcal.storage.canonical import as_json
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST

# Ratios of units that are often confused: a force in N and in kN, kgf or g, a length in mm and in m.
_UNITS = {1000.0: "kN and N, or mm and m", 9.80665: "kgf and N", 1000.0 / 9.80665: "g and N"}
_DRAWN = frozenset({"replicate", "seed"})  # inputs that differ between repeated runs
_FAR, _ROOM = 3.0, 0.25  # a value beyond _FAR times the range is suspect; `_ROOM` widens the range
_SIGNS = 3  # smallest number of runs from which a wrong sign is reported
_MANY = 0.1  # share of failed runs from which the failures are reported
_RETRY = "Fix the causes of the failures (see `stemcal status SPEC --failed`), then run `stemcal run SPEC --retry`."


@ranked(Rank.DATA)
def undeclared_scatter(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if equal inputs gave different responses although the spec declares no replicates."""
    study = evidence.study
    if study.solver.repeats or evidence.of(RsmResult) is not None:
        return
    drawn = {stage.name for stage in stages_of(study) if stage.seen(study).solver.repeats}
    answers: dict[str, list[float]] = defaultdict(list)
    for record in evidence.records:
        request = record["request"]
        if record["response"] is not None and request["stage"] not in drawn:
            inputs = {name: part for name, part in record["identity"].items() if name not in _DRAWN}
            answers[as_json(inputs)].append(float(record["response"]))
    for values in answers.values():
        if max(values) - min(values) > SAME * max(map(abs, values)):
            ends = f"runs at the same levels returned {min(values):.6g} and {max(values):.6g}"
            text = f"The program is stochastic ({ends}), but the spec has no `replicates`."
            yield Note("undeclared_scatter", "error", text, study.solver.chance_remedy())
            return


@ranked(Rank.DATA)
def reversed_sign(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if a response is negative in every run, but the measured one is positive."""
    naming = evidence.study.naming
    for named in (naming.response, *naming.others) if evidence.study.goal is None else ():
        name = FIRST if named == naming.response else named.name
        runs = (run for result in evidence.results.done for run in getattr(getattr(result, "design", None), "runs", ()))
        values = [value for run in runs if isfinite(value := run.number(name))]
        if len(values) < _SIGNS or max(values) >= 0.0 or named.apart:
            continue
        ends = f"{named.text(min(values), '.4g')} to {named.text(max(values), '.4g')}"
        text = (
            f"The sign of the simulated {named.long} is reversed: all {len(values)} runs returned negative values "
            f"({minus(ends)}), but the measured values are positive."
        )
        yield Note("reversed_sign", "error", text, evidence.study.solver.sign_remedy(named.name))


@ranked(Rank.DATA)
def probable_unit(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if measured values differ from the simulated range by the ratio of two units."""
    surface, study = evidence.of(RsmResult), evidence.study
    if surface is None:
        return
    reaches: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    for mean, fitted in zip(measured_means(study), fitted_surfaces(study, surface), strict=True):
        low, high = (float(fitted.predict(end)[0]) for end in extremes(fitted, surface.region))
        reaches[mean.response].append((mean.value, low, high))
    for response, values in reaches.items():
        first, *others = (_unit_ratio(*each) for each in values)
        if first is not None and all(other is not None and other[0] == first[0] for other in others):
            (size, name), (value, low, high), named = first, values[0], study.naming.named(response)
            measured, ends = f"{value:g}{named.unit_suffix}", f"{low:.3g} to {high:.3g}{named.unit_suffix}"
            text = (
                f"Two units were probably confused ({name}). The measured {named.long} is {measured}, about {size:.4g} "
                f"times the simulated values ({ends})."
            )
            check = "Check the units of the target and of the simulated response before you change a factor range."
            yield Note("probable_unit", "error", text, Remedy(check))


def _unit_ratio(value: float, low: float, high: float) -> tuple[float, str] | None:
    """Return the ratio of units that brings a value into the range `low` to `high`, and their names; None if none does.

    >>> _unit_ratio(130.0, 0.08, 0.19), _unit_ratio(130.0, 80.0, 125.0)
    ((1000.0, 'kN and N, or mm and m'), None)
    """
    if low <= 0.0 or low / _FAR <= value <= high * _FAR:
        return None
    for ratio, name in _UNITS.items():
        for size in (ratio, 1.0 / ratio):
            if low * (1.0 - _ROOM) <= value / size <= high * (1.0 + _ROOM):
                return size, name
    return None


@ranked(Rank.DATA)
def failed_runs(evidence: Evidence) -> Iterator[Note]:
    """Yield a note on failed runs: the levels at which they failed, and the effect on the surface, if any."""
    surface = evidence.of(RsmResult)
    if surface is None:
        yield from _failed_without_surface(evidence)
        return
    failed = np.array([run.response is None for run in surface.design.runs])
    for part in surface.conditions if surface.over is None else ():
        failed |= np.array([not answered.outcome.ok for answered in part.runs])
    unknown = any(fitted.df < 1 for fitted in fitted_surfaces(evidence.study, surface))
    if not failed.any() or (not unknown and failed.mean() < _MANY):
        return
    where, remedy = _where_failed(evidence.study, surface, failed)
    text = f"{failed.sum()} of {counted(len(failed), 'response surface run')} failed. {where}"
    if unknown:
        text += " The error of the response surface cannot be estimated from the remaining runs."
    yield Note("failed_runs", "warning", text, remedy)


@ranked(Rank.IDENTIFICATION)
def few_runs(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the surface has as many coefficients as runs although no run failed."""
    surface = evidence.of(RsmResult)
    unknown = surface is not None and any(fitted.df < 1 for fitted in fitted_surfaces(evidence.study, surface))
    if surface is not None and unknown and not any(failed_runs(evidence)):
        text = (
            f"The response surface has as many coefficients as runs ({len(surface.coefficients)}), so the error of the "
            "surface cannot be estimated. The intervals are therefore wide."
        )
        yield Note("few_runs", "warning", text, advice.more_runs(surface))


def _where_failed(study: Study, surface: RsmResult, failed: Mask) -> tuple[str, Remedy]:
    """Return the levels of failed runs, and the remedy: a range without them, or to repeat and add runs."""
    coded = np.array([[run.coded[name] for name in surface.names] for run in surface.design.runs])
    natural = surface.scales.to_natural(coded)
    bad, good = (
        [dict(zip(surface.names, row, strict=True)) for row in rows.tolist()]
        for rows in (natural[failed], natural[~failed])
    )
    why = {str(outcome.reason) for _, outcome in surface.runs()}
    if (known := _beyond(study, why, bad, good)) is not None:
        return known
    ends = zip(surface.names, natural[failed].min(axis=0).tolist(), natural[failed].max(axis=0).tolist(), strict=True)
    units = {entry.factor: "" if entry.unit == "1" else f" {entry.unit}" for entry in surface.factors}
    places = series(f"{n} {a:.4g}{f' to {b:.4g}' if b > a else ''}{units[n]}" for n, a, b in ends)
    more = advice.more_runs(surface)
    return f"They are at {places}.", replace(more, text=f"{_RETRY} {more.text}")


def _beyond(
    study: Study, why: Collection[str], bad: Sequence[Mapping[str, float]], good: Sequence[Mapping[str, float]]
) -> tuple[str, Remedy] | None:
    """Return text and remedy if time steps are too long, or if all runs beyond some level of a factor failed."""
    if study.kind.simulates_stems and {"contact_energy", "energy_drift"}.intersection(why):
        return "The time steps are too long for these levels.", for_physics(study, Doubt("drift", len(bad), None))
    varied = [factor for factor in study.factors if all(factor.name in row for row in (*bad, *good))]
    for factor in varied if len(bad) > 1 and good else ():
        for side, key in ((1.0, "high"), (-1.0, "low")):
            nearest = min(side * row[factor.name] for row in bad)
            last = max(side * row[factor.name] for row in good)
            if nearest <= last or nearest <= side * factor.centre:
                continue
            end = float(f"{side * 0.5 * (nearest + last):.3g}")
            unit = f" {factor.unit}".removesuffix(" 1")
            beyond, within = ("at least", "up to") if side > 0.0 else ("at most", "from")
            where = (
                f"All runs with {factor.name} of {beyond} {side * nearest:.4g}{unit} failed, and no run {within} "
                f"{side * last:.4g}{unit}."
            )
            edit = f"factors: [{{name: {factor.name}, {key}: {end:g}}}]"
            return where, Remedy(f"Set `{key}` of {factor.name} to {end:g}{unit}.", edit)
    return None


def _failed_without_surface(evidence: Evidence) -> Iterator[Note]:
    tried, failed, why = Counter[float](), Counter[float](), Counter[str]()
    levels: dict[bool, list[Mapping[str, float]]] = {True: [], False: []}
    for record in evidence.records:
        levels[record["status"] == "ok"].append(record["request"]["levels"])
        at = float(record["request"].get("condition") or 0.0)
        tried[at] += 1
        if record["status"] != "ok":
            failed[at] += 1
            why[str(record["reason"])] += 1
    if not failed:
        return
    none_left = [at for at in failed if failed[at] == tried[at]]
    text = f"{sum(failed.values())} of {counted(sum(tried.values()), 'run')} failed ({why.most_common(1)[0][0]})"
    text += f", including all runs{evidence.names.at(*none_left)}." if none_left else "."
    where, remedy = _beyond(evidence.study, why, levels[False], levels[True]) or ("", Remedy(_RETRY))
    yield Note("failed_runs", "error", f"{text} {where}".rstrip(), remedy)


@ranked(Rank.REACH)
def out_of_reach(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the only target of the study is outside the values of the surface in the ranges."""
    surface, study = evidence.of(RsmResult), evidence.study
    if surface is None or study.joint_targets or evidence.results.calibrated:
        return
    target, (low, high), names = study.calibration_target.response, advice.reach(surface), evidence.names
    if low <= target <= high:
        return
    measured = f"The measured {names.response.long} of {names.quantity(target, 'g')}"
    if (elsewhere := _reached_by_others(evidence, surface, target)) is not None:
        text, remedy = elsewhere
        surface_only = f"the response surface allows only {names.quantities((low, high))}"
        text = f"{measured} is out of reach of the varied factors: {surface_only}. {text}"
        yield Note("out_of_reach", "error", text, remedy)
        return
    text = f"{measured} is out of reach: the factor ranges allow only {names.quantities((low, high))}."
    yield Note("out_of_reach", "error", text, advice.to_reach(study, surface, target))


def _reached_by_others(evidence: Evidence, surface: RsmResult, target: float) -> tuple[str, Remedy] | None:
    """Return text and remedy if screening runs reach the target: a factor that the surface should vary in addition."""
    study, names = evidence.study, evidence.names
    others = [factor for factor in study.factors if factor.name not in surface.names]
    if (screened := evidence.of(ScreenResult)) is None:
        return None
    values = [run.response for run in screened.design.runs if run.response is not None]
    centre = float(surface.fitted.predict(np.zeros((1, len(surface.names))))[0])
    side = 1.0 if target > centre else -1.0
    beyond = sorted(value for value in values if side * value >= side * target)
    if not beyond or not others:
        return None

    most = max(others, key=lambda factor: screened.shares[factor.name]).name
    ends, mean = names.quantities((beyond[0], beyond[-1])), float(np.mean(values))
    text = (
        f"{counted(len(beyond), 'recorded run')} gave {ends} with other levels of {series(f.name for f in others)}. "
        f"The mean of these stages is {names.quantity(mean)}, and the response at the centre {names.quantity(centre)}; "
        "the difference is curvature."
    )
    every = f"rsm: {{factors: [{', '.join((*surface.names, most))}]}}"
    return text, Remedy(f"Vary {most} in the response surface as well: `{every}`.", every)


@ranked(Rank.MODEL)
def sign_against_expectation(evidence: Evidence) -> Iterator[Note]:
    """Yield a note for each significant effect whose sign differs from the `expected_sign` in the spec."""
    against = []
    for factor in evidence.study.factors:
        signs = (result.sign_of(factor.name) for result in reversed(evidence.results.done))
        estimated = next((sign for sign in signs if sign is not None), None)  # latest significant effect
        if factor.expected_sign and estimated not in (None, factor.expected_sign):
            against.append(factor.name)
    if against:
        names = series(against)
        text = f"The sign of the effect of {names} is opposite to the expected sign (`expected_sign`)."
        remedy = Remedy(f"Check the material law, the `expected_sign` key and the units of {names}.")
        yield Note("sign_against_expectation", "warning", text, remedy)


@ranked(Rank.MODEL)
def rough_response(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the residual of the surface is large although the simulation is deterministic."""
    surface = evidence.of(RsmResult)
    if surface is None:
        return
    repeats = surface.pure_error  # None if no runs are repeated
    exact = surface.deterministic if repeats is None else repeats.kind == "equal_repeats"
    if exact and (cv := surface.cv_percent) is not None and abs(cv) > ROUGH_PERCENT:
        text = (
            f"The response is not smooth or not quadratic: the residual standard deviation is "
            f"{abs(cv):.1f} % of the mean response, although the simulation is deterministic."
        )
        levels = evidence.results.parameters if evidence.results.calibrated else None
        yield Note("rough_response", "warning", text, advice.to_smooth(evidence.study, surface, levels))


RULES = (
    *(undeclared_scatter, reversed_sign, probable_unit, failed_runs, few_runs, out_of_reach, sign_against_expectation),
    rough_response,
)
