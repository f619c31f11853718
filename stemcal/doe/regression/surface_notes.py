"""What to beware of in a fitted surface, in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stemcal.doe.regression.anova import LackOfFit
from stemcal.doe.regression.influence import RunDiagnostics
from stemcal.doe.regression.least_squares import LeastSquares
from stemcal.remarks import Remark, Weight

DETERMINISTIC = "lack of fit cannot be tested: the solver is deterministic"
# Rules of thumb: a ratio of 4 makes a surface usable, a Cook's distance of 1 one run too strong, a variance
# inflation of 10 a coefficient too entangled with others.
_ADEQUATE, _INFLUENTIAL, _ENTANGLED = 4.0, 1.0, 10.0

_FAILED = Remark(
    Weight.NUMBERS,
    "{failed} of {runs} runs failed; the surface is fitted to the others, with {df} residual df; the design is no "
    "longer as planned (largest variance inflation {inflation:.2f}, as planned {planned:.2f}).",
)
_DROPPED = Remark(
    Weight.NUMBERS,
    "The runs left cannot estimate {terms}: these terms are left out. What they stand for is now in the other "
    "coefficients, and the surface must not be trusted beyond the runs it has.",
)
_FLAT = Remark(Weight.NUMBERS, "Every run gave the same response: the surface is flat.")
_SATURATED = Remark(
    Weight.NUMBERS, "As many coefficients as runs: the surface passes through every run and knows no error."
)
_NOISE = Remark(Weight.NUMBERS, "Adequate precision {precision:.2f} is below 4: the surface is mostly noise.")
_ONE_RUN = Remark(
    Weight.USE,
    "Without run {run} ({response:g}) lack of fit has p = {without:.4f} in place of {p:.4f}: that verdict rests on one "
    "run.",
)
_AGREE = Remark(Weight.ASIDE, f"All repeated points agree exactly, so {DETERMINISTIC}.")
_REPEATED = Remark(
    Weight.ASIDE,
    "The {repeated} repeated runs add no information; they only raise the residual df to {df}, so standard errors and "
    "p-values look better than they are.",
)
_REPEATED_OVER_MESHES = Remark(
    Weight.ASIDE,
    "{repeated} repeated runs add no information: they only raise the residual df to {df}; for the lack of fit every "
    "point counts once.",
)


@dataclass(frozen=True)
class Losses:
    """What failed runs have cost: how many failed, the terms left out, the variance inflation as planned."""

    failed: int
    dropped: tuple[str, ...]
    inflation_planned: float


def surface_notes(
    fit: LeastSquares,
    split: LackOfFit,
    diagnostics: Sequence[RunDiagnostics],
    precision: float | None,
    inflation: Sequence[float],
    losses: Losses,
) -> list[str]:
    """Say what the fit, its runs and their failures mean for the trust in it."""
    notes = []
    if losses.failed:
        notes.append(
            _FAILED(
                failed=losses.failed,
                runs=len(fit.response) + losses.failed,
                df=fit.df,
                inflation=max(inflation, default=1.0),
                planned=losses.inflation_planned,
            )
        )
    if losses.dropped:
        notes.append(_DROPPED(terms=", ".join(losses.dropped)))
    if max(inflation, default=1.0) > _ENTANGLED:
        notes.append(
            f"The largest variance inflation is {max(inflation):.1f}: the runs hardly tell some terms apart, "
            "and their coefficients are uncertain one by one."
        )
    if fit.flat:
        notes.append(_FLAT())
    elif fit.df == 0:
        notes.append(_SATURATED())
    elif fit.exact:
        notes.append("The quadratic passes through every run exactly: no F can be formed.")
    notes += _within_notes(fit, split) if split.within_df else _lack_of_fit_notes(split)
    if precision is not None and precision < _ADEQUATE:
        notes.append(_NOISE(precision=precision))
    return notes + _influence_notes(split, diagnostics)


def _within_notes(fit: LeastSquares, split: LackOfFit) -> list[str]:
    scatter = (split.pure_sum_of_squares / split.pure_df) ** 0.5
    notes = [
        f"Pure error is the scatter within the runs over mesh phases: {scatter:.4g} for the mean of a run, with "
        f"{split.pure_df} df. It is what the mesh leaves open, no scatter of an experiment, and stands beside the "
        "residual, which already contains it."
    ]
    if split.within_common is not None:
        notes.append(
            f"What a place of the mesh does to all runs alike (standard deviation {split.within_common:.4g}) is taken "
            "out of it: that shifts the whole surface and is in no interval."
        )
    if fit.mean_square is None or scatter**2 > fit.mean_square:
        notes.append("It is larger than the residual: all intervals are made from it, the F tests from the residual.")
    if split.deterministic:
        notes.append(_REPEATED_OVER_MESHES(repeated=fit.df - split.df, df=fit.df))
    return notes


def _lack_of_fit_notes(split: LackOfFit) -> list[str]:
    if split.deterministic:
        return [_AGREE(), _REPEATED(repeated=split.pure_df, df=split.df + split.pure_df)]
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
            notes.append(_ONE_RUN(run=run.run, response=run.response, without=without, p=p))
    return notes
