"""What an audit of a paper has found."""

from stemcal.numbers import minus
from stemcal.stages.audit import consistency, paper, suspicions
from stemcal.stages.audit.stage import AuditResult, Finding, NoValidationTable
from stemcal.stages.base import stage_called
from stemcal.text.language import all_of, say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence, states


def outcome(stage: AuditResult, _names: Names) -> list[str]:
    """Count what agrees and what does not."""
    return [
        say_number(
            "{agree} of {of} printed cells agree with what their data give; {count} thing does not.",
            "{agree} of {of} printed cells agree with what their data give; {count} things do not.",
            len(stage.findings),
            agree=stage.agree,
            of=stage.of,
        )
    ]


def said_of(finding: Finding, names: Names) -> str:
    """Return what is found, as a sentence."""
    return sentence(finding.found.fact, names)


def remarks(stage: AuditResult, names: Names) -> list[Remark]:
    """Return what the audit could not look at, and what holds of the solution."""
    return [remark(note, names) for note in stage.notes]


states(NoValidationTable, "No validation table is given: its responses are not looked at.")


@sentence.register
def _(note: suspicions.OneOfMany, names: Names) -> str:
    return names.say(
        "The solution {solution} is one point of a whole set with the same {response}; inside the design it reaches "
        "over {ranges}.",
        solution=_values(note.solution, names),
        response=names.response.long,
        ranges=all_of(
            names.say("{factor:factor} {low:.4g} to {high:.4g}", factor=factor, low=low, high=high)
            for factor, (low, high) in note.ranges.items()
        ),
    )


def _values(values: dict[str, float], names: Names) -> str:
    return ", ".join(names.say("{factor:factor} {value:g}", factor=factor, value=v) for factor, v in values.items())


# ---- levels and design

states(
    consistency.MisprintedLevel,
    "Design: {factor:factor} {printed:g} should read {level:g}. With {printed:g} {agree_printed} of {of} cells of the "
    "printed surface come out, with {level:g} {agree}.",
)


@sentence.register
def _(fact: paper.LevelDiffers, names: Names) -> str:
    what = (
        "Levels: {factor:factor} at coded {coded:g} is printed {printed}, the runs have {level:.7g}; as printed it "
        "would be coded {coded_as_printed:.3f}."
    )
    why = "That is a matter of rounding." if fact.rounded else "No rounding explains that."
    why = "This rounding moves the level far from where the design has it." if fact.far else why
    return f"{names.say(what, **vars(fact))} {say(why)}"


states(
    paper.DesignDiffers,
    "Design: {factor:factor} is printed {printed:g} in {runs} run; with that {with_printed.agree} of {with_printed.of} "
    "cells of the printed analysis of variance come out, with {used:g} {with_used.agree} of {with_used.of}.",
    "Design: {factor:factor} is printed {printed:g} in {runs} runs; with that {with_printed.agree} of "
    "{with_printed.of} cells of the printed analysis of variance come out, with {used:g} {with_used.agree} of "
    "{with_used.of}.",
    by="runs",
)
states(
    consistency.LevelsSwapped,
    "Screening: the paper prints {printed} for {factor:factor}, its data give {value:+.4g}, and all else of its row "
    "agrees: low and high of {factor:factor} are swapped in runs or table.",
)
states(
    suspicions.BoxLeavesDesign,
    "Search box: {factor:factor} from {low:g} to {high:g} is coded {coded_low:+.2f} to {coded_high:+.2f}, the runs "
    "reach ±{reach:.3f}: beyond them the surface extrapolates.",
)

# ---- surface and runs

states(
    suspicions.RepeatsDiffer,
    "Runs: {runs} runs at the same levels gave {low:g} to {high:response g}. A deterministic solver gives one value "
    "for one set of levels, so these runs differed in something not recorded.",
)


@sentence.register
def _(fact: consistency.SurfaceContradictsScreening, names: Names) -> str:
    one = "{low:response g}"
    several = "{low:g} to {high:response g}"
    given = names.say(one if fact.low == fact.high else several, low=fact.low, high=fact.high)
    template = (
        "Surface against screening: at {at} the surface gives {surface:response .0f}, the screening runs {given}."
    )
    return names.say(template, at=_values(fact.levels, names), surface=fact.surface, given=given)


