"""Runs added to a design already run: what the spec has to say for it, and what is kept."""

from dataclasses import dataclass

from stemcal.errors import UsageError
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.plan import plan
from stemcal.solvers.protocol import Solver
from stemcal.study.model import RsmOptions, ScreenOptions, Study
from stemcal.study.reading.amend import Change


@dataclass(frozen=True)
class Augmentation:
    """What is added: all signs turned to the screening; D-optimal runs, axial points to the surface's design."""

    fold_over: bool = False
    extra_runs: int = 0
    axial: float | None = None

    @property
    def stages(self) -> tuple[str, ...]:
        """The stages whose designs grow."""
        surface = bool(self.extra_runs) or self.axial is not None
        return ("screen",) * self.fold_over + ("rsm",) * surface


def augment(study: Study, added: Augmentation) -> tuple[Study, list[Change]]:
    """Return the study with the larger designs, and the changes of its spec.

    Raises
    ------
    UsageError
        If nothing is added, the spec has it already, or the solver can answer no further runs.
    """
    if not added.stages:
        raise UsageError("augment: say what to add, --fold-over, --extra-runs N or --axial DISTANCE")
    screen, rsm, changes = study.screen, study.rsm, list[Change]()
    if added.fold_over:
        screen = _folded(screen)
        changes.append(("screen", "fold_over", "true"))
    if added.extra_runs:
        rsm = _extended(rsm, added.extra_runs)
        changes.append(("rsm", "extra_runs", _written(rsm.extra_runs)))
    if added.axial is not None:
        if rsm.axial is not None:
            raise UsageError(f"augment: rsm.axial is {rsm.axial:g} already; one distance can be added")
        rsm = rsm.model_copy(update={"axial": added.axial})
        changes.append(("rsm", "axial", f"{added.axial:g}"))
    return study.model_copy(update={"screen": screen, "rsm": rsm}), changes


def _folded(screen: ScreenOptions) -> ScreenOptions:
    if screen.fold_over:
        raise UsageError("augment: screen.fold_over is true already; folding over once more repeats the design")
    return screen.model_copy(update={"fold_over": True})


def _extended(rsm: RsmOptions, count: int) -> RsmOptions:
    """Append a batch, so that the batches before it stay what they are."""
    before = rsm.extra_runs if isinstance(rsm.extra_runs, tuple) else (rsm.extra_runs,)
    batches = (*(size for size in before if size), count)
    return rsm.model_copy(update={"extra_runs": batches[0] if len(batches) == 1 else batches})


def _written(batches: int | tuple[int, ...]) -> str:
    return str(batches) if isinstance(batches, int) else f"[{', '.join(map(str, batches))}]"


@dataclass(frozen=True)
class Growth:
    """How many runs a stage's design had, has now, and how many of these are left to compute."""

    stage: str
    had: int
    rows: int
    to_run: int


def growth(
    before: Study, after: Study, stages: tuple[str, ...], folder: StudyFolder, solver: Solver | None = None
) -> list[Growth]:
    """Return how the design of each stage grows.

    Raises
    ------
    UsageError
        If a stage has not been run: then there is nothing to add to.
    """
    for stage in stages:
        if not folder.has_stage(stage):
            raise UsageError(f"augment: {stage} has not been run; run `stemcal {stage} SPEC` first")
    old, new = ({part.stage: part for part in plan(s, folder, solver).stages} for s in (before, after))
    return [Growth(s, old[s].rows, new[s].rows, new[s].to_run) for s in stages]
