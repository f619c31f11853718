"""Sentences, tables and figures of an optimum."""

from functools import partial

from stemcal.doe.comparison import error_percent
from stemcal.drawing.plot import Plot
from stemcal.drawing.showing import RANGE, Setting, Showing
from stemcal.drawing.style import BLUE, FAINT, INK, ORANGE, Figure, legend_above, literal, new_figure
from stemcal.drawing.table import Column, Table
from stemcal.formats import interval, percent, series, significant, unit_written, with_unit
from stemcal.stages.optimise.result import OPTIMUM, PRESENT, Cutter, OptimiseResult
from stemcal.stages.rsm.result import RsmResult
from stemcal.vocabulary import Wording


class OptimiseShowing(Showing[OptimiseResult]):
    """Sentences, tables and figures of an optimum."""

    def outcome(self, result: OptimiseResult, names: Wording) -> list[str]:
        levels = series(
            f"{names.in_text(name)} {with_unit(significant(value), result.units[name])}"
            for name, value in result.optimum.items()
        )
        return [f"Optimum on the response surfaces: {levels}."]

    def tables(self, result: OptimiseResult, names: Wording) -> list[Table]:
        return [_levels_table(result, names), *(_confirmation(result, name) for name in result.predicted)]

    def closing(self, result: OptimiseResult, setting: Setting) -> list[Table]:
        return self.tables(result, Wording(setting.study.naming))

    def figures(self, result: OptimiseResult, setting: Setting) -> list[Plot]:
        if not result.front:
            return []
        text = (
            "Pareto front on the response surfaces (line), runs of the design (grey), and the simulated optimum and "
            "present cutter. On the front, one response improves only if the other gets worse."
        )
        return [Plot("pareto-front", "optimise", text, partial(_draw_front, result, setting.results.of(RsmResult)))]


def _levels_table(result: OptimiseResult, names: Wording) -> Table:
    known, before, unit = result.optimum_interval or {}, result.present_levels, result.units
    label = {name: names.factor(name).removesuffix(f" ({unit_written(unit[name])})") for name in unit}
    rows = [
        {"factor": label[name], "unit": unit[name], PRESENT: before[name], OPTIMUM: level, "range": known.get(name)}
        for name, level in result.optimum.items()
    ]
    columns = [
        Column("factor", "Factor", words=True),
        Column("unit", "Unit", form=unit_written, words=True),
        Column(PRESENT, "Present cutter", form=significant),
        Column(OPTIMUM, "Optimum", form=significant),
        Column("range", RANGE.capitalize(), form=lambda ends: "" if ends is None else interval(ends, 3), words=True),
    ]
    return Table.of(columns, rows, "Optimal and present cutter")


def _confirmation(result: OptimiseResult, name: str) -> Table:
    unit, key, before = result.naming.named(name).written, result.key(name), result.present[name]

    def error(row: Cutter) -> float | None:
        value = row.outcome.of(key)
        return None if value is None else error_percent(value, row.predicted[name])

    def change(row: Cutter) -> float | None:
        value = row.outcome.of(key)
        return 100.0 * (value / before - 1.0) if value and before and row.cutter != PRESENT else None

    columns = [
        Column("cutter", "Cutter"),
        Column("predicted", "Predicted", unit, significant, lambda row: row.predicted[name]),
        Column("simulated", "Simulated", unit, significant, lambda row: row.outcome.of(key)),
        Column("error_percent", "Error", "%", percent, error),
        Column("change", "Change", "%", percent, change),
    ]
    foot = "Error in % = 100·(simulated − predicted)/simulated. Change: difference from the present cutter."
    rows = [row for row in result.cutters if row.material is None]
    return Table.of(columns, rows, f"Confirmation by simulation: {result.naming.named(name).long}", (foot,))


def _draw_front(result: OptimiseResult, surface: RsmResult | None) -> Figure:
    """Draw the Pareto front, design runs, optimum and present cutter in the plane of both responses."""
    x, y = result.gain_percent
    with new_figure(height=3.4) as figure:
        axes = figure.add_subplot()
        runs = () if surface is None else (part.runs for part in surface.conditions)
        every = [[run.outcome.number(result.key(name)) for name in (x, y)] for part in runs for run in part]
        axes.plot([a for a, _ in every], [b for _, b in every], "o", color=FAINT, markersize=4, label="design runs")
        front = [(point.predicted[x], point.predicted[y]) for point in result.front]
        axes.plot(*zip(*front, strict=True), color=BLUE, label="front")
        marks = {PRESENT: (result.present, "s", INK, 6), OPTIMUM: (result.simulated, "*", ORANGE, 13)}
        for label, (values, mark, colour, size) in marks.items():
            if (a := values[x]) is not None and (b := values[y]) is not None:
                axes.plot(a, b, mark, color=colour, markersize=size, label=label)
        for set_label, name in ((axes.set_xlabel, x), (axes.set_ylabel, y)):
            set_label(literal(result.naming.named(name).headed(result.naming.named(name).long)))
        legend_above(axes)
    return figure
