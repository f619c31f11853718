"""The calibration as a stage: the point of the surface that gives one measured mean, or of several for theirs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stemcal.doe.calibration.inversion import solve_target
from stemcal.doe.calibration.misfit import Misfit
from stemcal.doe.calibration.process_inversion import reach_of, solve_by_process
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.gaussian_process import GaussianProcess
from stemcal.errors import TargetUnreachable
from stemcal.naming import FIRST
from stemcal.solvers.protocol import Belonging
from stemcal.stages.invert import certainty
from stemcal.stages.invert.joint import solve_jointly
from stemcal.stages.invert.result import (
    InvertResult,
    Point,
    PriorUnused,
    SolvedByProcess,
)
from stemcal.stages.result import Head, Interval
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import Study

__all__ = ["InvertResult", "invert"]


@a_stage(InvertResult)
def invert(work: Work, head: Head) -> InvertResult:
    """Solve the surface for the force measured at the calibration diameter, or several surfaces for theirs."""
    study, surface = work.study, work.result(SurfaceResult)
    solved = (solve_jointly if study.joint_targets else solve)(study, head, surface)
    seen = work.solver
    belongs_to = seen.belongings(solved.condition) if isinstance(seen, Belonging) else None
    idle = tuple(one.name for one in study.factors if one.prior is not None and one.name not in surface.names)
    notes = (*solved.notes, *([PriorUnused(idle)] if idle else []))
    return replace(solved, belongs_to=belongs_to, notes=notes)


def solve(study: Study, head: Head, surface: SurfaceResult) -> InvertResult:
    """Return the calibrated point, what is known about it, and every factor's level there."""
    coding, target = surface.scales, study.calibration_target
    region, unit = surface.region(study), study.naming.response.unit_suffix
    priors = certainty.priors_of(study, coding)
    misfit = certainty.misfit_over(certainty.measured_of(target, [FIRST], study.naming), [surface.fitted], region)
    misfit = misfit.with_priors(priors, region)
    try:
        ends, rule = (region.low, region.high, region.radius), study.invert.rule
        found = solve_target(surface.fitted, target.response, *ends, rule, unit, region.within, priors)
    except TargetUnreachable as unreachable:
        if surface.process is None:
            raise
        return _solve_by_process(study, head, surface, surface.process, misfit, region, unreachable)
    known = certainty.certainty_of(study, coding, misfit, region, "single", np.array(found.point.coded))
    point = Point.of(found.point, coding)
    return InvertResult.of(
        study,
        head,
        surface.radius,
        point,
        known,
        ranges=_by_factor(coding, found.ranges),
        coded_ranges=dict(zip(coding.names, found.ranges, strict=True)),
        reachable=found.reachable,
        rule=found.rule,
        share=found.share,
        priors=certainty.prior_rows(study, coding, misfit, region),
        notes=found.notes,
    )


def _solve_by_process(
    study: Study,
    head: Head,
    surface: SurfaceResult,
    process: GaussianProcess,
    misfit: Misfit,
    region: Region,
    unreachable: TargetUnreachable,
) -> InvertResult:
    """Solve by the process, which predicts runs left out better than the quadratic that does not reach the target.

    Raises
    ------
    TargetUnreachable
        If the process, its errors counted, does not reach it either.
    """
    coding, target = surface.scales, study.calibration_target
    low, high = reach_of(process, region)
    if not low <= target.response <= high:
        raise TargetUnreachable(target.response, low, high, study.naming.response.unit_suffix)
    laboratory = float(sum(source.variance[0] for source in misfit.sources if source.name == "laboratory"))
    df = min((source.df for source in misfit.sources if source.name == "laboratory"), default=np.inf)
    found = solve_by_process(process, coding.names, target.response, laboratory, df, region, misfit.priors)
    known = certainty.certainty_by_process(study, coding, found, process.gradient(found.coded), misfit)
    point = Point.of(surface.assess(study, found.coded, process), coding)
    opinion = surface.second_opinion
    note = SolvedByProcess(
        unreachable.low,
        unreachable.high,
        surface.predicted_r2,
        None if opinion is None else opinion.process_predicted_r2,
    )
    reachable, rule = found.reachable, "process_nearest_to_centre"
    rows = certainty.prior_rows(study, coding, None, region)
    more = {"reachable": reachable, "rule": rule, "priors": rows, "notes": (note,)}
    return InvertResult.of(study, head, surface.radius, point, known, **more)


def _by_factor(coding: Coding, coded: Sequence[Interval]) -> dict[str, Interval]:
    natural = coding.to_natural(np.array(coded).T).T
    return {name: (float(lo), float(hi)) for name, (lo, hi) in zip(coding.names, natural, strict=True)}
