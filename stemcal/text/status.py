"""What `status` says below its table: who works here, what failed, what is stale, the verdict."""

from collections.abc import Iterator

from stemcal.folder.study_folder import Holder
from stemcal.overview.status import StageStatus, Status
from stemcal.stages.verdict.words import in_full
from stemcal.text.names import Names
from stemcal.text.runs import counted_reasons
from stemcal.words import counted


def lines(found: Status, names: Names) -> list[str]:
    """Return what is said of a study's state, the verdict with all its reasons last."""
    stages = [line for stage in found.stages for line in _stage(stage)]
    if found.sheet is not None:
        stages.append(f"Results are awaited: fill in {found.sheet}, then `stemcal run SPEC`.")
    return [_worker(found.working), *stages, *in_full(found.verdict, names)]


def _worker(working: Holder | None) -> str:
    if working is None:
        return "No process is working on this study."
    if working.pid is None:
        return "A process is working on this study."
    return f"Process {working.pid} on {working.host} has been working on this study since {working.since}."


def _stage(stage: StageStatus) -> Iterator[str]:
    name = stage.stage
    if stage.reasons:
        yield f"{name}: failed: {counted_reasons(stage.reasons)}; `stemcal status SPEC --failed` lists them."
    if stage.censored:
        yield f"{name}: {counted(stage.censored, 'response')} not clearly past the maximum at the end of the stroke."
    if stage.damaged:
        yield f"{name}: {counted(stage.damaged, 'damaged record')}: the next command repeats the run."
    if stage.changed:
        yield f"{name}.json is stale: {', '.join(stage.changed)} changed since."
