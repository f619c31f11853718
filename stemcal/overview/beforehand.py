"""Notes on the designs and the solver of a study before any run: requirements, losses and assumptions."""

from collections.abc import Iterator
from math import isclose

from stemcal.note import Note, Remedy
from stemcal.study.model import EmbeddedSolver, Growth, Study, factors_taken

_SMALL, _USUAL = 8, 12  # runs of a Plackett–Burman design


def beforehand(study: Study) -> Iterator[Note]:
    """Yield notes on the designs and the solver; none is a mistake."""
    k, runs = len(study.factors), study.screen.runs
    if study.screen.design == "plackett-burman" and runs is not None and runs <= _SMALL and k >= 3:
        yield _small_screening(runs, k)
    if study.rsm.design == "box-behnken" and study.rsm.factors == "significant":
        least, most = factors_taken(study.rsm.design)
        yield _box_behnken(least, most, k)
    yield from _not_varied(study)
    if isinstance(study.solver, EmbeddedSolver) and "failure_strain" in study.names:
        text = (
            f"The failure strain depends on internal_length {study.material.internal_length} and edge_spread "
            f"{study.blade.edge_spread}: a cutting curve cannot separate the three."
        )
        remedy = Remedy("Choose the lengths first, keep them, and report all three.")
        yield Note("lengths_belong", "caution", text, remedy)


def _small_screening(runs: int, factors: int) -> Note:
    df = runs - 1 - factors
    left = f"{df or 'no'} residual df {'is' if df == 1 else 'are'} left for the test"
    text = (
        f"screen.runs {runs} for {factors} factors: each main effect is fully aliased with two-factor interactions, "
        f"and {left}. With {_USUAL} runs the alias weight is 1/3, and {_USUAL - 1 - factors} df are left."
    )
    return Note("small_screening", "caution", text)


def _box_behnken(least: int, most: int, factors: int) -> Note:
    needs = f"rsm.design box-behnken needs {least} to {most} factors"
    if factors < least:
        text = f"{needs}, this study has {factors}: it will stop after the screening."
        return Note("too_few_factors", "caution", text, Remedy("Use central-composite."))
    text = (
        f"{needs}. If fewer are significant, the surface uses the {least} with the largest contribution, and some of "
        f"its terms are noise; if more, the {most} strongest."
    )
    remedy = Remedy(f"Set this with `rsm.factors: strongest {least}`; central-composite needs only two.")
    return Note("factors_wanted", "caution", text, remedy)


def _not_varied(study: Study) -> Iterator[Note]:
    """Yield the factors that stay at mid-level; an exponent changes nothing where its growth is one."""
    if isinstance(study.rsm.factors, str):
        return
    at = study.targets.calibrate_at
    grown = [growth for growth in study.material.growing().values() if isinstance(growth, Growth)]
    unseen = {growth.exponent for growth in grown if isclose(growth.at, at)}
    for factor in study.factors:
        screened = study.screen.design != "none" and factor.name not in unseen
        if not screened and factor.name not in study.rsm.factors:
            text = (
                f"No run varies {factor.name}: it is neither screened nor listed in rsm.factors, and stays at "
                f"{factor.centre:g}."
            )
            remedy = Remedy("List it in rsm.factors, or set this value instead of a range.")
            yield Note("not_varied", "caution", text, remedy)
