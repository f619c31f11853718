"""The analysis of the stage optimise: find the optimum on the surfaces, and simulate it and the present cutter."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import hypot, isclose, isfinite

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.comparison import NORMAL
from stemcal.doe.regression.least_squares import t_quantile
from stemcal.doe.regression.surface import Surface
from stemcal.errors import UsageError
from stemcal.notes import Note
from stemcal.runs.record import Outcome, lower_bound_notes
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request, Solver
from stemcal.solvers.replicates import repeated
from stemcal.stages.design import StageRuns
from stemcal.stages.fitting import fitted_surfaces, measured_means
from stemcal.stages.fresh import read_fresh
from stemcal.stages.optimise.options import present_levels
from stemcal.stages.optimise.result import OPTIMUM, PRESENT, Cutter, FrontPoint, Gain, OptimiseResult
from stemcal.stages.optimise.search import NoneAllowed, Optimum, Problem, find_optimum, intervals_of
from stemcal.stages.result import Head
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.work import Work, a_stage
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.study.types import units

_EDGE = 1e-3  # coded: an optimum nearer to the end of a range is at the end


@a_stage(OptimiseResult)
def optimise(work: Work, head: Head) -> OptimiseResult:
    """Find the optimum on the surfaces, simulate it and the present cutter, and compare them."""
    study, surface, name = work.study, work.result(RsmResult), _namer(work.study)
    problem = problem_of(study, surface)
    optimum = find_optimum(problem)
    cutters = _simulated(work, _cutters(study, surface, problem, optimum), pictured=True)
    elsewhere = _in_materials(work, cutters[:2])
    signs = problem.signs.items()
    gains = {name(key): gain_of(key, sign, problem.surfaces[key], cutters, elsewhere) for key, sign in signs}
    natural = {name: scale.natural for name, scale in surface.coding.items()}
    ends = intervals_of(problem, optimum)
    front = [_cutter("", _levels(study, surface, x), study, surface, problem) for x in optimum.front]
    simulated, present = ({name(key): cutter.outcome.of(key) for key in problem.surfaces} for cutter in cutters[:2])
    return OptimiseResult(
        head=head,
        minimised=tuple(name(key) for key, sign in signs if sign > 0.0),
        maximised=tuple(name(key) for key, sign in signs if sign < 0.0),
        limits={name(key): limit for key, limit in problem.limits.items()},
        units={factor.name: factor.unit for factor in study.factors},
        optimum=cutters[0].levels,
        optimum_interval=ends
        and {factor: (natural[factor](low), natural[factor](high)) for factor, (low, high) in ends.items()},
        predicted=cutters[0].predicted,
        simulated=simulated,
        present_levels=cutters[1].levels,
        present=present,
        gain_percent={key: gain and gain[0] for key, gain in gains.items()},
        gain_sd={key: gain[1] for key, gain in gains.items() if gain is not None},
        edges=_edges(study, surface, optimum.point),
        front=tuple(FrontPoint(cutter.levels, cutter.predicted) for cutter in front),
        cutters=Rows([*cutters, *elsewhere]),
        notes=(*_notes(study, optimum, gains), *lower_bound_notes([cutter.outcome for cutter in cutters])),
    )


def _namer(study: Study) -> Callable[[str], str]:
    return lambda key: study.naming.named(key).name


def problem_of(study: Study, surface: RsmResult) -> Problem:
    """Return the optimisation problem: the surfaces of the goal's responses, signs and limits."""
    assert study.goal is not None
    means, fitted = measured_means(study), fitted_surfaces(study, surface)
    surfaces = {mean.response: fit for mean, fit in zip(means, fitted, strict=True) if isinstance(fit, Surface)}
    named = {key: study.naming.named(key) for key in surfaces}
    return Problem(surfaces, study.goal.signs, study.goal.at_most, surface.region, named)


def _cutters(study: Study, surface: RsmResult, problem: Problem, optimum: Optimum) -> list[Cutter]:
    """Return the optimum, the present cutter and the ends of the Pareto front, before their simulation."""
    points = {OPTIMUM: _levels(study, surface, optimum.point), PRESENT: present_levels(study)}
    ends = (optimum.front[0], optimum.front[-1]) if optimum.front else ()
    points |= {f"front {n}": _levels(study, surface, x) for n, x in enumerate(ends, 1)}
    return [_cutter(name, levels, study, surface, problem) for name, levels in points.items()]


def _levels(study: Study, surface: RsmResult, x: Array) -> dict[str, float]:
    levels = dict(surface.fixed)
    for name, value in surface.scales.levels(x).items():
        factor = study.factor(name)
        levels[name] = min(max(float(f"{value:.4g}"), factor.low), factor.high)
    return {name: levels[name] for name in study.names}


def _cutter(name: str, levels: Mapping[str, float], study: Study, surface: RsmResult, problem: Problem) -> Cutter:
    x, named = surface.scales.to_coded([levels[factor] for factor in surface.names]), _namer(study)
    return Cutter(
        cutter=name,
        levels=dict(levels),
        predicted={named(key): float(fit.predict(x)[0]) for key, fit in problem.surfaces.items()},
        outcome=Outcome(response=None, status="failed"),
    )


def _simulated(work: Work, cutters: Sequence[Cutter], pictured: bool, first: int = 0) -> list[Cutter]:
    simulate, at = work.simulating("optimise", pictured), work.study.targets.calibrate_at
    outcomes = simulate(first, [cutter.levels for cutter in cutters], [at])
    return [replace(cutter, outcome=outcome) for cutter, outcome in zip(cutters, outcomes, strict=True)]


