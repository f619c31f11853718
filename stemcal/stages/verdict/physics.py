"""Doubts about the physical validity of runs, from the checks in their records, and remedies for them."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf
from typing import Any, Literal

import numpy as np

from stemcal.cutting.checks import MOST_DRIFT, MOST_HOURGLASS, MOST_INERTIA, NEGLIGIBLE_MASS
from stemcal.formats import outwards, series
from stemcal.notes import Remedy
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.results import Results
from stemcal.stages.stage import stage_called
from stemcal.study.model.study import Study
from stemcal.vocabulary import NOWHERE

DoubtKind = Literal["hourglass", "inertia", "drift", "stroke"]
_Doubts = dict[DoubtKind, float | None]
LIMITS: dict[DoubtKind, float] = {"hourglass": MOST_HOURGLASS, "inertia": MOST_INERTIA, "drift": MOST_DRIFT}
_DETAILS: dict[DoubtKind, str] = {
    "hourglass": "hourglass_ratio_percent",
    "inertia": "inertia_percent",
    "drift": "energy_drift_percent",
}
MOST_DOUBTFUL = 0.1  # share of doubtful runs from which they are reported
WARNED = frozenset({"hourglass_energy", "inertia_in_force", "energy_drifts", "stroke_too_short"})
"""Kinds of warnings of single runs that the verdict reports as doubts."""


@dataclass(frozen=True)
class Doubt:
    """A reason to doubt the simulation of some runs, such as a large kinetic energy.

    `worst` is the worst value in percent, None for a stroke that is too short; `condition` and `fitted` describe a
    calibrated run. The remedy brings runs down to the value `aim`; fewer than `MOST_DOUBTFUL` runs may stay doubtful.
    """

    kind: DoubtKind
    runs: int
    worst: float | None
    condition: float = NOWHERE
    fitted: bool = False
    aim: float | None = None


@dataclass(frozen=True)
class Physics:
    """Numbers of checked and of doubtful runs; doubts about any of them, and about the runs `at_solution`."""

    checked: int
    doubtful: int
    doubts: tuple[Doubt, ...]
    at_solution: tuple[Doubt, ...] = ()

    @property
    def share(self) -> float:
        return self.doubtful / self.checked if self.checked else 0.0


def physics_of(study: Study, results: Results, folder: StudyFolder) -> Physics:
    """Return the doubts about the runs of the study's own solver; runs without checks are not counted."""
    own = [result for result in results.done if stage_called(result.name).seen(study) is study]
    outcomes = [outcome for result in own for _, outcome in result.runs()]
    keys = dict.fromkeys(outcome.key for outcome in outcomes if outcome.key and outcome.ok)
    contents = {key: content for key in keys if (content := folder.peek(key)) is not None}
    every = {key: doubts for key, content in contents.items() if (doubts := _doubts(content["details"])) is not None}
    checked = list(every.values())
    compared = {row.key: row for result in results.done for row in reversed(result.judged(study))}
    sizes: dict[DoubtKind, list[float | None]] = defaultdict(list)
    for kind, size in (pair for doubts in checked for pair in doubts.items()):
        sizes[kind].append(size)
    spared = max(ceil(MOST_DOUBTFUL * len(checked)) - 1, 0)  # number of runs that may stay doubtful
    gathered = []
    for kind, each in sizes.items():
        worst = sorted(filter(None, each), reverse=True)
        aim = worst[min(spared, len(worst) - 1)] if worst else None
        gathered.append(Doubt(kind, len(each), max(worst, default=None), aim=aim))
    return Physics(
        checked=len(checked),
        doubtful=sum(bool(doubts) for doubts in checked),
        doubts=tuple(sorted(gathered, key=lambda doubt: (-doubt.runs, doubt.kind))),
        at_solution=tuple(
            Doubt(kind, 1, size, row.condition, row.fitted)
            for key, row in reversed(compared.items())
            for kind, size in every.get(key, {}).items()
        ),
    )


def _doubts(details: Mapping[str, Any]) -> _Doubts | None:
    """Return the doubts about a run with their values; None if the solver reports no checks."""
    sizes = {kind: details[name] for kind, name in _DETAILS.items() if isinstance(details.get(name), int | float)}
    if not sizes and "stroke_was_enough" not in details:
        return None
    if details.get("added_mass_percent", inf) <= NEGLIGIBLE_MASS:
        sizes.pop("inertia", None)  # without added mass, inertia is a physical part of the force
    doubts: _Doubts = {kind: value for kind, value in sizes.items() if value > LIMITS[kind]}
    return doubts | ({"stroke": None} if details.get("stroke_was_enough") is False else {})


