"""What can be said of a study's designs before any run: what they want, lose, and take for granted."""

from __future__ import annotations

from stemcal.study.model import CommandSolver, Study, factors_taken
from stemcal.words import joined

__all__ = ["beforehand"]

_SMALL, _USUAL = 8, 12  # runs of a Plackett–Burman design


def beforehand(study: Study) -> list[str]:
    """Return sentences on the designs and the program; none is a mistake."""
    return [*_small_screening(study), *_factors_wanted(study), *_taken_for_deterministic(study)]


def _small_screening(study: Study) -> list[str]:
    """Say what a design of four or eight runs loses."""
    k, runs = len(study.factors), study.screen.runs
    if study.screen.design != "plackett-burman" or runs is None or runs > _SMALL or k < 3:
        return []
    df = runs - 1 - k
    left = f"{df} residual df is" if df == 1 else f"{df or 'no'} residual df are"
    return [
        f"screen.runs {runs} for {k} factors: each main effect is that of two-factor interactions too, wholly, and "
        f"{left} left to test against. In the usual {_USUAL} runs a third of an interaction is in it, and "
        f"{_USUAL - 1 - k} df are left."
    ]


def _factors_wanted(study: Study) -> list[str]:
    """Say how many factors a Box–Behnken design wants, and what becomes of the study if the screening finds others."""
    least, most = factors_taken(study.rsm.design)
    if study.rsm.design != "box-behnken" or study.rsm.factors != "significant":
        return []
    if len(study.factors) < least:
        return [
            f"rsm.design box-behnken wants {least} to {most} factors, this study has {len(study.factors)}: it will end "
            "after the screening. Write central-composite."
        ]
    return [
        f"rsm.design box-behnken wants {least} to {most} factors. If fewer are significant, the surface takes the "
        f"{least} of largest contribution, and some of its terms are noise; if more, the {most} strongest. "
        f"`rsm.factors: strongest {least}` says so beforehand; central-composite does with two."
    ]


def _taken_for_deterministic(study: Study) -> list[str]:
    """Say that a program is taken for deterministic that nobody has called so."""
    if not isinstance(study.solver, CommandSolver) or study.solver.by_chance or study.solver.deterministic is not None:
        return []
    words = ["centre points count once", "no scatter is expected"]
    return [
        f"solver.deterministic is not said: equal inputs are taken to give equal answers, so {joined(words)}. "
        "Write true, and one run is repeated to see it, or false if there is chance in the program."
    ]