states(
    suspicions.InteractionsDisagree,
    "Interaction: {term:factor} is {surface:response +.3g} in the surface and {screening:response +.3g} in the "
    "screening runs (fitted beside all main effects): one of the designs sees something else.",
)
states(
    consistency.LackOfFitRestsOnRun,
    "Lack of fit: its p of {p:.3f} rests on run {run} ({response:response g}); without that run it is {p_without:.3f}.",
)
states(
    consistency.StarsDiffer,
    "{table}: {term:factor} is printed with {as_printed}, its p of {p:.2g} asks for {asked}.",
    as_printed=lambda fact, _names: _stars(fact.printed),
    asked=lambda fact, _names: _stars(fact.due),
)


def _stars(stars: str) -> str:
    return say({"": "no star", "*": "one star"}.get(stars, "two stars"))


# ---- equation, solution and target

states(
    suspicions.EquationMissesTarget,
    "Equation: at the printed solution the printed coefficients give {by_equation:response .2f}, those of the data "
    "{by_data:response .2f}; the target is {target:response g}.",
)


@sentence.register
def _(fact: consistency.NaturalBounds, names: Names) -> str:
    what = "Equation: its coefficients are for coded values, its bounds are natural ones."
    solution = "In natural values it gives {response:response ,.0f} at the printed solution."
    corner = "In natural values it gives {response:response ,.0f} at a corner of the ranges."
    return f"{say(what)} {names.say(solution if fact.at_solution else corner, response=fact.response)}"


@sentence.register
def _(fact: consistency.SolverMissesTarget, names: Names) -> str:
    missed = (
        "Validation: where {target:response g} was solved for the solver gives {simulated:response g} ({percent:+.1f} "
        "%): the parameters do not give the target."
    )
    outside = "That is outside the surface's 95 % prediction interval, {interval:responses}."
    inside = "That is inside the surface's 95 % prediction interval, {interval:responses}."
    parts = [missed, *([] if fact.interval is None else [outside if fact.outside else inside])]
    return " ".join(names.say(part, **vars(fact)) for part in parts)


states(
    consistency.GrowthDiffers,
    "Validation: the measured {names.response.long} grows with the power {measured:.2f} ({measured_interval[0]:.2f} to "
    "{measured_interval[1]:.2f}) of the {names.condition.long}, the simulated with {simulated:.2f} "
    "({simulated_interval[0]:.2f} to {simulated_interval[1]:.2f}): no parameters fit everywhere.",
)


# ---- names and laws


@sentence.register
def _(fact: suspicions.SignDefiesLaw, names: Names) -> str:
    acts = "{stage}: {factor:factor} acts with {effect:response +.4g}, the law asks for the sign {expected}."
    falls = (
        "From C = {low:g} to {high:g} both 1 + (rate/C)^P and 1 + (rate/C)^(1/P) fall at every strain rate from 0.001 "
        "to 10000 1/s."
    )
    fields = {**vars(fact), "stage": stage_called(fact.stage).title, "expected": minus(fact.expected)}
    said = names.say(acts, **fields)
    return said if fact.falls_over is None else f"{said} {say(falls, low=fact.falls_over[0], high=fact.falls_over[1])}"


states(
    consistency.ImpossibleShearModulus,
    "Factors: {called} of {range[0]:g} to {range[1]:g} {unit} is impossible with E of {elastic[0]:g} to {elastic[1]:g} "
    "{unit} and Poisson's ratio of {poisson[0]:g} to {poisson[1]:g}: E/(2(1 + ν)) is {possible[0]:.0f} to "
    "{possible[1]:.0f} {unit}. It is the tangent modulus of the hardening law.",
)
states(
    consistency.InvertedExponent,
    "Law: 1 + (rate/C)^P is printed, the law of Cowper and Symonds has 1/P. At 1 1/s, C {c:g} and P {p:g}, the first "
    "raises the yield stress by {printed_percent:.2g} %, the second by {usual_percent:.0f} %.",
)
states(
    suspicions.BladeStopsShort,
    "Loading: {per_minute:g} mm/min for {duration:g} s is {travel:.2f} mm of travel, {share:.0f} % of a stem of "
    "{condition:condition}: no cut is completed, and a maximum that comes later is not seen.",
    per_minute=lambda fact, _names: 60.0 * fact.speed,
    share=lambda fact, _names: 100.0 * fact.travel / fact.condition,
)