_SAFELY = 0.5  # share of a limit at which a remedy aims, because runs of a study scatter
_MOST_TIMES = 12.0  # finer elements are recommended if they increase the run time at most by this factor
_INPUT: dict[DoubtKind, str] = {
    "inertia": "less mass scaling or a slower blade",
    "hourglass": "a finer mesh or fully integrated elements",
    "drift": "a smaller time step",
    "stroke": "a longer stroke",
}


def for_physics(study: Study, doubt: Doubt, every: Sequence[Doubt] = ()) -> Remedy:
    """Return the remedy for a doubt; the remedy is strong enough for all doubts of this kind in `every`."""
    solver: Any = study.solver
    size = max(_aim(each) for each in (doubt, *every) if each.kind == doubt.kind)
    part = min(_part_of_step(each) for each in (doubt, *every))
    if not study.kind.simulates_stems:
        return Remedy(f"Use {_INPUT[doubt.kind]} in the solver input.")
    match doubt.kind:
        case "inertia":
            return _inertia(solver, size, part)
        case "hourglass":
            return _hourglass(solver, size, part)
        case "drift":  # halve the safety factor and a fixed time step
            safety = outwards(0.5 * solver.time_step_safety, False)
            values = {"time_step_safety": f"{safety:g}", **_time_step(solver, part)}
            return _in_solver(values, "to halve the time step.")
        case "stroke":
            ((key, value),) = study.loading.longer(2.0).written.items()
            edit = _edit("loading", **{key: value})
            return Remedy(f"Set `{key}: {value}` under `loading` to double the stroke.", edit)


def _aim(doubt: Doubt) -> float:
    return doubt.aim or doubt.worst or 0.0


def _part_of_step(doubt: Doubt) -> float:
    """Return the factor by which a fixed time step is multiplied so that a doubt is below its limit."""
    worst = _aim(doubt)
    match doubt.kind:
        case "inertia":
            return _SAFELY * LIMITS["inertia"] / worst
        case "hourglass" if (finer := worst / LIMITS["hourglass"]) ** 4 <= _MOST_TIMES:
            return 1.0 / finer
        case "drift":
            return 0.5
    return 1.0


def _edit(section: str, **values: str) -> str:
    """Return keys of a section as a YAML fragment.

    >>> _edit("solver", mass_scaling="2000", time_step="17 us")
    'solver: {mass_scaling: 2000, time_step: 17 us}'
    """
    return f"{section}: {{{', '.join(f'{key}: {value}' for key, value in values.items())}}}"


def _in_solver(values: Mapping[str, str], effect: str) -> Remedy:
    """Return the remedy to set keys of the solver; `effect` completes its sentence."""
    keys = series(f"`{key}: {value}`" for key, value in values.items())
    return Remedy(f"Set {keys} under `solver` {effect}", _edit("solver", **values))


def _inertia(solver: Any, worst: float, part: float) -> Remedy:
    """Return the remedy of less mass scaling: the blade then excites oscillations well below the limit.

    A body of stiffness k and mass m that is struck at the speed V oscillates with the force V √(k m). The share of
    inertia is therefore proportional to the root of the mass; the mass required by a fixed time step is proportional to
    its square.
    """
    limit = LIMITS["inertia"]
    swing = _SAFELY * limit / worst
    scaling = outwards(max(solver.mass_scaling * swing**2, 1.0), False)
    values = {"mass_scaling": f"{scaling:g}", **_time_step(solver, part)}
    effect = f"to reduce the contribution of inertia to below {limit:g} % of the force in most runs."
    return _in_solver(values, f"{effect} The runs then take about {outwards(1.0 / part, True):g} times as long.")


def _time_step(solver: Any, part: float) -> dict[str, str]:
    """Return the key for the solver's fixed time step times `part`, rounded down; {} if the step is not fixed."""
    if solver.time_step is None:
        return {}
    return {"time_step": f"{outwards(1e6 * solver.time_step * part, False):g} us"}


def _hourglass(solver: Any, worst: float, part: float) -> Remedy:
    """Return the remedy of smaller elements: the hourglass energy falls at least in proportion to their size.

    Elements smaller by a factor a are a³ times as many and need a times as many steps; a fixed time step is reduced.
    """
    limit, size = LIMITS["hourglass"], solver.element_size
    finer = worst / limit
    if finer**4 > _MOST_TIMES:
        return Remedy(
            f"Use much smaller elements or another mesh (hourglass energy: {worst:.0f} % of the internal energy, "
            f"{finer:.1f} times the limit)."
        )
    new = f"d/{np.ceil(finer * size.divisor):g}" if size.divisor else f"{outwards(size.mm / finer, False):g} mm"
    values = {"element_size": new, **_time_step(solver, part)}
    effect = f"to reduce the hourglass energy to below about {limit:g} % of the internal energy."
    return _in_solver(values, f"{effect} The runs then take about {outwards(finer**4, True):g} times as long.")
