"""Sheets of what surrounds the solution: refining, the joint fit, how well the parameters are fixed."""

from __future__ import annotations

from stemcal.naming import DIAMETER, Naming
from stemcal.report.numbers import fixed, interval, short, significant
from stemcal.report.tables.findings import response_sheets
from stemcal.report.tables.sheet import Sheet, place_cell, place_head, response_or_reason
from stemcal.report.tables.tested import tested_sheets
from stemcal.stages.audit.stage import AuditResult
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import Certainty, Desired, InvertResult, JointFitted
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import StageResult
from stemcal.stages.validate import ValidateResult


def further_sheets(stage: StageResult) -> list[Sheet]:
    """Return what only some stages have: a joint fit, intervals of the parameters, tests against the scatter."""
    sheets = []
    if isinstance(stage, InvertResult):
        sheets += [_joint_sheet(stage.joint, stage.naming)] if stage.joint is not None else []
        sheets += [_desired_sheet(stage.desirability, stage.naming)] if stage.desirability is not None else []
        sheets += [_interval_sheet(stage)] if len(stage.known) > 1 else []
    sheets += response_sheets(stage)
    if isinstance(stage, ValidateResult) and stage.discrepancy is not None:
        sheets.append(_corrected_sheet(stage))
    return [*sheets, *(tested_sheets(stage) if isinstance(stage, ValidateResult) else [])]


def _corrected_sheet(stage: ValidateResult) -> Sheet:
    """Return the forces that one scale for what the model misses predicts."""
    naming, response = stage.naming, stage.naming.response
    rows = tuple(
        (
            *place_cell(naming, row.compared.condition),
            short(row.compared.measured),
            significant(row.corrected.response),
            interval(row.corrected.interval),
        )
        for row in stage.rows
        if row.corrected is not None
    )
    foot = (
        f"Simulated times measured over simulated at the other fitted {naming.condition_plural}; "
        f"95 % of measured {response.plural}.",
    )
    columns = (*place_head(naming), *(response.headed(word) for word in ("Measured", "Predicted", "95 %")))
    return Sheet("With one scale for what the model misses", columns, rows, foot=foot, claims=True)


def _joint_sheet(joint: JointFitted, naming: Naming) -> Sheet:
    """Return what was measured beside the surfaces; the response and its unit in each row where there are several."""
    response, several = naming.response, bool(naming.others)
    others = "responses" if naming.condition is None else naming.condition_plural
    rows = []
    for row in joint.rows:
        named = naming.named(row.response)
        unit = named.beside if several else ""
        rows.append(
            (
                *((named.noun,) if several else ()),
                *place_cell(naming, row.condition),
                f"{short(row.measured)}{unit}",
                f"{significant(row.predicted)}{unit}",
                fixed(row.error_percent),
                fixed(row.left_out_error_percent),
            )
        )
    foot = (
        f"Largest error {fixed(joint.max_abs_error_percent)} %, left out "
        f"{fixed(joint.max_abs_left_out_error_percent)} %; no parameters in the region do better than "
        f"{fixed(joint.best_worst_error_percent)} %.",
        f"Left out: predicted from a fit to the other {others}.",
    )
    first = ("Response",) if several else ()
    both = ("Measured", "Surface") if several else (response.headed("Measured"), response.headed("Surface"))
    columns = (*first, *place_head(naming), *both, "Error, %", "Left out, %")
    return Sheet(f"All {others} fitted together", columns, tuple(rows), texts=len(columns) - 4, foot=foot)


def _desired_sheet(desired: Desired, naming: Naming) -> Sheet:
    """Return the most desirable point: between which values each response is wanted, and what it is there."""
    rows = []
    for row in desired.rows:
        named = naming.named(row.response)
        values = (row.low, row.target, row.high, row.predicted)
        told = (f"{significant(value)}{named.beside}" for value in values)
        rows.append((named.noun, *place_cell(naming, row.condition), *told, fixed(row.desirability, 3)))
    where = ", ".join(f"{name} {significant(value)}" for name, value in desired.solution.items())
    foot = (
        f"Overall desirability {fixed(desired.overall, 3)} at {where}.",
        "After Derringer and Suich: 0 at both ends, 1 at the measured mean; the product of all is largest there.",
    )
    columns = ("Response", *place_head(naming), "From", "Measured", "To", "Surface", "Desir-\nability")
    return Sheet("The most desirable point", columns, tuple(rows), texts=len(columns) - 5, foot=foot)


