"""Check whether the file of a stage is fresh, that is, whether it agrees with its present inputs.

Every stage file contains ``inputs``: the version of the code, and short hashes of the factors, the options of the
stage, all settings of the solver that affect a response, and the file of the stage before. A file is stale if one of
these differs; the names of those that differ show what has changed. A command reads a fresh file. It recomputes the
stage if the file is stale, or if runs of it are missing or have to be repeated.
"""

import logging
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.responses import packages_of
from stemcal.runs.answer import Progress, Watch, watch_nothing
from stemcal.runs.executors import RunExecutor
from stemcal.runs.record import Run, is_final, outcome_of
from stemcal.runs.study_folder import SCHEMA_VERSION, StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.program import file_hash
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.result import Head, R, StageResult, read_result
from stemcal.stages.stage import STAGES, Stage, calibrating, stage_called, stages_of
from stemcal.storage.canonical import digest
from stemcal.storage.plain import holds
from stemcal.study.model.laboratory_kind import TESTS
from stemcal.study.model.study import Study
from stemcal.version import __version__, code_version
from stemcal.vocabulary import FIRST

logger = logging.getLogger(__name__)

CODE = "stemcal"  # key of the version and hash of the code among the inputs
_SHORT = 16
_REQUEST = frozenset({"stage", "row", "levels", "condition"})  # keys of `Run.identity` for the run, not the solver
# Sections of the spec that determine the response of a virtual shear test, and keys in them that do not affect it.
_TEST = ("specimen", "layers", "blade", "supports", "loading", "contact", "material", "solver")
_NO_INPUT = frozenset({"solver.threads", "solver.time_limit"})


def inputs_of(study: Study, solver: Solver | None, folder: StudyFolder, stage: str) -> dict[str, str]:
    """Return the inputs of a stage file: the version of the code, and a hash of each other input."""
    kind = stage_called(stage)
    whole, study = study, kind.seen(study)
    if study is not whole:
        solver = None  # the stage runs in another model
    sections = {"factors", "tests", "responses", "conditions", *kind.reads}
    fields = {name for name, field in Study.model_fields.items() if (field.serialization_alias or name) in sections}
    dump = _with_contents(whole.model_dump(include=fields, by_alias=True))
    parts: dict[str, object] = {"factors": dump["factors"], "calibrate_at": study.targets.calibrate_at}
    parts |= {name: dump[name] for name in kind.reads}
    if study.tests:
        parts["tests"] = dump["tests"]
        versions = ((test.kind, TESTS.version_of(test.kind)) for test in study.tests)
        parts |= {f"package of {test}": version for test, version in versions if version}
    if study.targets.modes:
        parts["curves"] = [vars(modes) for modes in study.targets.modes.values()]
    parts |= packages_of(named.name for named in study.naming.further)
    if not study.naming.is_cutting:
        parts["named"] = [dump["responses"], dump["conditions"]]
    parts |= kind.inputs(study)
    if package := STAGES.version_of(stage):
        parts |= {"package": package, stage: whole.further[stage].model_dump()}
    if kind.simulates:
        parts |= _solver_parts(study, solver, stage)
        parts["solver.replicates"] = study.solver.repeats
    if (before := kind.needs(whole)) is not None:
        parts[f"{before}.json"] = folder.read_stage(before)
    return {CODE: code_version()} | {name: digest(part)[:_SHORT] for name, part in parts.items()}


def _solver_parts(study: Study, solver: Solver | None, stage: str) -> dict[str, object]:
    """Return the settings that affect a response, without the levels; does not import the embedded solver."""
    if study.kind.of_spec_alone and (solver is None or solver.of_spec_alone):
        dump = _with_contents(study.model_dump(include=set(_TEST)))
        leaves = {path: leaf for name in _TEST for path, leaf in _leaves(name, dump[name]).items()}
        return {path: leaf for path, leaf in leaves.items() if path not in _NO_INPUT}
    probe = Request(stage, 0, study.midlevels(), study.targets.calibrate_at)
    solver = solver or make_solver(study)
    identity = Run.of(solver, probe).identity | {"given": solver.table_of(stage)}
    return {
        path: leaf
        for name, part in identity.items()
        if name not in _REQUEST
        for path, leaf in _leaves(f"solver {name}", part).items()
    }


def _with_contents(part: Any) -> Any:
    """Return a part of a spec with each path replaced by the hash of the file."""
    if isinstance(part, Path):
        return file_hash(part)
    if isinstance(part, dict):
        return {name: _with_contents(inner) for name, inner in part.items()}
    return [_with_contents(inner) for inner in part] if isinstance(part, list | tuple) else part


def _leaves(name: str, part: object) -> dict[str, object]:
    """Return the values of a nested mapping by their dotted paths, which name the keys that changed.

    >>> _leaves("solver test", {"mesh": {"size": 1.0}, "speed": 2.0})
    {'solver test.mesh.size': 1.0, 'solver test.speed': 2.0}
    """
    if isinstance(part, Mapping) and part:
        return {path: leaf for inner, value in part.items() for path, leaf in _leaves(f"{name}.{inner}", value).items()}
    if isinstance(part, list | tuple) and len(part) == 1:
        return _leaves(name, part[0])
    return {name: part}


def require_fresh(study: Study, solver: Solver | None, folder: StudyFolder, stage: str) -> None:
    """Raise `UsageError` if a stage's file, or one before it, is missing or stale."""
    before = stage_called(stage).needs(study)
    if before is not None:
        require_fresh(study, solver, folder, before)
    if changed := changes_since(study, solver, folder, stage):
        raise UsageError(
            f"{folder.path / stage}.json is out of date ({', '.join(changed)} changed). Run `stemcal {stage} SPEC` "
            "again; recorded runs are reused."
        )


