"""Runs that people do: in a program that no script can start, or in the laboratory."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from stemcal.study.model.frozen import Flag, Frozen
from stemcal.study.model.program_options import MOST_FILES
from stemcal.study.types.field_types import SpecFile, Whole


class ManualSolver(Frozen):
    """Runs done by hand: a stage that needs results writes a sheet with its runs and waits until they are entered.

    `stemcal enter` takes the filled sheet.
    """

    kind: Literal["manual"] = "manual"
    """Runs done by hand: a sheet to fill in."""
    screen: SpecFile | None = None
    """CSV of the screening's design, if another program has made it: a column for each factor, the response last, whose
    cells may be empty and are not read."""
    rsm: SpecFile | None = None
    """CSV of the surface's design, likewise."""
    templates: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Input files of the program, written for each run with `{{factor}}` replaced by the factor's value."""
    files: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Files put beside them as they are."""
    deterministic: Flag | None = None
    """Whether equal levels give equal answers: if true, equal runs are done once; if false, every run is done anew, in
    random order, and its scatter counts. Not said, every run is done, in the order of the design."""
    replicates: Annotated[Whole, Field(ge=1, le=100)] = 1
    """How often every run of a design is done; more than one means that there is chance in it."""
    seed: Annotated[Whole, Field(ge=0, le=2**31)] = 0
    """Draws another order of the runs, and other `{{seed}}`."""
    version: Annotated[str, StringConstraints(strict=True, max_length=200)] = ""
    """Any text that tells versions of the program apart; another one asks for all runs anew."""

    @property
    def by_chance(self) -> bool:
        """Whether equal levels may give different answers, whose scatter counts."""
        return self.replicates > 1 or self.deterministic is False
