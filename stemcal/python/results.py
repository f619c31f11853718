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
from stemcal.folder.study_folder import StudyFolder
from stemcal.names import Names
from stemcal.overview.status import Entry, ledger
from stemcal.report.figures.certainty import profiles
from stemcal.report.figures.contour import contours, relief, solutions, with_unit
from stemcal.report.figures.effects import diagnostics, half_normal, observed_predicted, pareto, residuals
from stemcal.report.figures.gallery import gallery, spread_of
from stemcal.report.figures.validation import growth, validation
from stemcal.report.page.render import coded
from stemcal.report.records import Records, read_records
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.joint import fit_of_study
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import R, StageResult
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import Prediction, SurfaceResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.rules import verdict_of
from stemcal.stages.verdict.words import lines
from stemcal.study.model import Study
from stemcal.study.reading.checked import checked_number
from stemcal.words import did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure

V = TypeVar("V", bound=StageResult)


class ScreenPlots:
    """Figures of a screening."""

    def __init__(self, result: ScreenResult) -> None:
        self._result = result

    def pareto(self) -> Figure:
        """Draw the effects by size."""
        return pareto(self._result)

    def half_normal(self) -> Figure:
        """Draw the effects against half-normal scores."""
        return half_normal(self._result)


class SurfacePlots:
    """Figures of a surface; where there is a solution they show it."""

    def __init__(self, result: SurfaceResult, inversion: InvertResult | None) -> None:
        self._result, self._inversion = result, inversion

    def contour(self, across: str | None = None, up: str | None = None) -> Figure:
        """Draw lines of equal response over two factors, the two that matter most by default."""
        return contours(self._result, self._pair(across, up), self._inversion)

    def relief(self, across: str | None = None, up: str | None = None) -> Figure:
        """Draw the response as height over two factors."""
        return relief(self._result, self._pair(across, up), self._inversion)

    def observed_predicted(self) -> Figure:
        """Draw the simulated response against its prediction."""
        return observed_predicted(self._result)

    def residuals(self) -> Figure:
        """Draw what the surface leaves unexplained."""
        return residuals(self._result)

    def diagnostics(self) -> Figure:
        """Draw residuals against the normal law and in order of the runs, and Cook's distances."""
        return diagnostics(self._result)

    def _pair(self, across: str | None, up: str | None) -> tuple[str, str]:
        names = self._result.names
        for name in (across, up):
            if name is not None and name not in names:
                raise UsageError(f"the surface has no factor {name!r}; {did_you_mean(str(name), names)}")
        if across == up and across is not None:
            raise UsageError(f"a contour needs two factors, not {across} twice")
        wanted = [name for name in (across, up) if name is not None]
        free = [name for name in names if name not in wanted]
        pair = (across or free.pop(0), up or (free.pop(0) if free else ""))
        if not pair[1]:
            raise UsageError("a contour needs two factors; the surface has one")
        return pair


class InversionPlots:
    """Figures of a calibration."""

    def __init__(self, result: InvertResult, surface: SurfaceResult) -> None:
        self._result, self._surface = result, surface

    def solutions(self) -> Figure:
        """Draw the range of each factor over all solutions."""
        return solutions(self._surface, self._result)

    def profiles(self) -> Figure:
        """Draw the rise of the misfit over each factor."""
        return profiles(self._result, self._labels())

    def _labels(self) -> dict[str, str]:
        return {name: with_unit(self._surface, name) for name in self._result.point.solution}


class ValidationPlots:
    """Figures of a validation."""

    def __init__(self, result: ValidateResult, study: Study) -> None:
        self._result, self._study = result, study

    def responses(self) -> Figure:
        """Draw the first response, measured and simulated, over the condition: forces over diameters by default."""
        return validation(self._result, spread_of(self._study, self._result.naming.response))

    def growth(self) -> Figure:
        """Draw them on logarithmic axes."""
        return growth(self._result)


class Screen(ScreenResult):
    """A screening with its figures."""

    plot: ScreenPlots


class Surface(SurfaceResult):
    """A surface with its figures."""

    plot: SurfacePlots

    def predict(self, levels: Mapping[str, float]) -> Prediction:
        """Return the response at these levels (units of the spec); raise `UsageError` if one is missing or wrong."""
        known = levels if isinstance(levels, Mapping) else {}
        if missing := [name for name in self.names if name not in known]:
            raise UsageError(
                f"predict: no level of {', '.join(missing)}; give one by name, as in {{{missing[0]!r}: …}}"
            )
        return super().predict({name: checked_number(known[name], name) for name in self.names})


