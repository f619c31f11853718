"""The audit of a paper as a stage."""

from dataclasses import dataclass
from typing import ClassVar

from stemcal.errors import UsageError
from stemcal.executors.base import RunExecutor
from stemcal.files.rows import Column, Rows, Table
from stemcal.files.typed import Spread, inline, key, to_json
from stemcal.folder.study_folder import StudyFolder
from stemcal.notes import Note
from stemcal.runs.answer import Watch, ignore
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Solver
from stemcal.stages.audit.consistency import CONSISTENCY, explained
from stemcal.stages.audit.found import Calibrated, Check, Found, ranked
from stemcal.stages.audit.paper import cells_differ, claims_differ, design_differs, levels_differ
from stemcal.stages.audit.suspicions import SUSPICIONS, solution_is_one_of_many
from stemcal.stages.base import stages_of
from stemcal.stages.fresh import make
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.printed_tables import Agreement, Contradiction
from stemcal.stages.result import Head, StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.work import HERE, Work, a_stage
from stemcal.study.model import Study

CHECKS: tuple[Check, ...] = (cells_differ, claims_differ, levels_differ, design_differs, *SUSPICIONS, *CONSISTENCY)


class NoValidationTable(Note):
    """No validation table is given: its responses are not looked at."""


@dataclass(frozen=True)
class Finding(Spread):
    """One thing that does not agree, numbered."""

    number: int
    found: Found = inline()


@dataclass(frozen=True, kw_only=True, repr=False)
class AuditResult(StageResult):
    """What does not agree in a paper, and how many of its printed cells do."""

    name: ClassVar[str] = "audit"
    shown = ("agree", "of")

    head: Head = inline()
    agree: int
    of: int
    tables_agree: dict[str, Agreement] = key("tables")
    findings: Rows[Finding]
    notes: tuple[Note, ...] = ()

    def _tables(self) -> dict[str, Table]:
        """Return the findings, the values of each in one cell."""
        values = Column("values", of=lambda finding: _values(finding.found.fact))
        return {"audit": Table.of(("number", "consequence", "kind", values, "cause"), self.findings)}


def _values(fact: Contradiction) -> str:
    return "; ".join(f"{name} {value}" for name, value in to_json(fact).items() if name != "kind")


def audit(
    study: Study,
    folder: StudyFolder,
    executor: RunExecutor = HERE,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> AuditResult:
    """Recompute a paper's printed tables and claims; list what does not agree.

    Raises
    ------
    UsageError
        If there is nothing to audit: the runs are not printed ones, or nothing is said to be published.
    """
    if study.solver.kind != "table":
        raise UsageError("audit: recomputes from printed runs; give the spec a solver of kind table with the paper's")
    if study.published is None:
        raise UsageError("audit: the spec has no section published; say there what the paper printed")
    solver = solver or make_solver(study)
    with folder:
        for stage in stages_of(study):
            if stage.name != "validate" or not study.unvalidated:
                make(stage, study, folder, executor, watch, solver)
        return _audited(study, folder, executor, watch, solver)


@a_stage(AuditResult)
def _audited(work: Work, head: Head) -> AuditResult:
    looked_at = Calibrated(
        work.result(ScreenResult),
        work.result(SurfaceResult),
        work.result(InvertResult),
        None if work.study.unvalidated else work.result(ValidateResult),
    )
    return audit_all(work.study, head, looked_at)


def audit_all(study: Study, head: Head, stages: Calibrated) -> AuditResult:
    """Return what was found and how many cells agree."""
    found = ranked(explained([finding for check in CHECKS for finding in check(study, stages)]))
    tables = {name: count for audited in stages.published() for name, count in audited.tables.items()}
    agree, of = (sum(getattr(count, part) for count in tables.values()) for part in ("agree", "of"))
    return AuditResult(
        head=head,
        agree=agree,
        of=of,
        tables_agree=tables,
        findings=Rows(Finding(number, finding) for number, finding in enumerate(found, 1)),
        notes=(
            *([] if stages.validation is not None else [NoValidationTable()]),
            *solution_is_one_of_many(study, stages),
        ),
    )
