"""What is said of a plan: what a study takes, what is too much."""

from stemcal.errors import UsageError
from stemcal.executors import machine
from stemcal.numbers import duration, in_bytes
from stemcal.overview import plan
from stemcal.overview.foresight import Demand, ScarceMemory, TooLong, TooMuchMemory, excess, scarce
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import sentences, states


def total(found: plan.Plan) -> list[str]:
    """Say how many runs are left, and what they take."""
    if found.source == "by_hand":
        stages = " + ".join(str(stage.to_run) for stage in found.stages)
        one, many = "{stages} run by hand, {count} in all.", "{stages} runs by hand, {count} in all."
        return [say_number(one, many, found.to_run, stages=stages)]
    said = [say_number("{count} run to compute.", "{count} runs to compute.", found.to_run)]
    if found.seconds is not None:
        sources = {
            "none": "On one core they take {time}.",
            "guess": "On one core they take {time}, by a guess.",
            "tried": "On one core they take {time}, by half a second of a run on this machine.",
            "recorded": "On one core they take {time}, by runs recorded on this machine ({recorded}).",
        }
        said.append(say(sources[found.source], time=duration(found.seconds), recorded=found.recorded_runs))
    if found.elapsed is not None and found.to_run:
        one = "The whole study takes about {time} with {count} worker."
        many = "The whole study takes about {time} with {count} workers."
        said.append(say_number(one, many, found.workers, time=duration(found.elapsed)))
    if found.memory:
        said.append(say("A run takes about {memory} of memory.", memory=in_bytes(found.memory)))
    return said


def in_hours(hours: float) -> str:
    """Return a long time as people say it.

    >>> in_hours(49.6), in_hours(2e4), in_hours(float('inf'))
    ('about 50 h', 'about 833 days', 'more than 100 years')
    """
    if hours > 100 * 8766:
        return say("more than 100 years")
    return say("about {hours:.0f} h", hours=hours) if hours < 240 else say("about {days:.0f} days", days=hours / 24)


def warnings_before(demand: Demand, workers: int, here: bool = True) -> list[str]:
    """Return warnings of days and of scarce memory; raise `UsageError` for more memory than this machine has.

    Where the runs are computed is `here`, or elsewhere: then this machine's memory does not count.
    """
    found = list(excess(demand, workers, machine.machine_memory() if here else None))
    if impossible := [note for note in found if isinstance(note, TooMuchMemory)]:
        raise UsageError(" ".join(sentences(impossible)))
    return sentences([*found, *(scarce(demand, workers, machine.free_memory()) if here else ())])


def remarks(found: plan.Plan, names: Names) -> list[str]:
    """Return what is noted of the designs and the runs that are decided later."""
    return sentences(found.notes, names)


def objections(demand: Demand, workers: int, here: bool = True) -> tuple[list[str], list[str]]:
    """Say what speaks against so many runs: more than this machine's memory or days; memory that is not free now.

    Where they are computed is `here`, or elsewhere: then this machine's memory does not count.
    """
    too_much = excess(demand, workers, machine.machine_memory() if here else None)
    return sentences(too_much), sentences(scarce(demand, workers, machine.free_memory()) if here else ())


states(plan.FactorsAssumed, "The screening decides which factors the surface has; {factors} are assumed for the plan.")
states(plan.FirstRunTwice, "{stage} begins with its first run made twice: equal inputs must give equal answers.")
states(plan.DecidedLater, "{stage} decides its runs one by one: {most} at most come on top.")
states(plan.AskedTogether, "{stage} runs together what the stage before it proposes: {most} at most come on top.")
states(
    plan.CannotEstimate,
    "{stage}, {design}: {runs} runs cannot estimate {terms:factors}. Add runs or levels.",
)
states(
    plan.InAnotherProgram,
    "{here} runs here, at most {there} in {solver:program} (refine). Those take at most {seconds:duration} on one "
    "core.",
    otherwise="{here} runs here, at most {there} in {solver:program} (refine).",
    by=lambda note: note.seconds is not None,
)


states(
    TooMuchMemory,
    "A run needs about {each:memory} of memory, {at_a_time} at a time {all:memory}; this machine has {machine:memory}: "
    "take fewer workers (--workers {workers}).",
    otherwise="A run needs about {each:memory} of memory; this machine has {machine:memory}: take coarser elements "
    "(solver.element_size) or a shorter specimen.",
    by="workers",
    all=lambda note, _names: note.at_a_time * note.each,
)
states(
    ScarceMemory,
    "About {needed:memory} of memory are needed for a run, and {free:memory} are free now: close other programs; a run "
    "that finds none fails and is tried again by the next command.",
    "About {needed:memory} of memory are needed for {count} runs at a time, and {free:memory} are free now: close "
    "other programs or take fewer workers (--workers); a run that finds none fails and is tried again by the next "
    "command.",
    by="at_a_time",
)
states(
    TooLong,
    "The runs would take {time}, more than {most:g} h: take coarser elements (solver.element_size), a larger time_step "
    "or mass_scaling, or fewer runs.",
    time=lambda note, _names: in_hours(note.hours),
)
