"""The outcome of a response surface and how well it explains its runs, in sentences."""

from stemcal.doe.regression.canonical import Shape
from stemcal.naming import Names
from stemcal.numbers import fixed, signed_probability
from stemcal.stages.surface.result import SurfaceResult


def outcome(stage: SurfaceResult, names: Names) -> list[str]:
    """Return what was fitted to which runs; copies of a deterministic run do not count."""
    responses = [run.response for run in stage.design.runs if run.response is not None]
    count = len(stage.runs_diagnostics)
    text = (
        f"A quadratic surface in {names.factors(stage.names)} was fitted to {count} runs with responses from "
        f"{names.quantity(min(responses))} to {names.quantity(max(responses))}."
    )
    copies = len(responses) - count
    if stage.deterministic and copies > 0:
        text += f" Of its {len(responses)} runs {copies} repeat others; without scatter they add no information."
    return [text]


def certainty(stage: SurfaceResult, _names: Names) -> list[str]:
    """Return how well the surface explains its runs."""
    if stage.r2 is None:
        return ["All runs gave the same response, so the surface has no variation to explain."]
    explained = (
        f"The surface explains {fixed(100.0 * stage.r2, 1)} % of the variation between its runs "
        f"(R² {fixed(stage.r2, 3)}, predicted R² {fixed(stage.predicted_r2, 3)})."
    )
    return [explained, _lack_of_fit(stage)]


def _lack_of_fit(stage: SurfaceResult) -> str:
    lack = stage.anova_row("Lack of fit")
    if lack is None or lack.p is None or not stage.lack_of_fit_testable:
        return "Its lack of fit cannot be tested."
    significance = "significant" if lack.p < 0.05 else "not significant"
    return f"Its lack of fit is {significance} (p {signed_probability(lack.p)})."


def shape_name(shape: Shape) -> str:
    """Name the kind of a surface."""
    return f"{shape.kind} with a ridge" if shape.ridge and shape.kind != "plane" else shape.kind
