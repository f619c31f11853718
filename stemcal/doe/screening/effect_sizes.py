"""What a screening finds: effects, and the charts that judge them."""

from __future__ import annotations

from dataclasses import dataclass


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
    verdict: str = ""


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
