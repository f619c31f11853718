"""What a screening finds: effects, curvature, and the charts that judge effects."""

from dataclasses import dataclass
from typing import Literal

Standing = Literal["untested", "none", "disputed", "possible", "active"]


@dataclass(frozen=True)
class Conclusion:
    """Whether an effect stands out: by its p, by Lenth's margin of error (None: no such test), among all effects.

    `expected_sign`, ``+`` or ``-``, is what the study expected; None where it expected nothing.
    """

    by_p: bool | None
    by_lenth: bool | None
    among_all: bool
    expected_sign: str | None = None

    @property
    def standing(self) -> Standing:
        """Active where all methods agree, also among all effects; possible for one effect alone; else disputed.

        Untested where no method could judge it.
        """
        votes = [vote for vote in (self.by_p, self.by_lenth) if vote is not None]
        if not votes:
            return "untested"
        if not any(votes):
            return "none"
        if not all(votes):
            return "disputed"
        return "active" if self.among_all else "possible"


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
    stars: str
    lenth_t: float | None
    p_holm: float | None
    p_bh: float | None
    conclusion: Conclusion | None = None

    @property
    def sign(self) -> str:
        """The sign of the effect."""
        return "+" if self.effect > 0.0 else "-"

    @property
    def against_expectation(self) -> bool:
        """Whether the study expected the other sign."""
        expected = None if self.conclusion is None else self.conclusion.expected_sign
        return expected is not None and expected != self.sign


@dataclass(frozen=True)
class Curvature:
    """Mean of the corners, mean of so many centre runs, what they differ by (corners − centre), and its test.

    `df` are the degrees of freedom of the error; `curved` tells whether p is below the level of significance.
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


@dataclass(frozen=True)
class HalfNormalPoint:
    """|effect| and the half-normal quantile that it would have if all effects were chance."""

    factor: str
    size: float
    quantile: float


@dataclass(frozen=True)
class ParetoRow:
    """|t| of one effect."""

    factor: str
    t: float


@dataclass(frozen=True)
class Pareto:
    """|t| in falling order, with the limit of one test and, after Bonferroni, of all."""

    rows: tuple[ParetoRow, ...]
    t_limit: float | None
    bonferroni_limit: float | None


@dataclass(frozen=True)
class AliasMatrix:
    """How much of each two-factor interaction is in each effect's coefficient."""

    interactions: tuple[str, ...]
    weights: dict[str, tuple[float, ...]]
