"""The results of a study as a notebook uses them: tables that show themselves, frames, and every figure."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from stemcal.doe.calibration.fit import Fit
from stemcal.errors import UsageError
from stemcal.files.rows import Rows
from stemcal.folder import StudyFolder
from stemcal.naming import Names
from stemcal.overview.status import Entry, ledger
from stemcal.report.gallery import gallery
from stemcal.report.page import coded, for_notebook
from stemcal.report.records import Records, read_records
from stemcal.report.showing import Setting, showing_of
from stemcal.stages.climb.result import ClimbResult
from stemcal.stages.fitting import fit_of_study
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import R, StageResult
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.stage import STAGES
from stemcal.stages.surface.result import Prediction, SurfaceResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.rules import verdict_of
from stemcal.stages.verdict.words import lines
from stemcal.study.model import Study
from stemcal.study.reading.messages import checked_number
from stemcal.words import did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure

V = TypeVar("V", bound=StageResult)


class Surface(SurfaceResult):
    """A surface that checks the levels of a prediction; notebooks show it as the profiler of the report."""

    _owner: StudyResults

    def predict(self, levels: Mapping[str, float]) -> Prediction:
        """Return the response at these levels (units of the spec); raise `UsageError` if one is missing or wrong."""
        known = levels if isinstance(levels, Mapping) else {}
        if missing := [name for name in self.names if name not in known]:
            raise UsageError(
                f"predict: the level of {', '.join(missing)} is missing; pass it by name, as in {{{missing[0]!r}: …}}"
            )
        return super().predict({name: checked_number(known[name], name) for name in self.names})

    def _repr_html_(self) -> str:
        owner = self._owner
        found = self._owner._results.of(SurfaceResult)
        assert found is not None
        data = showing_of(found).profiler(found, Setting(owner.study, owner._results, owner.verdict.holds))
        return for_notebook(data or {})


class Inversion(InvertResult):
    """A calibration with its likelihood."""

    _study: Study
    _surface: SurfaceResult

    @cached_property
    def _fit(self) -> Fit:
        return fit_of_study(self._study, self._surface)

    def log_likelihood(self, levels: Mapping[str, Any]) -> Any:
        """Return the log-likelihood of the measurements, up to a constant, at levels in the units of the spec.

        Each level is a number, or an array to evaluate many points at once. Priors of the spec are included. The value
        is minus infinity outside the ranges. Raise `UsageError` if a level is missing.
        """
        names = self._surface.names
        if missing := [name for name in names if name not in levels]:
            raise UsageError(f"log_likelihood: the level of {', '.join(missing)} is missing")
        each = np.broadcast_arrays(*(np.asarray(levels[name], dtype=float) for name in names))
        points = self._surface.scales.to_coded(np.stack([one.ravel() for one in each], axis=-1))
        inside = self._surface.region(self._study).contains(points)
        found = np.where(inside, self._fit.log_likelihood(points), -np.inf).reshape(each[0].shape)
        return found if found.ndim else float(found)


def _extended(kind: type[V], result: StageResult, **more: object) -> V:
    """Return a result as an instance of its extended class."""
    extended = object.__new__(kind)
    extended.__dict__.update(vars(result), **more)
    return extended


class StudyResults:
    """The results of a study by stage; access to a stage that is not finished raises `UsageError`.

    Attributes
    ----------
    study : Study
    folder : StudyFolder
    stale : tuple of str
        Reasons why existing stage files are not used: an input has changed since.
    """

    def __init__(self, study: Study, folder: StudyFolder, results: Results) -> None:
        self.study, self.folder, self._results, self.stale = study, folder, results, results.stale

    @classmethod
    def read(cls, study: Study, folder: StudyFolder) -> StudyResults:
        """Read the results in a study folder."""
        return cls(study, folder, fresh_results(study, folder))

    @property
    def screen(self) -> ScreenResult:
        """The factors that affect the response."""
        return self.of(ScreenResult)

    @property
    def climb(self) -> ClimbResult:
        """The steps towards the target."""
        return self.of(ClimbResult)

    @property
    def surface(self) -> Surface:
        """The response as a quadratic surface."""
        return _extended(Surface, self.of(SurfaceResult), _owner=self)

    @property
    def inversion(self) -> Inversion:
        """The calibrated parameters and their intervals."""
        found, surface = self.of(InvertResult), self.of(SurfaceResult)
        return _extended(Inversion, found, _study=self.study, _surface=surface)

    @property
    def refinement(self) -> RefineResult:
        """The parameters corrected by simulations, in the model of the study or of `refine.in`."""
        return self.of(RefineResult)

    @property
    def validation(self) -> ValidateResult:
        """Measured and simulated responses."""
        return self.of(ValidateResult)

    def of(self, kind: type[R]) -> R:
        """Return the result of a stage by its class; raise `UsageError` if the stage is not finished."""
        if (result := self._results.of(kind)) is not None:
            return result
        missing = f"{self.folder.path / kind.name}.json does not exist yet; run `stemcal {kind.name} SPEC` first"
        raise UsageError(next(iter(self.stale), missing))

    def __getattr__(self, name: str) -> Any:
        """Return the result of a stage of another package by its name."""
        if (stage := None if name.startswith("_") else STAGES.named(name)) is None:
            raise AttributeError(f"StudyResults has no attribute {name!r}")
        return self.of(stage.result())

    @cached_property
    def verdict(self) -> Verdict:
        """The verdict on the study (calibrated, with reservations, not calibrated) with reasons and remedies."""
        return verdict_of(self.study, self.folder, self._results)

    @property
    def verdict_text(self) -> str:
        """The verdict in at most three lines, as printed at the end of `stemcal run`."""
        return "\n".join(lines(self.verdict, Names(self.study.naming)))

    @property
    def parameters(self) -> dict[str, float]:
        """The calibrated level of every factor, in the units of the spec."""
        return self._results.parameters

    @property
    def runs(self) -> Rows[Entry]:
        """Every run of the study with its outcome."""
        return ledger(self.study, self.folder)

    @cached_property
    def records(self) -> Records:
        """Curves, checks and energies of every run, by the label of the run."""
        return read_records(self._results, self.folder)

    # ---- every figure of the page

    @property
    def figure_names(self) -> list[str]:
        """The names of all figures, as `stemcal export figures SPEC list` shows them."""
        return [plot.name for plot in gallery(self.study, self._results, self.records)]

    def figure(self, name: str) -> Figure:
        """Draw the figure with this name, or the first whose name starts with it, such as ``contour``."""
        plots = {plot.name: plot for plot in gallery(self.study, self._results, self.records)}
        found = next((plot for one, plot in plots.items() if name == one or one.startswith(f"{name}-")), None)
        if found is None:
            raise UsageError(f"no figure {name!r}; {did_you_mean(str(name), plots)}")
        return found.draw()

    # ---- how they show themselves

    def __repr__(self) -> str:
        done = [f"  {line}" for line in (*map(repr, self._results.done), *self.stale)]
        return "\n".join([self.verdict_text, f"Study {self.study.name} in {self.folder.path}", *done])

    def _repr_html_(self) -> str:
        rows = "".join(f"<li>{escape(repr(result))}</li>" for result in self._results.done)
        stale = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.stale)
        first, *further = map(coded, self.verdict_text.splitlines())
        verdict = "".join(f"<br>{line}" for line in further)
        return f"<p><b>{first}</b>{verdict}</p><p>Study {escape(self.study.name)}</p><ul>{rows}{stale}</ul>"
