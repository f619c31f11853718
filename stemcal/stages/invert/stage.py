"""The calibration as a stage: the point of the surface that gives one measured mean, or of several for theirs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stemcal.doe.calibration.level_set import solve_target
from stemcal.doe.regression.coding import Coding
from stemcal.stages.invert import certainty, words
from stemcal.stages.invert.joint import fit_of_study, solve_jointly
from stemcal.stages.invert.result import InvertResult, Point
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
    idle = tuple(one.name for one in study.factors if one.prior is not None and one.name not in surface.names)
    notes = (*words.notes_of(solved), *solved.notes, *([words.prior_unused(idle)] if idle else []))
    return replace(solved, belongs_to=work.solver.belongings(solved.condition), notes=notes)


def solve(study: Study, head: Head, surface: SurfaceResult) -> InvertResult:
    """Return the calibrated point, what is known about it, and every factor's level there."""
    coding, target = surface.scales, study.calibration_target
    region, unit = surface.region(study), study.naming.response.unit_suffix
    ends, rule = (region.low, region.high, region.radius), study.invert.rule
    found = solve_target(surface.fitted, target.response, *ends, rule, unit)
    whole = replace(fit_of_study(study, surface), best=np.array(found.point.coded))
    known = certainty.certainty_of(study, coding, whole, "single")
    point = Point.of(found.point, coding)
    return InvertResult.of(
        study,
        head,
        surface.radius,
        point,
        known,
        ranges=_by_factor(coding, found.ranges),
        coded_ranges=dict(zip(coding.names, found.ranges, strict=True)),
        rule=found.rule,
        notes=tuple(words.of_level_set(found.free, found.second)),
    )


def _by_factor(coding: Coding, coded: Sequence[Interval]) -> dict[str, Interval]:
    natural = coding.to_natural(np.array(coded).T).T
    return {name: (float(lo), float(hi)) for name, (lo, hi) in zip(coding.names, natural, strict=True)}
