"""Tables as data, which the terminal, the report page, CSV files and notebooks show in their own ways."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from stemcal.storage.encodings import csv_text
from stemcal.storage.rows import Rows, html
from stemcal.storage.typed import to_json

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 40  # largest number of rows on the terminal and the page; the CSV file has all rows


@dataclass(frozen=True)
class Column:
    """A column of a table. In a column of numbers, a text is shown as it is, such as the reason for a missing value."""

    key: str  # heading in CSV files and data frames, and by default the field of a row that contains the value
    label: str | None = None  # heading on the terminal and the page; by default the key
    unit: str = ""
    form: Callable[[Any], str] | None = None  # formats a value as text; None for a column of words
    of: Callable[[Any], Any] | None = None  # returns the value from a row, instead of the field `key`
    words: bool = False  # whether a column with a `form` contains words, such as names that become labels
    claims: bool = False  # whether the column is shown only if the study is calibrated

    @property
    def left(self) -> bool:
        """Whether the column contains words, which are left-aligned."""
        return self.words or self.form is None

    @property
    def name(self) -> str:
        """The heading without the unit."""
        return self.key if self.label is None else self.label

    @property
    def head(self) -> str:
        """The heading with the unit.

        >>> Column("effect", "Effect", "N").head, Column("status").head
        ('Effect, N', 'status')
        """
        return f"{self.name}, {self.unit}" if self.unit else self.name

    def written(self, value: Any) -> str:
        """Return the text of a cell."""
        if self.form is None or (isinstance(value, str) and not self.words):
            return "" if value is None else str(value)
        return self.form(value)


@dataclass(frozen=True)
class Table:
    """A table; each row contains one unformatted value for each column."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]
    title: str = ""
    foot: tuple[str, ...] = ()  # lines below the table
    claimed: tuple[str, ...] = ()  # further lines, shown only if the study is calibrated
    strong: frozenset[int] = frozenset()  # indices of the rows that are emphasised
    detail: bool = False  # whether the page shows the table folded
    claims: bool = False  # whether the table is shown only if the study is calibrated

    @classmethod
    def of(
        cls,
        columns: Iterable[Column | str],
        things: Iterable[object],
        title: str = "",
        foot: Iterable[str] = (),
        **options: Any,
    ) -> Table:
        """Create a table with a row for each of `things` (mappings or dataclasses); missing fields are empty cells.

        >>> Table.of(["run", Column("level", "Level", "mm", "{:.2f}".format)], [{"run": "a", "level": 1.0}]).cells
        (('a', '1.00'),)
        """
        typed = tuple(Column(column) if isinstance(column, str) else column for column in columns)
        rows = []
        for thing in things:
            fields = thing if isinstance(thing, Mapping) else getattr(thing, "__dict__", {})
            if is_dataclass(thing):  # values by JSON key, and the level of each factor by the name of the factor
                fields = to_json(thing)
                fields = {**fields.get("levels", {}), **fields}
            rows.append(tuple(fields.get(c.key) if c.of is None else c.of(thing) for c in typed))
        return cls(typed, tuple(rows), title, tuple(foot), **options)

    @classmethod
    def of_rows(cls, rows: Rows[Any]) -> Table:
        """Create a table with a column for each field of the dataclass instances in `rows`."""
        return cls.of(list(to_json(rows[0])) if rows else (), rows)

    @property
    def heads(self) -> tuple[str, ...]:
        """The headings of the columns, with units."""
        return tuple(column.head for column in self.columns)

    @property
    def cells(self) -> tuple[tuple[str, ...], ...]:
        """The formatted cells, row by row."""
        return tuple(tuple(c.written(v) for c, v in zip(self.columns, row, strict=True)) for row in self.rows)

    def unclaimed(self) -> Table | None:
        """Return the table without the parts that are shown only for a calibrated study; None if nothing is left."""
        left = self._at([place for place, column in enumerate(self.columns) if not column.claims])
        return None if self.claims else replace(left, claimed=())

    def _at(self, places: Sequence[int]) -> Table:
        rows = tuple(tuple(row[place] for place in places) for row in self.rows)
        return replace(self, columns=tuple(self.columns[place] for place in places), rows=rows)

    def shortened(self, whole: str, most: int = MOST_ROWS) -> Table:
        """Return a table of at most `most` rows: the first rows, and the rows with the largest errors.

        A line below the table refers to `whole`, the name of the file with all rows.

        >>> table = Table.of(["run", "error_percent"], [{"run": n, "error_percent": -n % 7} for n in range(9)])
        >>> short = table.shortened("`a.csv`", 4)
        >>> [row[0] for row in short.rows]
        [0, 1, 2, 8]
        >>> short.foot
        ('4 of 9 rows are shown: the first 2 and the 2 with the largest errors. `a.csv` contains all rows.',)
        """
        if len(self.rows) <= most:
            return self
        error = next((place for place, column in enumerate(self.columns) if column.key == "error_percent"), None)
        first = most if error is None else most // 2
        kept, words = list(range(first)), f"{most} of {len(self.rows)} rows are shown"
        if error is not None:
            rest = sorted(range(first, len(self.rows)), key=lambda i: -abs(self.rows[i][error] or 0.0))
            kept += sorted(rest[: most - first])
            words = f"{words}: the first {first} and the {most - first} with the largest errors"
        rows, strong = tuple(self.rows[i] for i in kept), frozenset(kept.index(i) for i in self.strong if i in kept)
        return replace(self, rows=rows, strong=strong, foot=(*self.foot, f"{words}. {whole} contains all rows."))

    def headed(self, headings: Mapping[str, str | None]) -> Table:
        """Return a copy with other column keys; `headings` maps old to new keys, or to None to omit a column.

        A column keeps its key if another column has the new key. It also keeps it if it contains text: a column
        ``response`` with text contains names of responses, not values of the first response.

        >>> table = Table.of(["condition", "response", "status"], [{"condition": 8.0, "response": 3.1}])
        >>> [column.key for column in table.headed({"condition": None, "response": "angle"}).columns]
        ['angle', 'status']
        >>> table = Table.of(["condition", "response"], [{"condition": 8.0, "response": "work"}])
        >>> [column.key for column in table.headed({"condition": "diameter", "response": "force"}).columns]
        ['diameter', 'response']
        """
        keys = [column.key for column in self.columns]
        texts = {key for place, key in enumerate(keys) if any(isinstance(row[place], str) for row in self.rows)}
        table = self._at([place for place, key in enumerate(keys) if headings.get(key, key) is not None])
        renamed = {key: name for key, name in headings.items() if name and name not in keys and key not in texts}
        return replace(table, columns=tuple(replace(c, key=renamed.get(c.key, c.key)) for c in table.columns))

    def csv(self) -> str:
        """Return the table as CSV: lines end in ``\\n``, None is an empty cell."""
        return csv_text([[column.key for column in self.columns], *self.rows])

    def to_frame(self) -> pd.DataFrame:
        import pandas as pd

        return pd.DataFrame(list(self.rows), columns=[column.key for column in self.columns])

    def _repr_html_(self) -> str:
        return html(self.to_frame())


@dataclass(frozen=True)
class PaperTable:
    """A table for publication. `left`: whether each column is left-aligned; `strong`: indices of the rows in bold."""

    number: int
    caption: str
    heads: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    left: tuple[bool, ...]
    note: str = ""
    strong: frozenset[int] = frozenset()


def showable(tables: Iterable[Table], holds: bool) -> list[Table]:
    """Return the tables to show: unchanged if the study is calibrated (`holds`), otherwise as `Table.unclaimed`."""
    return [part for table in tables if (part := table if holds else table.unclaimed()) is not None]
