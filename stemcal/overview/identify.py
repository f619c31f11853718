"""Which test to buy: how narrow each parameter's interval would become, foretold before anything is measured.

The responses are simulated at mid-levels, and with one factor at a time a half step of the surface's design lower and
higher: 2k + 1 runs at a condition, whose central differences give slopes and curvatures. As if a laboratory had
measured just what mid-levels give, with the scatter of the targets, the parameters are fitted to every combination of
tests as the calibration fits them, so the intervals are of its kind and end where the ranges end.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from stemcal.doe.calibration.misfit import Observation, misfit_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.d_optimal import d_optimal_shares, log_determinant
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.rows import Rows
from stemcal.measured.curve_modes import CurveModes, most_modes
from stemcal.notes import Note
from stemcal.overview.plan import surface_names
from stemcal.runs.outcome import Outcome
from stemcal.solvers import make_solver
from stemcal.stages.design import design_radius, surface_coding
from stemcal.stages.invert.certainty import certainty_of, priors_of
from stemcal.stages.surface.result import region_in
from stemcal.stages.work import Work, needs_simulation
from stemcal.study.model import LaboratoryMeans, LaboratorySection, Study
from stemcal.study.model.laboratory_tests import BEFORE_MAXIMUM
from stemcal.study.model.measured_targets import named_modes

CUTTING = "cutting"
SPECIMENS = (5, 10, 20)
ASSUMED_CV = 0.1
"""Coefficient of variation of a response, where the spec has no scatter at all."""
_EVERY_SUBSET = 4  # tests beside the first of which every combination is tried; of more, pairs and all together


@dataclass(frozen=True)
class Step:
    """The levels at which a factor was tried, in its unit."""

    factor: str
    unit: str
    low: float
    middle: float
    high: float


@dataclass(frozen=True)
class Expected:
    """The 95 % interval that a parameter would have, in its unit, and its share of the range: from a half on, free."""

    factor: str
    expected_low: float
    expected_high: float
    share: float
    free: bool


@dataclass(frozen=True)
class Combination:
    """What so many specimens of each test would tell; `loosest` is what changes together, told least, by factor.

    It is empty where every parameter is told.
    """

    tests: tuple[str, ...]
    conditions: tuple[float, ...]
    specimens: int
    parameters: Rows[Expected]
    loosest: dict[str, float]


@dataclass(frozen=True)
class Allotted:
    """The share of all specimens that a test at a condition has in the D-optimal division."""

    test: str
    condition: float
    share: float


class ScatterAssumed(Note):
    """Responses without a scatter in the spec count with this coefficient of variation, per cent."""

    responses: tuple[str, ...]
    percent: float


class MaximumOutOfReach(Note):
    """Responses that do not count: the stroke of their test ends before its maximum is passed."""

    responses: tuple[str, ...]


@dataclass(frozen=True)
class Identified:
    """What combinations of tests would tell, by so many `runs`, 2k + 1 at each condition.

    `division` makes the determinant of the information greatest;
    an even one is worth `even_percent` of its specimens.
    """

    schema_version: int
    stage: str
    study: str
    runs: int
    steps: Rows[Step]
    combinations: Rows[Combination]
    division: Rows[Allotted]
    even_percent: float
    notes: tuple[Note, ...]


@dataclass(frozen=True, eq=False)
class Measurable:
    """A response that a test at a condition may measure: its local surface, and its coefficient of variation."""

    test: str
    condition: float
    response: str
    surface: Surface
    variation: float
    specimens: str = ""
    systematic: Mapping[str, float] = field(default_factory=dict)

    def measured(self, specimens: int) -> Observation:
        """Return it as measured over so many specimens whose mean is what mid-levels give; by itself without modes."""
        value = float(self.surface.beta[0])
        told = self.response, self.specimens if most_modes(specimens) else "", self.systematic
        return Observation(self.surface, value, self.variation * abs(value), specimens, *told)

    def information(self, errors: Sequence[str] = ()) -> Array:
        """Return what one specimen tells of the k coded factors and m errors that all share, (k + m, k + m).

        It is the outer product of slopes in standard errors.
        """
        slopes = self.surface.gradient(np.zeros(len(self.surface.names)))
        moved = [self.systematic.get(name, 0.0) for name in errors]
        in_errors = np.append(slopes, moved) / (self.variation * self.surface.beta[0])
        return np.outer(in_errors, in_errors)


def identify(work: Work, specimens: Sequence[int] = SPECIMENS) -> Identified:
    """Simulate what the foretelling needs and return what each combination of tests would tell.

    Parameters
    ----------
    specimens : sequence of int
        Numbers of specimens of each test at each condition, one after the other.

    Raises
    ------
    UsageError
        If a screening has still to choose the factors, or the solver cannot simulate.
    RunsFailed
        If one of the runs fails.
    """
    study = work.study
    needs_simulation("plan --identify", study, work.solver)
    names = surface_names(study, work.solver, work.folder)
    if names is None:
        raise UsageError("plan --identify: name the factors in rsm.factors, or run `stemcal screen SPEC` before it")
    coding = surface_coding(study, names)
    conditions = _conditions(study)
    points = central_differences(len(names))
    runs = _simulated(work, coding, points, conditions)
    found, notes = _measurable(work, coding, points, runs)
    region = region_in(study, coding, design_radius(study, len(names)))
    told = [
        _told(study, coding, region, chosen, n)
        for chosen in _subsets(found, study.targets.calibrate_at)
        for n in specimens
    ]
    return Identified(
        1,
        "identify",
        study.name,
        len(points) * len(conditions),
        Rows(
            Step(name, study.factor(name).unit, c - h, c, c + h)
            for name, c, h in zip(names, coding.centre, coding.half_step, strict=True)
        ),
        Rows(told),
        *divided(found, region, max(specimens)),
        tuple(notes),
    )


def _conditions(study: Study) -> list[float]:
    """Return where there may be measured: several tests where they are fitted, one wherever it has targets."""
    fitted = [target.condition for target in study.joint_targets] or [study.targets.calibrate_at]
    return fitted if study.tests else [target.condition for target in study.targets.means]


def central_differences(k: int) -> Array:
    """Return the centre, and each factor a half step to either side, (2k + 1, k) coded."""
    return np.vstack([np.zeros((1, k)), -np.eye(k), np.eye(k)])


def _simulated(work: Work, coding: Coding, points: Array, conditions: Sequence[float]) -> dict[float, list[Outcome]]:
    """Return the outcomes at the points, by condition."""
    study = every_test_measured(work.study, conditions)
    levels = coding.runs(points, study.midlevels())
    solver = work.solver if study is work.study else make_solver(study)
    simulate = replace(work, study=study, solver=solver).simulating("identify")
    found = simulate(0, levels, conditions)
    if failed := next((outcome for outcome in found if not outcome.ok), None):
        raise RunsFailed(f"plan --identify: a run failed: {failed.message or failed.reason}; narrow the ranges")
    return {at: found[i :: len(conditions)] for i, at in enumerate(conditions)}


def every_test_measured(study: Study, conditions: Sequence[float]) -> Study:
    """Return the study as if what a test usually tells had been measured wherever a test has no targets."""
    tests = tuple(test if test.targets else _measured(test, conditions) for test in study.tests)
    return study.model_copy(update={"tests": tests})


def _measured(test: LaboratorySection, conditions: Sequence[float]) -> LaboratorySection:
    told: dict[str, Any] = dict.fromkeys(test.told, 1.0)
    means = [LaboratoryMeans.model_construct(diameter=at, **told) for at in conditions]
    return test.model_copy(update={"targets": tuple(means)})


def _measurable(
    work: Work, coding: Coding, points: Array, runs: Mapping[float, Sequence[Outcome]]
) -> tuple[list[Measurable], list[Note]]:
    """Return what may be measured, and what was assumed of it."""
    beyond = {name for outcomes in runs.values() for name in _beyond_stroke(work, outcomes[0])}
    places = [(at, *named) for at in runs for named in _responses(work.study, at) if named[1] not in beyond]
    scatter = {response: _variation(work.study, response) for _, _, response in places}
    typical = next((cv for cv in scatter.values() if cv), ASSUMED_CV)
    targets = {target.condition: target for target in work.study.targets.means}
    found = [
        Measurable(
            test,
            at,
            response,
            local_surface(points, [outcome.number(response) for outcome in runs[at]], coding.names),
            scatter[response] or typical,
            *((target.specimens_of(response), target.systematic_of(response)) if (target := targets.get(at)) else ()),
        )
        for at, test, response in places
    ]
    bare = tuple(response for response, cv in scatter.items() if not cv)
    notes: list[Note] = [ScatterAssumed(bare, 100.0 * typical)] if bare else []
    return found, [*notes, *([MaximumOutOfReach(tuple(sorted(beyond)))] if beyond else [])]


def _beyond_stroke(work: Work, outcome: Outcome) -> set[str]:
    """Return the responses of tests without targets that are bounds: the stroke ends before the maximum is passed."""
    record = work.folder.peek(outcome.key) or {"details": {}}
    told = record["details"].get("laboratory", {})
    return {
        test.called(response)
        for test in work.study.tests
        if not test.targets and any(one["kind"] == "maximum_not_passed" for one in told[test.name]["warnings"])
        for response in test.told
        if response not in BEFORE_MAXIMUM
    }


def _responses(study: Study, condition: float) -> Iterator[tuple[str, str]]:
    """Yield the test and the name of every response that may be measured at a condition."""
    for response in study.invert.responses:
        if not study.test_of(response):
            stem = study.naming.is_cutting or bool(study.tests) or bool(study.targets.modes)
            yield (CUTTING if stem else study.naming.named(response).name), response
    for test in study.tests:
        for response in test.means_at(condition) if test.targets else test.told:
            yield test.name, test.called(response)


def _variation(study: Study, response: str) -> float | None:
    """Return the coefficient of variation of a response, pooled over its targets; None where they have no scatter."""
    means = [target.mean_of(response) for target in study.targets.means]
    squares = [(sd / mean) ** 2 for mean, sd in means if mean and sd]
    return float(np.sqrt(np.mean(squares))) if squares else None


def local_surface(points: Array, values: Sequence[float], names: Sequence[str]) -> Surface:
    """Return the quadratic through central differences; factors act by their products, as in a power law.

    βᵢⱼ = βᵢβⱼ/β₀: if each by itself changes a response by a share of it, both together change it by both shares.
    """
    alone = fit_surface(points, values, names, [*names, *(f"{name}^2" for name in names)])
    beta, k = alone.beta.copy(), len(names)
    products = [beta[1 + i] * beta[1 + j] / beta[0] for i, j in combinations(range(k), 2)]
    beta[1 + k : 1 + k + len(products)] = products
    return replace(alone, beta=beta)


def _subsets(found: Sequence[Measurable], calibrate_at: float) -> list[list[Measurable]]:
    """Return the combinations: the first test alone and with others; of a single test, its conditions so."""
    by_test = len({one.test for one in found}) > 1
    labels = [one.test if by_test else one.condition for one in found]
    first = found[0].test if by_test else calibrate_at
    others = [label for label in dict.fromkeys(labels) if label != first]
    sizes = range(len(others) + 1) if len(others) <= _EVERY_SUBSET else (0, 1, 2, len(others))
    return [
        [one for one, label in zip(found, labels, strict=True) if label in (first, *chosen)]
        for size in sizes
        for chosen in combinations(others, size)
    ]


def told_by(found: Sequence[Measurable], modes: Iterable[CurveModes], specimens: int) -> list[Measurable]:
    """Return what so many specimens tell: of their curves no more modes than a laboratory of so many would find."""
    beyond = {named.name for named in named_modes(modes)[most_modes(specimens) :]}
    return [one for one in found if one.response not in beyond]


def _told(study: Study, coding: Coding, region: Region, found: Sequence[Measurable], specimens: int) -> Combination:
    """Return what a combination would tell, by the profiles of the fit to it."""
    kept = told_by(found, study.targets.modes.values(), specimens)
    misfit = replace(misfit_of([one.measured(specimens) for one in kept], region), foretold=True)
    misfit = misfit.with_priors(priors_of(study, coding), region)
    known = certainty_of(study, coding, misfit, region, "joint", np.zeros(region.k))
    return Combination(
        tuple(dict.fromkeys(one.test for one in found)),
        tuple(dict.fromkeys(one.condition for one in found)),
        specimens,
        Rows(Expected(name, *known.intervals[name], known.share[name], name in known.free) for name in coding.names),
        known.loosest,
    )


def divided(found: Sequence[Measurable], region: Region, specimens: int) -> tuple[Rows[Allotted], float]:
    """Return the D-optimal division of so many specimens a place, and what an even one is worth of it, per cent.

    What the ranges tell counts beside: that of an even distribution, whose variance is width²/12. The testing machine,
    which more specimens do not average away, is a parameter of its own, 0 ± 1, that is not asked for.
    """
    places = list(dict.fromkeys((one.test, one.condition) for one in found))
    errors = sorted({name for one in found for name in one.systematic})
    each = np.array(
        [sum(one.information(errors) for one in found if (one.test, one.condition) == place) for place in places]
    )
    low, high = region.bounds()
    known = np.diag(np.append(12.0 / (high - low) ** 2, np.ones(len(errors))))
    told, beside = specimens * len(places) * each, len(errors)
    shares = d_optimal_shares(told, known, beside)
    best, even = (
        log_determinant(np.tensordot(w, told, 1) + known, beside)
        for w in (shares, np.full_like(shares, 1 / len(shares)))
    )
    rows = Rows(Allotted(*place, float(share)) for place, share in zip(places, shares, strict=True))
    return rows, float(100.0 * np.exp((even - best) / region.k))
