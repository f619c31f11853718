"""Rows of results: a tuple of dataclasses that converts to a pandas DataFrame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar, get_args

from stemcal.storage.typed import to_json

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")
_SHOWN = 12  # largest number of rows that the Python prompt prints
_WIDTH = 100  # characters in a printed line; columns beyond this width are printed below


class Rows(tuple[T, ...]):
    """A tuple of dataclasses of one type, printed as a table with one row for each.

    >>> from dataclasses import make_dataclass
    >>> Rows([make_dataclass("Point", [("x", int), ("y", float)])(1, 2.5)])
       x    y
    0  1  2.5
    """

    __slots__ = ()

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        rows = core_schema.tuple_schema([handler.generate_schema(*get_args(source))], variadic_item_index=0)
        return core_schema.no_info_after_validator_function(cls, rows)

    def to_frame(self) -> pd.DataFrame:
        """Return a DataFrame with one column per field, or per part of a nested field (``levels.yield_stress``)."""
        import pandas as pd

        return pd.json_normalize([to_json(row) for row in self])

    def _repr_html_(self) -> str:
        return html(self.to_frame())

    def __repr__(self) -> str:
        return str(self.to_frame().to_string(max_rows=_SHOWN, line_width=_WIDTH)) if self else "no rows"


def html(frame: pd.DataFrame) -> str:
    """Return a DataFrame as HTML for a notebook."""
    return str(frame.to_html(max_rows=60, index=False, na_rep="", border=0))
