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

RANGE = "95 % confidence interval"  # heading of the interval that is reported for each calibrated parameter


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
        """Return the result that is an instance of `kind`; None if its stage is not finished."""


@dataclass(frozen=True)
class Setting:
    """The inputs for figures and closing tables, in addition to the result of a stage."""

    study: Study
    results: Finished  # results of all finished stages
    holds: bool = True  # whether the verdict is that the study is calibrated
    frame: Callable[[Mapping[str, Any]], str] = str  # converts the data of the prediction profiler to HTML

    @cached_property
    def labels(self) -> dict[str, str]:
        return {factor.name: factor.label for factor in self.study.factors}

    @cached_property
    def labelled(self) -> Wording:
        """The wording for figures: the label of a factor includes the unit, as in ``Yield stress (MPa)``."""
        names = {}
        for factor in self.study.factors:
            unit = unit_written(factor.unit)
            names[factor.name] = f"{factor.label or factor.name} ({unit})" if unit else factor.label
        return Wording(self.study.naming, names)


class Showing(Checked, Generic[R]):
    """Base class that creates the sentences, tables and figures of a stage; subclasses override what they need."""

    claims: ClassVar[bool] = False  # whether `outcome` is shown only if the verdict is that the study is calibrated

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
        """Return the 95 % confidence interval of each parameter that the stage determines, as text, by name."""
        return {}

    def closing(self, result: R, setting: Setting) -> list[Table]:
        """Return the tables that `stemcal run` prints last, when the whole study is finished."""
        return []

    def profiler(self, result: R, setting: Setting) -> dict[str, Any] | None:
        """Return the data of the prediction profiler on the report page, as JSON values; None if there is none."""
        return None

    def in_notebook(self, result: R, setting: Setting) -> R:
        """Return the result, maybe of a subclass with more methods, for use in a notebook."""
        return result


def names_of(result: Any, labels: Mapping[str, str] | None = None) -> Wording:
    """Return the wording for a result, with its names of responses and the `labels` of factors (by factor name)."""
    return Wording(result.naming, labels or {})
