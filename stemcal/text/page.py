"""What the page says of a study by itself: its kind, its question, which runs failed, what is folded."""

from collections.abc import Iterable

from stemcal.executors.code import code_version
from stemcal.numbers import short
from stemcal.stages.base import stage_called
from stemcal.stages.result import StageResult
from stemcal.study.model import Study, program_of
from stemcal.text.language import all_of, say, say_number
from stemcal.text.names import Names
from stemcal.version import __version__

_FOLLOWING = ("climb", "refine")  # their runs follow from each other; a failed one is answered by the next


def kind_of(study: Study) -> str:
    """Return what is calibrated here."""
    if study.naming.is_cutting:
        return say("Calibration of a stem cutting model")
    fitted = [study.naming.named(name).long for name in study.invert.responses]
    return say("Calibration of a simulation to the measured {responses:all}", responses=fitted)


def question(study: Study) -> str:
    """Return what the study asks."""
    others = len(study.targets.means) - max(len(study.joint_targets), 1)
    return " ".join([_asked(study), *([_elsewhere(study, others)] if others else [])])


def _asked(study: Study) -> str:
    target, naming, names = study.calibration_target, study.naming, Names(study.naming)
    if len(study.joint_targets) > 1:
        return _asked_together(study, names)
    if naming.is_cutting:
        stem = (
            "Which parameters make a simulated stem of {condition:condition} diameter resist cutting with the measured "
            "maximum force of {response}?"
        )
        return names.say(stem, condition=target.condition, response=naming.response.text(target.response, ".6g"))
    means = [(naming.named(name), target.mean_of(name)[0]) for name in study.invert.responses]
    measured = [f"{short(mean)}{named.unit_suffix}" for named, mean in means if mean is not None]
    responses = [named.long for named, mean in means if mean is not None]
    nowhere = "Which parameters make the simulated {responses:all} equal the measured {measured:all}?"
    somewhere = (
        "Which parameters make the simulated {responses:all} at {condition:condition} equal the measured "
        "{measured:all}?"
    )
    template = somewhere if names.placed else nowhere
    return names.say(template, responses=responses, measured=measured, condition=target.condition)


def _asked_together(study: Study, names: Names) -> str:
    stems = (
        "Which parameters make simulated stems of {conditions:conditions} diameter resist cutting with the measured "
        "maximum forces?"
    )
    responses = (
        "Which parameters make the simulated {responses:all} at {conditions:conditions} equal what was measured?"
    )
    fitted = [study.naming.named(name).long for name in study.invert.responses]
    template = stems if study.naming.is_cutting and len(fitted) == 1 else responses
    return names.say(template, responses=fitted, conditions=[target.condition for target in study.joint_targets])


def _elsewhere(study: Study, others: int) -> str:
    return say_number(
        "Do they hold at {count} other value of the {condition}?",
        "Do they hold at {count} other values of the {condition}?",
        others,
        condition=Names(study.naming).condition.long,
    )


def failures(done: Iterable[StageResult]) -> list[str]:
    """Name the runs of designs and of the validation that gave no response."""
    return [
        say(
            "{stage}, run {run} failed: {why}",
            stage=stage_called(result.name).title,
            run=label.removeprefix(f"{result.name} "),
            why=outcome.message or outcome.reason,
        )
        for result in done
        if result.name not in _FOLLOWING
        for label, outcome in result.runs()
        if not outcome.ok
    ]


def further_reasons(count: int) -> str:
    """Say how many reasons follow the first."""
    return say_number("{count} more reason", "{count} more reasons", count)


def made_with(study: Study, spec_hash: str) -> list[tuple[str, str]]:
    """Return what a reader needs to make the study again and to cite it: spec, solver, program."""
    spec = "{name}, SHA-256 {hash}" if spec_hash else "{name}"
    return [
        (say("Spec"), say(spec, name=study.source.name, hash=spec_hash)),
        (say("Solver"), program_of(study.solver)),
        (say("Page made by"), say("stemcal {version}", version=code_version())),
        (say("Cite"), say("The stemcal developers, stemcal, version {version}, with this spec.", version=__version__)),
    ]


def folded(titles: Iterable[str], figures: int, notes: int) -> str:
    """List what is folded; nothing if nothing is."""
    counts = [say_number("{count} figure", "{count} figures", figures)] if figures else []
    counts += [say_number("{count} note", "{count} notes", notes)] if notes else []
    return all_of([*titles, *counts])
