"""Options that several commands share, and the session of a command: study, locked folder, executor and progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from stemcal.cli.console import await_, envelope, route_log, stderr, warn
from stemcal.errors import UsageError, Waiting
from stemcal.formats import counted

Spec = Annotated[Path, typer.Argument(metavar="SPEC", help="Spec of the study (YAML file).", show_default=False)]

Out = Annotated[Path | None, typer.Option("--out", "-o", metavar="DIR", help="Study folder (default: runs/NAME).")]

Workers = Annotated[
    int | None,
    typer.Option(
        "--workers",
        "-j",
        metavar="N",
        min=1,
        help="Number of simulations to run in parallel.",
        show_default="all cores",
    ),
]

ExecutorName = Annotated[
    str,
    typer.Option(
        "--executor", metavar="local|dask://HOST:PORT", help="Run simulations on this machine or on a Dask cluster."
    ),
]


def _name_envelope(ctx: typer.Context, value: bool) -> bool:
    if value:
        envelope.command = ctx.command_path.removeprefix(ctx.find_root().command_path).strip()
    return value


AsJson = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.", callback=_name_envelope)]

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Suppress the progress bar and the notes.")]

if TYPE_CHECKING:
    from stemcal.by_hand.own_sheet import OwnSheet
    from stemcal.report.progress import Watcher
    from stemcal.runs.executors import RunExecutor
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.stages.results import Results
    from stemcal.study.model.study import Study

_DASK = "dask://"
T = TypeVar("T")


@dataclass(frozen=True)
class Session:
    """An open study: its locked folder, its executor, its progress display, and its run sheet if it has manual runs."""

    study: Study
    folder: StudyFolder
    executor: RunExecutor
    watch: Watcher
    sheet: OwnSheet | None

    def continued(self, work: Callable[[], T]) -> T:
        """Return the result of `work`; call it again if new results were saved to the sheet while it ran."""
        while True:
            try:
                return work()
            except Waiting:
                if self.sheet is None or not self.sheet.enter_saved():
                    raise

    def foresee(self, stage: str | None = None) -> None:
        """Warn of long runs of a `stage` (default: all stages); raise `UsageError` if they need too much memory."""
        from stemcal.solvers import make_solver
        from stemcal.stages.fresh import finished
        from stemcal.stages.stage import stage_called

        if finished(self.study, self.folder, stage):
            return
        from stemcal.overview.foresight import demand_left, warnings_before
        from stemcal.runs.executors.local import LocalExecutor

        here = isinstance(self.executor, LocalExecutor)
        solver = make_solver(self.study if stage is None else stage_called(stage).seen(self.study))
        demand = demand_left(self.study, self.folder, solver, stage)
        for sentence in warnings_before(demand, self.executor.workers, here):
            warn(sentence)


def study_or_exit(spec: Path, changes: Mapping[str, object] | None = None) -> Study:
    """Return the study in a spec, with `changes`; raise `SpecError` with all problems, and warn of doubtful values."""
    from stemcal.study.reading import load_study

    route_log()
    study = load_study(spec, **(changes or {}))
    for sentence in study.warnings:
        warn(sentence)
    return study


def _executor_called(name: str, workers: int | None) -> Callable[[float | None], RunExecutor]:
    """Return a function that creates this executor, from the time limit of a run (s); `UsageError` for a wrong name."""
    if name == "local":
        from stemcal.runs.executors.local import LocalExecutor

        return lambda time_limit: LocalExecutor(workers, time_limit)
    host, _, port = name.removeprefix(_DASK).rpartition(":")
    if not name.startswith(_DASK):
        raise UsageError(f"--executor {name}: unknown executor; use `local` or `dask://HOST:PORT`")
    if not host or not port.isdigit():
        raise UsageError(f"--executor {name}: write the address of your scheduler as `dask://HOST:PORT`")
    if workers is not None:
        raise UsageError(
            "--workers: this option applies only to `--executor local`; omit the option, and start the workers on "
            "the cluster"
        )
    from stemcal.runs.executors.cluster import DaskExecutor

    return lambda time_limit: DaskExecutor(name.removeprefix(_DASK), time_limit)


@contextmanager
def opened(
    spec: Path,
    out: Path | None,
    workers: int | None,
    executor: str,
    quiet: bool,
    entered: Path | None = None,
    changes: Mapping[str, object] | None = None,
) -> Iterator[Session]:
    """Open a study in its folder, which is locked during the ``with`` block; `changes` modify the spec.

    First, the results in the run sheet of the folder are recorded, unless the command itself records them (then
    `entered` is this sheet). If `Waiting` ends the block, a new sheet is written and the command exits with a message.
    """
    make_executor = _executor_called(executor, workers)
    study = study_or_exit(spec, changes)

    from stemcal.report.progress import make_watch
    from stemcal.runs.study_folder import StudyFolder, place_of

    sheet = None
    try:
        with ExitStack() as stack:
            pool = stack.enter_context(make_executor(study.solver.run_limit))
            folder = stack.enter_context(StudyFolder(place_of(study.name, out)))
            watch = stack.enter_context(make_watch(None if quiet else stderr(), study.naming))
            if study.by_hand.kind.answers == "asks_people":
                from stemcal.by_hand.own_sheet import OwnSheet

                sheet = stack.enter_context(OwnSheet(study, folder, entered))
            yield Session(study, folder, pool, watch, sheet)
    except Waiting as waiting:
        if sheet is None:
            raise
        results = f"{counted(sheet.awaited, 'result')} from the {waiting.stage} stage"
        to_do = f"Waiting for {results}. Fill in {sheet.path}. Then run"
        if not sheet.awaited:
            to_do = f"All results in {sheet.path} are recorded. To continue, run"
        earlier = f". The previous sheet is {sheet.earlier}" if sheet.earlier else ""
        await_(f"{to_do} `stemcal run {spec}`{earlier}")
        raise typer.Exit(Waiting.exit_code) from None


def existing_folder(study: Study, out: Path | None) -> StudyFolder:
    """Return the folder of a study; `UsageError` if it does not exist."""
    from stemcal.runs.study_folder import StudyFolder, place_of

    path = place_of(study.name, out)
    if not path.is_dir():
        raise UsageError(f"{path} does not exist; run `stemcal run SPEC` first, or specify the folder with `--out`")
    return StudyFolder(path)


def finished_work(spec: Path, out: Path | None, quiet: bool = False) -> tuple[Study, StudyFolder, Results]:
    """Return a study, its folder and its up-to-date results; unless `quiet`, warn of out-of-date stages."""
    from stemcal.stages.results import fresh_results

    study = study_or_exit(spec)
    folder = existing_folder(study, out)
    results = fresh_results(study, folder)
    for sentence in () if quiet else results.stale:
        warn(sentence)
    return study, folder, results
