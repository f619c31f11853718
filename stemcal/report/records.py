"""Read curves, pictures, warnings and provenance from the records of runs."""

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
    """Force (N) over travel of the blade (mm), and the travel at the first fracture, mm."""

    travel: Numbers
    force: Numbers
    broke: float | None = None


@dataclass(frozen=True)
class Details:
    """Results of a run besides the responses; end state (`shape`) and frames (`film`) are arrays packed as text."""

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
    key: str
    details: Details
    provenance: Mapping[str, Any] = field(default_factory=dict)  # machine, program versions and times
    at_solution: bool = False  # whether the run has the calibrated parameters; its pictures are on the page


Records = Mapping[str, _RunRecord]  # run records by the label of the run


def read_records(results: Results | StageResult, folder: StudyFolder) -> dict[str, _RunRecord]:
    """Return the intact records of the runs of all finished stages, or of one stage, by the label of the run."""
    records = {}
    for result in results.done if isinstance(results, Results) else [results]:
        stage = stage_called(result.name)
        pictured = stage.pictured and not stage.one_by_one and result.naming.condition == DIAMETER
        for label, outcome in result.runs():
            content = folder.peek(outcome.key) if outcome.key else None
            if content is not None:
                details = Details()
                with suppress(ValueError):  # invalid details are ignored, because the response is still valid
                    details = from_json(Details, content["details"])
                records[label] = _RunRecord(content["key"], details, content["provenance"], pictured)
    return records


def _distinct_of(records: Records) -> dict[str, tuple[str, _RunRecord]]:
    """Return each record once, by its key, with its first label; several runs may share a record."""
    distinct: dict[str, tuple[str, _RunRecord]] = {}
    for label, record in records.items():
        distinct.setdefault(record.key, (label, record))
    return distinct


def run_warnings(records: Records, verdict: Verdict | None = None) -> list[Note]:
    """Return a note for each kind of warning that the `verdict` does not report: number of runs, first warning."""
    reported = WARNED if verdict is not None and verdict.has("physics") else ()
    kinds: dict[str, dict[str, Note]] = {}
    distinct = _distinct_of(records)
    for label, record in distinct.values():
        for note in record.details.warnings:
            if note.kind not in reported:
                kinds.setdefault(note.kind, {}).setdefault(label, note)
    runs = counted(len(distinct), "run")
    firsts = [(len(labelled), *next(iter(labelled.items()))) for labelled in kinds.values()]
    return [Note(note.kind, "warning", f"{count} of {runs} (first: {label}): {note}") for count, label, note in firsts]


def spec_hash(study: Study) -> str:
    """Return the SHA-256 of the spec file; empty if there is none, as for a study created in Python."""
    return file_hash(study.source) if study.source.is_file() else ""


def provenance_rows(records: Records) -> list[tuple[str, str]]:
    """Return (name, value) rows on program versions, machine and times of the runs; a value may list several."""
    distinct = [record for _, record in _distinct_of(records).values()]
    provenances = [record.provenance for record in distinct]
    rows = [("Distinct runs", str(len(distinct)))]
    for name in ("stemcal", "python", "numpy", "platform", "host"):
        values = sorted({str(provenance[name]) for provenance in provenances if provenance.get(name)})
        if values:
            rows.append((name.capitalize() if name != "stemcal" else name, ", ".join(values)))
    if versions := sorted({v for record in distinct if (v := record.details.program_version)}):
        rows.append(("Program", "; ".join(versions)))
    starts = sorted(provenance["started"] for provenance in provenances if provenance.get("started"))
    if starts:
        ends = sorted(provenance["finished"] for provenance in provenances if provenance.get("finished"))
        first, last = (stamp[:19].replace("T", " ") for stamp in (starts[0], ends[-1]))
        rows.append(("Computed", f"{first} to {last} UTC"))
    seconds = sum(provenance.get("wall_seconds") or 0.0 for provenance in provenances)
    rows.append(("Computing time for all runs", duration(seconds)))
    return rows