def _interval_sheet(stage: InvertResult) -> Sheet:
    sets = stage.known
    rows = [
        (name, *(cell for part in sets for cell in (interval(part.intervals[name]), share_of(part, name))))
        for name in stage.point.solution
    ]
    columns = [cell for part in sets for cell in (part.source, "of range")]
    foot = [
        "95 % intervals by profile likelihood; free: three quarters of the range or more remain possible.",
        *dict.fromkeys(f"{part.source}: {part.taken}." for part in sets if part.taken),
    ]
    return Sheet(
        f"How well the {stage.naming.values} fix the parameters",
        ("Factor", *columns),
        tuple(rows),
        foot=tuple(foot),
        claims=True,
    )


def share_of(part: Certainty, name: str) -> str:
    """Return how much of a factor's range its interval takes, or that it is free."""
    return "free" if name in part.free else f"{fixed(100.0 * part.share[name], 0)} %"


def climb_sheet(stage: ClimbResult) -> Sheet:
    """Return every step towards the target with its relative error."""
    rows = [
        (
            str(row.step),
            *(significant(row.levels[name]) for name in stage.names),
            response_or_reason(row.outcome.response, row.outcome.reason),
            fixed(row.error_percent),
        )
        for row in stage.rows
    ]
    centres = ", ".join(
        f"{name} {significant(entry.center)} ± {significant(entry.half_step)}" for name, entry in stage.coding.items()
    )
    foot = (
        f"Target {_target(stage)}. Error = 100·(measured − simulated)/measured.",
        f"The design of the surface: {centres} (coded 0 ± 1).",
    )
    columns = ("Step", *stage.names, stage.naming.response.heading(), "Error, %")
    return Sheet("Steps towards the target", columns, tuple(rows), 0, foot, frozenset({stage.best_step}))


def audit_sheet(stage: AuditResult) -> Sheet:
    """Return what an audit found."""
    rows = [(str(row.number), row.found.consequence, row.found.sentence) for row in stage.findings]
    tables = "; ".join(f"{name} {count.agree} of {count.of}" for name, count in stage.tables_agree.items())
    foot = (f"Printed cells that agree: {tables}.",)
    return Sheet("What does not agree", ("", "Touches", "Finding"), tuple(rows), texts=3, foot=foot)


def refine_sheet(stage: RefineResult) -> Sheet:
    """Return every iteration of the closed loop: where, what was predicted, what was simulated."""
    names, naming, response = list(stage.solution), stage.naming, stage.naming.response
    jointly = bool(stage.at_conditions)
    rows = [
        (
            str(row.iteration),
            row.how,
            *(place_cell(naming, row.condition) if jointly else ()),
            *(significant(row.levels[name]) for name in names),
            significant(row.predicted),
            f"{'in' if row.inside_interval else 'out'}side" if row.inside_interval is not None else "",
            response_or_reason(row.outcome.response, row.outcome.reason),
            fixed(row.error_percent),
        )
        for row in stage.rows
    ]
    verdict = "within" if stage.converged else "not within"
    foot = (
        f"Target {f'at each {naming.condition_noun}' if jointly else _target(stage)}; the best point is {verdict} "
        f"{short(stage.tolerance_percent)} %, after {len(rows)} of {stage.budget} runs.",
        f"Surface: as it was then; the simulated {response.noun} lies in- or outside its 95 % prediction interval.",
    )
    at = _narrow_head(naming) if jointly else ()
    surface, simulated = response.headed("Surface", ",\n"), response.headed("Simulated", ",\n")
    columns = ("", "From", *at, *names, surface, "Inter-\nval", simulated, "Error,\n%")
    best = frozenset(i for i, row in enumerate(stage.rows) if row.iteration == stage.iteration)
    return Sheet("Simulated at the solution", columns, tuple(rows), texts=2, foot=foot, strong=best)


def _narrow_head(naming: Naming) -> tuple[str, ...]:
    """Return the head of the condition's column where a table is crowded."""
    return ("Diam.,\nmm",) if naming.condition == DIAMETER else place_head(naming, ",\n")


def _target(stage: RefineResult | ClimbResult) -> str:
    return f"{short(stage.target)}{stage.naming.response.beside}{stage.naming.at(stage.condition)}"
