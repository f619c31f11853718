"""The result of the stage optimise: optimum, Pareto front, and gain over the present cutter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from stemcal.drawing.table import Table
from stemcal.formats import fixed
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.stages.result import Head, Interval, StageResult
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, absent, inline

OPTIMUM, PRESENT = "optimum", "present"
Gain = tuple[float, float | None, float | None]


@dataclass(frozen=True, kw_only=True)
class Cutter(Spread):
    """A cutter: levels, predicted responses, and the outcome of its run, in another material if `material` is set."""

    cutter: str
    levels: dict[str, float]
    predicted: dict[str, float]
    material: int | None = absent()
    outcome: Outcome = inline()

    @property
    def label(self) -> str:
        return self.cutter if self.material is None else f"{self.cutter}, material {self.material}"


@dataclass(frozen=True)
class FrontPoint:
    """A point of the Pareto front: its levels and the predicted responses."""

    levels: dict[str, float]
    predicted: dict[str, float]


@dataclass(frozen=True, kw_only=True, repr=False)
class OptimiseResult(StageResult):
    """The optimum, its front, and its gain with 95 % limits; `edges` are the range ends at which the optimum is.

    `gain_sd` has the standard deviations of the gain of each response by source (material, runs).
    """

    name: ClassVar[str] = "optimise"
    shown = ("optimum",)

    head: Head = inline()
    minimised: tuple[str, ...]
    maximised: tuple[str, ...]
    limits: dict[str, float]
    units: dict[str, str]
    optimum: dict[str, float]
    optimum_interval: dict[str, Interval] | None
    predicted: dict[str, float]
    simulated: dict[str, float | None]
    present_levels: dict[str, float]
    present: dict[str, float | None]
    gain_percent: dict[str, Gain | None]
    gain_sd: dict[str, dict[str, float]]
    edges: dict[str, str]
    front: tuple[FrontPoint, ...] = ()
    cutters: Rows[Cutter]
    notes: tuple[Note, ...] = ()

    @property
    def best(self) -> tuple[dict[str, float], dict[str, float]]:
        return self.optimum, self.present_levels

    @property
    def gains(self) -> tuple[str, ...]:
        """Sentence on the simulated optimum, each response compared with the present cutter."""
        return (f"{'; '.join(map(self.compared, self.gain_percent))}.",)

    def compared(self, name: str) -> str:
        """Return a clause on a response at the optimum: value, difference from the present cutter, and interval."""
        named, value, gain = self.naming.named(name), self.simulated[name], self.gain_percent[name]
        if value is None or gain is None:
            return f"{named.long}: not simulated"
        way = ("less", "more") if name in self.minimised else ("more", "less")
        worse, (g, low, high) = gain[0] < 0.0, gain
        size = f"{fixed(abs(g), 0 if abs(g) >= 10 else 1)} % {way[worse]}"
        # written like the gain: positive in the direction of the word (more, less)
        known = "" if low is None or high is None else f" (95 %: {_ends(*((-high, -low) if worse else (low, high)))} %)"
        return f"{named.long} {named.text(value, '.4g')}, {size} than the present cutter{known}"

    def _tables(self) -> dict[str, Table]:
        names = (*self.optimum, *self.predicted)
        rows = [
            {"cutter": row.label, **row.levels, **{name: row.outcome.of(self.key(name)) for name in self.predicted},
             **{f"predicted_{name}": value for name, value in row.predicted.items()},
             "status": row.outcome.status, "reason": row.outcome.reason}
            for row in self.cutters
        ]  # fmt: skip
        columns = ("cutter", *names, *(f"predicted_{name}" for name in self.predicted), "status", "reason")
        tables = {"optimise": Table.of(columns, rows)}
        front = [{**point.levels, **point.predicted} for point in self.front]
        return tables | ({"optimise_front": Table.of(names, front)} if front else {})

    def key(self, name: str) -> str:
        """Return the key of a response in an `Outcome`."""
        return "response" if name == self.naming.response.name else name

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        for cutter in self.cutters:
            yield cutter.label, cutter.outcome


def _ends(low: float, high: float) -> str:
    places = 0 if max(abs(low), abs(high)) >= 10 else 1
    return f"{fixed(low, places)} to {fixed(high, places)}"
