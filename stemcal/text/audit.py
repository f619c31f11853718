"""What an audit of a paper has found."""

from stemcal.stages.audit import consistency, paper, suspicions
from stemcal.stages.audit.stage import AuditResult, NoValidationTable
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


@sentence.register
def _(fact: paper.DesignDiffers, names: Names) -> str:
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


@sentence.register
def _(fact: consistency.StarsDiffer, names: Names) -> str:
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


@sentence.register
def _(fact: consistency.GrowthDiffers, names: Names) -> str:
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
def _(fact: suspicions.SignDefiesLaw, names: Names) -> str:
    acts = "{stage}: {factor:factor} acts with {effect:response +.4g}, the law asks for the sign {expected}."
    falls = (
        "From C = {low:g} to {high:g} both 1 + (rate/C)^P and 1 + (rate/C)^(1/P) fall at every strain rate from 0.001 "
        "to 10000 1/s."
    )
    fields = {**vars(fact), "stage": stage_called(fact.stage).title, "expected": minus(fact.expected)}
    said = names.say(acts, **fields)
    return said if fact.falls_over is None else f"{said} {say(falls, low=fact.falls_over[0], high=fact.falls_over[1])}"


@sentence.register
def _(fact: consistency.ImpossibleShearModulus, names: Names) -> str:
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
    consistency.InvertedExponent,
    "Law: 1 + (rate/C)^P is printed, the law of Cowper and Symonds has 1/P. At 1 1/s, C {c:g} and P {p:g}, the first "
    "raises the yield stress by {printed_percent:.2g} %, the second by {usual_percent:.0f} %.",
)


@sentence.register
def _(fact: suspicions.BladeStopsShort, names: Names) -> str:
    return names.say(
        "Loading: {speed:g} mm/min for {duration:g} s is {travel:.2f} mm of travel, {share:.0f} % of a stem of "
        "{condition:condition}: no cut is completed, and a maximum that comes later is not seen.",
        speed=60.0 * fact.speed,
        duration=fact.duration,
        travel=fact.travel,
        share=100.0 * fact.travel / fact.condition,
        condition=fact.condition,
    )
