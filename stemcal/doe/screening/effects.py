"""What a screening finds: effects, their residual, and curvature."""

from dataclasses import dataclass

from stemcal.doe.screening.lenth import Lenth


@dataclass(frozen=True)
class Effect:
    """One factor's change of the response from its low to its high level, with its tests."""

    factor: str
    symbol: str
    effect: float
    contribution_percent: float
    sum_of_squares: float
    f: float | None
    p: float | None
    lenth_t: float | None


@dataclass(frozen=True)
class Residual:
    """What the effects leave unexplained."""

    sum_of_squares: float
    df: int


@dataclass(frozen=True)
class Curvature:
    """Mean of the corners, mean of `runs` centre runs, their difference (corners − centre), and its test.

    `curved` is True where p is below the level of significance.
    """

    corners: float
    centre: float
    runs: int
    difference: float
    sum_of_squares: float
    f: float | None
    p: float | None
    df: int
    curved: bool


def stands_out(effect: Effect, size: Lenth) -> bool:
    """Return whether an effect exceeds Lenth's margin of error."""
    return size.me is not None and abs(effect.effect) > size.me
