"""What was measured, and the fit of the surfaces to it: shared by calibration, refinement, validation and verdict."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot

from stemcal.doe.calibration.fit import Fit, Prior, fit
from stemcal.doe.calibration.observations import Observation
from stemcal.doe.calibration.region import Region
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.naming import CUTTING, FIRST, Named, Naming
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import Study, Target


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
    """Return the priors of the factors of a surface."""
    scales = zip(coding.names, coding.centre, coding.half_step, strict=True)
    return tuple(
        Prior(j, known.kind, known.mean, known.sd, centre, half_step)
        for j, (name, centre, half_step) in enumerate(scales)
        if (known := study.factor(name).prior) is not None
    )


def measured_means(study: Study) -> list[Measured]:
    """Return what the joint fit is made to: every response measured at its diameters."""
    return [
        mean for target in study.joint_targets for mean in measured_of(target, study.fitted_responses, study.naming)
    ]


def joint_surfaces(study: Study, surface: SurfaceResult, further: Sequence[tuple[Array, Array]] = ()) -> list[Surface]:
    """Return the surface of every measured mean, in their order; `further` are points and the responses there."""
    at = {part.condition: part for part in surface.conditions}
    return [
        surface.refitted(at[mean.condition].runs, [(x, float(found[i])) for x, found in further], mean.response)
        for i, mean in enumerate(measured_means(study))
    ]


def fit_of_study(study: Study, surface: SurfaceResult) -> Fit:
    """Return the fit of everything that the parameters are fitted to, priors among it."""
    jointly = bool(study.joint_targets)
    means = measured_means(study) if jointly else measured_of(study.calibration_target, [FIRST], study.naming)
    surfaces = joint_surfaces(study, surface) if jointly else [surface.fitted]
    return fit_over(means, surfaces, surface.region(study), priors_of(study, surface.scales))
