"""What `check` says of designs and programs; light, for nothing is computed."""

from stemcal.overview.beforehand import (
    FactorsWanted,
    LengthsBelong,
    NotVaried,
    SmallScreening,
    TooFewFactors,
    beforehand,
)
from stemcal.study.model import Study
from stemcal.text.names import Names
from stemcal.text.notes import sentence, sentences, states


def remarks(study: Study) -> list[str]:
    """Say what the designs and the solver of a study want, lose, and take for granted."""
    return sentences(beforehand(study))


states(
    FactorsWanted,
    "rsm.design box-behnken wants {least} to {most} factors. If fewer are significant, the surface takes the {least} "
    "of largest contribution, and some of its terms are noise; if more, the {most} strongest. `rsm.factors: strongest "
    "{least}` says so beforehand; central-composite needs only two.",
)
states(
    TooFewFactors,
    "rsm.design box-behnken wants {least} to {most} factors, this study has {factors}: it will end after the "
    "screening. Write central-composite.",
)
states(
    NotVaried,
    "No run varies {factor:factor}: it is neither screened nor named under rsm.factors, and stays at {level:g}. Name "
    "it there, or give it this value in place of a range.",
)
states(
    LengthsBelong,
    "The failure strain found will belong to internal_length {internal_length} and edge_spread {edge_spread}: no "
    "cutting curve tells the three apart. Choose the lengths first, keep them, and report all three.",
)


@sentence.register
def _(note: SmallScreening, names: Names) -> str:
    none = (
        "screen.runs {runs} for {factors} factors: each main effect is wholly aliased with two-factor interactions, "
        "and no residual df are left to test against. In the usual {usual_runs} runs a third of an interaction is in "
        "it, and {usual_df} df are left."
    )
    one = (
        "screen.runs {runs} for {factors} factors: each main effect is wholly aliased with two-factor interactions, "
        "and {count} residual df is left to test against. In the usual {usual_runs} runs a third of an interaction is "
        "in it, and {usual_df} df are left."
    )
    many = (
        "screen.runs {runs} for {factors} factors: each main effect is wholly aliased with two-factor interactions, "
        "and {count} residual df are left to test against. In the usual {usual_runs} runs a third of an interaction is "
        "in it, and {usual_df} df are left."
    )
    return names.say(none, **vars(note)) if note.df == 0 else names.say_number(one, many, note.df, **vars(note))
