"""Runs whose results are entered into a sheet: known ones, those of a program without a script, experiments."""

from typing import Annotated, Literal

from pydantic import Field

from stemcal.study.model.frozen import Frozen
from stemcal.study.model.program_options import MOST_FILES
from stemcal.study.types.field_types import SpecFile, Whole


class SheetSolver(Frozen):
    """A sheet of runs: a CSV file with a row for each run. A stage that needs results adds rows to it and waits.

    The sheet is `sheet.csv` in the study folder. `stemcal run` takes the results from it, `stemcal enter` from a copy.
    """

    kind: Literal["sheet"] = "sheet"
    """Results are entered into a sheet."""
    file: SpecFile | None = None
    """Sheet of runs that are known or designed elsewhere, CSV or xlsx, with the columns run, factors and responses. Its
    rows are the designs of the stages that it names; empty results are asked for."""
    templates: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Input files of the program, written for each run with `{{factor}}` replaced by the factor's value."""
    replicates: Annotated[Whole, Field(ge=1, le=100)] | None = None
    """How often every run of a design is done, in random order, where equal levels give different answers: their
    scatter counts. Without the key equal levels give equal answers, and are asked for once."""

    @property
    def by_chance(self) -> bool:
        """Whether equal levels may give different answers, whose scatter counts."""
        return self.replicates is not None
