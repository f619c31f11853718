"""Tables of a transfer: parameters for another program or mesh, what they give there, and its runs."""

from stemcal.files.rows import Column, Table
from stemcal.numbers import fixed, interval, short, significant
from stemcal.report.tables.columns import ERROR, condition, factor, levels, simulated
from stemcal.stages.regularise import HIGHEST, LOWEST, TOLERANCE, Regularisation, Regularised
from stemcal.stages.transfer.result import TransferResult
from stemcal.text.names import Names, program
from stemcal.text.tables import line
from stemcal.text.transfer import role


def transfer_tables(stage: TransferResult, names: Names) -> list[Table]:
    """Return what moved, the responses at every condition, and every run."""
    there, unit = program(stage.solver.kind), names.response.written
    settings = ", ".join(f"{name} {value}" for name, value in (stage.solver.belongs_to or {}).items())
    belonging = [line("belongs", settings=settings)] if settings else []
    known = any(one.interval is not None for one in stage.adjusted)
    parameters = Table.of(
        [
            factor(names),
            Column("calibrated", "Calibrated", form=significant),
            Column("value", "There", form=significant),
            *([Column("interval", "95 % range", form=interval, claims=True)] if known else []),
            Column("between", "Between", form=interval, of=lambda one: (one.low, one.high)),
        ],
        stage.adjusted,
        line("transferred", there=there),
        [line("alone"), *([line("range there")] if known else []), *belonging],
    )
    reached = {
        ("measured", True): "reached measured",
        ("measured", False): "not reached measured",
        ("study", True): "reached study",
        ("study", False): "not reached study",
    }[stage.aims_at, stage.converged]
    near = {"missed": stage.missed_percent, "tolerance": stage.tolerance_percent, "runs": len(stage.asked)}
    responses = Table.of(
        [
            *condition(names.naming),
            Column("role", "Role"),
            Column("measured", "Measured", unit, short),
            Column("calibrated", "Study", unit, significant),
            Column("before", "There before", unit, significant),
            Column("after", "There after", unit, significant),
            ERROR,
        ],
        stage.rows,
        line("there", names, there=there),
        [line(reached, names, budget=stage.budget, **near), line("error there")],
    )
    runs = Table.of(
        [
            Column("run", "No.", form=format),
            Column("role", "For", of=lambda one: role(one.role)),
            *condition(names.naming),
            *levels(stage.moving, names),
            Column("predicted", "Expected", unit, significant),
            simulated(names.response, "Simulated"),
        ],
        stage.asked,
        line("runs there", there=there),
        detail=True,
    )
    return [parameters, responses, runs]


def regularisation_table(found: Regularisation) -> Table:
    """Return the failure strain of every element size."""

    def band(row: Regularised) -> tuple[float, float] | str:
        return "" if row.low is None or row.high is None else (row.low, row.high)

    columns = [
        Column("element_size", "Element size", "mm", significant),
        Column("failure_strain", "Failure strain", form=significant),
        Column("band", "At one place", form=interval, of=band),
        Column("force", "Mean force", "N", significant),
        Column("sd_percent", "SD over places", "%", fixed),
        Column("runs", "Runs", form=format),
        Column("found", "Valid", of=lambda row: line("valid" if row.found else "not valid")),
    ]
    searched = {"lowest": LOWEST, "highest": HIGHEST, "tolerance": 100.0 * TOLERANCE}
    foot = line("regularised", aim=found.aim, at=found.condition, places=found.rows[0].places, **searched)
    return Table.of(columns, found.rows, line("regularisation"), [foot])
