"""Results as JSON and back: the same, and what does not fit is named with its place."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from stemcal.drawing.table import Table
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, absent, from_json, inline, to_json


@dataclass(frozen=True)
class Inner:
    x: float
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Outer(Spread):
    spread: Inner = inline()
    perhaps: Inner | None = None
    rows: Rows[Inner]
    pair: tuple[float, float]
    few: dict[str, int]
    maybe: float | None = absent()
    called: int = field(metadata={"alias": "otherwise"})


CONTENT: dict[str, Any] = {
    "x": 1.0, "name": "n", "perhaps": None, "rows": [{"x": 2, "name": ""}], "pair": [1.0, 2.0], "few": {"a": 1},
    "otherwise": 3,
}  # fmt: skip


def test_there_and_back() -> None:
    found = from_json(Outer, CONTENT)
    assert found.spread == Inner(1.0, "n") and found.rows[0].x == 2 and found.pair == (1.0, 2.0) and found.called == 3
    assert to_json(found) == CONTENT and list(to_json(found)) == list(CONTENT)
    assert from_json(Outer, {**CONTENT, "maybe": 4.0, "unknown": 1}).maybe == 4.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rows": [{"x": "2"}]}, r"rows\[0\]\.x: .*valid number \(found '2'\)"),
        ({"few": {"a": 1.5}}, r"few\.a: Input should be a valid integer.*1\.5"),
        ({"few": [1]}, "few: Input should be an object"),
        ({"x": True}, "x: Input should be a valid number"),
        ({"pair": [1.0]}, r"pair\[1\]: Field required"),
        ({"perhaps": [1.0]}, "perhaps: Input should be an object"),
    ],
)
def test_what_does_not_fit_is_named(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        from_json(Outer, {**CONTENT, **changes})


def test_a_missing_key_is_named() -> None:
    with pytest.raises(ValueError, match="pair: Field required"):
        from_json(Outer, {name: value for name, value in CONTENT.items() if name != "pair"})


def test_rows_and_tables_become_frames() -> None:
    rows = Rows([Inner(1.0, "a"), Inner(2.0, "b")])
    assert rows.to_frame()["x"].tolist() == [1.0, 2.0]
    assert Table.of(["name", "y"], rows).rows == (("a", None), ("b", None))
    assert repr(Rows()) == "no rows"


@pytest.mark.parametrize("given", [[1.0], "x", 5, None])
def test_what_is_no_object_is_named(given: Any) -> None:
    with pytest.raises(ValueError, match="Input should be an object"):
        from_json(Outer, given)
