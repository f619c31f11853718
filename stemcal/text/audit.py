"""What an audit of a paper has found."""

from __future__ import annotations

from stemcal.stages.audit.consistency import (
    GrowthDiffers,
    ImpossibleShearModulus,
    InvertedExponent,
    LackOfFitRestsOnRun,
    LevelsSwapped,
    MisprintedLevel,
    NaturalBounds,
    SolverMissesTarget,
    StarsDiffer,
    SurfaceContradictsScreening,
)
from stemcal.stages.audit.paper import DesignDiffers, LevelDiffers
from stemcal.stages.audit.stage import AuditResult, NoValidationTable
from stemcal.stages.audit.suspicions import (
    BladeStopsShort,
    BoxLeavesDesign,
    EquationMissesTarget,
    InteractionsDisagree,
    OneOfMany,
    RepeatsDiffer,
    SignDefiesLaw,
)
from stemcal.stages.base import stage_called
from stemcal.text.language import all_of, say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence, states
from stemcal.text.numbers import minus


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


def remarks(stage: AuditResult, names: Names) -> list[Remark]:
    """Return what the audit could not look at, and what holds of the solution."""
    return [remark(note, names) for note in stage.notes]


states(NoValidationTable, "No validation table is given: its responses are not looked at.")


@sentence.register
def _(note: OneOfMany, names: Names) -> str:
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
    MisprintedLevel,
    "Design: {factor:factor} {printed:g} should read {level:g}. With {printed:g} {agree_printed} of {of} cells of the "
    "printed surface come out, with {level:g} {agree}.",
)


@sentence.register
def _(fact: LevelDiffers, names: Names) -> str:
    if fact.far:
        template = (
            "Levels: {factor:factor} at coded {coded:g} is printed {printed}, the runs have {level:.7g}; as printed it "
            "would be coded {coded_as_printed:.3f}, a rounding that moves the level far from where the design has it."
        )
    elif fact.rounded:
        template = (
            "Levels: {factor:factor} at coded {coded:g} is printed {printed}, the runs have {level:.7g}; as printed it "
            "would be coded {coded_as_printed:.3f}, a matter of rounding."
        )
    else:
        template = (
            "Levels: {factor:factor} at coded {coded:g} is printed {printed}, the runs have {level:.7g}; as printed it "
            "would be coded {coded_as_printed:.3f}, which no rounding explains."
        )
    return names.say(template, **vars(fact))


@sentence.register
def _(fact: DesignDiffers, names: Names) -> str:
    return names.say_number(
        "Design: {factor:factor} is printed {printed:g} in {runs} run; with that {agree} of {of} cells of the printed "
        "analysis of variance come out, with {used:g} {agree_used} of {of_used}.",
        "Design: {factor:factor} is printed {printed:g} in {runs} runs; with that {agree} of {of} cells of the printed "
        "analysis of variance come out, with {used:g} {agree_used} of {of_used}.",
        fact.runs,
        **vars(fact),
        agree=fact.with_printed.agree,
        of=fact.with_printed.of,
        agree_used=fact.with_used.agree,
        of_used=fact.with_used.of,
    )


states(
    LevelsSwapped,
    "Screening: the paper prints {printed} for {factor:factor}, its data give {value:+.4g}, and all else of its row "
    "agrees: low and high of {factor:factor} are swapped in runs or table.",
)
states(
    BoxLeavesDesign,
    "Search box: {factor:factor} from {low:g} to {high:g} is coded {coded_low:+.2f} to {coded_high:+.2f}, the runs "
    "reach ±{reach:.3f}: beyond them the surface extrapolates.",
)

# ---- surface and runs

states(
    RepeatsDiffer,
    "Runs: {runs} runs at the same levels gave {low:g} to {high:response g}. A deterministic solver gives one value "
    "for one set of levels, so these runs differed in something not recorded.",
)


@sentence.register
def _(fact: SurfaceContradictsScreening, names: Names) -> str:
    one = (
        "Surface against screening: at {at} the surface gives {surface:response .0f}, the screening run {low:response "
        "g}."
    )
    several = (
        "Surface against screening: at {at} the surface gives {surface:response .0f}, the screening runs {low:g} to "
        "{high:response g}."
    )
    return names.say(one if fact.low == fact.high else several, at=_values(fact.levels, names), **vars(fact))


states(
    InteractionsDisagree,
    "Interaction: {term:factor} is {surface:response +.3g} in the surface and {screening:response +.3g} in the "
    "screening runs (fitted beside all main effects): one of the designs sees something else.",
)
states(
    LackOfFitRestsOnRun,
    "Lack of fit: its p of {p:.3f} rests on run {run} ({response:response g}); without that run it is {p_without:.3f}.",
)


