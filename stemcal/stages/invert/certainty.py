"""How well the measured means fix the parameters: profiles and intervals."""

from collections.abc import Sequence
from typing import Literal

from stemcal.doe.calibration.fit import Fit
from stemcal.doe.calibration.intervals import (
    Profile,
    loosest_direction,
    moved_together,
    profiles_of,
    unseen_directions,
)
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import Array
from stemcal.files.rows import Rows
from stemcal.stages.invert.result import Certainty, PriorRow, ProfileCurve
from stemcal.stages.result import Interval
from stemcal.study.model import Study

# A factor that changes by this part of its half-step along a flat direction is not determined by itself.
_MOVED = 0.25


def prior_rows(study: Study, coding: Coding) -> Rows[PriorRow]:
    """Return the priors of the factors of a surface, in their units."""
    known = [(name, study.factor(name)) for name in coding.names]
    return Rows(
        PriorRow(name, factor.prior.kind, factor.prior.mean, factor.prior.sd, factor.unit, factor.prior.source)
        for name, factor in known
        if factor.prior is not None
    )


def certainty_of(study: Study, coding: Coding, known: Fit, source: Literal["joint", "single"]) -> Certainty:
    """Return what a fit leaves possible: of all measured means, or of the calibration target alone."""
    profiles, unseen = profiles_of(known), unseen_directions(known)
    changes = tuple(changes_along(coding, row) for row in unseen)
    free = tuple(p.factor for p in profiles if p.free)
    moved = {name for row in unseen for name in _movers(coding.names, row)}
    not_identified = tuple(name for name in coding.names if name in free or name in moved)
    loosest = changes_along(coding, loosest_direction(known)) if not_identified and not changes else {}
    return Certainty(
        source=source,
        scatter=known.errors.scatter,
        level=0.95,
        intervals={p.factor: _natural(coding, j, p.low, p.high) for j, p in enumerate(profiles)},
        coded_intervals={p.factor: (p.low, p.high) for p in profiles},
        bounded={p.factor: p.bounded for p in profiles},
        share={p.factor: p.share for p in profiles},
        free=free,
        not_identified=not_identified,
        loosest=changes[0] if changes else loosest,
        profiles={p.factor: _curve(coding, j, p) for j, p in enumerate(profiles)},
        directions=tuple(coding.by_name(row) for row in unseen),
        unseen_changes=changes,
        known_sd=known.errors.scatter == "measured" and all((o.n or 1) == 1 for o in known.observations),
        surface_error_known=known.errors.surface_error_known,
        units={name: study.factor(name).unit for name in coding.names},
    )


def _value(coding: Coding, j: int, coded: float) -> float:
    return coding.centre[j] + coding.half_step[j] * float(coded)


def _natural(coding: Coding, j: int, low: float, high: float) -> Interval:
    return _value(coding, j, low), _value(coding, j, high)


def _movers(names: Sequence[str], direction: Array) -> list[str]:
    """Return the factors that move along a direction by more than a small part of the one that moves most."""
    return [name for name, part in zip(names, moved_together(direction), strict=True) if abs(part) >= _MOVED]


def changes_along(coding: Coding, direction: Array) -> dict[str, float]:
    """Return how much each factor changes along a coded direction, in its unit.

    The largest part changes by one half step; parts below a twentieth of it are left out.
    """
    steps = zip(coding.names, moved_together(direction), coding.half_step, strict=True)
    return {name: part * half_step for name, part, half_step in steps if part != 0.0}


def _curve(coding: Coding, j: int, profile: Profile) -> ProfileCurve:
    values = tuple(_value(coding, j, value) for value in profile.values.tolist())
    return ProfileCurve(values, tuple(profile.rise.tolist()), profile.allowed)
