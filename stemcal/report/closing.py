"""Sheets of what surrounds the solution: refining, the joint fit, how well the parameters are fixed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from stemcal.report.numbers import fixed, interval, probability, short, significant

if TYPE_CHECKING:
    from stemcal.report.sheets import Sheet

Stage = Mapping[str, Any]


def further_sheets(stage: Stage) -> list[Sheet]:
    """Return what only some stages have: a joint fit, intervals of the parameters, tests against the scatter."""
    from stemcal.report.findings import response_sheets

    sheets = [_joint_sheet(stage)] if "joint" in stage else []
    sheets += [_interval_sheet(stage)] if "certainty" in stage else []
    tested = any(row.get("p_different") is not None for row in stage.get("rows", []))
    return [*sheets, *response_sheets(stage), *([_test_sheet(stage)] if tested else [])]


def _test_sheet(stage: Stage) -> Sheet:
    from stemcal.report.sheets import Sheet

    rows = [
        (
            short(row["diameter"]),
            f"{short(row['measured'])} ± {short(row['sd'])} ({row['n']})" if row["sd"] else short(row["measured"]),
            interval([row["measured_low"], row["measured_high"]]) if row["measured_low"] is not None else "",
            significant(row["simulated"]),
            probability(row["p_different"]),
            probability(row["p_equivalent"]),
        )
        for row in stage["rows"]
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
    return Sheet("Tests against the scatter of the measured force", columns, tuple(rows), foot=foot)


def _joint_sheet(stage: Stage) -> Sheet:
    from stemcal.report.sheets import Sheet

    joint = stage["joint"]
    rows = [
        (
            short(row["diameter"]),
            short(row["measured"]),
            significant(row["predicted"]),
            fixed(row["error_percent"]),
            fixed(row["left_out_error_percent"]),
        )
        for row in joint["rows"]
    ]
    foot = (
        f"Largest error {fixed(joint['max_abs_error_percent'])} %, left out "
        f"{fixed(joint['max_abs_left_out_error_percent'])} %; no parameters in the region do better than "
        f"{fixed(joint['best_worst_error_percent'])} %.",
        "Left out: predicted from a fit to the other diameters.",
    )
    columns = ("Diameter, mm", "Measured, N", "Surface, N", "Error, %", "Left out, %")
    return Sheet("All diameters fitted together", columns, tuple(rows), foot=foot)


def _interval_sheet(stage: Stage) -> Sheet:
    from stemcal.report.sheets import Sheet

    sets = [stage["certainty"], *([stage["certainty_alone"]] if "certainty_alone" in stage else [])]
    rows = [
        (name, *(cell for part in sets for cell in (interval(part["intervals"][name]), _share(part, name))))
        for name in stage["solution"]
    ]
    columns = [cell for part in sets for cell in (part["source"], "of range")]
    foot = ("95 % intervals by profile likelihood; free: three quarters of the range or more remain possible.",)
    return Sheet("How well the forces fix the parameters", ("Factor", *columns), tuple(rows), foot=foot)


def _share(part: Stage, name: str) -> str:
    return "free" if name in part["free"] else f"{fixed(100.0 * part['share'][name], 0)} %"


def climb_sheet(stage: Stage) -> Sheet:
    """Return every step towards the target with its relative error."""
    from stemcal.report.sheets import Sheet

    rows = [
        (
            str(row["step"]),
            *(significant(row["levels"][name]) for name in stage["names"]),
            significant(row["force"]) if row["force"] is not None else row["reason"],
            fixed(row["error_percent"]),
        )
        for row in stage["rows"]
    ]
    centres = ", ".join(
        f"{name} {significant(entry['center'])} ± {significant(entry['half_step'])}"
        for name, entry in stage["coding"].items()
    )
    foot = (
        f"Target {short(stage['target'])} N at {short(stage['diameter'])} mm. "
        "Error = 100·(measured − simulated)/measured.",
        f"The design of the surface: {centres} (coded 0 ± 1).",
    )
    columns = ("Step", *stage["names"], "Force, N", "Error, %")
    return Sheet("Steps towards the target", columns, tuple(rows), 0, foot, frozenset({stage["best_step"]}))


def audit_sheet(stage: Stage) -> Sheet:
    """Return what an audit found."""
    from stemcal.report.sheets import Sheet

    rows = [(str(found["number"]), found["kind"], found["sentence"]) for found in stage["findings"]]
    tables = "; ".join(f"{name} {count['agree']} of {count['of']}" for name, count in stage["tables"].items())
    foot = (f"Printed cells that agree: {tables}.",)
    return Sheet("What does not agree", ("", "Kind", "Finding"), tuple(rows), texts=3, foot=foot)


def refine_sheet(stage: Stage) -> Sheet:
    """Return every iteration of the closed loop: where, what was predicted, what was simulated."""
    from stemcal.report.sheets import Sheet

    names = list(stage["solution"])
    jointly = "at_diameters" in stage
    rows = [
        (
            str(row["iteration"]),
            row["how"],
            *([short(row["diameter"])] if jointly else []),
            *(significant(row["levels"][name]) for name in names),
            significant(row["predicted"]),
            f"{'in' if row['inside_interval'] else 'out'}side" if row["inside_interval"] is not None else "",
            significant(row["force"]) if row["force"] is not None else row["reason"],
            fixed(row["error_percent"]),
        )
        for row in stage["rows"]
    ]
    verdict = "within" if stage["converged"] else "not within"
    foot = (
        f"Target {'at each diameter' if jointly else _target(stage)}; the best point is {verdict} "
        f"{short(stage['tolerance_percent'])} %, after {len(rows)} of {stage['budget']} runs.",
        "Surface: as it was then; the simulated force lies in- or outside its 95 % prediction interval.",
    )
    at = ("Diam.,\nmm",) if jointly else ()
    columns = ("", "From", *at, *names, "Surface,\nN", "Inter-\nval", "Simulated,\nN", "Error,\n%")
    best = frozenset(i for i, row in enumerate(stage["rows"]) if row["iteration"] == stage["iteration"])
    return Sheet("Simulated at the solution", columns, tuple(rows), texts=2, foot=foot, strong=best)


def _target(stage: Stage) -> str:
    return f"{short(stage['target'])} N at {short(stage['diameter'])} mm"