@sentence.register
def _(fact: StarsDiffer, names: Names) -> str:
    return names.say(
        "{table}: {term:factor} is printed with {printed}, its p of {p:.2g} asks for {due}.",
        table=fact.table,
        term=fact.term,
        printed=_stars(fact.printed),
        p=fact.p,
        due=_stars(fact.due),
    )


def _stars(stars: str) -> str:
    return say({"": "no star", "*": "one star"}.get(stars, "two stars"))


# ---- equation, solution and target

states(
    EquationMissesTarget,
    "Equation: at the printed solution the printed coefficients give {by_equation:response .2f}, those of the data "
    "{by_data:response .2f}; the target is {target:response g}.",
)


@sentence.register
def _(fact: NaturalBounds, names: Names) -> str:
    solution = (
        "Equation: its coefficients are for coded values, its bounds are natural ones; in natural values it gives "
        "{response:response ,.0f} at the printed solution."
    )
    corner = (
        "Equation: its coefficients are for coded values, its bounds are natural ones; in natural values it gives "
        "{response:response ,.0f} at a corner of the ranges."
    )
    return names.say(solution if fact.at_solution else corner, response=fact.response)


@sentence.register
def _(fact: SolverMissesTarget, names: Names) -> str:
    if fact.interval is None:
        template = (
            "Validation: where {target:response g} was solved for the solver gives {simulated:response g} "
            "({percent:+.1f} %): the parameters do not give the target."
        )
    elif fact.outside:
        template = (
            "Validation: where {target:response g} was solved for the solver gives {simulated:response g} "
            "({percent:+.1f} %), outside the surface's 95 % prediction interval {interval:responses}: the parameters "
            "do not give the target."
        )
    else:
        template = (
            "Validation: where {target:response g} was solved for the solver gives {simulated:response g} "
            "({percent:+.1f} %), inside the surface's 95 % prediction interval {interval:responses}: the parameters "
            "do not give the target."
        )
    return names.say(template, **vars(fact))


@sentence.register
def _(fact: GrowthDiffers, names: Names) -> str:
    return names.say(
        "Validation: the measured {response} grows with the power {measured:.2f} ({low:.2f} to {high:.2f}) of the "
        "{condition}, the simulated with {simulated:.2f} ({simulated_low:.2f} to {simulated_high:.2f}): no parameters "
        "fit everywhere.",
        response=names.response.long,
        condition=names.condition.long,
        measured=fact.measured,
        low=fact.measured_interval[0],
        high=fact.measured_interval[1],
        simulated=fact.simulated,
        simulated_low=fact.simulated_interval[0],
        simulated_high=fact.simulated_interval[1],
    )


# ---- names and laws


@sentence.register
def _(fact: SignDefiesLaw, names: Names) -> str:
    template = "{stage}: {factor:factor} acts with {effect:response +.4g}, the law asks for the sign {expected}."
    if fact.falls_over is not None:
        template = (
            "{stage}: {factor:factor} acts with {effect:response +.4g}, the law asks for the sign {expected}: from C = "
            "{low:g} to {high:g} both 1 + (rate/C)^P and 1 + (rate/C)^(1/P) fall at every strain rate from 0.001 to "
            "10000 1/s."
        )
    low, high = fact.falls_over or (0.0, 0.0)
    fields = {**vars(fact), "stage": stage_called(fact.stage).title, "expected": minus(fact.expected)}
    return names.say(template, **fields, low=low, high=high)


@sentence.register
def _(fact: ImpossibleShearModulus, names: Names) -> str:
    pairs = {"": fact.range, "e_": fact.elastic, "nu_": fact.poisson, "g_": fact.possible}
    return names.say(
        "Factors: {called} of {low:g} to {high:g} {unit} is impossible with E of {e_low:g} to {e_high:g} {unit} and "
        "Poisson's ratio of {nu_low:g} to {nu_high:g}: E/(2(1 + ν)) is {g_low:.0f} to {g_high:.0f} {unit}. It is the "
        "tangent modulus of the hardening law.",
        called=fact.called,
        unit=fact.unit,
        **{name + end: value for name, ends in pairs.items() for end, value in zip(("low", "high"), ends, strict=True)},
    )


states(
    InvertedExponent,
    "Law: 1 + (rate/C)^P is printed, the law of Cowper and Symonds has 1/P. At 1 1/s, C {c:g} and P {p:g}, the first "
    "raises the yield stress by {printed_percent:.2g} %, the second by {usual_percent:.0f} %.",
)


@sentence.register
def _(fact: BladeStopsShort, names: Names) -> str:
    return names.say(
        "Loading: {speed:g} mm/min for {duration:g} s is {travel:.2f} mm of travel, {share:.0f} % of a stem of "
        "{condition:condition}: no cut is completed, and a maximum that comes later is not seen.",
        speed=60.0 * fact.speed,
        duration=fact.duration,
        travel=fact.travel,
        share=100.0 * fact.travel / fact.condition,
        condition=fact.condition,
    )
