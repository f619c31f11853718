"""What a stage leaves in the study folder: its JSON and its tables, the same bytes for the same results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from stemcal import __version__
from stemcal.errors import RunsFailed
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.answering import record_key
from stemcal.stages.layout import Design, design_radius
from stemcal.stages.lineage import inputs_of, tell_changes
from stemcal.stages.policy import is_censored, reason_lines
from stemcal.study.durable import plain
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

SCHEMA_VERSION = 1
Stage = dict[str, Any]


def head(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> Stage:
    """Return how every stage file begins."""
    inputs = inputs_of(study, solver, folder, stage)
    tell_changes(folder, stage, inputs)
    return {
        "schema_version": SCHEMA_VERSION,
        "stage": stage,
        "study": study.name,
        "title": study.title,
        "stemcal_version": __version__,
        "inputs": inputs,
    }


def leave(folder: StudyFolder, stage: Stage) -> Stage:
    """Write a stage's JSON and tables; returns the stage as a reader of the file gets it."""
    stage = plain({**{key: value for key, value in stage.items() if key != "notes"}, "notes": stage["notes"]})
    name = stage["stage"]
    for table, (columns, rows) in TABLES[name](stage).items():
        folder.write_csv(table, columns, [[row.get(column) for column in columns] for row in rows])
    folder.write_stage(name, stage)
    folder.log("stage_done", stage=name)
    return stage


_TOLD = {"travel": "travel", "work": "work", "phases": "phases", "sd": "peak_sd", "phase_forces": "phase_forces"}


def run_entry(request: Request, answer: Answer, solver: Solver) -> Stage:
    """Return what a stage file tells of one run; ``sd`` is the scatter of the force over that many mesh ``phases``."""
    told = {name: answer.details[detail] for name, detail in _TOLD.items() if detail in answer.details}
    return {
        "force": answer.force,
        **(told if answer.ok else {}),
        "status": answer.status,
        "censored": is_censored(answer),
        "reason": answer.reason,
        "message": answer.message,
        "key": record_key(solver, request),
    }


def design_entry(design: Design, requests: Sequence[Request], answers: Sequence[Answer], solver: Solver) -> Stage:
    """Return a design with its runs, numbered from 1."""
    runs = [
        {
            "run": request.row + 1,
            "levels": dict(request.levels),
            "coded": dict(zip(design.names, coded, strict=True)),
            **_marks(design, request, answer),
            **run_entry(request, answer, solver),
        }
        for request, answer, coded in zip(requests, answers, design.coded.tolist(), strict=True)
    ]
    return {"kind": design.kind, "runs": runs}


def _marks(design: Design, request: Request, answer: Answer) -> Stage:
    """Return block and weight of a run: the design's, or those beside it in a table of runs."""
    marks: Stage = {name: answer.details[name] for name in ("block", "weight") if name in answer.details}
    return marks if design.blocks is None else {**marks, "block": design.blocks[request.row]}


def coding_entry(study: Study, design: Design) -> Stage:
    """Return how the factors of a surface are coded, where the others stay, how far the design reaches."""
    factors = []
    for entry in design.coding.as_dict():
        factor = study.factor(entry["factor"])
        factors.append({**entry, **factor.model_dump(include={"symbol", "label", "unit", "low", "high"})})
    middle = study.midlevels()
    return {
        "names": list(design.names),
        "factors": factors,
        "coding": {e["factor"]: {"center": e["center"], "half_step": e["half_step"]} for e in factors},
        "fixed": {name: level for name, level in middle.items() if name not in design.names},
        "radius": design_radius(study, len(design.names)),
    }


@contextmanager
def reasons_given(requests: Sequence[Request], answers: Sequence[Answer]) -> Iterator[None]:
    """Add to a `RunsFailed` which runs failed and why."""
    try:
        yield
    except RunsFailed as error:
        raise RunsFailed("\n".join([str(error), *reason_lines(requests, answers)])) from None


# ---- tables

Table = tuple[list[str], Sequence[Mapping[str, Any]]]


def _screen_tables(stage: Stage) -> dict[str, Table]:
    columns = ["factor", "symbol", "effect", "contribution_percent", "sum_of_squares", "f", "p", "stars"]
    columns += ["lenth_t", "p_holm", "p_bh"]
    return {"screen": (columns, stage["effects"]), "screen_runs": _runs_table(stage)}


def _rsm_tables(stage: Stage) -> dict[str, Table]:
    """Analysis of variance with the coefficients beside it; the mean has a coefficient only."""
    terms = {row["term"]: row for row in stage["coefficients"]}
    anova_columns = ["source", "sum_of_squares", "df", "mean_square", "f", "p", "stars"]
    beside = ["value", "standard_error", "low", "high"]
    rows: list[Mapping[str, Any]] = [{"source": "1", **terms["1"]}]
    rows += [{**row, **terms.get(row["source"], {})} for row in stage["anova"]]
    return {"rsm": ([*anova_columns, *beside], rows), "rsm_runs": _runs_table(stage)}


def _invert_tables(stage: Stage) -> dict[str, Table]:
    rows = [
        {
            "factor": name,
            "solution": value,
            "coded": stage["coded"][name],
            "low": stage["ranges"][name][0],
            "high": stage["ranges"][name][1],
        }
        for name, value in stage["solution"].items()
    ]
    return {"invert": (["factor", "solution", "coded", "low", "high"], rows)}


def _climb_tables(stage: Stage) -> dict[str, Table]:
    columns = ["step", *stage["names"], "force", "error_percent", "status", "reason"]
    return {"climb": (columns, [{**row["levels"], **row} for row in stage["rows"]])}


def _refine_tables(stage: Stage) -> dict[str, Table]:
    varied = list(stage["solution"])
    at = ["diameter"] if "at_diameters" in stage else []
    columns = ["iteration", "how", *at, *varied, "predicted", "force", "error_percent", "status", "reason"]
    return {"refine": (columns, [{**row["levels"], **row} for row in stage["rows"]])}


def _audit_tables(stage: Stage) -> dict[str, Table]:
    return {"audit": (["number", "place", "kind", "printed", "computed", "sentence"], stage["findings"])}


def _validate_tables(stage: Stage) -> dict[str, Table]:
    columns = ["diameter", "measured", "simulated", "error_percent", "role", "status", "reason"]
    columns += ["sd", "n", "measured_low", "measured_high", "p_different", "p_equivalent"]
    return {"validate": (columns, stage["rows"])}


def _runs_table(stage: Stage) -> Table:
    """Levels and force of every run, as a table solver reads them."""
    runs = stage["design"]["runs"]
    varied = list(runs[0]["coded"])
    marks = [name for name in ("block", "weight") if name in runs[0]]
    rows = [{**run["levels"], **{name: run.get(name) for name in ("run", *marks, "force")}} for run in runs]
    return ["run", *varied, *marks, "force"], rows


TABLES = {
    "screen": _screen_tables,
    "rsm": _rsm_tables,
    "invert": _invert_tables,
    "climb": _climb_tables,
    "refine": _refine_tables,
    "validate": _validate_tables,
    "audit": _audit_tables,
}
