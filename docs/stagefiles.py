"""The reference of stage files, from the replayed study."""

from __future__ import annotations

import csv
import json
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

REPLAY = Path(__file__).parents[1] / "configs" / "paper-replay.yaml"
STAGES = ("screen", "rsm", "invert", "validate")
KINDS = {"str": "text", "int": "whole number", "float": "number", "bool": "true or false", "NoneType": "null"}
SHORT = 40  # characters of an example
Row = tuple[str, ...]


def stage_files() -> list[tuple[str, Row, list[Row]]]:
    """Return title, heading and rows of a table for each stage file, and one for the CSV files."""
    from stemcal.runs.executors import InlineExecutor
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.stages.fresh import make_all
    from stemcal.study.reading import load_study

    study = load_study(REPLAY)
    names = {factor.name for factor in study.factors}
    with tempfile.TemporaryDirectory() as place:
        with StudyFolder(Path(place)) as folder, InlineExecutor() as executor:
            make_all(study, folder, executor)
        tables = []
        for stage in STAGES:
            data = json.loads((Path(place) / f"{stage}.json").read_text("utf-8"))
            tables.append((f"{stage}.json", ("Key", "Type", "Example"), _one_per_key(_keys(data, names))))
        return [*tables, ("CSV files", ("File", "Columns"), list(_columns(Path(place))))]


def _keys(value: Any, names: set[str], path: str = "") -> Iterator[Row]:
    """Walk through a JSON value: path, kind, example of every leaf."""
    if isinstance(value, dict):
        for key, below in value.items():
            yield from _keys(below, names, f"{path}.{'*' if key in names else key}".lstrip("."))
    elif isinstance(value, list) and value and isinstance(value[0], (dict, list)):
        for below in value:
            yield from _keys(below, names, f"{path}[]")
    elif isinstance(value, list):
        yield f"`{path}[]`", f"{_kind(value[0]) if value else 'text'}, a list", _example(value[0]) if value else ""
    else:
        yield f"`{path}`", _kind(value), _example(value)


def _one_per_key(rows: Iterable[Row]) -> list[Row]:
    """Return the first row of every key that is not null, else null."""
    found: dict[str, Row] = {}
    for row in rows:
        if found.get(row[0], ("", "null"))[1] == "null":
            found[row[0]] = row
    return list(found.values())


def _kind(value: Any) -> str:
    return KINDS[type(value).__name__]


def _example(value: Any) -> str:
    """Return a value in short form."""
    text = f"{value:.4g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)
    text = text if len(text) <= SHORT else f"{text[: SHORT - 2]} …"
    return "" if value is None else f"`{text}`"


def _columns(folder: Path) -> Iterator[Row]:
    for path in sorted(folder.glob("*.csv")):
        with path.open(encoding="utf-8", newline="") as file:
            yield f"`{path.name}`", ", ".join(f"`{name}`" for name in next(csv.reader(file)))
