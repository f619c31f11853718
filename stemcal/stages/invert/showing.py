"""Sentences, tables and figures of a calibration."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from stemcal.doe.calibration.likelihood import Fit
from stemcal.drawing.columns import ERROR, factor, from_means, measured_columns, scores, to_decimals
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import RANGE, Setting, Showing
from stemcal.drawing.style import BLUE, FAINT, INK, Figure, axis_of, new_figure
from stemcal.drawing.table import Column, Table
from stemcal.errors import UsageError
from stemcal.formats import MISSING, direction, fixed, interval, short, significant, unit_written
from stemcal.stages.fitting import Surfaces, fit_of_study
from stemcal.stages.invert import words
from stemcal.stages.invert.result import Certainty, InvertResult, JointFitted
from stemcal.storage.typed import to_json
from stemcal.study.model.study import Study
from stemcal.vocabulary import Wording


class InvertShowing(Showing[InvertResult]):
    """Sentences, tables and figures of a calibration."""

    def outcome(self, result: InvertResult, names: Wording) -> list[str]:
        return words.outcome(result, names)

    def tables(self, result: InvertResult, names: Wording) -> list[Table]:
        return [calibration_table(result, names), *([_joint_table(result.joint, names)] if result.joint else [])]

    def figures(self, result: InvertResult, setting: Setting) -> list[Plot]:
        units = {name: setting.study.factor(name).unit for name in result.point.solution}
        labels = {name: axis_of(setting.labels.get(name, name), unit) for name, unit in units.items()}
        text = (
            "Misfit as a function of each factor, minimized over the other factors. Within the 95 % confidence "
            "interval (shaded), the misfit is below the dashed line. The vertical line marks the calibrated value."
        )
        return [Plot("profiles", "invert", text, partial(profiles, result, labels), claims=True)]

    def in_notebook(self, result: InvertResult, setting: Setting) -> InvertResult:
        inversion = object.__new__(NotebookInversion)
        inversion.__dict__.update(vars(result), _study=setting.study, _surface=setting.results.of(Surfaces))
        return inversion

    def cited(self, result: InvertResult) -> Mapping[str, str]:
        return _ranges(result)

    def closing(self, result: InvertResult, setting: Setting) -> list[Table]:
        table = calibration_table(result, Wording(setting.study.naming), setting.results.parameters)
        name, value, *others = table.columns
        unit = Column("unit", "Unit", form=unit_written, words=True)
        kept = [column for column in others if column.key == "range"]
        rows = tuple((*row[:2], setting.study.factor(row[0]).unit, row[2]) for row in table.rows)
        columns = (replace(name, label="Parameter"), value, unit, *kept)
        return [replace(table, columns=columns, rows=rows, foot=(), claimed=())]


class NotebookInversion(InvertResult):
    """A calibration for notebooks, with its likelihood."""

    _study: Study
    _surface: Surfaces

    @cached_property
    def _fit(self) -> Fit:
        return fit_of_study(self._study, self._surface)

    def log_likelihood(self, levels: Mapping[str, Any]) -> Any:
        """Return the log-likelihood of the measurements, up to a constant, at levels in the units of the spec.

        Each level is a number, or an array to evaluate many points at once. Priors of the spec are included. The value
        is minus infinity outside the ranges. Raise `UsageError` if a level is missing.
        """
        names = self._surface.names
        if missing := ", ".join(name for name in names if name not in levels):
            raise UsageError(f"log_likelihood: no level is given for {missing}. Pass a level for every factor.")
        each = np.broadcast_arrays(*(np.asarray(levels[name], dtype=float) for name in names))
        points = self._surface.scales.to_coded(np.stack([values.ravel() for values in each], axis=-1))
        inside = self._surface.region.contains(points)
        likelihood = np.where(inside, self._fit.log_likelihood(points), -np.inf).reshape(each[0].shape)
        return likelihood if likelihood.ndim else float(likelihood)


def calibration_table(stage: InvertResult, names: Wording, refined: Mapping[str, float] | None = None) -> Table:
    """Return the table of calibrated (or `refined`) parameters and ranges, with target and prediction below it."""
    point, ranges = stage.point, _ranges(stage)
    rows: list[dict[str, Any]] = [
        {"factor": name, "range": ranges[name], "coded": coded, "solution": (refined or point.solution)[name]}
        for name, coded in point.coded.items()
    ]
    columns = [
        factor(names),
        Column("solution", "Calibrated", form=significant),
        Column("range", RANGE, form=str, claims=True),
        Column("coded", "Coded", form=to_decimals(3)),
    ]
    where = (
        f"The calibration target is {names.quantity(stage.target, '.6g')}, and the predicted value at the calibrated "
        f"point is {names.quantity(point.predicted)}. The calibrated point, determined by "
        f"{_RULES[stage.rule]}, is at a coded distance of {point.coded_radius:.3f} from the design centre."
    )
    mean, run = (
        MISSING if bounds is None else names.quantities(bounds)
        for bounds in (point.mean_interval, point.prediction_interval)
    )
    ends = f"The 95 % confidence interval of the mean {names.response.long} is {mean}."
    if mean != run:
        ends += f" The 95 % prediction interval for a single run is {run}."
    elif point.mean_interval is not None:
        ends += " A single run has the same interval, because runs of a deterministic solver do not scatter."
    claimed = (ends, *words.range_to_cite(stage, names))
    return Table.of(columns, rows, "Calibrated parameters", (where, *words.valid_for(stage)), claimed=claimed)


_RULES = {
    "least_coded_distance": "the smallest coded distance",
    "others_at_centre": "the strongest factor with all others at their centre values",
    "joint_least_squares": "least squares over all fitted values",
}


def _ranges(stage: InvertResult) -> dict[str, str]:
    """Return the range to report for each parameter; limits set by the factor range are marked."""
    known = stage.certainty
    return {name: interval(known.intervals[name], bounded=known.bounded[name]) for name in stage.point.solution}


def _joint_table(joint: JointFitted, names: Wording) -> Table:
    values = ("measured", "Measured", short), ("predicted", "Surface", significant)
    columns = measured_columns(names, bool(names.naming.others or joint.further), values)
    error, left_out = joint.max_abs_error_percent, joint.max_abs_left_out_error_percent
    rows = from_means(map(to_json, (*joint.rows, *joint.further)), names)
    columns.append(ERROR)
    foot = [f"Largest absolute percentage error: {fixed(error)} %."]
    if left_out is not None:
        columns.append(Column("left_out_error_percent", "Cross-val.", "%", direction))
        others = "tests" if any(row.left_out_interval is not None for row in joint.rows) else "values"
        foot = [
            f"Largest error: {fixed(error)} % for fitted values, {fixed(left_out)} % in the cross-validation.",
            f"Cross-validation (cross-val.): error of the value predicted from a fit to the other {others}.",
        ]
    return Table.of(columns, rows, "Fitted together", (*foot, *scores(names)))


def profiles(invert: InvertResult, labels: Mapping[str, str] | None = None) -> Figure:
    """Draw the profile of the misfit for each factor: the interval is where it is below the dashed line."""
    names = list(invert.point.solution)
    with new_figure(height=1.5 * len(names) + 0.4) as figure:
        for row, name in enumerate(names, 1):
            axes = figure.add_subplot(len(names), 1, row)
            axes.plot(*zip(*profile_points(invert.certainty, name), strict=True), color=BLUE)
            axes.axvspan(*invert.certainty.intervals[name], color=BLUE, alpha=0.12, linewidth=0)
            axes.axhline(1.0, color=FAINT, linestyle="--", linewidth=1)
            axes.axvline(invert.point.solution[name], color=INK, linewidth=0.8)
            axes.set_ylim(0.0, 3.0)
            axes.set_xlabel((labels or {}).get(name, name))
        figure.supylabel("increase in misfit (1 = 95 % limit)", fontsize=9)
    return figure


def profile_points(part: Certainty, name: str) -> list[tuple[float, float]]:
    """Return the profile of a factor as points (level, rise/allowed rise); the ratio is 1 at the interval limits."""
    curve, ends = part.profiles[name], zip(part.intervals[name], part.bounded[name], strict=True)
    points = [(value, rise / (curve.allowed or 1.0)) for value, rise in zip(curve.values, curve.rise, strict=True)]
    return sorted(points + [(end, 1.0) for end, bounded in ends if bounded])
