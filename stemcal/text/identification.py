"""What is said of a foretelling of what combinations of tests would tell."""

from collections.abc import Mapping

from stemcal.naming import FIRST
from stemcal.numbers import interval, significant
from stemcal.overview.identify import Combination, Expected, Identified, MaximumOutOfReach, ScatterAssumed
from stemcal.text.calibration import change, with_unit
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.notes import sentences, states

_WORTH_TELLING = 0.005  # of the specimens


def place(tests: tuple[str, ...], conditions: tuple[float, ...], names: Names) -> str:
    """Name a combination by its tests, or by its conditions where one test is done at several."""
    if len(tests) == 1 and names.naming.condition is not None:
        return names.say("{test} at {conditions:conditions}", test=tests[0], conditions=conditions)
    return say("{tests:all}", tests=tests)


def expected(one: Expected) -> str:
    """Write the interval that a parameter would have."""
    return say("free") if one.free else interval((one.expected_low, one.expected_high), 3)


def foot(found: Identified, names: Names) -> list[str]:
    """Say what was simulated, how specimens are best divided, and what each combination tells least of."""
    units = {step.factor: step.unit for step in found.steps}
    steps = "{step.factor:factor} {step.low:significant} and {high}"
    levels = [names.say(steps, step=step, high=with_unit(significant(step.high), step.unit)) for step in found.steps]
    shares = [
        say("{share:.0f} % {place}", share=100.0 * one.share, place=place((one.test,), (one.condition,), names))
        for one in found.division
        if one.share >= _WORTH_TELLING
    ]
    simulated = "{runs} runs: mid-levels, and one factor at a time at {levels:all}."
    divided = "D-optimal division of the specimens: {shares:all}; an even one is worth {even:.0f} % of it."
    most = max(one.specimens for one in found.combinations)
    return [
        say(simulated, runs=found.runs, levels=levels),
        say(divided, shares=shares, even=found.even_percent),
        *(loosest(one, units, names) for one in found.combinations if one.loosest and one.specimens == most),
    ]


def remarks(found: Identified, names: Names) -> list[str]:
    """Say what the foretelling assumes and leaves out."""
    return sentences(found.notes, names)


def loosest(one: Combination, units: Mapping[str, str], names: Names) -> str:
    """Say which change a combination tells least of; a factor that is left alone has no size of change."""
    at = place(one.tests, one.conditions, names)
    if len(one.loosest) == 1:
        return names.say("Left free by {place}: {factor:factor}.", place=at, factor=next(iter(one.loosest)))
    template = "Left free by {place}: {changes:all} together."
    changes = [change(name, size, units[name], names) for name, size in one.loosest.items()]
    return say(template, place=at, changes=changes)


states(
    ScatterAssumed,
    "No scatter is given for {bare:all}; a coefficient of variation of {percent:.3g} % is assumed.",
    bare=lambda note, names: [names.response.name if one == FIRST else one for one in note.responses],
)
states(
    MaximumOutOfReach,
    "{responses:all} does not count: the stroke ends before the maximum is passed. Lengthen the stroke to count it.",
    "{responses:all} do not count: the stroke ends before the maximum is passed. Lengthen the stroke to count them.",
    by="responses",
)
