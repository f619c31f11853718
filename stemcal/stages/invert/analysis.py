"""The calibration: the point of the surface that gives one measured mean, or of several surfaces for theirs.

At a condition (a diameter) each response (force, travel and work to the maximum force) has its own surface.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from stemcal.doe.calibration.confidence_intervals import (
    contradiction,
    left_out,
    left_out_intervals,
    loosest_direction,
    missed_observations,
    moved_together,
    profiles_of,
    settled,
    unseen_directions,
)
from stemcal.doe.calibration.level_set_ranges import assess_point, solve_target
from stemcal.doe.calibration.likelihood import Fit
from stemcal.doe.coding import Array, Coding
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
    """Solve the surface for the force measured at the calibration diameter, or several surfaces for theirs."""
    study, surface = work.study, work.result(Surfaces)
    solved = (_solve_jointly if study.joint_targets else solve)(study, head, surface)
    idle = tuple(one.name for one in study.factors if one.prior is not None and one.name not in surface.names)
    notes = (*words.invert_notes(solved), *solved.notes, *([words.prior_unused(idle)] if idle else []))
    return replace(solved, depends_on=work.solver.settings_that_matter(solved.condition), notes=notes)


def solve(study: Study, head: Head, surface: Surfaces) -> InvertResult:
    """Return the calibrated point, what is known about it, and every factor's level there."""
    coding, target = surface.scales, study.calibration_target
    region, unit = surface.region, study.naming.response.unit_suffix
    ends, rule = (region.low, region.high, region.radius), study.of(InvertOptions).rule
    found = solve_target(surface.refitted(surface.design.runs), target.response, *ends, rule, unit)
    whole = replace(fit_of_study(study, surface), best=np.array(found.point.coded))
    known = _certainty_of(study, coding, whole, "single")
    natural = map(tuple, coding.to_natural(np.array(found.ranges).T).T.tolist())
    exact = {
        "ranges": dict(zip(coding.names, natural, strict=True)),
        "coded_ranges": dict(zip(coding.names, found.ranges, strict=True)),
    }
    point = Point.of(found.point, coding)
    return InvertResult.of(study, head, surface.radius, point, known, rule=found.rule, **exact)


# ---- several measured means at once: the parameters that fit them all


def _solve_jointly(study: Study, head: Head, surface: Surfaces) -> InvertResult:
    """Return the parameters that fit all diameters and responses of the spec best."""
    coding, means = surface.scales, measured_means(study)
    whole = fit_of_study(study, surface)
    found, flat = settled(whole)
    point = assess_point(surface.fitted, found.best, surface.region.low, surface.region.high, surface.radius)
    units = {name: study.factor(name).unit for name in coding.names}
    return InvertResult.of(
        study,
        head,
        surface.radius,
        Point.of(point, coding),
        _certainty_of(study, coding, replace(whole, best=found.best) if len(flat) else whole, "joint"),
        rule="joint_least_squares",
        joint=_fitted(study, means, found, bool(len(flat))),
        priors=prior_rows(study, coding),
        notes=tuple(words.flat_direction(_changes_along(coding, row), units) for row in flat),
    )


def _fitted(study: Study, means: Sequence[Measured], found: Fit, flat: bool) -> JointFitted:
    conditions, naming = [mean.condition for mean in means], study.naming
    several, own = len(set(conditions)) > 1, not naming.is_cutting
    tests = [study.test_of(mean.response) for mean in means]
    apart = len(set(tests)) > 1  # then a test is held out, at all its conditions
    groups: Sequence[object] = tests if apart else conditions if several else [] if own else range(len(means))
    errors = left_out(found, groups)
    every = _rows(means, found, errors, left_out_intervals(found, groups) if apart else [None] * len(means))
    rows = Rows(row for mean, row in zip(means, every, strict=True) if mean.leads)
    first = [
        (row.condition, row.measured, standard_error(row.measured, row.sd, row.n))
        for mean, row in zip(means, every, strict=True)
        if mean.response == FIRST
    ]
    tests_scatter = found.p_value is not None
    return JointFitted(
        rows=rows,
        further=Rows(row for mean, row in zip(means, every, strict=True) if not mean.leads),
        scatter=found.errors.scatter,
        misfit=found.least if tests_scatter else None,
        df=found.df,
        p=found.p_value,
        max_abs_error_percent=max(abs(row.error_percent) for row in rows),
        max_abs_left_out_error_percent=max(abs(row.left_out_error_percent or 0.0) for row in rows) if errors else None,
        formula=formula_left_out(first) if naming.is_force_on_stems else None,
        contradiction=_contradiction(means, found),
        out_of_reach=Rows(MeasuredMean(means[i].named.name, means[i].condition) for i in missed_observations(found)),
        separated=not flat,
    )


def _contradiction(means: Sequence[Measured], known: Fit) -> Contradicted | None:
    found = contradiction(known)
    if found is None:
        return None
    mean, (low, high) = means[found.index], found.allowed
    return Contradicted(mean.named.name, mean.condition, mean.value, low, high, found.standard_errors, found.p)


def _rows(
    means: Sequence[Measured], known: Fit, left_out: Sequence[float], intervals: Sequence[Interval | None]
) -> list[JointRow]:
    without: Sequence[float | None] = left_out or [None] * len(means)
    predicted, errors = known.predict(known.best)[0].tolist(), known.errors_percent(known.best).tolist()
    return [
        JointRow(mean.condition, mean.named.name, mean.named.unit, mean.value, mean.sd, mean.n, *values)
        for mean, *values in zip(means, predicted, errors, without, intervals, strict=True)
    ]


# A factor that changes by this part of its half-step along a flat direction is not determined by itself.
_MOVED = 0.25


def prior_rows(study: Study, coding: Coding) -> Rows[PriorRow]:
    """Return the priors of the factors of a surface, in their units."""
    known = [(factor, factor.prior) for factor in map(study.factor, coding.names) if factor.prior is not None]
    return Rows(PriorRow(factor.name, prior.mean, prior.sd, factor.unit, prior.source) for factor, prior in known)


def _certainty_of(study: Study, coding: Coding, known: Fit, source: Literal["joint", "single"]) -> Certainty:
    """Return the uncertainty of a fit to all measured means, or to the calibration target alone."""
    profiles, unseen = profiles_of(known), unseen_directions(known)
    changes = tuple(_changes_along(coding, row) for row in unseen)
    free = tuple(p.factor for p in profiles if p.free)
    parts = [pair for row in unseen for pair in zip(coding.names, moved_together(row), strict=True)]
    moved = {name for name, part in parts if abs(part) >= _MOVED}
    not_identified = tuple(name for name in coding.names if name in free or name in moved)
    loosest = _changes_along(coding, loosest_direction(known)) if not_identified and not changes else {}
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
    """Return the change of each factor along a coded direction, in its unit.

    The largest part changes by one half step; parts below a twentieth of it are left out.
    """
    steps = zip(coding.names, moved_together(direction), coding.half_step, strict=True)
    return {name: part * half_step for name, part, half_step in steps if part != 0.0}
