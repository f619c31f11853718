"""What is taken from the records of the runs: curves, pictures, where and when they were computed."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from stemcal.formats import counted, duration
from stemcal.notes import Note
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.program import file_hash
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.stage import stage_called
from stemcal.stages.verdict.physics import WARNED
from stemcal.stages.verdict.result import Verdict
from stemcal.storage.typed import from_json
from stemcal.study.model.study import Study
from stemcal.vocabulary import DIAMETER

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class RunCurve:
    """Force (N) over travel of the blade (mm)."""

    travel: Numbers
    force: Numbers
    broke: float | None = None  # travel at which the stem broke


@dataclass(frozen=True)
class Details:
    """What a solver reported in addition to the force; `shape` and `film` are packed."""

    curve: RunCurve | None = None
    energies: dict[str, Numbers] | None = None
    shape: Any = None
    film: Any = None
    warnings: tuple[Note, ...] = ()
    program_version: str | None = None
    break_travel: float | None = None
    severed: bool | None = None


@dataclass(frozen=True)
class _RunRecord:
    """The record of a run: details, where, when and with what it was computed; `at_solution` if cut there."""

    key: str
    details: Details
    provenance: Mapping[str, Any] = field(default_factory=dict)
    at_solution: bool = False


Records = Mapping[str, _RunRecord]
"""Records by the label of the run."""


def read_records(results: Results | StageResult, folder: StudyFolder) -> dict[str, _RunRecord]:
    """Return the intact records of the results' runs, by the label of the run."""
    records = {}
    for result in results.done if isinstance(results, Results) else [results]:
        stage = stage_called(result.name)
        pictured = stage.pictured and not stage.one_by_one and result.naming.condition == DIAMETER
        for label, outcome in result.runs():
            content = folder.peek(outcome.key) if outcome.key else None
            if content is not None:
                details = Details()
                with suppress(ValueError):  # of a curve or a picture that is none, only the response is used
                    details = from_json(Details, content["details"])
                records[label] = _RunRecord(content["key"], details, content["provenance"], pictured)
    return records


def _distinct_of(records: Records) -> dict[str, tuple[str, _RunRecord]]:
    """Return every record once, by its key, with the first label it has."""
    distinct: dict[str, tuple[str, _RunRecord]] = {}
    for label, record in records.items():
        distinct.setdefault(record.key, (label, record))
    return distinct


def run_warnings(records: Records, verdict: Verdict | None = None) -> list[Note]:
    """Return a note per kind of warning: number of runs and the first text; without those repeated by the `verdict`."""
    repeated = WARNED if verdict is not None and verdict.has("physics") else ()
    kinds: dict[str, dict[str, Note]] = {}
    distinct = _distinct_of(records)
    for label, record in distinct.values():
        for warning in (one for one in record.details.warnings if one.kind not in repeated):
            kinds.setdefault(warning.kind, {}).setdefault(label, warning)
    runs = counted(len(distinct), "run")
    firsts = [(len(labelled), *next(iter(labelled.items()))) for labelled in kinds.values()]
    return [Note(one.kind, "warning", f"{count} of {runs} (first: {label}): {one}") for count, label, one in firsts]


def spec_hash(study: Study) -> str:
    """Return the SHA-256 of the spec's file; nothing of a study that was made in Python or whose file is gone."""
    return file_hash(study.source) if study.source.is_file() else ""


def provenance_rows(records: Records) -> list[tuple[str, str]]:
    """Return program, version and machine of the runs; several values if they changed during the study."""
    distinct = [record.provenance for _, record in _distinct_of(records).values()]
    rows = [("Distinct runs", str(len(distinct)))]
    for name in ("stemcal", "python", "numpy", "platform", "host"):
        values = sorted({str(made[name]) for made in distinct if made.get(name)})
        if values:
            rows.append((name.capitalize() if name != "stemcal" else name, ", ".join(values)))
    if versions := sorted({v for _, r in _distinct_of(records).values() if (v := r.details.program_version)}):
        rows.append(("Program", "; ".join(versions)))
    starts = sorted(made["started"] for made in distinct if made.get("started"))
    if starts:
        ends = sorted(made["finished"] for made in distinct if made.get("finished"))
        first, last = (stamp[:19].replace("T", " ") for stamp in (starts[0], ends[-1]))
        rows.append(("Computed", f"{first} to {last} UTC"))
    seconds = sum(made.get("wall_seconds") or 0.0 for made in distinct)
    rows.append(("Computing time for all runs", duration(seconds)))
    return rows
