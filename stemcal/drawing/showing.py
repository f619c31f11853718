"""The base class `Showing`: it creates the sentences, tables and figures of a stage from the result of the stage."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from stemcal.drawing.plot import Plot
from stemcal.drawing.table import Table
from stemcal.formats import unit_written
from stemcal.registry import Checked
from stemcal.study.model.study import Study
from stemcal.vocabulary import Wording

R = TypeVar("R", bound=Any)  # the result of a stage

RANGE = "95 % confidence interval"  # the name of the interval that is reported with a calibrated parameter


class Finished(Protocol):
    """The results of the finished stages of a study (`stages.results.Results`)."""

    @property
    def done(self) -> Sequence[Any]:
        """The results of the finished stages, in order."""

    @property
    def calibrated(self) -> bool:
        """Whether a finished stage has determined the parameters."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """The calibrated level of every factor."""

    def of(self, kind: type[Any]) -> Any:
        """Return the result of this class; None if its stage is not finished."""


@dataclass(frozen=True)
class Setting:
    """Inputs, besides the result of a stage, from which sentences, tables and figures are created."""

    study: Study
    results: Finished  # results of all finished stages
    holds: bool = True  # whether the verdict is that the study is calibrated
    frame: Callable[[Mapping[str, Any]], str] = str  # converts the data of the profiler to HTML for a notebook

    @cached_property
    def labels(self) -> dict[str, str]:
        return {factor.name: factor.label for factor in self.study.factors}

    @cached_property
    def labelled(self) -> Wording:
        """The wording for figures, in which factors have label and unit: ``Yield stress (MPa)``."""
        names = {}
        for factor in self.study.factors:
            unit = unit_written(factor.unit)
            names[factor.name] = f"{factor.label or factor.name} ({unit})" if unit else factor.label
        return Wording(self.study.naming, names)


class Showing(Checked, Generic[R]):
    """Creates the sentences, tables and figures of a stage; a stage overrides the methods that it needs."""

    claims: ClassVar[bool] = False  # whether the outcome is shown only if the study is calibrated

    def outcome(self, result: R, names: Wording) -> list[str]:
        """Return sentences that state the outcome."""
        return []

    def tables(self, result: R, names: Wording) -> list[Table]:
        """Return the tables of the stage."""
        return []

    def findings(self, result: R, names: Wording) -> list[Table]:
        """Return the tables that `stemcal run` prints as soon as the stage is finished."""
        return []

    def figures(self, result: R, setting: Setting) -> list[Plot]:
        """Return the figures of the stage, which are drawn later, on first use."""
        return []

    def cited(self, result: R) -> Mapping[str, str]:
        """Return the 95 % confidence interval of each parameter that the stage determines, as text to report."""
        return {}

    def closing(self, result: R, setting: Setting) -> list[Table]:
        """Return the tables that `stemcal run` prints last, when the whole study is finished."""
        return []

    def profiler(self, result: R, setting: Setting) -> dict[str, Any] | None:
        """Return the data of the page's profiler in types of JSON; None if the stage has none."""
        return None

    def in_notebook(self, result: R, setting: Setting) -> R:
        """Return the result for use in a notebook, where it may have further methods."""
        return result


def names_of(result: Any, labels: Mapping[str, str] | None = None) -> Wording:
    """Return the wording of a result, with `labels` of factors by their names."""
    return Wording(result.naming, labels or {})
