"""Rules of the verdict on the validation: errors of held-out values, failed runs, trends, bends."""

from collections.abc import Iterator

from stemcal.doe.comparison import standard_error
from stemcal.doe.designs import surface_design
from stemcal.doe.regression.section import bend_of
from stemcal.notes import Note, Remedy, Severity
from stemcal.stages.invert.options import chose_conditions
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.rsm.options import RsmOptions
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.trend_advice import trend_reason
from stemcal.stages.verdict.verdict_rules import Evidence, Rank, ranked
from stemcal.stages.verdict.words import miss
from stemcal.vocabulary import FIRST


@ranked(Rank.VALIDATION)
def validation(evidence: Evidence) -> Iterator[Note]:
    """Yield notes on large errors of held-out values, failed runs, or the lack of held-out values."""
    study = evidence.study
    if (checked := evidence.of(ValidateResult)) is None:
        return
    if checked.is_from_table:
        text = (
            "The simulated values used for the validation were read from a table, so they may have been computed with "
            "parameter values that differ from the calibrated values."
        )
        remedy = Remedy("For the validation, use a solver that computes new results, not a table of stored results.")
        yield Note("validation_from_table", "warning", text, remedy)
        return
    held_out = [row for row in evidence.judged if not row.fitted]
    failed = tuple(row.condition for row in held_out if row.error_percent is None)
    if failed:
        names = evidence.names
        text = f"The simulation of the {names.response.long}{names.at(*failed)} failed."
        remedy = Remedy("Repeat the failed runs with `stemcal run SPEC --retry`.")
        yield Note("validation_failed", "warning", text, remedy)
    off = [row for row in held_out if row.size > evidence.equivalent_percent]
    if off:
        worst = max(off, key=lambda row: row.size)
        left_out = worst.response not in (study.naming.response.name, *study.fitted_responses)
        until = "Until the fit is repeated, use the parameters only where simulation and measurement agree."
        remedy = advice.fit_all(study, "responses" if left_out else "conditions", until)
        if not left_out and chose_conditions(study):  # do not advise against conditions that the spec lists
            remedy = Remedy(
                "Use the parameters only where simulation and measurement agree, or add a factor that could "
                "explain the error."
            )
        severity: Severity = "error" if evidence.mostly_off else "warning"
        yield Note("validation", severity, f"{miss(worst, evidence.names)}.", remedy)
    predictions = (result.prediction for result in evidence.results.done)
    in_turn = [each.worst_percent for each in predictions if each is not None and each.in_turn]  # cross-validation
    if not held_out and not any(percent <= evidence.equivalent_percent for percent in in_turn):
        text = "The parameters have not been independently validated because all measurements were used in the fit."
        yield Note("unchecked", "warning", text, advice.measure_more(study))


@ranked(Rank.TREND)
def trend(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if the error has a trend with the diameter, after a fit to a single force."""
    study, checked, solved = evidence.study, evidence.of(ValidateResult), evidence.of(InvertResult)
    if checked is None or checked.is_from_table or study.joint_targets:
        return
    if solved is None or solved.certainty.not_identified:  # other parameter values may fit as well without a trend
        return
    rows = [
        (row.condition, row.measured, row.simulated, standard_error(row.measured, row.sd, row.n))
        for row in checked.compared
        if row.simulated
    ]
    then = "With a response surface at every diameter, stemcal can suggest how to remove the trend."
    remedy = advice.fit_all(study, "conditions", then)
    yield from trend_reason(evidence, rows, checked.worst_percent or 0.0, lambda: remedy)


@ranked(Rank.MODEL)
def bent_over_conditions(evidence: Evidence) -> Iterator[Note]:
    """Yield a note if one surface over factors and conditions does not follow the response over the condition."""
    surface, checked = evidence.of(RsmResult), evidence.of(ValidateResult)
    if surface is None or surface.over is None:
        return
    bend, condition = surface.over.bend, surface.over.name
    if checked is not None and not checked.is_from_table:  # the validation has runs at further conditions
        x = surface.scales.to_coded(surface.scales.point(checked.parameters))
        fitted = [target.condition for target in evidence.study.joint_targets]
        rows = [row for row in checked.compared if row.simulated and min(fitted) <= row.condition <= max(fitted)]
        section = surface.section(surface.over.at, FIRST, [(row.condition, x, row.simulated or 0.0) for row in rows])
        bend = bend_of(section.whole, section.logarithm)
    if bend is None or not bend.significant:
        return
    text = (
        f"The response surface does not follow the {evidence.names.response.long} over the {condition}: terms of third "
        f"and fourth order in the {condition} would change it by {bend.percent:.1f} % (root mean square)."
    )
    fewest = surface_design(evidence.study.of(RsmOptions).design).factors[0]
    other = ", design: central-composite" if len(surface.names) < fewest and fewest > 2 else ""
    remedy = Remedy(f"Fit a response surface at each {condition}.", f"rsm: {{over: factors{other}}}")
    yield Note("bent_over_conditions", "warning", text, remedy)


RULES = (trend, validation, bent_over_conditions)
