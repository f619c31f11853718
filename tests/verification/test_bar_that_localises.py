"""A bar necks and parts: at the same elongation and work whatever its elements, and in OpenRadioss as foretold."""

import os
from functools import cache
from math import pi, sqrt
from typing import Any

import necking_bar as BARS
import pytest

from stemcal.solvers.deck.equivalents import nonlocal_length
from stemcal.solvers.deck.openradioss import HOME


@cache
def pulled(breadth: float, parts: int) -> Any:
    """Return a bar of this breadth (of ℓ) with elements of ℓ over `parts`, pulled by the embedded solver."""
    return BARS.pulled_here(breadth, BARS.LENGTH / parts)


@pytest.mark.parametrize(
    "breadth", [1 / 8, *(pytest.param(wide, marks=pytest.mark.slow) for wide in (1 / 2, 1.0, 2.0))]
)
def test_elongation_and_work_are_not_the_meshs(breadth: float) -> None:
    """Of three sizes of elements; that of the narrow bar tends to ε_f ℓ √π from above, by 4 % from ℓ/3 to ℓ/8.

    The mean at failure is that of the weight exp(−r²/ℓ²) over the profile; the strain grows by 0.3 % to the output.
    """
    bars = [pulled(breadth, parts) for parts in BARS.SECTIONS[breadth]]
    for told, within in (("elongation", 0.05), ("work", 0.06), ("zone", 0.07)):
        values = [getattr(one, told) for one in bars]
        assert max(values) < (1.0 + within) * min(values), told
    for one in bars:
        assert BARS.gaussian_mean(one) == pytest.approx(BARS.LAW.failure_strain, rel=0.02)
        assert one.zone > BARS.LENGTH * sqrt(pi)
    if breadth < 0.2:
        assert bars[-1].zone == pytest.approx(BARS.LENGTH * sqrt(pi), rel=0.05)


def test_length_for_openradioss_lies_between_the_limits() -> None:
    """√π/2 ℓ for a neck without length, ℓ/2 for one that is long against ℓ, less the longer the neck."""
    narrow, wide = (BARS.radioss_length(pulled(1 / 8, parts)) / BARS.LENGTH for parts in (8, 3))
    assert 0.5 < wide < narrow < 0.5 * sqrt(pi)


@pytest.mark.slow
@pytest.mark.skipif(HOME not in os.environ, reason=f"{HOME} names no OpenRadioss")
@pytest.mark.parametrize(("breadth", "parts"), [(1 / 8, 3), (1 / 8, 8), (1 / 2, 8), (1.0, 4)])
def test_openradioss_parts_the_bar_alike(breadth: float, parts: int) -> None:
    """With the length worked out neck, zone, elongation and work agree; with that of decks the zone is as foretold."""
    here, size = pulled(breadth, parts), BARS.LENGTH / parts
    there = BARS.pulled_there(breadth, size, BARS.radioss_length(here) / BARS.LENGTH)
    for told in ("neck", "zone", "elongation", "work"):
        assert getattr(there, told) == pytest.approx(getattr(here, told), rel=0.05), told
    own = nonlocal_length(BARS.LENGTH, "openradioss", size) / BARS.LENGTH
    foretold = BARS.radioss_mean(here, own * BARS.LENGTH)
    assert BARS.pulled_there(breadth, size, own).zone == pytest.approx(
        2.0 * size * float(foretold.sum()) / float(foretold.max()), rel=0.05
    )
