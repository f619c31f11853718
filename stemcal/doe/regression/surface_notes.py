"""What to beware of in a fitted surface."""

from collections.abc import Iterator, Sequence

from stemcal.doe.regression.anova import LackOfFit
from stemcal.doe.regression.influence import RunDiagnostics
from stemcal.doe.regression.least_squares import LeastSquares
from stemcal.naming import Names
from stemcal.note import Note
from stemcal.numbers import signed_probability
from stemcal.words import counted

# Rules of thumb: a ratio of 4 makes a surface usable, a Cook's distance of 1 one run too strong, a variance
# inflation of 10 a coefficient too entangled with others.
ADEQUATE, _INFLUENTIAL, _ENTANGLED = 4.0, 1.0, 10.0


def flat_response(consequence: str) -> Note:
    """Return the warning that every run gave the same response."""
    return Note("flat_response", "warning", f"Every run gave the same response: {consequence}.")


def surface_notes(
    fit: LeastSquares,
    split: LackOfFit,
    diagnostics: Sequence[RunDiagnostics],
    precision: float | None,
    inflation: Sequence[float],
    failed: int,
    copies: int,
    written: Names,
) -> Iterator[Note]:
    """Yield what the fit, its runs and their failures mean for the trust in it."""
    largest = max(inflation, default=1.0)
    if failed:
        text = (
            f"{failed} of {len(fit.response) + failed} runs failed; the surface is fitted to the others, with {fit.df} "
            f"residual df. The design is no longer as planned (largest variance inflation factor {largest:.2f})."
        )
        yield Note("surface_runs_failed", "warning", text)
    if largest > _ENTANGLED:
        text = f"Some terms are nearly collinear (largest variance inflation factor {largest:.1f})."
        yield Note("terms_entangled", "caution", text)
    if fit.flat:
        yield flat_response("the surface is constant")
    elif fit.df == 0:
        text = "The surface has as many coefficients as runs, so its error cannot be estimated."
        yield Note("saturated_surface", "warning", text)
    elif fit.exact:
        yield Note("exact_surface", "caution", "The surface passes through every run exactly: F cannot be computed.")
    if copies:
        text = (
            f"{counted(copies, 'run')} exactly repeat others, so the solver is deterministic. Each point counts once, "
            f"which leaves {fit.df} residual df."
        )
        yield Note("copies_only", "info", text)
    yield from _lack_of_fit_notes(split)
    if precision is not None and precision < ADEQUATE:
        text = f"Adequate precision {precision:.2f} is below {ADEQUATE:g}: the surface is mostly noise."
        yield Note("mostly_noise", "warning", text)
    yield from _influence_notes(split, diagnostics, written)


def _lack_of_fit_notes(split: LackOfFit) -> Iterator[Note]:
    untested = "Lack of fit cannot be tested"
    if split.pure_df == 0:
        yield Note("nothing_repeated", "caution", f"{untested}: no repeated runs differ.")
    elif split.df == 0:
        text = f"{untested}: the design has as many distinct points as the surface has terms."
        yield Note("no_point_to_spare", "caution", text)


def _influence_notes(split: LackOfFit, diagnostics: Sequence[RunDiagnostics], written: Names) -> Iterator[Note]:
    def called(run: RunDiagnostics) -> str:
        return f"run {run.run} ({written.quantity(run.response, 'g')})"

    for run in diagnostics:
        if run.cooks_distance is not None and run.cooks_distance > _INFLUENTIAL:
            text = f"One run strongly influences the surface: {called(run)}, Cook's distance {run.cooks_distance:.2f}."
            yield Note("influential_run", "caution", text)
    for run in diagnostics:
        p, without = split.p, run.lack_of_fit_p_without
        if p is not None and without is not None and (p < 0.05) != (without < 0.05):
            text = (
                f"The test for lack of fit depends on {called(run)}: p is {signed_probability(p)} with it and "
                f"{signed_probability(without)} without it."
            )
            yield Note("verdict_on_one_run", "warning", text)
