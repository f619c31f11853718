"""What to beware of in a fitted surface, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from stemcal.doe.anova import LackOfFit
from stemcal.doe.influence import RunDiagnostics
from stemcal.doe.regression import LeastSquares

DETERMINISTIC = "lack of fit cannot be tested: the solver is deterministic"
# Rules of thumb: a ratio of 4 makes a surface usable, a Cook's distance of 1 one run too strong, a variance
# inflation of 10 a coefficient too entangled with others.
_ADEQUATE, _INFLUENTIAL, _ENTANGLED = 4.0, 1.0, 10.0


def surface_notes(
    fit: LeastSquares,
    split: LackOfFit,
    diagnostics: Sequence[RunDiagnostics],
    precision: float | None,
    inflation: Sequence[float],
    n_failed: int,
) -> list[str]:
    """Say what the fit, its runs and their failures mean for the trust in it."""
    notes = []
    if n_failed:
        notes.append(
            f"{n_failed} of {len(fit.response) + n_failed} runs failed; the surface is fitted to the others, "
            f"with {fit.df} residual df; the design is no longer as planned (largest variance inflation "
            f"{max(inflation, default=1.0):.2f})."
        )
    if max(inflation, default=1.0) > _ENTANGLED:
        notes.append(
            f"The largest variance inflation is {max(inflation):.1f}: the runs hardly tell some terms apart, "
            "and their coefficients are uncertain one by one."
        )
    if fit.flat:
        notes.append("Every run gave the same response: the surface is flat.")
    elif fit.df == 0:
        notes.append("As many coefficients as runs: the surface passes through every run and knows no error.")
    elif fit.exact:
        notes.append("The quadratic passes through every run exactly: no F can be formed.")
    notes += _lack_of_fit_notes(split)
    if precision is not None and precision < _ADEQUATE:
        notes.append(f"Adequate precision {precision:.2f} is below 4: the surface is mostly noise.")
    return notes + _influence_notes(split, diagnostics)


def _lack_of_fit_notes(split: LackOfFit) -> list[str]:
    if split.deterministic:
        return [
            f"All repeated points agree exactly, so {DETERMINISTIC}.",
            f"The {split.pure_df} repeated runs add no information; they only raise the residual df to "
            f"{split.df + split.pure_df}, so standard errors and p-values look better than they are.",
        ]
    if split.pure_df == 0:
        return ["Lack of fit cannot be tested: no design point is repeated."]
    if split.df == 0:
        return ["Lack of fit cannot be tested: the design has as many distinct points as the surface has terms."]
    return []


def _influence_notes(split: LackOfFit, diagnostics: Sequence[RunDiagnostics]) -> list[str]:
    notes = [
        f"Run {run.run} ({run.response:g}) sways the surface: Cook's distance {run.cooks_distance:.2f}."
        for run in diagnostics
        if run.cooks_distance is not None and run.cooks_distance > _INFLUENTIAL
    ]
    for run in diagnostics:
        p, without = split.p, run.lack_of_fit_p_without
        if p is not None and without is not None and (p < 0.05) != (without < 0.05):
            notes.append(
                f"Without run {run.run} ({run.response:g}) lack of fit has p = {without:.4f} in place of "
                f"{p:.4f}: that verdict rests on one run."
            )
    return notes
