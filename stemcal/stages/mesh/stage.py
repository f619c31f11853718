"""The mesh as a stage: the solution simulated on other meshes, their scatter carried into every interval."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.calibration.mesh_scatter import MeshScatter, scatter_of, size_factors
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.naming import FIRST
from stemcal.notes import Note
from stemcal.solvers.protocol import Answer, Meshed, Request, Solver
from stemcal.stages.invert.certainty import measured_of
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.error_budget import Carried
from stemcal.stages.mesh.result import MeshResult, MeshRun
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import Head
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import MeshOptions, Study

__all__ = ["MeshResult", "mesh"]

# What the details of a run over several places of the mesh call travel and work at each.
_AT_PLACES = {"travel": "phase_travels", "work": "phase_works"}


class ScatterUnknown(Note):
    """A measured response whose values at each place of the mesh the runs do not tell."""

    response: str


@dataclass(frozen=True, eq=False)
class Simulated:
    """A response at the solution: on the study's own mesh (diameters,), at other places and of other sizes."""

    own: Array
    placed: Array
    sized: Array
    sizes: tuple[str, ...]

    @property
    def scatter(self) -> MeshScatter:
        """Its scatter over the places."""
        return scatter_of(self.own, self.placed, self.sized)


def _can_mesh(_stage: str, study: Study, solver: Solver) -> None:
    if not isinstance(solver, Meshed):
        raise UsageError(f"mesh: solver {study.solver.kind} does not say how it would mesh otherwise; use the embedded")


@a_stage(MeshResult, _can_mesh)
def mesh(work: Work, head: Head) -> MeshResult:
    """Simulate the solution on other meshes and carry their scatter into every interval."""
    study, solver, options = work.study, work.solver, work.study.mesh or MeshOptions()
    assert isinstance(solver, Meshed)
    surface, solution = work.result(SurfaceResult), work.result(InvertResult)
    parameters = (work.result(RefineResult) if study.refine is not None else solution).parameters
    at = [target.condition for target in study.joint_targets] or [study.targets.calibrate_at]
    rows = _simulate(work, parameters, at, options)
    _require_responses(rows, options.phases)
    found = _simulated(rows, FIRST)
    scatter = found.scatter
    sizes = size_factors(found.own, found.sized, found.sizes, scatter)
    further = {name: _simulated(rows, name).scatter for name in _told_further(study, rows, options.phases)}
    over = {name: part.over(solver.phases) for name, part in further.items()}
    carried = Carried.of(study, surface, solution, scatter.over(solver.phases), over)
    return MeshResult(
        head=head,
        parameters=dict(parameters),
        belongs_to=solution.belongs_to or {},
        condition=solution.condition,
        rows=Rows(rows),
        scatter=scatter,
        further=further or None,
        sizes=Rows(sizes),
        budget=Rows(carried.budget()),
        mean_interval=carried.mean_interval,
        prediction_interval=carried.prediction_interval,
        ranges=carried.ranges,
        coded_ranges=carried.coded_ranges,
        certainty=carried.certainty,
        certainty_alone=carried.certainty_alone,
        notes=tuple(ScatterUnknown(name) for name in _wanted_further(study) if name not in further),
    )


def _simulate(work: Work, levels: dict[str, float], at: Sequence[float], options: MeshOptions) -> list[MeshRun]:
    """Simulate every mesh at every diameter; the study's own as the validation does, whose record it has."""
    own = [Request("mesh", 0, levels, condition, pictured=True) for condition in at]
    placed = [Request("mesh", 1, levels, condition, phases=options.phases) for condition in at]
    sized = [
        Request("mesh", 2 + i, levels, condition, element_size=str(size))
        for i, size in enumerate(options.sizes)
        for condition in at
    ]
    requests, names = [*own, *placed, *sized], ("own", "phases", *map(str, options.sizes))
    answers = work.answers(requests)
    answered = zip(requests, answers, work.outcomes(requests, answers), strict=True)
    wanted = _wanted_further(work.study)
    return [
        MeshRun(
            condition=request.condition,
            mesh=names[request.row],
            further={name: _at_places(answer, name) for name in wanted if request.phases is not None} or None,
            outcome=outcome,
        )
        for request, answer, outcome in answered
    ]


def _wanted_further(study: Study) -> list[str]:
    """Return which of travel and work were measured somewhere: their scatter is told too."""
    measured = {mean.response for target in study.targets.means for mean in measured_of(target, list(_AT_PLACES))}
    return [name for name in _AT_PLACES if name in measured]


def _at_places(answer: Answer, response: str) -> tuple[float, ...]:
    return tuple(answer.details.get(_AT_PLACES[response], ())) if answer.ok else ()


def _told_further(study: Study, rows: Sequence[MeshRun], phases: int) -> list[str]:
    """Return which of travel and work the runs tell on the study's own mesh and at each place."""
    placed = [row for row in rows if row.mesh == "phases"]
    own = [row.outcome for row in rows if row.mesh == "own"]
    return [
        name
        for name in _wanted_further(study)
        if all(len(row.at_places(name)) == phases for row in placed) and all(o.of(name) for o in own)
    ]


def _require_responses(rows: Sequence[MeshRun], phases: int) -> None:
    """Raise `RunsFailed` if the study's own mesh failed, or its places, or if these have no force each."""
    for name in ("own", "phases"):
        for row in rows:
            if row.mesh == name and row.outcome.response is None:
                reason = f"({row.outcome.reason}): {row.outcome.message}"
                raise RunsFailed(f"mesh: the run at {row.condition:g} mm ({name}) failed {reason}")
    if any(len(row.at_places(FIRST)) != phases for row in rows if row.mesh == "phases"):
        raise RunsFailed("mesh: the solver tells no force at each place of the mesh (details: phase_forces)")


def _simulated(rows: Sequence[MeshRun], response: str) -> Simulated:
    """Return a response on every mesh; sizes that failed at a diameter are left out."""
    by_mesh: dict[str, list[MeshRun]] = {}
    for row in rows:
        by_mesh.setdefault(row.mesh, []).append(row)
    whole = [
        name
        for name, of in by_mesh.items()
        if name not in ("own", "phases") and all(row.outcome.of(response) for row in of)
    ]
    sized = [[row.outcome.number(response) for row in by_mesh[name]] for name in whole]
    own = [row.outcome.of(response) for row in by_mesh["own"]]
    return Simulated(
        np.array(own, dtype=float),
        np.array([row.at_places(response) for row in by_mesh["phases"]], dtype=float),
        np.array(sized, dtype=float).reshape(len(whole), len(own)).T,
        tuple(whole),
    )
