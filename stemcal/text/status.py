"""What `status` says below its table: who works here, what failed, what is stale, the verdict."""

from collections.abc import Iterator

from stemcal.folder.study_folder import Holder
from stemcal.overview.status import StageStatus, Status
from stemcal.stages.verdict.words import in_full
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.runs import counted_reasons


def lines(found: Status, names: Names) -> list[str]:
    """Return what is said of a study's state, the verdict with all its reasons last."""
    stages = [line for stage in found.stages for line in _stage(stage)]
    awaited = "Results are awaited: fill in {sheet}, then `stemcal run SPEC`."
    if found.sheet is not None:
        stages.append(say(awaited, sheet=found.sheet))
    return [_worker(found.working), *stages, *in_full(found.verdict, names)]


def _worker(working: Holder | None) -> str:
    if working is None:
        return say("No process works here now.")
    if working.pid is None:
        return say("A process works here.")
    return say("Process {pid} on {host} works here since {since}.", **vars(working))


def _stage(stage: StageStatus) -> Iterator[str]:
    if stage.reasons:
        template = "{stage}: failed: {reasons}; `stemcal status SPEC --failed` lists them."
        yield say(template, stage=stage.stage, reasons=counted_reasons(stage.reasons))
    if stage.censored:
        yield say_number(
            "{stage}: {count} response was not clearly past its maximum when the stroke ended.",
            "{stage}: {count} responses were not clearly past their maximum when the stroke ended.",
            stage.censored,
            stage=stage.stage,
        )
    if stage.damaged:
        yield say_number(
            "{stage}: {count} record is damaged; its run will be done again.",
            "{stage}: {count} records are damaged; their runs will be done again.",
            stage.damaged,
            stage=stage.stage,
        )
    if stage.changed:
        changed = ", ".join(stage.changed)
        yield say("{stage}.json is stale: {changed} changed since.", stage=stage.stage, changed=changed)
