"""The runs of a surface as its fit takes them: scatter, what repeated ones show."""

from collections.abc import Sequence

import numpy as np

from stemcal.naming import Names
from stemcal.note import Note, Remedy
from stemcal.stages.result import DesignRuns


def pure_error_of(design: DesignRuns, names: Names, by_chance: bool = False) -> Note | None:
    """Return what repeated runs show; None if there are none.

    A solver that computes gives equal answers to equal inputs; repeated runs that differ were not equal, but for a
    program with chance in it.
    """
    groups: dict[tuple[float, ...], list[float]] = {}
    for run in design.runs:
        if run.response is not None:
            groups.setdefault(tuple(run.coded.values()), []).append(run.response)
    repeated = [responses for responses in groups.values() if len(responses) > 1]
    if not repeated:
        return None
    widest = max(repeated, key=lambda responses: max(responses) - min(responses))
    same = max(widest) - min(widest) <= 1e-9 * max(map(abs, widest))
    if same and by_chance:
        remedy = Remedy("Remove `replicates`, or pass {{seed}} to the program.")
        return Note("equal_seeds", "caution", "Runs with different seeds agree exactly.", remedy)
    if same:
        text = "Repeated runs agree exactly: the solver is deterministic, and there is no pure error."
        return Note("equal_repeats", "caution", text)
    if by_chance:
        return _scatter(repeated, names)
    text = (
        f"{len(widest)} runs at the same levels gave responses from {names.quantity(min(widest), 'g')} to "
        f"{names.quantity(max(widest), 'g')}. A deterministic solver gives one response for one set of levels, so "
        "these runs differed in something not recorded."
    )
    return Note("unequal_repeats", "caution", text)


def _scatter(repeated: Sequence[Sequence[float]], names: Names) -> Note:
    df = sum(len(responses) - 1 for responses in repeated)
    square = sum(float(np.sum((np.array(responses) - np.mean(responses)) ** 2)) for responses in repeated) / df
    sd = names.quantity(square**0.5, ".3g")
    text = f"Runs at the same levels, each with its own seed, scatter with a standard deviation of {sd} ({df} df)."
    return Note("scatter_of_seeds", "caution", text)
