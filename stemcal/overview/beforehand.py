"""What can be said of a study's designs before any run: what they want, lose, and take for granted."""

from collections.abc import Iterator
from math import isclose

from stemcal.notes import Note
from stemcal.study.model import EmbeddedSolver, Growth, Study, factors_taken

_SMALL, _USUAL = 8, 12  # runs of a Plackett–Burman design


class SmallScreening(Note):
    """A Plackett–Burman design of four or eight runs aliases main effects wholly with interactions."""

    runs: int
    factors: int
    df: int
    usual_runs: int
    usual_df: int


class TooFewFactors(Note):
    """The design of the surface wants more factors than the study has."""

    least: int
    most: int
    factors: int


class FactorsWanted(Note):
    """The design of the surface wants so many factors, whatever the screening finds."""

    least: int
    most: int


class LengthsBelong(Note):
    """The failure strain that will be found belongs to these lengths, as the spec writes them."""

    internal_length: str
    edge_spread: str


class NotVaried(Note):
    """A factor that no run varies: it is not screened, or not where it shows, and `rsm.factors` does not name it."""

    factor: str
    level: float


def beforehand(study: Study) -> Iterator[Note]:
    """Yield notes on the designs and the solver; none is a mistake."""
    k, runs = len(study.factors), study.screen.runs
    if study.screen.design == "plackett-burman" and runs is not None and runs <= _SMALL and k >= 3:
        yield SmallScreening(runs, k, runs - 1 - k, _USUAL, _USUAL - 1 - k)
    if study.rsm.design == "box-behnken" and study.rsm.factors == "significant":
        least, most = factors_taken(study.rsm.design)
        yield TooFewFactors(least, most, k) if k < least else FactorsWanted(least, most)
    yield from _not_varied(study)
    if isinstance(study.solver, EmbeddedSolver) and "failure_strain" in study.names:
        yield LengthsBelong(str(study.material.internal_length), str(study.blade.edge_spread))


def _not_varied(study: Study) -> Iterator[NotVaried]:
    """Yield the factors that stay at mid-level; an exponent changes nothing where its growth is one."""
    if isinstance(study.rsm.factors, str):
        return
    at = study.targets.calibrate_at
    grown = [growth for growth in study.material.growing().values() if isinstance(growth, Growth)]
    unseen = {growth.exponent for growth in grown if isclose(growth.at, at)}
    for factor in study.factors:
        screened = study.screen.design != "none" and factor.name not in unseen
        if not screened and factor.name not in study.rsm.factors:
            yield NotVaried(factor.name, factor.centre)
