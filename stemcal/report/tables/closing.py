"""Sheets of what surrounds the solution: refining, the joint fit, how well the parameters are fixed."""

from __future__ import annotations

from stemcal.report.numbers import fixed, interval, probability, short, significant
from stemcal.report.tables.findings import response_sheets
from stemcal.report.tables.sheet import Sheet, force_or_reason
from stemcal.stages.audit.stage import AuditResult
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import Certainty, InvertResult, JointFitted
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import StageResult
from stemcal.stages.validate import ValidateResult


def further_sheets(stage: StageResult) -> list[Sheet]:
    """Return what only some stages have: a joint fit, intervals of the parameters, tests against the scatter."""
    sheets = []
    if isinstance(stage, InvertResult):
        sheets += [_joint_sheet(stage.joint)] if stage.joint is not None else []
        sheets += [_interval_sheet(stage)] if len(stage.known) > 1 else []
    sheets += response_sheets(stage)
    if isinstance(stage, ValidateResult) and stage.discrepancy is not None:
        sheets.append(_corrected_sheet(stage))
    if isinstance(stage, ValidateResult) and any(row.p_different is not None for row in stage.compared):
        sheets.append(_test_sheet(stage))
    return sheets


def _test_sheet(stage: ValidateResult) -> Sheet:
    rows = [
        (
            short(row.diameter),
            f"{short(row.measured)} ± {short(row.sd)} ({row.n})" if row.sd else short(row.measured),
            interval(None if row.measured_low is None else (row.measured_low, row.measured_high or 0.0), missing=""),
            significant(row.simulated),
            probability(row.p_different),
            probability(row.p_equivalent),
        )
        for row in stage.compared
    ]
    foot = (
        "Different: Welch's test. Equal: two one-sided tests; a small p shows that the forces agree within the margin.",
    )
    columns = (
        "Diameter,\nmm",
        "Measured ± sd (n),\nN",
        "95 % of the\nmean, N",
        "Simulated,\nN",
        "p differ-\nent",
        "p\nequal",
    )
    return Sheet("Tests against the scatter of the measured force", columns, tuple(rows), foot=foot, claims=True)


def _corrected_sheet(stage: ValidateResult) -> Sheet:
    """Return the forces that one scale for what the model misses predicts."""
    rows = tuple(
        (
            short(row.compared.diameter),
            short(row.compared.measured),
            significant(row.corrected.force),
            interval(row.corrected.interval),
        )
        for row in stage.rows
        if row.corrected is not None
    )
    foot = ("Simulated times measured over simulated at the other fitted diameters; 95 % of measured forces.",)
    columns = ("Diameter, mm", "Measured, N", "Predicted, N", "95 %, N")
    return Sheet("With one scale for what the model misses", columns, rows, foot=foot, claims=True)


def _joint_sheet(joint: JointFitted) -> Sheet:
    rows = [
        (
            short(row.diameter),
            short(row.measured),
            significant(row.predicted),
            fixed(row.error_percent),
            fixed(row.left_out_error_percent),
        )
        for row in joint.rows
    ]
    foot = (
        f"Largest error {fixed(joint.max_abs_error_percent)} %, left out "
        f"{fixed(joint.max_abs_left_out_error_percent)} %; no parameters in the region do better than "
        f"{fixed(joint.best_worst_error_percent)} %.",
        "Left out: predicted from a fit to the other diameters.",
    )
    columns = ("Diameter, mm", "Measured, N", "Surface, N", "Error, %", "Left out, %")
    return Sheet("All diameters fitted together", columns, tuple(rows), foot=foot)


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
        "How well the forces fix the parameters", ("Factor", *columns), tuple(rows), foot=tuple(foot), claims=True
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
            force_or_reason(row.outcome.force, row.outcome.reason),
            fixed(row.error_percent),
        )
        for row in stage.rows
    ]
    centres = ", ".join(
        f"{name} {significant(entry.center)} ± {significant(entry.half_step)}" for name, entry in stage.coding.items()
    )
    foot = (
        f"Target {short(stage.target)} N at {short(stage.diameter)} mm. Error = 100·(measured − simulated)/measured.",
        f"The design of the surface: {centres} (coded 0 ± 1).",
    )
    columns = ("Step", *stage.names, "Force, N", "Error, %")
    return Sheet("Steps towards the target", columns, tuple(rows), 0, foot, frozenset({stage.best_step}))


def audit_sheet(stage: AuditResult) -> Sheet:
    """Return what an audit found."""
    rows = [(str(row.number), row.found.consequence, row.found.sentence) for row in stage.findings]
    tables = "; ".join(f"{name} {count.agree} of {count.of}" for name, count in stage.tables_agree.items())
    foot = (f"Printed cells that agree: {tables}.",)
    return Sheet("What does not agree", ("", "Touches", "Finding"), tuple(rows), texts=3, foot=foot)


def refine_sheet(stage: RefineResult) -> Sheet:
    """Return every iteration of the closed loop: where, what was predicted, what was simulated."""
    names = list(stage.solution)
    jointly = bool(stage.at_diameters)
    rows = [
        (
            str(row.iteration),
            row.how,
            *([short(row.diameter)] if jointly else []),
            *(significant(row.levels[name]) for name in names),
            significant(row.predicted),
            f"{'in' if row.inside_interval else 'out'}side" if row.inside_interval is not None else "",
            force_or_reason(row.outcome.force, row.outcome.reason),
            fixed(row.error_percent),
        )
        for row in stage.rows
    ]
    verdict = "within" if stage.converged else "not within"
    foot = (
        f"Target {'at each diameter' if jointly else _target(stage)}; the best point is {verdict} "
        f"{short(stage.tolerance_percent)} %, after {len(rows)} of {stage.budget} runs.",
        "Surface: as it was then; the simulated force lies in- or outside its 95 % prediction interval.",
    )
    at = ("Diam.,\nmm",) if jointly else ()
    columns = ("", "From", *at, *names, "Surface,\nN", "Inter-\nval", "Simulated,\nN", "Error,\n%")
    best = frozenset(i for i, row in enumerate(stage.rows) if row.iteration == stage.iteration)
    return Sheet("Simulated at the solution", columns, tuple(rows), texts=2, foot=foot, strong=best)


def _target(stage: RefineResult) -> str:
    return f"{short(stage.target)} N at {short(stage.diameter)} mm"
