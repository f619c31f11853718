"""Rules on the refinement in another model: its factors exist, and the study keeps all rules in that model too."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from stemcal.study.model import SheetSolver
from stemcal.study.rules.draft import Draft, Finding


def refinement_is_possible(draft: Draft) -> Iterator[Finding]:
    """Only factors with rising ranges can move, and only in another model; people run one of two programs."""
    if draft.refine is None:
        return
    by_name = {factor.name: factor for factor in draft.factors.values()}
    for name, ends in draft.refine.adjust.items():
        if name not in draft.names:
            yield draft.unknown_factor(("refine", "adjust", name), name)
        elif name in by_name and ends is not None and ends[0] >= ends[1]:
            message = f"low {ends[0]:g} is not below high {ends[1]:g}"
            yield Finding(("refine", "adjust", name), message, "widen the range")
    if not draft.refine.elsewhere and (draft.refine.adjust or draft.refine.changes):
        key = "adjust" if draft.refine.adjust else next(iter(next(iter(draft.refine.changes.values()))))
        message = "it applies to another model only, and there is no key `in`"
        yield Finding(("refine", key), message, "add refine.in, or remove it", at_key=True)
    if isinstance(draft.solver, SheetSolver) and isinstance(draft.refine.in_, SheetSolver):
        message = "the study's runs are entered by hand already, and a sheet asks for one program only"
        yield Finding(("refine", "in", "kind"), message, "make a separate study for it")


def seen_there(draft: Draft) -> Draft | None:
    """Return the study as `refine.in` simulates it; None without it, or where the sections are not valid."""
    if draft.refine is None or not draft.refine.elsewhere or draft.solver is None:
        return None
    test: dict[str, Any] = {}
    for name, change in draft.refine.changes.items():
        if (section := getattr(draft, name, None)) is not None:
            test[name] = section.model_copy(update=change)
    return replace(draft, solver=draft.refine.solver_there(draft.solver), refine=None, **test)


def wrong_there(draft: Draft, broken: Sequence[Finding]) -> Iterator[Finding]:
    """Yield what is wrong with the study in `refine.in`, at the keys of that section.

    A factor that does not move may have no effect there.
    """
    for finding in broken:
        section = finding.path[0] if finding.path else ""
        if section == "solver":
            yield finding._replace(path=("refine", "in", *finding.path[1:]))
        elif section in ("responses", "conditions") and draft.stem_solver == "":
            yield finding._replace(path=("refine", "in"), at_key=False)
        elif section == "factors" and draft.refine is not None and isinstance(index := finding.path[1], int):
            factor = draft.factors.get(index)
            if factor is not None and factor.name in draft.refine.adjust and finding.path[2:] == ("name",):
                yield finding._replace(path=("refine", "adjust", factor.name))