class Inversion(InvertResult):
    """A calibration with its figures and its likelihood."""

    plot: InversionPlots
    _study: Study
    _surface: SurfaceResult

    @cached_property
    def _fit(self) -> Fit:
        return fit_of_study(self._study, self._surface)

    def log_likelihood(self, levels: Mapping[str, Any]) -> Any:
        """Return the log-likelihood of what was measured, up to a constant, at levels in the units of the spec.

        Each level is a number, or an array to evaluate many points at once. Priors of the spec are included. The value
        is minus infinity outside the ranges. Raise `UsageError` if a level is missing.
        """
        names = self._surface.names
        if missing := [name for name in names if name not in levels]:
            raise UsageError(f"log_likelihood: no level of {', '.join(missing)}")
        each = np.broadcast_arrays(*(np.asarray(levels[name], dtype=float) for name in names))
        points = self._surface.scales.to_coded(np.stack([one.ravel() for one in each], axis=-1))
        inside = self._surface.region(self._study).contains(points)
        found = np.where(inside, self._fit.log_likelihood(points), -np.inf).reshape(each[0].shape)
        return found if found.ndim else float(found)


class Validation(ValidateResult):
    """A validation with its figures."""

    plot: ValidationPlots


def _plotted(kind: type[V], result: StageResult, plot: object, **more: object) -> V:
    """Return a result as the class that has figures."""
    plotted = object.__new__(kind)
    plotted.__dict__.update(vars(result), plot=plot, **more)
    return plotted


class StudyResults:
    """What a study came to, stage by stage; a stage that is not done raises `UsageError` when it is asked for.

    Attributes
    ----------
    study : Study
    folder : StudyFolder
    stale : tuple of str
        Why stages whose files are there are left out: something has changed since.
    """

    def __init__(self, study: Study, folder: StudyFolder, results: Results) -> None:
        self.study, self.folder, self._results, self.stale = study, folder, results, results.stale

    @classmethod
    def of(cls, study: Study, folder: StudyFolder) -> StudyResults:
        """Read what lies in the folder of a study."""
        return cls(study, folder, fresh_results(study, folder))

    @property
    def screen(self) -> Screen:
        """Which factors move the response."""
        found = self._there(self._results.screen, "screen")
        return _plotted(Screen, found, ScreenPlots(found))

    @property
    def climb(self) -> ClimbResult:
        """The steps towards the target."""
        return self._there(self._results.climb, "climb")

    @property
    def surface(self) -> Surface:
        """The response as a quadratic surface."""
        found = self._there(self._results.surface, "rsm")
        return _plotted(Surface, found, SurfacePlots(found, self._results.inversion))

    @property
    def inversion(self) -> Inversion:
        """The calibrated parameters and how well they are known."""
        found, surface = self._there(self._results.inversion, "invert"), self._there(self._results.surface, "rsm")
        return _plotted(Inversion, found, InversionPlots(found, surface), _study=self.study, _surface=surface)

    @property
    def refinement(self) -> RefineResult:
        """The parameters corrected by simulations, in the study's own model or in that of `refine.in`."""
        return self._there(self._results.refinement, "refine")

    @property
    def validation(self) -> Validation:
        """Measured against simulated response."""
        found = self._there(self._results.validation, "validate")
        return _plotted(Validation, found, ValidationPlots(found, self.study))

    def _there(self, result: R | None, stage: str) -> R:
        if result is None:
            reason = next(iter(self.stale), f"{self.folder.path / stage}.json is not there yet")
            raise UsageError(f"{reason}; run `stemcal {stage} SPEC` first" if not self.stale else reason)
        return result

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the study is calibrated, with reservations or not, for which reasons, and what would mend it."""
        return verdict_of(self.study, self.folder, self._results)

    @property
    def verdict_text(self) -> str:
        """The verdict in three lines at most, as `stemcal run` ends with it."""
        return "\n".join(lines(self.verdict, Names(self.study.naming)))

    @property
    def parameters(self) -> dict[str, float]:
        """The calibrated level of every factor, in the units of the spec."""
        return self._results.parameters

    @property
    def runs(self) -> Rows[Entry]:
        """Every run of the study and what came of it."""
        return ledger(self.study, self.folder)

    @cached_property
    def records(self) -> Records:
        """What the solver told of every run, by the label of the run: curves, checks, energies."""
        return read_records(self._results, self.folder)

    # ---- every figure of the page

    @property
    def figure_names(self) -> list[str]:
        """The names of all figures, as `stemcal export figures SPEC list` shows them."""
        return [plot.name for plot in gallery(self.study, self._results, self.records)]

    def figure(self, name: str) -> Figure:
        """Draw the figure of that name."""
        plots = {plot.name: plot for plot in gallery(self.study, self._results, self.records)}
        if name not in plots:
            raise UsageError(f"no figure {name!r}; {did_you_mean(str(name), plots)}")
        return plots[name].draw()

    # ---- how they show themselves

    def __repr__(self) -> str:
        done = [f"  {line}" for line in (*map(repr, self._results.done()), *self.stale)]
        return "\n".join([self.verdict_text, f"Study {self.study.name} in {self.folder.path}", *done])

    def _repr_html_(self) -> str:
        rows = "".join(f"<li>{escape(repr(result))}</li>" for result in self._results.done())
        stale = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.stale)
        first, *further = map(coded, self.verdict_text.splitlines())
        verdict = "".join(f"<br>{line}" for line in further)
        return f"<p><b>{first}</b>{verdict}</p><p>Study {escape(self.study.name)}</p><ul>{rows}{stale}</ul>"