def changes_since(study: Study, solver: Solver | None, folder: StudyFolder, stage: str) -> list[str]:
    """Return the names of the inputs that changed since a stage file was written; only `CODE` if the code changed."""
    old = folder.examine_stage(stage).get("inputs")
    if not isinstance(old, dict) or old.get(CODE) != code_version():
        return [CODE]
    try:
        new = inputs_of(study, solver, folder, stage)
    except UsageError:
        return [f"{stage_called(stage).needs(study)}.json"]
    differing = sorted(name for name in {*old, *new} if old.get(name) != new.get(name))
    if not differing and _by_hand(study, stage):  # a result that was corrected by hand changes no input
        result = read_result(folder, stage_called(stage).result())
        return [] if _runs_agree(result, study, folder, whole=False) else ["results"]
    return differing


def _by_hand(study: Study, stage: str) -> bool:
    seen: Study = stage_called(stage).seen(study)
    return seen.kind.answers == "asks_people"


def head_of(study: Study, solver: Solver | None, folder: StudyFolder, stage: str) -> Head:
    """Return the head for a new stage file; log the inputs that changed since the old file."""
    with suppress(UsageError):
        if folder.has_stage(stage) and (changed := changes_since(study, solver, folder, stage)):
            logger.warning("%s is recomputed (changed: %s)", stage, ", ".join(changed))
            folder.log("inputs_changed", stage=stage, changed=changed)
    inputs = inputs_of(study, solver, folder, stage)
    return Head(SCHEMA_VERSION, stage, study.name, study.title, __version__, inputs, study.naming)


def read_fresh(study: Study, solver: Solver | None, folder: StudyFolder, kind: type[R]) -> R:
    """Return a stage's result; raise `UsageError` if its file, or one before it, is missing or stale."""
    require_fresh(study, solver, folder, kind.name)
    return read_result(folder, kind)


def calibrated_parameters(study: Study, solver: Solver, folder: StudyFolder) -> dict[str, float]:
    """Return the calibrated levels of all factors, from the last stage that calibrates them."""
    return dict(read_fresh(study, solver, folder, calibrating(study).result()).settles or {})


def make(stage: Stage[R], study: Study, folder: StudyFolder, executor: RunExecutor, watch: Watch) -> R:
    """Run a stage, or read its result if it is fresh; its file is then in the folder."""
    lacking = "targets" if study.goal is not None else "goal"
    if lacking in stage.reads:
        raise UsageError(f"{stage.name}: this stage requires `{lacking}`; add a section `{lacking}` to the spec")
    with folder:
        if (known := fresh(stage.result(), study, folder)) is None:
            if study.pending:
                raise UsageError(study.pending)
            return stage.making()(study, folder, executor, watch)
        outcomes = [outcome for _, outcome in known.runs()]
        distinct = {outcome.keys: outcome.ok for outcome in outcomes}
        count, failed = len(distinct), sum(not ok for ok in distinct.values())
        if outcomes:
            watch(Progress(known.name, count, count, count, failed, None, points=len(outcomes)))
        return known


def make_all(
    study: Study,
    folder: StudyFolder,
    executor: RunExecutor,
    watch: Watch = watch_nothing,
    done: Callable[[StageResult], None] = lambda _result: None,
    until: str | None = None,
) -> list[StageResult]:
    """Run the stages of a study in order, or read fresh ones, up to `until`; call `done` with each result at once."""
    results = []
    with folder:
        for stage in stages_of(study):
            results.append(make(stage, study, folder, executor, watch))
            done(results[-1])
            if stage.name == until:
                break
    return results


def finished(study: Study, folder: StudyFolder, stage: str | None = None) -> bool:
    """Check that a `stage` of a study is fresh, or that all are if it is None."""
    stages = stages_of(study) if stage is None else (stage_called(stage),)
    return all(fresh(each.result(), study, folder) is not None for each in stages)


def fresh(kind: type[R], study: Study, folder: StudyFolder) -> R | None:
    """Return the stored result of a stage; None if there is none, or if a new computation would store another one."""
    if not folder.has_stage(kind.name):
        return None
    try:
        result = read_fresh(study, None, folder, kind)
    except UsageError:
        return None
    is_of_study = (result.head.study, result.head.title) == (study.name, study.title)
    return result if is_of_study and _runs_agree(result, study, folder) and not changed_tables(result, folder) else None


def _runs_agree(result: StageResult, study: Study, folder: StudyFolder, whole: bool = True) -> bool:
    """Check that the run records agree with a result; with `whole`, also that every run has a final record."""
    entered = (FIRST, *study.own_further) if _by_hand(study, result.name) else ()
    for _, outcome in result.runs():
        keys = [key for key in outcome.keys if key]
        records = [record for key in keys if (record := folder.peek(key)) is not None]
        final = [record for record in records if is_final(record, study.solver.run_limit)]
        if whole and len(final) < len(keys):
            return False
        done = [answer for record in records if (answer := outcome_of(record, study.naming)).ok]
        if records and outcome.ok != bool(done):
            return False
        for name in entered if done else ():
            recorded = (outcome.of(name),) if outcome.replicates is None else outcome.replicates.of(name)
            if recorded not in (tuple(answer.of(name) for answer in done), (None,)):
                return False
    return True


def changed_tables(result: StageResult, folder: StudyFolder) -> list[str]:
    """Return the names of CSV files of a stage that are missing or differ from its tables."""
    files = {f"{name}.csv": table.csv().encode("utf-8") for name, table in result.tables().items()}
    return [name for name, content in files.items() if not holds(folder.path / name, content)]
