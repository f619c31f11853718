"""What can be said of a study's designs before any run: what they want, lose, and take for granted."""

from collections.abc import Iterator

from stemcal.notes import Note
from stemcal.study.model import EmbeddedSolver, Study, factors_taken

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


def beforehand(study: Study) -> Iterator[Note]:
    """Yield notes on the designs and the solver; none is a mistake."""
    k, runs = len(study.factors), study.screen.runs
    if study.screen.design == "plackett-burman" and runs is not None and runs <= _SMALL and k >= 3:
        yield SmallScreening(runs, k, runs - 1 - k, _USUAL, _USUAL - 1 - k)
    if study.rsm.design == "box-behnken" and study.rsm.factors == "significant":
        least, most = factors_taken(study.rsm.design)
        yield TooFewFactors(least, most, k) if k < least else FactorsWanted(least, most)
    if isinstance(study.solver, EmbeddedSolver) and "failure_strain" in study.names:
        yield LengthsBelong(str(study.material.internal_length), str(study.blade.edge_spread))
