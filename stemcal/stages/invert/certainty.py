"""How well the measured means fix the parameters: profiles and intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot
from typing import Literal

from stemcal.doe.calibration.fit import Fit, Prior, fit
from stemcal.doe.calibration.intervals import (
    Profile,
    loosest_direction,
    moved_together,
    profiles_of,
    unseen_directions,
)
from stemcal.doe.calibration.observations import Observation
from stemcal.doe.calibration.region import Region
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.files.rows import Rows
from stemcal.naming import CUTTING, FIRST, Named, Naming
from stemcal.stages.invert.result import Certainty, PriorRow, ProfileCurve
from stemcal.stages.result import Interval
from stemcal.study.model import Study, Target

# A factor that moves by so much of its half step, where another goes a whole one, is not fixed by itself.
_MOVED = 0.25


@dataclass(frozen=True)
class Measured:
    """A measured mean at one condition: of the ``force``, or of a further response such as ``travel`` or ``work``.

    `specimens` and `systematic` are those of an `Observation`.
    """

    condition: float
    response: str
    value: float
    sd: float | None = None
    n: int | None = None
    naming: Naming = CUTTING
    specimens: str = ""
    systematic: Mapping[str, float] = field(default_factory=dict)

    @property
    def spread(self) -> float | None:
        """The standard deviation of n specimens by themselves that would leave the mean as uncertain."""
        alike = hypot(*self.systematic.values())
        return None if self.sd is None else hypot(self.sd, (self.n or 1) ** 0.5 * alike)

    @property
    def named(self) -> Named:
        """What the response is called."""
        return self.naming.named(self.response)

    @property
    def leads(self) -> bool:
        """Whether a fit is judged by it: the force, and every response that a study declares itself."""
        return self.response == FIRST or not self.naming.is_cutting


def measured_of(target: Target, responses: Sequence[str], naming: Naming = CUTTING) -> list[Measured]:
    """Return what was measured of these responses at one condition."""
    found = []
    for name in responses:
        mean, sd = target.mean_of(name)
        if mean:
            more = (target.specimens_of(name), target.systematic_of(name))
            found.append(Measured(target.condition, name, mean, sd, target.count_of(name), naming, *more))
    return found


def fit_over(
    measured: Sequence[Measured], surfaces: Sequence[Surface], region: Region, priors: Sequence[Prior] = ()
) -> Fit:
    """Fit measured means, each with its surface, and priors within a region."""
    observations = [
        Observation(s, mean.value, mean.sd, mean.n, mean.response, mean.specimens, mean.systematic)
        for mean, s in zip(measured, surfaces, strict=True)
    ]
    return fit(observations, region, priors)


def priors_of(study: Study, coding: Coding) -> tuple[Prior, ...]:
    """Return what the study knows beforehand of the factors of a surface."""
    scales = zip(coding.names, coding.centre, coding.half_step, strict=True)
    return tuple(
        Prior(j, known.kind, known.mean, known.sd, centre, half_step)
        for j, (name, centre, half_step) in enumerate(scales)
        if (known := study.factor(name).prior) is not None
    )


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
