"""One measured mean: the point of the surface that gives it."""

from __future__ import annotations

import numpy as np

from stemcal.doe.calibration.inversion import solve_target
from stemcal.doe.calibration.region import Region
from stemcal.naming import FIRST
from stemcal.remarks import Remark, Weight
from stemcal.stages.invert.certainty import certainty_of, measured_of, misfit_over
from stemcal.stages.invert.result import InvertResult, Point, PublishedPoint
from stemcal.stages.result import Head, Interval
from stemcal.stages.surface.result import SurfaceResult, box_of
from stemcal.study.model import Study

_PUBLISHED_OUTSIDE = Remark(
    Weight.NUMBERS, "The published solution lies outside the design region: the surface extrapolates there."
)


def solve(study: Study, head: Head, surface: SurfaceResult) -> InvertResult:
    """Return the calibrated point, what is known about it, and every factor's level there."""
    coding, target = surface.scales, study.calibration_target
    low, high, response = *box_of(study, coding), study.naming.response
    found = solve_target(surface.fitted, target.response, low, high, surface.radius, study.invert.rule, response)
    measured = measured_of(target, [FIRST], study.naming)
    misfit = misfit_over(measured, [surface.fitted])
    region = Region(low, high, surface.radius)
    known = certainty_of(study, coding, misfit, region, f"{measured[0].label} alone")
    point = Point.of(found.point, coding)
    natural = coding.to_natural(np.array(found.ranges).T).T
    ranges: dict[str, Interval] = {
        name: (float(lo), float(hi)) for name, (lo, hi) in zip(coding.names, natural, strict=True)
    }
    return InvertResult(
        head=head,
        target=found.target,
        point=point,
        ranges=ranges,
        coded_ranges=dict(zip(coding.names, found.ranges, strict=True)),
        reachable=found.reachable,
        rule=found.rule,
        share=found.share,
        radius=found.radius,
        certainty=known,
        condition=target.condition,
        target_sd=target.sd,
        target_n=target.n,
        parameters={**study.midlevels(), **point.solution},
        notes=(*found.notes, *known.sentences),
    )


def assess_published(study: Study, surface: SurfaceResult) -> tuple[PublishedPoint | None, list[str]]:
    """Return what the surface says of the published solution, and remarks; (None, []) if there is none."""
    if study.published is None or not study.published.solution:
        return None, []
    coding, given, response = surface.scales, study.published.solution, study.naming.response
    missing = [name for name in coding.names if name not in given]
    natural = [given.get(name, centre) for name, centre in zip(coding.names, coding.centre, strict=True)]
    point = surface.assess(study, coding.to_coded(natural))
    apart = point.predicted - study.calibration_target.response
    remarks = [
        f"At the published solution the surface predicts {response.text(point.predicted, '.2f')}, "
        f"{response.text(apart, '+.2f')} from the target; it is one point of the solution set."
    ]
    if missing:
        remarks.append(f"The published solution has no {', '.join(missing)}; the centre is taken.")
    if not point.inside:
        remarks.append(_PUBLISHED_OUTSIDE())
    return PublishedPoint(point=Point.of(point, coding), difference=apart), remarks
