"""The failure strain that a mesh without lengths takes: over element size, told by simulating such meshes.

Where elements fail each by itself the force belongs to their size. For each size the failure strain is sought with
which the mean force over some places of the mesh is the calibrated one; what the places scatter becomes a band. It is
no stage: it reads the calibrated study and leaves records only.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, exp, sqrt

import numpy as np

from stemcal.doe.calibration.transfer import Mover, Tried, Way, best_of, next_step
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.naming import FIRST
from stemcal.runs.answer import Progress, Watch, answer_all
from stemcal.runs.outcome import Outcome, outcome_of
from stemcal.solvers.protocol import Request
from stemcal.stages.validate.stage import calibrated_parameters
from stemcal.stages.work import Work
from stemcal.study.model import EmbeddedSolver, Study
from stemcal.study.types.lengths import Length

STAGE = "regularise"
STRAIN = "failure_strain"
# Where the search ends, and up to where a size is valid, as shares of the force.
TOLERANCE, VALID, _MOST_RUNS = 0.02, 0.05, 12
_ENDS = 3  # times that the ends of the band are run, each time farther out
# The stroke to the same force is longer there, times.
_STROKE = 3.0
# Of a mesh without lengths: force over failure strain, by logarithms, where nothing is known yet.
_FIRST_SLOPE = 0.5
LOWEST, HIGHEST, _LEAST_TILT = 1e-3, 2.0, 0.05


@dataclass(frozen=True)
class Regularised:
    """The failure strain for one element size (mm), and the force it gives over so many places of the mesh.

    `low` to `high` are the strains that the places would take each by itself; `bracketed` tells whether each place
    reaches the force between strains that were tried, inside the range of the search. The size is valid (`found`) if
    it is, and both the mean force and the standard error of that mean are within 5 % of the aim.
    """

    element_size: float
    failure_strain: float
    low: float | None
    high: float | None
    force: float
    sd_percent: float | None
    places: int
    runs: int
    bracketed: bool
    found: bool

    @property
    def se_percent(self) -> float | None:
        """The standard error of the mean force, percent of it."""
        return None if self.sd_percent is None else self.sd_percent / sqrt(self.places)

    @property
    def places_needed(self) -> int | None:
        """How many places the mean needs with such a scatter."""
        return None if self.sd_percent is None else ceil((self.sd_percent / (100.0 * VALID)) ** 2)


@dataclass(frozen=True)
class Regularisation:
    """Failure strain over element size at one stem diameter (mm), for the force `aim`; `levels` are all the others."""

    condition: float
    aim: float
    levels: dict[str, float]
    rows: Rows[Regularised]

    def row(self, size: float) -> Regularised:
        """Return the row of an element size."""
        return next(row for row in self.rows if row.element_size == size)


def without_lengths(study: Study) -> Study:
    """Return the study with elements that fail each by itself under a sharp edge, and the stroke they need.

    Raises
    ------
    UsageError
        If the study has no embedded solver, or no failure strain to be adjusted; or if it is calibrated to another.
    """
    solver = study.solver
    if not isinstance(solver, EmbeddedSolver):
        raise UsageError(f"export material needs `solver: {{kind: embedded}}`; this spec has kind {solver.kind}")
    if STRAIN not in study.names:
        raise UsageError(f"export material adjusts {STRAIN}, which is no factor of this study")
    sections = {
        "solver": solver.model_copy(update={"replicates": None}),
        "material": study.material.model_copy(update={"internal_length": Length(0.0)}),
        "blade": study.blade.model_copy(update={"edge_spread": Length(0.0)}),
        "loading": study.loading.model_copy(update={"duration": _STROKE * study.loading.duration}),
    }
    return study.model_copy(update=sections)


def regularise(work: Work, sizes: Sequence[float], places: int) -> Regularisation:
    """Find the failure strain for each element size (mm), the coarsest first: finer ones begin where it ended.

    Raises
    ------
    UsageError
        If the study is not calibrated yet.
    """
    study, there = work.study, without_lengths(work.study)
    levels, target = calibrated_parameters(study, work.solver, work.folder), study.calibration_target
    rows: list[Regularised] = []
    start = levels[STRAIN]
    with work.folder:
        for index, size in enumerate(sorted(sizes, reverse=True)):
            of_size = replace(work, watch=_of_size(work.watch, index, len(sizes)))
            if rows:  # the strain is that of an element: over half the length it is twice as large
                start = min(rows[-1].failure_strain * rows[-1].element_size / size, HIGHEST)
            rows.append(_at_size(of_size, there, {**levels, STRAIN: start}, target.response, size, places))
        work.watch(Progress(STAGE, len(sizes), len(sizes), 0, 0, None, counts="size"))
    return Regularisation(target.condition, target.response, levels, Rows(reversed(rows)))


def _at_size(work: Work, there: Study, levels: dict[str, float], aim: float, size: float, places: int) -> Regularised:
    """Search the failure strain at one size."""
    start, tried, outcomes = levels[STRAIN], list[Tried](), list[Outcome]()
    way = Way((Mover(STRAIN, start, LOWEST, HIGHEST, _FIRST_SLOPE / start),))
    place: float | None = 0.0
    while place is not None and len(tried) < _MOST_RUNS:
        outcomes.append(_simulated(work, there, {**levels, **way.at(place)}, size, places, len(tried)))
        tried.append(Tried(place, outcomes[-1].number(FIRST)))
        if abs(tried[-1].response / aim - 1.0) <= TOLERANCE:
            break
        step = next_step(tried, aim, way)
        place = None if step is None else step.place
    best = best_of(tried, aim)
    if best is None:
        raise RunsFailed(f"export material: no run with elements of {size:g} mm succeeded: {outcomes[-1].message}")
    outcome, strain = outcomes[tried.index(best)], way.at(best.place)[STRAIN]
    strains = [way.at(one.place)[STRAIN] for one in tried]
    for _ in range(_ENDS):  # the ends of the band are run too: beyond what was tried they are a guess
        for end in _band(strains, outcomes, aim):
            if end is not None and end not in strains:
                outcomes.append(_simulated(work, there, {**levels, STRAIN: end}, size, places, len(strains)))
                strains.append(end)
        low, high = _band(strains, outcomes, aim)
        inside = low is not None and high is not None and low > LOWEST and high < HIGHEST
        if bracketed := inside and _bracketed(outcomes, aim):
            break
    percent = None if outcome.sd is None else 100.0 * outcome.sd / best.response
    row = Regularised(size, strain, low, high, best.response, percent, places, len(strains), bracketed, found=False)
    error, least = row.se_percent, 100.0 * VALID
    right = abs(best.response / aim - 1.0) <= VALID
    return replace(row, found=right and bracketed and error is not None and error <= least)


def _simulated(work: Work, there: Study, levels: dict[str, float], size: float, places: int, row: int) -> Outcome:
    """Simulate one failure strain at some places of a mesh."""
    from stemcal.solvers.embedded import Embedded  # a curve is shown without the solver

    solver = Embedded(there)
    at = there.targets.calibrate_at
    request = Request(STAGE, row, levels, at, phases=places, element_size=f"{size:g} mm")
    policy = there.runs.model_copy(update={"quorum": 0.0, "keep_going": True})
    (answer,) = answer_all([request], solver, work.folder, work.executor, work.watch, policy)
    return outcome_of(request, answer, solver)


def _band(strains: Sequence[float], outcomes: Sequence[Outcome], aim: float) -> tuple[float | None, float | None]:
    """Return the least and the largest strain that a place takes by itself, by its forces over all strains tried."""
    runs = sorted((strain, o.phase_responses) for strain, o in zip(strains, outcomes, strict=True) if o.phase_responses)
    if not runs:
        return None, None
    x = np.log([strain for strain, _ in runs])
    each = [_crossing(x, np.log(np.array(forces) / aim)) for forces in zip(*(f for _, f in runs), strict=True)]
    return max(exp(min(each)), LOWEST), min(exp(max(each)), HIGHEST)


def _bracketed(outcomes: Sequence[Outcome], aim: float) -> bool:
    """Tell whether every place has the force between strains tried, or as near at one as the search goes."""
    forces = [outcome.phase_responses for outcome in outcomes if outcome.phase_responses]
    if not forces:
        return False
    least, most = 1.0 - TOLERANCE, 1.0 + TOLERANCE
    return all(min(each) <= most * aim and max(each) >= least * aim for each in zip(*forces, strict=True))


def _of_size(watch: Watch, index: int, sizes: int) -> Watch:
    """Return what tells of a run as one of its size: how many runs a size needs is not known before."""

    def tell(progress: Progress) -> None:
        watch(replace(progress, done=index, total=sizes, cached=0, failed=0, counts="size"))

    return tell


def _crossing(x: Array, y: Array) -> float:
    """Return where a line through points of rising x crosses zero, going on beyond them with the slope at that end."""
    above = np.nonzero(y >= 0.0)[0]
    at = int(above[0]) if len(above) else len(y)
    if 0 < at < len(y):
        return float(x[at - 1] - y[at - 1] * (x[at] - x[at - 1]) / (y[at] - y[at - 1]))
    end, near = (0, 1) if at == 0 else (-1, -2)
    slope = (y[end] - y[near]) / (x[end] - x[near]) if len(x) > 1 else _FIRST_SLOPE
    return float(x[end] - y[end] / max(slope, _LEAST_TILT * _FIRST_SLOPE))
