"""Tables of factors, of measured values, and of runs."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from stemcal.drawing.columns import condition, levels, simulated, to_decimals
from stemcal.drawing.table import Column, Table
from stemcal.formats import series, short, significant, unit_written
from stemcal.stages.ledger import LedgerRow
from stemcal.stages.result import DesignRuns, StageResult
from stemcal.stages.stage import stage_called
from stemcal.study.model.study import Study
from stemcal.study.types.factor import PARAMETERS
from stemcal.study.types.units import from_internal
from stemcal.vocabulary import FIRST, MOST_LISTED, TRAVEL, WORK, Variable, Wording

MANY = 4  # with more factors than this, columns are headed by symbols instead of names


def design_tables(
    result: StageResult, symbols: Mapping[str, str], labels: Mapping[str, str] | None = None
) -> list[Table]:
    """Return the table of the runs of a stage's design: factor levels and responses; no table without a design.

    Columns are headed by the names of factors or their `labels`, or by `symbols` if there are many factors.
    """
    if not isinstance(design := getattr(result, "design", None), DesignRuns):
        return []
    naming, crowded = result.naming, len(design.varied) > MANY
    columns = [
        Column("run", "Run", form=format),
        *levels(design.varied, Wording(naming, symbols if crowded else labels or {}), lambda value: short(value, 4)),
        *(condition(naming) if design.runs and design.runs[0].condition is not None else ()),
        simulated(naming.response),
        *map(_other, (response for response in naming.further if response not in (TRAVEL, WORK))),
    ]
    foot = ["The symbols are defined in the table of factors."] if crowded and any(symbols.values()) else []
    return [Table.of(columns, design.runs, f"{stage_called(result.name).title} runs", foot, detail=True)]


def _other(named: Variable) -> Column:
    return Column(named.name, named.capital, named.written, significant, lambda run: run.outcome.of(named.name))


def runs_table(rows: Iterable[LedgerRow], names: Wording, title: str) -> Table:
    """Return a table with a row for each run."""
    columns = [
        Column("stage", "Stage"),
        Column("key", "Key", form=lambda key: key[:8], words=True),
        Column("status", "Status"),
        Column("reason", "Reason"),
        Column("run", "Run", form=format),
        *condition(names.naming),
        Column(FIRST, names.response.capital, names.response.written, significant),
        Column("wall_seconds", "Time", "s", to_decimals(1)),
    ]
    entries = list(rows)
    return Table.of(columns, entries, title, () if entries else ["None."])


def setting_tables(study: Study, levels: Mapping[str, float] | None = None) -> list[Table]:
    """Return the tables of factors and of measured values, and at calibrated `levels` also `grown_table`."""
    measured = [_measured(study)] if study.goal is None else []
    grown = [grown_table(study, levels)] if levels is not None and study.material.growing() else []
    return [factors_table(study), *measured, *grown]


def grown_table(study: Study, levels: Mapping[str, float]) -> Table:
    """Return the material parameters that depend on the diameter, for each measured stem, at these factor levels."""

    def value(name: str, unit: str) -> Callable[[float], float]:
        return lambda diameter: from_internal(study.parameters(levels, diameter)[name], unit)

    columns = [replace(column, of=lambda diameter: diameter) for column in condition(study.naming)]
    for name in study.material.growing():
        label, unit = name.replace("_", " ").capitalize(), PARAMETERS[name].unit
        columns.append(Column(name, label, unit_written(unit), significant, value(name, unit)))
    diameters = sorted(target.condition for target in study.targets.means)
    return Table.of(columns, diameters, "Calibrated material parameters for each stem", claims=True)


def factors_table(study: Study, keys: bool = True) -> Table:
    """Return the table of factors with their low and high levels, and with their `keys` in the spec."""
    columns = [
        Column("symbol", "Symbol"),
        *([Column("name", "Factor")] if keys else []),
        Column("label", "Meaning" if keys else "Factor"),
        Column("unit", "Unit", form=unit_written, words=True),
        Column("low", "Low", form=short),
        Column("high", "High", form=short),
    ]
    return Table.of(columns, study.factors, "Factors")


def _measured(study: Study) -> Table:
    naming, targets = study.naming, study.targets.means
    fitted = [target.condition for target in study.joint_targets or (study.calibration_target,)]

    def other(named: Variable) -> list[Column]:
        means = Column(named.name, named.capital, named.written, short, lambda target: target.mean_of(named.name)[0])
        if all(target.mean_of(named.name)[1] is None for target in targets):
            return [means]
        sds = Column(f"sd of {named.name}", "SD", named.written, short, lambda target: target.mean_of(named.name)[1])
        return [means, sds]

    unit = naming.response.written
    further = [named for named in naming.further if any(each.mean_of(named.name)[0] is not None for each in targets)]
    columns = [
        *condition(naming),
        Column("response", naming.response.capital if further else "Measured", unit, short),
        Column("sd", "SD", unit, short),
        *(column for named in further for column in other(named)),
        Column("n", "n", form=short),
    ]
    strong, foot = frozenset[int](), []
    if naming.condition is not None and 1 < len(fitted) == len(targets):
        foot = ["The parameters are fitted jointly to all measurements."]
    elif naming.condition is not None:
        strong = frozenset(i for i, target in enumerate(targets) if target.condition in fitted)
        foot = [f"The values in bold ({Wording(naming).conditions(fitted)}) were used in the fit."]
    responses = [response.long for response in (naming.response, *further)]
    title = f"Measured {series(responses) if len(responses) <= MOST_LISTED else f'{len(responses)} responses'}"
    return Table.of(columns, targets, title, foot, strong=strong).shortened("The spec")
