"""Tables of the parameters: as calibrated and how well they are known; the steps towards them, and the refinement."""

from __future__ import annotations

from typing import Any

from stemcal.files.rows import Column, Table
from stemcal.naming import Naming
from stemcal.report.tables.columns import ERROR, condition, factor, level_list, levels, response, to_decimals, with_unit
from stemcal.report.tables.of_responses import further_responses
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import Certainty, Desired, InvertResult, JointFitted
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import Interval
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.numbers import fixed, interval, short, significant
from stemcal.text.tables import line, range_to_cite, valid_for


def calibration_tables(stage: InvertResult, names: Names) -> list[Table]:
    """Return the calibrated parameters, and what only some studies have: a joint fit, intervals from several values."""
    return [calibration_table(stage, names), *joint_tables(stage, names)]


def joint_tables(stage: InvertResult, names: Names) -> list[Table]:
    """Return what was measured beside the surfaces, what it leaves of each parameter; nothing of a single response."""
    tables = [_joint_table(stage.joint, names)] if stage.joint is not None else []
    tables += [_desired_table(stage.desirability, names)] if stage.desirability is not None else []
    tables += [_interval_table(stage, names)] if len(stage.known) > 1 else []
    if stage.joint is not None and stage.joint.further:
        tables.append(further_responses(((row.condition, row) for row in stage.joint.further), "predicted", names))
    return tables


def calibration_table(stage: InvertResult, names: Names) -> Table:
    """Return the calibrated parameters with the range of each that is to be cited, and what else was found."""
    point, known, (head, ranges) = stage.point, stage.certainty, cited_ranges(stage)
    published = {} if stage.published is None else stage.published.point.solution
    rows: list[dict[str, Any]] = [
        {"factor": name, "range": ranges.get(name), "coded": point.coded[name], "published": published.get(name)}
        | {"solution": value, "share": known and _share(known, name)}
        for name, value in point.solution.items()
    ]
    columns = [
        factor(names),
        Column("solution", "Calibrated", form=significant),
        Column("range", head, form=interval, claims=True),
        *([Column("share", "of its range", form=str, claims=True)] if known is not None else []),
        Column("coded", "Coded", form=to_decimals(3)),
        *([Column("published", "Published", form=short)] if published else []),
    ]
    found = {"target": stage.target, "predicted": point.predicted, "radius": point.coded_radius, "rule": stage.rule}
    ends = line("intervals of the response", names, mean=point.mean_interval, one=point.prediction_interval)
    foot = (line("point", names, **found), *valid_for(stage))
    return Table.of(columns, rows, line("calibration"), foot, claimed=(ends, *range_to_cite(stage, names)))


def _share(part: Certainty, name: str) -> str:
    """Return how much of a factor's range its interval takes, or that it is free."""
    return say("free") if name in part.free else f"{100.0 * part.share[name]:.0f} %"


def cited_ranges(stage: InvertResult) -> tuple[str, dict[str, Interval]]:
    """Return what the range of each parameter to cite is called, and the ranges."""
    return ("Exact solutions", stage.ranges) if stage.certainty is None else ("95 % range", stage.certainty.intervals)


def _joint_table(joint: JointFitted, names: Names) -> Table:
    """Return what was measured beside the surfaces; the response and its unit in each row where there are several."""
    naming, several = names.naming, bool(names.naming.others)

    def value(key: str, label: str, form: Any) -> Column:
        if not several:
            return Column(key, label, names.response.written, form)
        return Column(key, label, "", form, lambda row: with_unit(getattr(row, key), naming.named(row.response), form))

    columns = [
        *([_named_response(naming)] if several else []),
        *condition(naming),
        value("measured", "Measured", short),
        value("predicted", "Surface", significant),
        ERROR,
        Column("left_out_error_percent", "Left out", "%", fixed),
    ]
    errors = {"error": joint.max_abs_error_percent, "left_out": joint.max_abs_left_out_error_percent}
    largest = line("joint errors", best=joint.best_worst_error_percent, **errors)
    return Table.of(columns, joint.rows, line("joint"), (largest, line("left out")))


def _named_response(naming: Naming) -> Column:
    return Column("response", "Response", of=lambda row: naming.named(row.response).noun)


def _desired_table(desired: Desired, names: Names) -> Table:
    """Return the most desirable point: between which values each response is wanted, and what it is there."""
    naming = names.naming

    def value(key: str, label: str) -> Column:
        return Column(key, label, "", significant, lambda row: with_unit(getattr(row, key), naming.named(row.response)))

    columns = [
        _named_response(naming),
        *condition(naming),
        *(value(*each) for each in (("low", "From"), ("target", "Measured"), ("high", "To"), ("predicted", "Surface"))),
        Column("desirability", "Desirability", form=to_decimals(3)),
    ]
    overall = line("desirability", overall=desired.overall, levels=level_list(desired.solution, names))
    return Table.of(columns, desired.rows, line("desired"), (overall, line("product")))


def _interval_table(stage: InvertResult, names: Names) -> Table:
    """Return the interval of each parameter from one measured value and from all of them, side by side."""

    def told(part: Certainty) -> list[Column]:
        return [
            Column(part.source, part.source, "", interval, lambda row: part.intervals[row["factor"]]),
            Column(f"share {part.source}", "of range", "", str, lambda row: _share(part, row["factor"])),
        ]

    columns = [factor(names), *(column for part in stage.known for column in told(part))]
    rows = [{"factor": name} for name in stage.point.solution]
    assumed = dict.fromkeys(f"{part.source}: {part.taken}." for part in stage.known if part.taken)
    return Table.of(columns, rows, line("known"), (line("profile"), *assumed), claims=True)


def climb_table(stage: ClimbResult, names: Names) -> Table:
    """Return every step towards the target with its relative error."""
    columns = [Column("step", "Step", form=format), *levels(stage.names, names), response(names.response), ERROR]
    centres = (
        f"{names.factor(name)} {significant(scale.center)} ± {significant(scale.half_step)}"
        for name, scale in stage.coding.items()
    )
    foot = _target(stage, names), line("error"), line("centre", levels=", ".join(centres))
    return Table.of(columns, stage.rows, line("climb"), foot, strong=frozenset({stage.best_step}))


def _target(stage: ClimbResult | RefineResult, names: Names) -> str:
    at = "target" if names.naming.condition is None else "target at"
    return line(at, names, target=stage.target, at=stage.condition)


def refine_table(stage: RefineResult, names: Names) -> Table:
    """Return every iteration of the closed loop: where, what was predicted, what was simulated."""
    columns = [
        Column("iteration", "No.", form=format),
        Column("how", "From"),
        *(condition(names.naming) if stage.at_conditions else ()),
        *levels(stage.solution, names),
        Column("predicted", "Surface", names.response.written, significant),
        Column("interval", "Interval", of=lambda row: _inside(row.inside_interval)),
        response(names.response, "Simulated"),
        ERROR,
    ]
    best = frozenset(i for i, row in enumerate(stage.rows) if row.iteration == stage.iteration)
    near = {"tolerance": stage.tolerance_percent, "runs": len(stage.rows), "budget": stage.budget}
    within = line("within" if stage.converged else "beyond", **near)
    foot = (*(() if stage.at_conditions else [_target(stage, names)]), within, line("predicted then", names))
    return Table.of(columns, stage.rows, line("refinement"), foot, strong=best)


def _inside(flag: bool | None) -> str:
    return "" if flag is None else say("inside") if flag else say("outside")
