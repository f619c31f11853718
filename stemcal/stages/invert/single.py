"""One measured mean: the point of the surface that gives it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stemcal.doe.calibration.inversion import solve_target
from stemcal.doe.calibration.region import Region
from stemcal.naming import FIRST
from stemcal.notes import Note
from stemcal.stages.invert.certainty import certainty_of, measured_of, misfit_over
from stemcal.stages.invert.result import InvertResult, Point, PublishedPoint
from stemcal.stages.result import Head, Interval
from stemcal.stages.surface.result import SurfaceResult, box_of
from stemcal.study.model import Study


@dataclass(frozen=True)
class PublishedIncomplete(Note):
    """The published solution lacks factors of the surface: their centres are taken."""

    factors: tuple[str, ...]


def solve(study: Study, head: Head, surface: SurfaceResult) -> InvertResult:
    """Return the calibrated point, what is known about it, and every factor's level there."""
    coding, target = surface.scales, study.calibration_target
    (low, high), unit = box_of(study, coding), study.naming.response.unit_suffix
    found = solve_target(surface.fitted, target.response, low, high, surface.radius, study.invert.rule, unit)
    region = Region(low, high, surface.radius)
    misfit = misfit_over(measured_of(target, [FIRST], study.naming), [surface.fitted], region)
    known = certainty_of(study, coding, misfit, region, "single", np.array(found.point.coded))
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
        notes=found.notes,
    )


def assess_published(study: Study, surface: SurfaceResult) -> tuple[PublishedPoint | None, list[Note]]:
    """Return what the surface says of the published solution, and notes; (None, []) if there is none."""
    if study.published is None or not study.published.solution:
        return None, []
    coding, given = surface.scales, study.published.solution
    missing = tuple(name for name in coding.names if name not in given)
    natural = [given.get(name, centre) for name, centre in zip(coding.names, coding.centre, strict=True)]
    point = surface.assess(study, coding.to_coded(natural))
    published = PublishedPoint(
        point=Point.of(point, coding), difference=point.predicted - study.calibration_target.response
    )
    return published, [PublishedIncomplete(missing)] if missing else []
