"""The keys of the `solver` section in a spec with manual runs."""

from typing import Annotated, Literal

from pydantic import Field

from stemcal.solvers.options import MOST_FILES
from stemcal.study.types.field_types import SpecFile, Whole
from stemcal.study.types.solver_kind import SolverOptions


class SheetSolver(SolverOptions):
    """A run sheet: a CSV file with one row per run. A stage that needs results adds rows to the sheet and waits.

    The sheet is `sheet.csv` in the study folder. `stemcal run` reads the results from this
    sheet, and `stemcal enter` reads them from a copy.
    """

    kind: Literal["sheet"] = "sheet"
    """A run sheet in which results are entered by hand."""
    file: SpecFile | None = None
    """Run sheet (CSV or xlsx) that lists existing or planned runs, with columns for the run, the factors and the
    responses. The rows of a stage form the design of that stage. stemcal requests any missing results."""
    templates: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Input files that are written for each run; `{{factor}}` is replaced by the value of the factor."""
    replicates: Annotated[Whole, Field(ge=1, le=100)] | None = None
    """Number of repeats of each run, in random order, for experiments and stochastic programs. Every interval
    includes the scatter of the repeats. Without this key, runs with equal levels are performed only once."""
