"""The figures of a validation."""

from functools import partial

from stemcal.naming import FIRST, Named
from stemcal.report.figures.plot import Plot
from stemcal.report.figures.validation import growth, validation
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model import Study

MOST_RESPONSES = 6  # whose figures the page shows


def plots(study: Study, validate: ValidateResult) -> list[Plot]:
    """Return the figures of a validation."""
    naming, plots = study.naming, []
    worst = _largest_errors(validate)
    responses = [naming.response, *(other for other in naming.others if other.name in worst)]
    shown = {naming.response.name, *sorted(worst, key=lambda name: -worst[name])[: MOST_RESPONSES - 1]}
    for response in responses:
        spread = spread_of(study, response)
        text = f"Measured and simulated {response.long}"
        if naming.condition is not None:
            text += "; the parameters are fitted to the ringed values" if validate.fitted else ""
        text += ". Bars: standard deviation of the measurements." if spread else "."
        name = "validation" if response is naming.response else f"validation-{response.name}"
        draw, on_page = partial(validation, validate, spread, response), response.name in shown
        if response is naming.response and len(responses) > len(shown):
            text += f" {len(shown)} of {len(responses)} responses are shown: the first and those of the largest errors."
        plots.append(Plot(name, "validate", text, draw, on_page))
    if naming.is_force_on_stems and validate.measured_exponent and validate.simulated_exponent:
        text = "The same forces on logarithmic axes: the slope is the power of the diameter with which they grow."
        plots.append(Plot("growth", "validate", text, partial(growth, validate)))
    return plots


def _largest_errors(validate: ValidateResult) -> dict[str, float]:
    """Return the largest absolute error of each further response, percent."""
    largest: dict[str, float] = {}
    for row in validate.rows:
        for one in row.further:
            largest[one.response] = max(largest.get(one.response, 0.0), abs(one.error_percent or 0.0))
    return largest


def spread_of(study: Study, response: Named) -> dict[float, float]:
    """Return the standard deviation of what was measured of a response, by the condition."""
    name = FIRST if response is study.naming.response else response.name
    measured = ((target.condition, target.mean_of(name)[1]) for target in study.targets.means)
    return {place: sd for place, sd in measured if sd is not None}
