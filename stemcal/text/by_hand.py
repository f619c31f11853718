"""What is said of runs done by hand: what is awaited, what became of a sheet, why a row of it is refused."""

from stemcal.by_hand import refusals
from stemcal.by_hand.entering import Entered
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import sentence, states


def waiting_for(count: int, stage: str, sheet: str, spec: str = "SPEC") -> str:
    """Say what a study waits for, and where to write it."""
    return say_number(
        "Waiting for {count} result of {stage}; fill in {sheet}, then: stemcal enter {spec} {sheet}",
        "Waiting for {count} results of {stage}; fill in {sheet}, then: stemcal enter {spec} {sheet}",
        count,
        stage=stage,
        sheet=sheet,
        spec=spec,
    )


def nothing_awaited(spec: str) -> str:
    """Say that all results are there."""
    return say("No result is awaited; `stemcal run {spec}` shows what the study comes to", spec=spec)


def entered(found: Entered, names: Names) -> list[str]:
    """Say what became of a sheet: how many results were taken, then each row that was not."""
    said = [say_number("{count} result taken.", "{count} results taken.", len(found.taken))]
    if found.known:
        said.append(say_number("{count} was known already.", "{count} were known already.", len(found.known)))
    if found.replaced:
        runs = ", ".join(found.replaced)
        said.append(
            say_number("{count} replaced: {runs}.", "{count} replaced: {runs}.", len(found.replaced), runs=runs)
        )
    return [" ".join(said)]


def refused(found: Entered, names: Names) -> list[str]:
    """Say of each row that was not taken where it stands, what is wrong and what to do."""
    head = say_number(
        "{count} row is not taken; mend it and enter the sheet again.",
        "{count} rows are not taken; mend them and enter the sheet again.",
        len(found.refused),
    )
    return [head, *(sentence(one, names) for one in found.refused)]


states(
    refusals.UnknownRun, "{place}: the study asks for no run {run!r}; write its name as the sheet does, such as rsm 3"
)
states(refusals.OtherStudy, "{place}: {run} is of the study {given!r}, not of {own!r}; enter the row for that one")
states(refusals.OtherReplicate, "{place}: {run} has no replicate {replicate!r}; write the number as on the sheet")
states(
    refusals.SeveralMeant,
    "{place}: several runs are called {run}; tell its condition and replicate, as `ask` gives them",
)
states(refusals.Incomplete, "{place}: {run} has no {response}; write its value too, or `failed: why`")
states(refusals.FailedWithValue, "{place}: {run} is said to have failed and has a value; delete one of the two")
states(refusals.NoReason, "{place}: {run} is said to have failed; write why, as `failed: the stem slipped`")
states(refusals.BrokenRow, "{place}: the row has more cells than the heading; put texts and decimal commas in quotes")
states(refusals.ToldTwice, "{place}: {run} has another result at {other}; delete the wrong row")
states(refusals.NothingToWithdraw, "{place}: {run} has no result that could be withdrawn; delete the word")
states(
    refusals.OtherLevels,
    "{place}: {run} was asked for at {name} = {asked:.6g}{unit}, the row has {given!r}; copy the row from the sheet, "
    "or do the run as it was asked for",
)
states(
    refusals.FarOff,
    "{place}: {run} has {response} = {value:.6g}, the {count} others lie from {low:.4g} to {high:.4g}; mend it, or if "
    "it is right enter the sheet with --yes",
)
states(
    refusals.KnownOtherwise,
    "{place}: {run} has the result {known} already ({when} {who}), not {given}; if that was wrong, enter the sheet "
    'with --replace --reason "why"',
    when=lambda fact, _names: fact.when[:16],
)
states(
    refusals.Unreadable,
    {
        "no_number": "{place}: {run}, {response}: {given!r} is not a number; write a number, or `failed: why`",
        "ambiguous": "{place}: {run}, {response}: {given!r} may be {readings[0]:.6g} or {readings[1]:.6g}; write "
        "it without a comma",
        "too_large": "{place}: {run}, {response}: {given!r} is beyond 1e30; check it",
        "other_unit": "{place}: {run}, {response}: {given!r} is in {unit}, not in {wanted}; convert it",
    },
    by="why",
)
