"""Functions to load, calibrate and simulate a study from Python."""

import warnings
from pathlib import Path
from typing import Annotated

from pydantic import Field

from stemcal.by_hand.entering import AskAndTell
from stemcal.errors import UsageError
from stemcal.formats import did_you_mean
from stemcal.overview.foresight import Demand, demand_left, demand_of_one, warnings_before
from stemcal.python.results import Simulated, StudyResults
from stemcal.report.progress import notebook_watch
from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.study_folder import StudyFolder, place_of
from stemcal.solvers import make_solver
from stemcal.solvers.embedded import simulate_levels as shear_test
from stemcal.stages.fresh import make_all
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study as read_spec
from stemcal.study.reading.messages import checked, level_of
from stemcal.study.rules.factors import wrong_levels
from stemcal.study.types.field_types import Size, Whole

_Workers = Annotated[Whole, Field(ge=1)] | None


def load_study(path: str | Path, **changes: object) -> Study:
    """Read a study from a YAML file; raise `SpecError` with all mistakes in it.

    `changes` modify the spec before it is checked. A keyword is the name of a section or of a factor, its value is
    written as in a spec. A mapping is merged into the spec; any other value replaces the value in the spec:

    ``load_study("my-stems.yaml", yield_stress={"high": 25}, rsm={"alpha": "face"})``
    """
    study = read_spec(path, **changes)
    study._manual_runs = AskAndTell()
    return study


def calibrate(
    study: Study | str | Path,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    progress: bool | None = None,
) -> StudyResults:
    """Run all stages of a study; finished runs in the folder are reused.

    study      the study, or the path of its YAML file
    out        the study folder; by default ``runs/<study name>``
    workers    number of parallel simulations; by default the number of cores
    progress   whether to show a progress bar; by default in a terminal and in Jupyter

    Raises `RunsFailed`, `TargetUnreachable`, `FolderLocked`, `Waiting` and `UsageError` as on the command line.
    """
    study, workers = _study(study), checked(_Workers, workers, "workers")
    folder = StudyFolder(place_of(study.name, out))
    with LocalExecutor(workers, study.solver.run_limit) as executor, notebook_watch(progress, study.naming) as watch:
        _warn_before(demand_left(study, folder, make_solver(study)), executor.workers)
        make_all(study, folder, executor, watch)
    folder.remember_spec(study.source)
    return StudyResults(study, folder)


def _study(study: Study | str | Path) -> Study:
    if isinstance(study, Study):
        return study
    if isinstance(study, str | Path):
        return load_study(study)
    raise UsageError(
        f"study: the type {type(study).__name__} is not valid. Pass the result of `stemcal.load_study` or the path of "
        "a spec."
    )


def _warn_before(demand: Demand, workers: int) -> None:
    """Warn if the runs will take very long; raise `UsageError` if they need more memory than this machine has."""
    for warning in warnings_before(demand, workers):
        warnings.warn(warning, stacklevel=3)


def open_results(folder: str | Path, study: Study | None = None) -> StudyResults:
    """Return the results in a study folder.

    By default, the study is read from the spec of the last `calibrate` or `stemcal run` in this folder; the folder
    contains the path of that spec. Raises `UsageError` if the folder does not exist or contains no such path.
    """
    place = Path(folder)
    if not place.is_dir():
        raise UsageError(f"{place}: the folder does not exist. Run `stemcal run SPEC` first, or pass another folder.")
    results_folder = StudyFolder(place)
    if study is None:
        spec = results_folder.remembered_spec()
        if spec is None:
            raise UsageError(f"{place}: the folder contains no spec. Pass the study: `open_results(folder, study)`.")
        study = load_study(spec)
    return StudyResults(study, results_folder)


def simulate(study: Study | str | Path, diameter: float | str | None = None, **levels: float | str) -> Simulated:
    """Simulate one cutting test of a study.

    study      the study, or the path of its YAML file
    diameter   outer diameter of the stem, in mm or with a unit; by default that of the specimen
    levels     values of factors, in the units of the spec or with a unit; other factors are at mid-level

    Raises `UsageError` if the study has another solver, a factor is unknown, a value is not allowed in a spec, or the
    simulation needs too much time or memory. Raises `SimulationFailed` if the result is not reliable.
    """
    study = _study(study)
    if not study.kind.simulates_stems:
        raise UsageError(
            f"simulate: the solver kind is `{study.solver.kind}`, but `embedded` is required. Write `solver: {{kind: "
            f"embedded}}`."
        )
    for name in levels:
        if name not in study.names:
            raise UsageError(f"simulate: {name!r} is not a factor; {did_you_mean(name, study.names)}")
    chosen = study.specimen.outer_diameter if diameter is None else checked(Size, diameter, "diameter")
    whole = {**study.midlevels(), **{name: level_of(study.factor(name), value) for name, value in levels.items()}}
    if wrong := list(wrong_levels(study, whole, chosen)):
        raise UsageError("\n".join(f"simulate: {sentence}" for sentence in wrong))
    _warn_before(demand_of_one(study, [chosen]), 1)
    return Simulated(whole, chosen, shear_test(study, whole, chosen))
