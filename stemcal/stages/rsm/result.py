"""The result of the stage rsm: coefficients, analysis of variance, diagnostics, and the surface."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.solution_ranges import Assessment, assess_point
from stemcal.doe.coding import term_columns, term_names
from stemcal.doe.regression.anova import AnovaRow, Coefficient, FitStatistics
from stemcal.doe.regression.canonical import CanonicalForm
from stemcal.doe.regression.surface import ReductionStep
from stemcal.drawing.table import Table
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.stages.fitting import AtCondition, ConditionAxis, FactorCoding, Surfaces
from stemcal.stages.result import CodedScale, DesignRuns, Head, Interval
from stemcal.storage.rows import Rows
from stemcal.storage.typed import absent, inline, to_json
from stemcal.vocabulary import FIRST, Vocabulary, Wording


@dataclass(frozen=True, kw_only=True, repr=False)
class RsmResult(Surfaces, FitStatistics):
    """The response as a quadratic in the coded factors, with the `covariance` of its coefficients in their order."""

    name: ClassVar[str] = "rsm"
    shown = ("names", "r2")

    head: Head = inline()
    names: tuple[str, ...]
    factors: Rows[FactorCoding]
    coding: dict[str, CodedScale]
    fixed: dict[str, float]
    radius: float
    design: DesignRuns
    covariance: tuple[tuple[float, ...], ...] | None = None
    reduction: tuple[ReductionStep, ...] | None = None
    canonical: CanonicalForm | None = None
    conditions: Rows[AtCondition] = absent(Rows())
    over: ConditionAxis | None = absent()
    pure_error: Note | None = None
    deterministic: bool = absent(False)  # equal inputs give equal responses
    notes: tuple[Note, ...] = ()

    @property
    def regressed(self) -> Vocabulary:
        """Names of the fitted responses; the first one is a logarithm if the surface is fitted to the logarithm."""
        return self.naming.of_logarithm if self.over is not None and FIRST in self.over.logarithms else self.naming

    def response_at(self, coded: Mapping[str, Any]) -> Any:
        """Return the response at the calibration condition for coded values, numbers or arrays, of all factors."""
        values = np.broadcast_arrays(*(np.asarray(coded[name], dtype=float) for name in self.names))
        points = np.column_stack([value.ravel() for value in values])
        response = self.fitted.predict(points) if self.over is not None else term_columns(points) @ self.beta
        return np.asarray(response).reshape(values[0].shape)

    @cached_property
    def beta(self) -> Array:
        """Coefficients of all terms of the full quadratic; 0 for terms that are not in the model."""
        known = {row.term: row.value for row in self.coefficients}
        return np.array([known.get(term, 0.0) for term in term_names(self.axes)])

    def predict(self, levels: Mapping[str, float]) -> Assessment:
        """Return the response with its intervals at these levels (units of the spec); other factors are ignored."""
        coded = self.scales.to_coded([levels[name] for name in self.names])
        return assess_point(self.fitted, coded, radius=self.radius)

    def sign_of(self, factor: str) -> Literal["+", "-"] | None:
        """Return the sign of the slope at the centre if its 95 % interval excludes 0."""
        slope = next((row for row in self.coefficients if row.term == factor), None)
        if slope is None or slope.low is None or slope.high is None or slope.low * slope.high <= 0.0:
            return None
        return "+" if slope.value > 0.0 else "-"

    def drawn_between(self, name: str) -> Interval:
        """Return the coded ends of a factor's axis in figures: they enclose all runs and the design in the range."""
        reach, factor, scale = self.radius or 1.0, self.factor(name), self.coding[name]
        runs = [run.levels[name] for run in self.design.runs]
        low, high = scale.natural(-reach), scale.natural(reach)
        low = min(*runs, max(low, factor.low))
        high = max(*runs, min(high, factor.high))
        return (low - scale.center) / scale.half_step, (high - scale.center) / scale.half_step

    def symbols(self) -> dict[str, str]:
        """Return the symbol of every factor, or its name if it has no symbol."""
        symbols, condition = {each.factor: each.symbol or each.factor for each in self.factors}, self.naming.condition
        if self.over is None or condition is None:
            return symbols
        return {**symbols, self.over.name: condition.symbol or condition.name}

    def _tables(self) -> dict[str, Table]:
        terms = {row.term: to_json(row) for row in self.coefficients}
        rows = [{"source": "1", **terms["1"]}, *({**to_json(row), **terms.get(row.source, {})} for row in self.anova)]
        columns = [field.name for field in (*fields(AnovaRow), *fields(Coefficient)[1:-1])]
        return {"rsm": Table.of(columns, rows), "rsm_runs": self.design.table()}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        for part in self.conditions:
            for answered in part.runs:
                yield f"rsm {answered.run}{Wording(self.naming).at(part.condition)}", answered.outcome
        for run in self.design.runs:
            yield f"rsm {run.run}", run.outcome
