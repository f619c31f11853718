"""Tables of measured responses, beside what a surface or a simulation gives: what calibration and validation share."""

from collections.abc import Iterable, Mapping
from typing import Any

from stemcal.files.rows import Table
from stemcal.names import Names
from stemcal.numbers import short
from stemcal.report.tables.columns import ERROR, Form, measured_of


def further_table(
    rows: Iterable[Mapping[str, Any]], found: tuple[str, str, Form], names: Names, foot: Iterable[str] = ()
) -> Table:
    """Return further responses at each condition: measured, beside what the surface or the simulation `found`."""
    columns = [*measured_of(names, True, [("measured", "Measured", short), found]), ERROR]
    of_stems = [] if names.naming.others else ["Travel and work of the blade from first touch to the maximum force."]
    return Table.of(columns, rows, f"Besides the {names.response.long}", (*of_stems, *foot, *scores(names)))


def scores(names: Names) -> list[str]:
    """Return what the values are that count from their measured mean."""
    text = (
        "Score: distance of a curve from the mean measured curve along a mode; its error is in % of the maximum force."
    )
    return [text] if any(named.apart for named in names.naming.responses) else []


_VALUES = "measured", "predicted", "simulated"
_INTERVALS = ("left_out_interval",)


def from_means(rows: Iterable[dict[str, Any]], names: Names) -> list[dict[str, Any]]:
    """Return rows of responses; of one that counts so, how far values are from the measured mean."""
    found = []
    for row in rows:
        if (named := names.naming.named(row["response"])).apart:
            values: dict[str, Any] = {
                key: named.counted(row[key], row["measured"]) for key in _VALUES if row.get(key) is not None
            }
            ends = {key: row[key] for key in _INTERVALS if row.get(key) is not None}
            values |= {key: [named.counted(end, row["measured"]) for end in pair] for key, pair in ends.items()}
            row = row | values | ({"sd": float(f"{row['sd']:.4g}")} if row.get("sd") else {})
        found.append(row)
    return found
