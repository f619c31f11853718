"""The results of a study for notebooks: stage results, verdict, parameters, runs and figures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any

from stemcal.cutting.result import CuttingResult
from stemcal.drawing.showing import Setting
from stemcal.drawing.table import Column, Table
from stemcal.errors import UsageError
from stemcal.formats import did_you_mean
from stemcal.report.curves import force_travel
from stemcal.report.gallery import gallery
from stemcal.report.outcome import showing_of
from stemcal.report.page.page import coded
from stemcal.report.records import Records, read_records
from stemcal.report.records import RunCurve as DrawnCurve
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.ledger import LedgerRow, ledger
from stemcal.stages.result import R
from stemcal.stages.results import fresh_results
from stemcal.stages.stage import STAGES, stages_known
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.stages.verdict.words import lines
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.vocabulary import Wording

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from stemcal.arrays import Array


class StudyResults:
    """The results of a study by stage; access to a stage that is not finished raises `UsageError`.

    Results are attributes: `screen`, `climb`, `surface`, `inversion`, `refinement`, `validation`, and stages of other
    packages by name. `of` returns a result by its class.

    `stale` contains a sentence for each stage file that is not used because its inputs changed.
    """

    def __init__(self, study: Study, folder: StudyFolder) -> None:
        self.study, self.folder, self._results = study, folder, fresh_results(study, folder)
        self.stale = self._results.stale

    def of(self, kind: type[R]) -> R:
        """Return the stage result that is an instance of `kind`; raise `UsageError` if the stage is not finished."""
        if (result := self._results.of(kind)) is not None:
            return result
        missing = f"{self.folder.path / kind.name}.json does not exist. Run `stemcal {kind.name} SPEC` first."
        raise UsageError(next(iter(self.stale), missing))

    def __getattr__(self, name: str) -> Any:
        """Return the result of the stage with this name or attribute, with the methods that `in_notebook` adds."""
        stages = () if name.startswith("_") else STAGES.all
        if (stage := next((stage for stage in stages if name in (stage.name, stage.attribute)), None)) is None:
            raise AttributeError(f"StudyResults has no attribute {name!r}")
        result = self.of(stage.result())
        return showing_of(result).in_notebook(result, self._setting)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(stage.attribute or stage.name for stage in stages_known(self.study))]

    @cached_property
    def _setting(self) -> Setting:
        from stemcal.report.page.page import for_notebook

        return Setting(self.study, self._results, self.verdict.holds, for_notebook)

    @cached_property
    def verdict(self) -> Verdict:
        """The verdict (calibrated, calibrated with reservations, or not calibrated), with reasons and remedies."""
        return verdict_of(self.study, self.folder, self._results)

    @property
    def verdict_text(self) -> str:
        """The verdict in at most three lines, as printed at the end of `stemcal run`."""
        return "\n".join(lines(self.verdict, Wording(self.study.naming)))

    @property
    def parameters(self) -> dict[str, float]:
        """The calibrated level of every factor, in the units of the spec."""
        return self._results.parameters

    @property
    def runs(self) -> Rows[LedgerRow]:
        """All runs of the study with their outcomes."""
        return ledger(self.study, self.folder)

    @cached_property
    def records(self) -> Records:
        """Curves, checks and energies of all runs, by run label."""
        return read_records(self._results, self.folder)

    @property
    def figure_names(self) -> list[str]:
        """The names of all figures, as in the output of `stemcal export figures SPEC list`."""
        return [plot.name for plot in gallery(self.study, self._results, self.records)]

    def figure(self, name: str) -> Figure:
        """Draw the figure with this name, or the first whose name starts with it, such as ``contour``."""
        plots = {plot.name: plot for plot in gallery(self.study, self._results, self.records)}
        plot_named = next((plot for key, plot in plots.items() if name == key or key.startswith(f"{name}-")), None)
        if plot_named is None:
            raise UsageError(f"figure: no figure is named {name!r}; {did_you_mean(str(name), plots)}")
        return plot_named.figure

    def __repr__(self) -> str:
        done = [f"  {line}" for line in (*map(repr, self._results.done), *self.stale)]
        return "\n".join([self.verdict_text, f"Study {self.study.name} in {self.folder.path}", *done])

    def _repr_html_(self) -> str:
        rows = "".join(f"<li>{escape(repr(result))}</li>" for result in self._results.done)
        stale = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.stale)
        first, *further = map(coded, self.verdict_text.splitlines())
        verdict = "".join(f"<br>{line}" for line in further)
        return f"<p><b>{first}</b>{verdict}</p><p>Study {escape(self.study.name)}</p><ul>{rows}{stale}</ul>"


@dataclass(frozen=True, eq=False, repr=False)
class Curve:
    """Filtered force on the blade (N) over its travel from first contact (mm), and the travel at the break, if any."""

    travel: Array
    force: Array
    broke: float | None = None

    def to_frame(self) -> pd.DataFrame:
        """Return the curve as a pandas DataFrame with the columns ``travel`` and ``force``."""
        rows = zip(self.travel.tolist(), self.force.tolist(), strict=True)
        return Table((Column("travel"), Column("force")), tuple(rows)).to_frame()

    def plot(self) -> Figure:
        return force_travel({"force": DrawnCurve(tuple(self.travel), tuple(self.force), self.broke)}, ["force"])

    def __repr__(self) -> str:
        return f"Curve with {len(self.travel)} points (maximum force {self.force.max():.4g} N)"


@dataclass(frozen=True, eq=False, repr=False)
class Simulated:
    """The result of one simulated cutting test: factor levels, stem diameter (mm), and the `result` of the solver."""

    levels: dict[str, float]
    diameter: float
    result: CuttingResult

    @property
    def peak_force(self) -> float:
        """Maximum force, N."""
        return self.result.peak_force

    @property
    def curve(self) -> Curve:
        """Force versus travel."""
        history = self.result.history
        return Curve(history.travel, history.force_filtered, self.result.break_travel)

    def __repr__(self) -> str:
        result = self.result
        where = f"{result.peak_force:.4g} N at {result.peak_travel:.3g} mm"
        return f"Shear test (stem diameter {self.diameter:g} mm): {where}, {result.elements} elements"
