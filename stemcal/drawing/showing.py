"""The base class of what shows a stage: its sentences, tables and figures, made from its result."""

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

RANGE = "95 % confidence interval"
"""What the range of a parameter to cite is called."""


class Finished(Protocol):
    """The results of the finished stages of a study (`stages.results.Results`)."""

    @property
    def done(self) -> Sequence[Any]:
        """The results, in order."""

    @property
    def calibrated(self) -> bool:
        """Whether the parameters are known."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """The calibrated level of every factor."""

    def of(self, kind: type[Any]) -> Any:
        """Return the result of a stage by its class; None where it is not done."""


@dataclass(frozen=True)
class Setting:
    """A study, all results, whether it is calibrated (`holds`), and `frame`: profiler data as HTML for a notebook."""

    study: Study
    results: Finished
    holds: bool = True
    frame: Callable[[Mapping[str, Any]], str] = str

    @cached_property
    def labels(self) -> dict[str, str]:
        """What people call the factors."""
        return {factor.name: factor.label for factor in self.study.factors}

    @cached_property
    def labelled(self) -> Wording:
        """The factors by label and unit, as papers print them."""
        names = {}
        for factor in self.study.factors:
            unit = unit_written(factor.unit)
            names[factor.name] = f"{factor.label or factor.name} ({unit})" if unit else factor.label
        return Wording(self.study.naming, names)


class Showing(Checked, Generic[R]):
    """Words, tables and figures of a stage; an outcome that `claims` agreement is shown of a calibrated study only."""

    claims: ClassVar[bool] = False

    def outcome(self, result: R, names: Wording) -> list[str]:
        """Return the outcome in sentences."""
        return []

    def tables(self, result: R, names: Wording) -> list[Table]:
        """Return its tables."""
        return []

    def findings(self, result: R, names: Wording) -> list[Table]:
        """Return the tables that `stemcal run` prints before its end."""
        return []

    def figures(self, result: R, setting: Setting) -> list[Plot]:
        """Return its figures, none of them drawn yet."""
        return []

    def cited(self, result: R) -> Mapping[str, str]:
        """Return the 95 % confidence interval of each parameter that it sets, to cite."""
        return {}

    def validity(self, result: R, holds: bool) -> list[str]:
        """Return the settings that the parameters depend on; if the study `holds`, what their ranges assume."""
        return []

    def closing(self, result: R, setting: Setting) -> list[Table]:
        """Return the tables of the last screen of a whole study."""
        return []

    def profiler(self, result: R, setting: Setting) -> dict[str, Any] | None:
        """Return the data of the profiler of the page, for JSON."""
        return None

    def in_notebook(self, result: R, setting: Setting) -> R:
        """Return the result as a notebook uses it, which may do more."""
        return result


def names_of(result: Any, labels: Mapping[str, str] | None = None) -> Wording:
    """Return the names of a result's responses, its condition and its factors."""
    return Wording(result.naming, labels or {})