def _in_materials(work: Work, cutters: Sequence[Cutter]) -> list[Cutter]:
    simulated = []
    for number in range(1, len(work.study.materials) + 1):
        study = work.study.in_material(number)
        other = replace(work, study=study, solver=make_solver(study).placed(work.folder.work))
        numbered = [replace(cutter, material=number) for cutter in cutters]
        simulated += _simulated(other, numbered, pictured=False, first=_first_in(number))
    return simulated


def _first_in(number: int) -> int:
    """Return the number of the first run in another material; runs 0 to 3 are in the material of the study."""
    return 2 + 2 * number


def gain_of(
    key: str, sign: float, fitted: Surface, cutters: Sequence[Cutter], elsewhere: Sequence[Cutter]
) -> tuple[Gain, dict[str, float]] | None:
    """Return the gain g (%) of the optimum over the present cutter with 95 % limits, and its standard deviations.

    With the responses O of the optimum and P of the present cutter, g = 100 (P − O)/|P| if the response is minimised.
    The mean of n runs has the variance v = s² own/n, with s² = `mean_square` and own = `own_scatter` of the surface;
    then var g = 100² v (1 + O²/P²)/P². Each other material is one standard deviation away in one direction, so the
    variance due to the material is Σ (gₘ − g)².
    """
    best, present = cutters[:2]
    o, p = best.outcome.number(key), present.outcome.number(key)
    if not np.isfinite([o, p]).all() or p == 0.0:
        return None
    g = sign * 100.0 * (p - o) / abs(p)
    pairs = zip(elsewhere[::2], elsewhere[1::2], strict=True)
    others = [(a.outcome.number(key), b.outcome.number(key)) for a, b in pairs]
    changes = [sign * 100.0 * (b - a) / abs(b) - g for a, b in others if np.isfinite([a, b]).all()]
    sources = {"material": hypot(*changes)} if changes else {}
    if fitted.mean_square is None:
        return (g, None, None), sources
    n = len(present.outcome.keys)
    sources["runs"] = 100.0 * (fitted.mean_square * fitted.own_scatter / n) ** 0.5 * hypot(1.0, o / p) / abs(p)
    half = hypot(t_quantile(0.95, fitted.df) * sources["runs"], NORMAL * sources.get("material", 0.0))
    return (g, g - half, g + half), sources


def _edges(study: Study, surface: RsmResult, x: Array) -> dict[str, str]:
    """Return the range ends at which the optimum is, except physical bounds, beyond which no range can extend."""
    region = surface.region
    ends = {name: "high" for name, gap in zip(surface.names, region.high - x, strict=True) if gap < _EDGE}
    ends |= {name: "low" for name, gap in zip(surface.names, x - region.low, strict=True) if gap < _EDGE}
    if not ends and region.radius is not None and float(np.linalg.norm(x)) > region.radius - _EDGE:
        far = int(np.argmax(np.abs(x)))
        ends = {surface.names[far]: "high" if x[far] > 0.0 else "low"}
    return {name: end for name, end in ends.items() if not _is_physical_bound(study, name, end)}


def _is_physical_bound(study: Study, name: str, end: str) -> bool:
    factor, parameter = study.factor(name), study.kind.parameters.get(name)
    bound = None if parameter is None else parameter.lowest if end == "low" else parameter.highest
    if parameter is None or bound is None or not isfinite(bound):
        return False
    return isclose(units.from_internal(factor.internal(getattr(factor, end)), parameter.unit), bound, abs_tol=1e-12)


def _notes(study: Study, optimum: Optimum, gains: Mapping[str, tuple[Gain, dict[str, float]] | None]) -> Iterator[Note]:
    """Yield notes on the Pareto front of two responses, and on the sources of uncertainty of the gain."""
    if optimum.front:
        yield Note("knee", "info", "The optimum is the knee of the Pareto front, the point farthest from the chord.")
    elif len(optimum.weights) > 1:
        yield Note("no_conflict", "info", "One cutter is best for both responses, so there is no Pareto front.")
    parts = [
        f"{study.naming.named(name).long}: {', '.join(f'{source} {sd:.2g} %' for source, sd in gain[1].items())}"
        for name, gain in gains.items()
        if gain is not None and gain[1]
    ]
    if parts:
        text = f"Standard deviations of the gain by source ({'; '.join(parts)})."
        if not study.materials:
            text += " The uncertainty of the material is not included; use `material: {from: FOLDER}` to include it."
        yield Note("gain_sources", "info", text)


def foresee(study: Study, solver: Solver, folder: StudyFolder | None) -> StageRuns:
    """Return the runs of the cutters; until the surfaces are fitted, other levels in the ranges take their place."""
    cutters = None
    with suppress(UsageError, NoneAllowed):
        if folder is not None:
            surface = read_fresh(study, solver, folder, RsmResult)
            problem = problem_of(study, surface)
            cutters = [cutter.levels for cutter in _cutters(study, surface, problem, find_optimum(problem))]
    count = 2 if study.goal is None or len(study.goal.signs) == 1 else 4
    parts = [n / (count + 1.0) for n in range(1, count + 1)]
    unknown = [{each.name: each.low + part * (each.high - each.low) for each in study.factors} for part in parts]
    at, levels = study.targets.calibrate_at, cutters or unknown
    requests = [Request("optimise", row, each, at, pictured=True) for row, each in enumerate(levels)]
    times = study.solver.repeats
    others = [
        repeated([Request("optimise", row, each, at) for row, each in enumerate(levels[:2], _first_in(number))], times)
        for number in range(1, len(study.materials) + 1)
    ]
    return StageRuns("optimise", repeated(requests, times), cutters is not None, in_materials=others)
