"""Rows of results, and tables: they show themselves in a notebook and become frames of pandas on request."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from stemcal.files.showing import csv_text
from stemcal.files.typed import to_json

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")
Cell = str | float | bool | None
_SHOWN = 12  # rows of a table that a prompt shows


class Rows(tuple[T, ...]):
    """Dataclasses of one kind, a row each.

    >>> from dataclasses import make_dataclass
    >>> Rows([make_dataclass("Point", ["x", "y"])(1, 2.5)])
       x    y
    0  1  2.5
    """

    __slots__ = ()

    def to_frame(self) -> pd.DataFrame:
        """Return a frame with a column per field; of a field with parts, one per part, as ``levels.yield_stress``."""
        import pandas as pd

        return pd.DataFrame([_flat(to_json(row)) for row in self])

    def table(self) -> Table:
        """Return a table with a column per field."""
        return Table.of(list(to_json(self[0])) if self else (), self)

    def _repr_html_(self) -> str:
        return _html(self.to_frame())

    def __repr__(self) -> str:
        return str(self.to_frame().to_string(max_rows=_SHOWN, max_cols=8)) if self else "no rows"


@dataclass(frozen=True)
class Table:
    """A table as the study folder keeps it."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    @classmethod
    def of(cls, columns: Sequence[str], things: Iterable[object]) -> Table:
        """Take these columns from results, a row each; empty where one has no such field."""
        rows = [{**row.get("levels", {}), **row} for row in map(to_json, things)]
        return cls(tuple(columns), tuple(tuple(row.get(column) for column in columns) for row in rows))

    def headed(self, headings: Mapping[str, str | None]) -> Table:
        """Return it with other headings over columns; those of None are left out.

        A heading that another column has already is not taken: the column keeps its own.

        >>> table = Table(("condition", "response", "status"), ((8.0, 322.1, "ok"),))
        >>> table.headed({"condition": None, "response": "angle"}).columns
        ('angle', 'status')
        """
        kept = [i for i, column in enumerate(self.columns) if headings.get(column, column) is not None]
        columns = [headings.get(self.columns[i]) or self.columns[i] for i in kept]
        columns = [self.columns[i] if name in self.columns else name for i, name in zip(kept, columns, strict=True)]
        return Table(tuple(columns), tuple(tuple(row[i] for i in kept) for row in self.rows))

    def csv(self) -> str:
        """Return the text of its CSV file: lines end in ``\\n``, cells of None are empty."""
        return csv_text([self.columns, *self.rows])

    def to_frame(self) -> pd.DataFrame:
        """Return a frame of pandas."""
        import pandas as pd

        return pd.DataFrame(list(self.rows), columns=list(self.columns))

    def _repr_html_(self) -> str:
        return _html(self.to_frame())


def _html(frame: pd.DataFrame) -> str:
    return str(frame.to_html(max_rows=60, index=False, na_rep="", border=0))


def _flat(row: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return nested mappings by the path to each value.

    >>> _flat({"run": 1, "levels": {"a": 2.0}})
    {'run': 1, 'levels.a': 2.0}
    """
    cells: dict[str, Any] = {}
    for key, value in row.items():
        cells |= _flat(value, f"{above}{key}.") if isinstance(value, Mapping) else {f"{above}{key}": value}
    return cells
