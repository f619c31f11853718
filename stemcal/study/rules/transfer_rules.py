"""Rules on the transfer: the study as the other program sees it keeps the rules too; what moves there is a factor."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from stemcal.study.model import SheetSolver
from stemcal.study.rules.draft import Draft, Finding


def target_can_be_reached(draft: Draft) -> Iterator[Finding]:
    """What moves are factors with ranges that rise; of two programs people run one."""
    if draft.transfer is None:
        return
    by_name = {factor.name: factor for factor in draft.factors.values()}
    for name, own in draft.transfer.adjust.items():
        path, factor = ("transfer", "adjust", name), by_name.get(name)
        if name not in draft.names:
            yield draft.unknown_factor(path, name)
        elif factor is not None:
            low = factor.low if own.low is None else own.low
            high = factor.high if own.high is None else own.high
            if low >= high:
                yield Finding(path, f"low {low:g} is not below high {high:g}", "widen the range")
    if isinstance(draft.solver, SheetSolver) and isinstance(draft.transfer.solver, SheetSolver):
        message = "the study's runs are entered by hand already, and a sheet asks for one program only"
        yield Finding(("transfer", "solver", "kind"), message, "make the transfer a study of its own")


def seen_there(draft: Draft) -> Draft | None:
    """Return the study as the transfer's solver sees it; None without one, or where the sections are not valid."""
    if draft.transfer is None or draft.solver is None:
        return None
    test: dict[str, Any] = {}
    for name, change in draft.transfer.test.changes.items():
        if (section := getattr(draft, name, None)) is not None:
            test[name] = section.model_copy(update=change)
    return replace(draft, solver=draft.transfer.solver_beside(draft.solver), transfer=None, **test)


def told_there(draft: Draft, broken: Sequence[Finding]) -> Iterator[Finding]:
    """Yield what is wrong with the study there, at the keys of the transfer; what is none of theirs is told above.

    A factor that does not move may have no effect there.
    """
    for finding in broken:
        section = finding.path[0] if finding.path else ""
        if section == "solver":
            yield finding._replace(path=("transfer", *finding.path))
        elif section in ("responses", "conditions") and draft.stem_solver == "":
            yield finding._replace(path=("transfer", "solver"), at_key=False)
        elif section == "factors" and draft.transfer is not None and isinstance(index := finding.path[1], int):
            factor = draft.factors.get(index)
            if factor is not None and factor.name in draft.transfer.adjust and finding.path[2:] == ("name",):
                yield finding._replace(path=("transfer", "adjust", factor.name))
