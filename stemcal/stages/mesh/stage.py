"""The mesh as a stage: the solution simulated on other meshes, their scatter carried into every interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.calibration.mesh import MeshScatter, SizeFactor, scatter_of, size_factors
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.runs.outcome import Outcome
from stemcal.solvers.protocol import Meshed, Request
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.carried import Carried
from stemcal.stages.mesh.result import MeshResult, MeshRun
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import MeshOptions
from stemcal.words import joined

__all__ = ["MeshResult", "mesh"]


@dataclass(frozen=True, eq=False)
class Simulated:
    """Forces at the solution, N: on the study's own mesh (diameters,), at other places and of other sizes."""

    own: Array
    placed: Array
    sized: Array
    sizes: tuple[str, ...]


@a_stage
def mesh(work: Work) -> MeshResult:
    """Simulate the solution on other meshes and carry their scatter into every interval."""
    study, solver, options = work.study, work.solver, work.study.mesh or MeshOptions()
    if not isinstance(solver, Meshed):
        raise UsageError(f"mesh: solver {study.solver.kind} does not say how it would mesh otherwise; use the embedded")
    surface, solution = work.fresh(SurfaceResult), work.fresh(InvertResult)
    parameters = (work.fresh(RefineResult) if study.refine is not None else solution).parameters
    head = work.head("mesh")
    at = [target.diameter for target in study.joint_targets] or [study.targets.calibrate_at]
    rows = _simulate(work, parameters, at, options)
    found = _forces(rows, at, options.phases)
    scatter = scatter_of(found.own, found.placed, found.sized)
    sizes = size_factors(found.own, found.sized, found.sizes, scatter)
    carried = Carried.of(study, surface, solution, scatter.over(solver.phases))
    return MeshResult(
        head=head,
        parameters=dict(parameters),
        belongs_to=solution.belongs_to or {},
        diameter=solution.diameter,
        rows=Rows(rows),
        scatter=scatter,
        sizes=Rows(sizes),
        budget=Rows(carried.budget()),
        mean_interval=carried.mean_interval,
        prediction_interval=carried.prediction_interval,
        ranges=carried.ranges,
        coded_ranges=carried.coded_ranges,
        certainty=carried.certainty,
        certainty_alone=carried.certainty_alone,
        notes=tuple(_notes(scatter, sizes, rows, len(at)) + carried.notes),
    )


def _simulate(work: Work, levels: dict[str, float], at: Sequence[float], options: MeshOptions) -> list[MeshRun]:
    """Simulate every mesh at every diameter; the study's own as the validation does, whose record it has."""
    own = [Request("mesh", 0, levels, diameter, pictured=True) for diameter in at]
    placed = [Request("mesh", 1, levels, diameter, phases=options.phases) for diameter in at]
    sized = [
        Request("mesh", 2 + i, levels, diameter, element_size=str(size))
        for i, size in enumerate(options.sizes)
        for diameter in at
    ]
    requests, names = [*own, *placed, *sized], ("own", "phases", *map(str, options.sizes))
    told = zip(requests, work.outcomes(requests), strict=True)
    return [MeshRun(diameter=r.diameter, mesh=names[r.row], outcome=outcome) for r, outcome in told]


def _forces(rows: Sequence[MeshRun], at: Sequence[float], phases: int) -> Simulated:
    """Return the forces; sizes that failed at a diameter are left out.

    Raises
    ------
    RunsFailed
        If the study's own mesh or its places failed.
    """
    by_mesh: dict[str, list[Outcome]] = {}
    for row in rows:
        by_mesh.setdefault(row.mesh, []).append(row.outcome)
    for name in ("own", "phases"):
        for diameter, outcome in zip(at, by_mesh[name], strict=True):
            if outcome.force is None:
                raise RunsFailed(
                    f"mesh: the run at {diameter:g} mm ({name}) failed ({outcome.reason}): {outcome.message}"
                )
    placed = [outcome.phase_forces or () for outcome in by_mesh["phases"]]
    if any(len(found) != phases for found in placed):
        raise RunsFailed("mesh: the solver tells no force at each place of the mesh (details: phase_forces)")
    whole = [name for name in by_mesh if name not in ("own", "phases") and all(o.force for o in by_mesh[name])]
    sized = [[outcome.force or np.nan for outcome in by_mesh[name]] for name in whole]
    return Simulated(
        np.array([outcome.force for outcome in by_mesh["own"]], dtype=float),
        np.array(placed, dtype=float),
        np.array(sized, dtype=float).reshape(len(whole), len(at)).T,
        tuple(whole),
    )


def _notes(scatter: MeshScatter, sizes: Sequence[SizeFactor], rows: Sequence[MeshRun], diameters: int) -> list[str]:
    apart = 100.0 * (scatter.mean_factor - 1.0)
    shared = ""
    if diameters > 1:
        shared = f", {100.0 * scatter.common**0.5:.1f} % of it shared by all diameters"
    notes = [
        f"Over {scatter.placements} places of the mesh the force at the solution has a standard deviation of "
        f"{scatter.sd_percent:.1f} %{shared}; their mean is {_percent(apart)} the study's own mesh."
    ]
    notes += [
        f"Elements of {size.element_size} give a force {_percent(100.0 * (size.factor - 1.0))} the study's own: the "
        "calibrated values belong to their element size, and this is in no interval."
        for size in sizes
    ]
    failed = [f"{row.mesh} at {row.diameter:g} mm ({row.outcome.reason})" for row in rows if row.outcome.force is None]
    return notes + ([f"No force with elements of {joined(failed)}: left out."] if failed else [])


def _percent(apart: float) -> str:
    """Write how far a force is from another.

    >>> _percent(-4.31), _percent(0.02)
    ('4.3 % below', '0.0 % above')
    """
    return f"{abs(apart):.1f} % {'below' if apart < 0.0 else 'above'}"
