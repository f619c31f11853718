"""What to beware of in a fitted surface."""

from collections.abc import Iterator, Sequence

from stemcal.doe.regression.anova import LackOfFit
from stemcal.doe.regression.influence import RunDiagnostics
from stemcal.doe.regression.least_squares import LeastSquares
from stemcal.notes import Note, Weight

# Rules of thumb: a ratio of 4 makes a surface usable, a Cook's distance of 1 one run too strong, a variance
# inflation of 10 a coefficient too entangled with others.
ADEQUATE, _INFLUENTIAL, _ENTANGLED = 4.0, 1.0, 10.0


class SurfaceRunsFailed(Note, weight=Weight.NUMBERS):
    """Runs failed, so the design is not the planned one; its largest variance inflation."""

    failed: int
    runs: int
    df: int
    inflation: float


class TermsEntangled(Note):
    """The largest variance inflation is beyond what tells terms apart."""

    inflation: float


class FlatResponse(Note, weight=Weight.NUMBERS):
    """Every run gave the same response."""


class SaturatedSurface(Note, weight=Weight.NUMBERS):
    """There are as many coefficients as runs."""


class ExactSurface(Note):
    """The quadratic passes through every run exactly."""


class MostlyNoise(Note, weight=Weight.NUMBERS):
    """Adequate precision is below 4."""

    precision: float


class CopiesOnly(Note, weight=Weight.ASIDE):
    """So many runs repeat others exactly: the solver is deterministic, and every point counts once."""

    repeated: int
    df: int


class NothingRepeated(Note):
    """Lack of fit cannot be tested: no point is repeated."""


class NoPointToSpare(Note):
    """Lack of fit cannot be tested: as many distinct points as terms."""


class InfluentialRun(Note):
    """Cook's distance of a run is beyond 1."""

    run: int
    value: float
    cooks_distance: float


class VerdictOnOneRun(Note, weight=Weight.USE):
    """Whether lack of fit is significant depends on one run."""

    run: int
    value: float
    p: float
    without: float


def surface_notes(
    fit: LeastSquares,
    split: LackOfFit,
    diagnostics: Sequence[RunDiagnostics],
    precision: float | None,
    inflation: Sequence[float],
    failed: int,
    copies: int,
) -> Iterator[Note]:
    """Yield what the fit, its runs and their failures mean for the trust in it."""
    largest = max(inflation, default=1.0)
    if failed:
        yield SurfaceRunsFailed(failed, len(fit.response) + failed, fit.df, largest)
    if largest > _ENTANGLED:
        yield TermsEntangled(largest)
    if fit.flat:
        yield FlatResponse()
    elif fit.df == 0:
        yield SaturatedSurface()
    elif fit.exact:
        yield ExactSurface()
    if copies:
        yield CopiesOnly(copies, fit.df)
    yield from _lack_of_fit_notes(split)
    if precision is not None and precision < ADEQUATE:
        yield MostlyNoise(precision)
    yield from _influence_notes(split, diagnostics)


def _lack_of_fit_notes(split: LackOfFit) -> Iterator[Note]:
    if split.pure_df == 0:
        yield NothingRepeated()
    elif split.df == 0:
        yield NoPointToSpare()


def _influence_notes(split: LackOfFit, diagnostics: Sequence[RunDiagnostics]) -> Iterator[Note]:
    for run in diagnostics:
        if run.cooks_distance is not None and run.cooks_distance > _INFLUENTIAL:
            yield InfluentialRun(run.run, run.response, run.cooks_distance)
    for run in diagnostics:
        p, without = split.p, run.lack_of_fit_p_without
        if p is not None and without is not None and (p < 0.05) != (without < 0.05):
            yield VerdictOnOneRun(run.run, run.response, p, without)
