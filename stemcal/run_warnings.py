"""What a careful engineer would want to know about a run before using its force: facts, a class for each kind."""

from stemcal.files.typed import Tagged

# Shares above which a result is to be looked at before it is used, percent.
MOST_INERTIA = 5.0
MOST_HOURGLASS = 10.0
MOST_DRIFT = 2.0
# Of how far a section has widened; a piece that stays straight has up to 2.
MOST_BUCKLING = 5.0
# With less added mass than this inertia is the stem's own and no doubt, percent.
NEGLIGIBLE_MASS = 1.0


class RunWarning(Tagged):
    """A doubt about a run's force, with the values it speaks of; in records ``{"kind": …, ...values}``."""


class StrokeTooShort(RunWarning):
    """The maximum is not known to be passed when the stroke ends.

    The curve is ``rising``, ``regained`` or ``falling`` (`cutting.stroke`). Forces in N at the peak, at the lowest
    point after it and at the end, travel in mm.
    """

    ending: str
    peak: float
    peak_travel: float
    valley: float
    end: float
    stroke: float


class MaximumNotPassed(RunWarning):
    """A laboratory test ends, after so many mm, before its force is known to have passed its maximum."""

    stroke: float


class Buckles(RunWarning):
    """A piece between lubricated ends bends or wrinkles before it breaks, by that share of how far it has widened."""

    percent: float


class EnergyDrifts(RunWarning):
    """The energy balance is off by that share of the work."""

    percent: float


class InertiaInForce(RunWarning):
    """Blade and supports differ at the peak, of the force on the blade; kinetic energy is of internal energy."""

    percent: float
    kinetic_percent: float


class HourglassEnergy(RunWarning):
    """Hourglass energy, of internal energy."""

    percent: float


class ForceAfterBreak(RunWarning):
    """After the break at a travel (mm) the force exceeds the peak before it (N)."""

    travel: float
    force: float
    peak: float


class NothingDeleted(RunWarning):
    """The material has no failure criterion: at the failure strain elements lose their shear stress and stay."""
