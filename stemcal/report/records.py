"""What the page takes from the records of the runs: curves, where and how long they were computed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from stemcal.report.numbers import duration, short
from stemcal.report.words import counted

if TYPE_CHECKING:
    from stemcal.study.store import StudyFolder

Stage = Mapping[str, Any]
Curves = dict[str, tuple[list[float], list[float]]]


def runs_of(stage: Stage) -> Iterator[tuple[str, str]]:
    """Yield label and record key of every run of a stage."""
    if stage["stage"] == "validate":
        for row in stage["rows"]:
            yield f"{short(row['diameter'])} mm", row.get("key", "")
    for number, row in enumerate(stage["rows"] if stage["stage"] in ("climb", "refine") else [], 1):
        yield f"{stage['stage']} {number}", row.get("key", "")
    for part in stage.get("diameters", []):
        for run in part["runs"]:
            yield f"{stage['stage']} {run['run']} at {short(part['diameter'])} mm", run.get("key", "")
    for run in stage.get("design", {}).get("runs", []):
        yield f"{stage['stage']} {run['run']}", run.get("key", "")


def at_solution(label: str) -> bool:
    """Tell whether a label is that of a validation run, which alone is named by its diameter.

    >>> at_solution("8 mm"), at_solution("rsm 3 at 8 mm"), at_solution("refine 1")
    (True, False, False)
    """
    return label.endswith(" mm") and label.count(" ") == 1


def read_records(stages: Iterable[Stage], folder: StudyFolder) -> dict[str, dict[str, Any]]:
    """Return the intact records of the stages' runs, by the label of the run."""
    found = {}
    for stage in stages:
        for label, key in runs_of(stage):
            record = folder.peek(key) if key else None
            if record is not None:
                found[label] = record
    return found


def curves_of(records: Mapping[str, Mapping[str, Any]]) -> Curves:
    """Return force over travel of every run whose solver kept it."""
    kept = {label: record["details"].get("curve") for label, record in records.items()}
    return {label: (curve["travel"], curve["force"]) for label, curve in kept.items() if curve}


def run_warnings(records: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return what the solver warned of, once per kind: how many runs, and the first one's words."""
    kinds: dict[str, list[tuple[str, str]]] = {}
    distinct = {record["key"]: (label, record) for label, record in reversed(list(records.items()))}
    for label, record in reversed(list(distinct.values())):
        for warning in record["details"].get("warnings", ()):
            kinds.setdefault(re.sub(r"[\d.]+", "#", warning), []).append((label, warning))
    return [
        f"{len(found)} of {counted(len(distinct), 'run')} (first {found[0][0]}): {found[0][1]}."
        for found in kinds.values()
    ]


def provenance_rows(records: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Return what the runs were computed with; several values where it changed on the way."""
    distinct = {record["key"]: record["provenance"] for record in records.values()}
    rows = [("Distinct runs", str(len(distinct)))]
    for name in ("stemcal", "python", "numpy", "platform", "host"):
        values = sorted({str(p[name]) for p in distinct.values() if p.get(name)})
        if values:
            rows.append((name.capitalize() if name != "stemcal" else name, ", ".join(values)))
    starts = sorted(p["started"] for p in distinct.values() if p.get("started"))
    if starts:
        ends = sorted(p["finished"] for p in distinct.values() if p.get("finished"))
        rows.append(("Computed", f"{_moment(starts[0])} to {_moment(ends[-1])} UTC"))
    seconds = sum(p.get("wall_seconds") or 0.0 for p in distinct.values())
    rows.append(("Computing time, all runs", duration(seconds)))
    return rows


def _moment(stamp: str) -> str:
    """Return a time stamp to the second, as people write it."""
    return stamp[:19].replace("T", " ")
