"""The analysis of the stage invert: solve one surface for one measured mean, or fit several surfaces to their means.

Each response (force, travel and work to the maximum force) has its own surface at each condition (diameter).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration import confidence_intervals as certainty
from stemcal.doe.calibration.likelihood import Fit
from stemcal.doe.calibration.solution_ranges import assess_point, solve_target
from stemcal.doe.coding import Coding
from stemcal.doe.comparison import formula_left_out, standard_error
from stemcal.stages.fitting import Measured, Surfaces, fit_of_study, measured_means
from stemcal.stages.invert import words
from stemcal.stages.invert.options import InvertOptions
from stemcal.stages.invert.result import (
    Certainty,
    Contradicted,
    InvertResult,
    JointFitted,
    JointRow,
    MeasuredMean,
    Point,
    PriorRow,
    ProfileCurve,
)
from stemcal.stages.result import Head, Interval
from stemcal.stages.work import Work, a_stage
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST


@a_stage(InvertResult)
def invert(work: Work, head: Head) -> InvertResult:
    """Solve the surface for the target at the calibration diameter, or fit all surfaces of a joint fit."""
    study, surface = work.study, work.result(Surfaces)
    solved = (_solve_jointly if study.joint_targets else solve)(study, head, surface)
    idle = tuple(f.name for f in study.factors if f.prior is not None and f.name not in surface.names)
    notes = (*words.invert_notes(solved), *solved.notes, *([words.prior_unused(idle)] if idle else []))
    return replace(solved, depends_on=work.solver.settings_that_matter(solved.condition), notes=notes)


def solve(study: Study, head: Head, surface: Surfaces) -> InvertResult:
    """Return the calibrated point of a single target, with its uncertainty."""
    coding, target = surface.scales, study.calibration_target
    region, unit = surface.region, study.naming.response.unit_suffix
    ends, rule = (region.low, region.high, region.radius), study.of(InvertOptions).rule
    chosen = solve_target(surface.refitted(surface.design.runs), target.response, *ends, rule, unit)
    whole = replace(fit_of_study(study, surface), best=np.array(chosen.point.coded))
    known = _certainty_of(study, coding, whole, "single")
    natural = map(tuple, coding.to_natural(np.array(chosen.ranges).T).T.tolist())
    exact = {
        "ranges": dict(zip(coding.names, natural, strict=True)),
        "coded_ranges": dict(zip(coding.names, chosen.ranges, strict=True)),
    }
    point = Point.of(chosen.point, coding)
    return InvertResult.of(study, head, surface.radius, point, known, rule=chosen.rule, **exact)


def _solve_jointly(study: Study, head: Head, surface: Surfaces) -> InvertResult:
    coding, means = surface.scales, measured_means(study)
    whole = fit_of_study(study, surface)
    fit, flat = certainty.settled(whole)
    point = assess_point(surface.fitted, fit.best, surface.region.low, surface.region.high, surface.radius)
    factors = [study.factor(name) for name in coding.names]
    units, priors = {f.name: f.unit for f in factors}, [(f, f.prior) for f in factors if f.prior is not None]
    return InvertResult.of(
        study,
        head,
        surface.radius,
        Point.of(point, coding),
        _certainty_of(study, coding, replace(whole, best=fit.best) if len(flat) else whole, "joint"),
        rule="joint_least_squares",
        joint=_fitted(study, means, fit, bool(len(flat))),
        priors=Rows(PriorRow(f.name, prior.mean, prior.sd, f.unit, prior.source) for f, prior in priors),
        notes=tuple(words.flat_direction(_changes_along(coding, row), units) for row in flat),
    )


def _fitted(study: Study, means: Sequence[Measured], fit: Fit, flat: bool) -> JointFitted:
    conditions, naming = [mean.condition for mean in means], study.naming
    several, own = len(set(conditions)) > 1, not naming.is_cutting
    tests = [study.test_of(mean.response) for mean in means]
    apart = len(set(tests)) > 1  # then all means of one test are left out together
    groups: Sequence[object] = tests if apart else conditions if several else [] if own else range(len(means))
    errors = certainty.left_out(fit, groups)
    every = _rows(means, fit, errors, certainty.left_out_intervals(fit, groups) if apart else [None] * len(means))
    rows = Rows(row for mean, row in zip(means, every, strict=True) if mean.leads)
    first = [
        (row.condition, row.measured, standard_error(row.measured, row.sd, row.n))
        for mean, row in zip(means, every, strict=True)
        if mean.response == FIRST
    ]
    contradicted = None
    if (odd := certainty.contradiction(fit)) is not None:
        mean, ends = means[odd.index], odd.allowed
        contradicted = Contradicted(mean.named.name, mean.condition, mean.value, *ends, odd.standard_errors, odd.p)
    missed = [means[i] for i in certainty.missed_observations(fit)]
    return JointFitted(
        rows=rows,
        further=Rows(row for mean, row in zip(means, every, strict=True) if not mean.leads),
        scatter=fit.errors.scatter,
        misfit=fit.least if fit.p_value is not None else None,
        df=fit.df,
        p=fit.p_value,
        max_abs_error_percent=max(abs(row.error_percent) for row in rows),
        max_abs_left_out_error_percent=max(abs(row.left_out_error_percent or 0.0) for row in rows) if errors else None,
        formula=formula_left_out(first) if naming.is_force_on_stems else None,
        contradiction=contradicted,
        out_of_reach=Rows(MeasuredMean(mean.named.name, mean.condition) for mean in missed),
        separated=not flat,
    )


def _rows(
    means: Sequence[Measured], known: Fit, left_out: Sequence[float], intervals: Sequence[Interval | None]
) -> list[JointRow]:
    without: Sequence[float | None] = left_out or [None] * len(means)
    predicted, errors = known.predict(known.best)[0].tolist(), known.errors_percent(known.best).tolist()
    return [
        JointRow(mean.condition, mean.named.name, mean.named.unit, mean.value, mean.sd, mean.n, *values)
        for mean, *values in zip(means, predicted, errors, without, intervals, strict=True)
    ]


_MOVED = 0.25  # a factor that changes by more than this part of its half step along a flat direction is undetermined


def _certainty_of(study: Study, coding: Coding, known: Fit, source: Literal["joint", "single"]) -> Certainty:
    """Return the uncertainty of a fit to all measured means, or to the calibration target alone."""
    profiles, (unseen, loosest_direction) = certainty.profiles_of(known), certainty.loose_directions(known)
    changes = tuple(_changes_along(coding, row) for row in unseen)
    free = tuple(p.factor for p in profiles if p.free)
    parts = [pair for row in unseen for pair in zip(coding.names, certainty.moved_together(row), strict=True)]
    moved = {name for name, part in parts if abs(part) >= _MOVED}
    not_identified = tuple(name for name in coding.names if name in free or name in moved)
    loosest = _changes_along(coding, loosest_direction) if not_identified and not changes else {}
    curves = {}
    for j, p in enumerate(profiles):
        values = tuple(_value(coding, j, value) for value in p.values.tolist())
        curves[p.factor] = ProfileCurve(values, tuple(p.rise.tolist()), p.allowed)
    return Certainty(
        source=source,
        scatter=known.errors.scatter,
        level=0.95,
        intervals={p.factor: (_value(coding, j, p.low), _value(coding, j, p.high)) for j, p in enumerate(profiles)},
        coded_intervals={p.factor: (p.low, p.high) for p in profiles},
        bounded={p.factor: p.bounded for p in profiles},
        share={p.factor: p.share for p in profiles},
        free=free,
        not_identified=not_identified,
        loosest=changes[0] if changes else loosest,
        profiles=curves,
        directions=tuple(coding.by_name(row) for row in unseen),
        unseen_changes=changes,
        known_sd=known.errors.scatter == "measured" and all((o.n or 1) == 1 for o in known.observations),
        surface_error_known=known.errors.surface_error_known,
        units={name: study.factor(name).unit for name in coding.names},
    )


def _value(coding: Coding, j: int, coded: float) -> float:
    return coding.centre[j] + coding.half_step[j] * float(coded)


def _changes_along(coding: Coding, direction: Array) -> dict[str, float]:
    """Return the change of each factor (in its unit) along a coded direction whose largest component is set to 1."""
    steps = zip(coding.names, certainty.moved_together(direction), coding.half_step, strict=True)
    return {name: part * half_step for name, part, half_step in steps if part != 0.0}
