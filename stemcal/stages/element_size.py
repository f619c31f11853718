"""The failure strain for a given element size, in a mesh without internal length, where each element fails by itself.

The force then depends on the element size and on the position of the mesh under the edge. The loop of the refinement
searches the failure strain at which the mean force over several positions is the calibrated force. This is no stage: it
reads the calibrated study and writes run records only.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil, sqrt
from statistics import stdev

from stemcal.doe.calibration.search_path import Mover, SearchPath
from stemcal.drawing.table import Column, Table
from stemcal.errors import UsageError
from stemcal.formats import fixed, interval, significant
from stemcal.stages.fresh import calibrated_parameters
from stemcal.stages.loop import Loop, PathSteps
from stemcal.stages.result import Interval
from stemcal.stages.work import Work
from stemcal.study.model.study import Study
from stemcal.study.types.field_types import Length
from stemcal.version import code_version
from stemcal.vocabulary import FIRST

STAGE, _STRAIN = "material", "failure_strain"
# relative errors of the force: the search ends below _TOLERANCE; an element size is valid up to _VALID
_TOLERANCE, _VALID = 0.02, 0.05
_LOWEST, _HIGHEST = 1e-3, 2.0  # range of the failure strain
_FEWEST_POSITIONS, _MOST_POSITIONS = 5, 50
_MOST_RUNS = 12
_LONGER_STROKE = 3.0  # factor on the stroke: `without_lengths`, the same force requires a longer stroke
_FIRST_SLOPE = 0.5  # first estimate of ∂ ln(force)/∂ ln(failure strain)


@dataclass(frozen=True)
class SizedStrain:
    """The failure strain for one element size (mm), and the mean force over positions of the mesh.

    `aim` is the target force (N) at the diameter `condition` (mm), `levels` has the levels of all factors. `interval`
    is the 95 % confidence interval of the failure strain from the scatter over the positions (`sd_percent` of the mean
    force). The size is `valid` if the error of the mean force and its standard error are both at most 5 % of the aim.
    """

    condition: float
    aim: float
    levels: dict[str, float]
    element_size: float
    failure_strain: float
    interval: Interval | None
    force: float
    sd_percent: float | None
    positions: int
    runs: int
    valid: bool

    @property
    def positions_needed(self) -> int:
        """The number of positions with which the standard error of the mean is at most 5 %."""
        positions = ((self.sd_percent or 0.0) / (100.0 * _VALID)) ** 2
        return ceil(round(positions, 6))  # round-off must not add a position: 20 % requires 16


def without_lengths(study: Study) -> Study:
    """Return the study without internal length and edge spread; raise `UsageError` for other solvers or factors."""
    solver = study.solver
    if not study.kind.simulates_stems:
        raise UsageError(
            f"export material: the solver kind is `{solver.kind}`, but `embedded` is required. "
            "Write `solver: {kind: embedded}`."
        )
    if _STRAIN not in study.names:
        missing = f"{_STRAIN} is not a factor of this study. Add {_STRAIN} to the `factors` section."
        raise UsageError(f"export material: {missing}")
    sections = {
        "solver": solver.model_copy(update={"replicates": None}),
        "material": study.material.model_copy(update={"internal_length": Length(0.0)}),
        "blade": study.blade.model_copy(update={"edge_spread": Length(0.0)}),
        "loading": study.loading.longer(_LONGER_STROKE),
    }
    return study.model_copy(update=sections)


def strain_of(work: Work, size: float) -> SizedStrain:
    """Find the failure strain for an element size (mm), over as many mesh positions as the scatter requires."""
    there, levels = without_lengths(work.study), calibrated_parameters(work.study, work.solver, work.folder)
    positions, runs = _FEWEST_POSITIONS, 0
    with work.folder:
        while True:
            sized = _searched(work, there, levels, size, positions)
            runs += sized.runs
            enough = min(sized.positions_needed, _MOST_POSITIONS)
            if enough <= positions:
                return replace(sized, runs=runs)
            positions, levels = enough, {**levels, _STRAIN: sized.failure_strain}


def _searched(work: Work, there: Study, levels: Mapping[str, float], size: float, positions: int) -> SizedStrain:
    """Search for the failure strain at which the mean force over `positions` of the mesh has the target value."""
    from stemcal.solvers.embedded import Embedded, meshed_as  # slow to import; a table is shown without it

    meshed = meshed_as(there, size)
    placed = meshed.model_copy(update={"solver": meshed.solver.model_copy(update={"replicates": positions})})
    simulate = replace(work, study=placed, solver=Embedded(placed, random_offset=False)).simulating(STAGE)
    start, at, aim = levels[_STRAIN], there.calibration_target.condition, there.calibration_target.response
    path = SearchPath((Mover(_STRAIN, start, _LOWEST, _HIGHEST, _FIRST_SLOPE / start),))
    steps = PathSteps(path, levels, at, aim, aim)
    loop = Loop(steps, simulate, 100.0 * _TOLERANCE, _MOST_RUNS)
    loop.run()
    point = loop.best.point
    outcome = loop.responses(point.levels)[at]
    force, forces = outcome.number(FIRST), () if outcome.replicates is None else outcome.replicates.values
    share = stdev(forces) / force if len(forces) > 1 else None
    error = None if share is None else share / sqrt(len(forces))
    interval = None if error is None else steps.intervals(point, error, len(forces) - 1.0)[_STRAIN]
    return SizedStrain(
        condition=at,
        aim=aim,
        levels={**levels, _STRAIN: point.levels[_STRAIN]},
        element_size=size,
        failure_strain=point.levels[_STRAIN],
        interval=interval,
        force=force,
        sd_percent=None if share is None else 100.0 * share,
        positions=positions,
        runs=len(loop.runs),
        valid=error is not None and error <= _VALID and abs(force / aim - 1.0) <= _VALID,
    )


def strain_table(sized: SizedStrain) -> Table:
    """Return the table with the failure strain and the force."""
    columns = [
        Column("element_size", "Element size", "mm", significant),
        Column("failure_strain", "Failure strain", form=significant),
        Column("interval", "95 % interval", form=interval),
        Column("force", "Mean force", "N", significant),
        Column("sd_percent", "CV over positions", "%", fixed),
        Column("positions", "Positions", form=format),
        Column("runs", "Runs", form=format),
        Column("valid", "Valid", of=lambda row: "yes" if row.valid else "no"),
    ]
    foot = (
        f"The search ends at the first failure strain at which the mean force is within {100.0 * _TOLERANCE:g} % of "
        f"{sized.aim:.4g} N (stem diameter {sized.condition:g} mm). A failure strain is valid if the error and the "
        "standard error of the mean force are both below 5 %. The 95 % confidence interval of the failure strain is "
        "computed from the scatter of the force over mesh positions."
    )
    return Table.of(columns, [sized], "Failure strain for this element size", [foot])


def material_lines(study: Study, sized: SizedStrain) -> list[str]:
    """Return the comment lines at the head of the material card."""
    lines = [
        f"Stem material of the study {study.name}, calibrated with stemcal {code_version()}.",
        "Units: mm, tonne, s, N, MPa. Each element fails independently at the failure strain of this card.",
        f"The failure strain {sized.failure_strain:.4g} is valid only for an element size of {sized.element_size:g} "
        "mm.",
        f"For a stem diameter of {sized.condition:g} mm, the mean force over {sized.positions} mesh positions is "
        f"{sized.force:.4g} N (measured: {sized.aim:.4g} N).",
    ]
    if study.material.growing():
        only = f"so all values are valid only for a diameter of {sized.condition:g} mm."
        lines.append(f"Some parameters depend on the stem diameter, {only}")
    return lines


def not_valid(sized: SizedStrain) -> str:
    """Return the message that no valid failure strain was found for the element size, with a remedy."""
    return (
        f"--element-size: no valid failure strain was found for an element size of {sized.element_size:g} mm. The mean "
        f"force is {sized.force:.4g} N (target {sized.aim:.4g} N), with a coefficient of variation of "
        f"{sized.sd_percent or 0.0:.3g} % over {sized.positions} mesh positions. Choose another element size."
    )
