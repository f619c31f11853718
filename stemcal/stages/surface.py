"""The response surface: design rows → forces → regression, analysis of variance, and what stands beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar, TypeVar

import numpy as np

from stemcal.doe.calibration.inversion import Assessment, assess_point
from stemcal.doe.regression.anova import AnovaRow
from stemcal.doe.regression.canonical import Canonical, RidgePoint, analyse_shape, ridge_path
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.fit_statistics import Coefficient
from stemcal.doe.regression.gaussian_process import SecondOpinion, second_opinion
from stemcal.doe.regression.influence import RunDiagnostics
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.reduction import Reduction, Step, reduce_surface
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.doe.regression.transform import BoxCox, box_cox
from stemcal.doe.regression.within import Within, moderated_weights
from stemcal.errors import RunsFailed
from stemcal.executors.base import RunExecutor
from stemcal.files.rows import Rows, Table
from stemcal.files.typed import absent, inline, to_json
from stemcal.folder.store import StudyFolder
from stemcal.runs.answer import Watch, answer_all, ignore
from stemcal.runs.outcome import Outcome, outcome_of
from stemcal.runs.policy import censored_remarks
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.audit.cells import Audited, audit_surface, sentences
from stemcal.stages.base import stage_called
from stemcal.stages.climb import ClimbResult
from stemcal.stages.design import Design, design_radius, runs_of, surface_design, surface_factors
from stemcal.stages.result import (
    CodedScale,
    DesignRun,
    DesignRuns,
    Head,
    Interval,
    StageResult,
    head_of,
    leave,
    read_fresh,
    reasons_given,
)
from stemcal.stages.screen import ScreenResult
from stemcal.study.model import CodingEntry, Study

_RIDGE_POINTS = 5
_MOST_RUNS = 150  # beyond this a Gaussian process takes longer than it is worth
_ANOVA = ("source", "sum_of_squares", "df", "mean_square", "f", "p", "stars")
_BESIDE = ("value", "standard_error", "low", "high")
Further = Sequence[tuple[Array, float]]
AnswerAll = Callable[[Sequence[Request]], list[Answer]]


@dataclass(frozen=True)
class FactorCoding:
    """How a factor of the surface is coded, in its unit, and what it is called."""

    factor: str
    center: float
    half_step: float
    symbol: str = ""
    label: str = ""
    unit: str = "1"
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class ReductionSteps:
    """How terms were taken out or in."""

    method: str
    steps: tuple[Step, ...]
    dropped: tuple[str, ...]


@dataclass(frozen=True)
class Shape:
    """Stationary point (None where there is no single one) and principal axes of a surface."""

    coded: dict[str, float] | None
    natural: dict[str, float] | None
    predicted: float | None
    coded_radius: float | None
    inside: bool
    kind: str
    eigenvalues: tuple[float, ...]
    axes: tuple[dict[str, float], ...]


@dataclass(frozen=True)
class RidgeRow:
    """Where the surface is highest at a distance from the centre; no standard error of a saturated fit."""

    radius: float
    coded: dict[str, float]
    predicted: float
    standard_error: float | None


@dataclass(frozen=True)
class Opinions:
    """The quadratic against a Gaussian process through the same runs."""

    polynomial_predicted_r2: float | None
    process_predicted_r2: float | None
    largest_difference: float
    typical_difference: float


@dataclass(frozen=True)
class FitSummary:
    """What is kept of a fit beside the main one."""

    coefficients: Rows[Coefficient]
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    press: float | None
    cv_percent: float | None
    runs_failed: int


@dataclass(frozen=True, kw_only=True)
class DiameterRun:
    """One run of the surface's design at another diameter."""

    run: int
    outcome: Outcome = inline()
    weight: float | None = absent()


@dataclass(frozen=True, kw_only=True)
class AtDiameter:
    """The surface's design run at one diameter of a joint fit; `fit` is of the force, `responses` of the others."""

    diameter: float
    runs: Rows[DiameterRun]
    fit: FitSummary = inline()
    responses: dict[str, FitSummary] | None = absent()


@dataclass(frozen=True)
class Prediction:
    """What the surface says of a point: force and 95 % intervals, N; None where a saturated fit knows none."""

    force: float
    mean_interval: Interval | None
    prediction_interval: Interval | None
    inside: bool


Answered = DesignRun | DiameterRun
A = TypeVar("A", DesignRun, DiameterRun)


@dataclass(frozen=True, kw_only=True, repr=False)
class SurfaceResult(StageResult):
    """The force as a quadratic in the coded factors, with its analysis of variance, intervals and diagnostics."""

    name: ClassVar[str] = "rsm"

    head: Head = inline()
    names: tuple[str, ...]
    factors: Rows[FactorCoding]
    coding: dict[str, CodedScale]
    fixed: dict[str, float]
    radius: float
    design: DesignRuns
    coefficients: Rows[Coefficient]
    anova: Rows[AnovaRow]
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    adequate_precision: float | None
    press: float | None
    cv_percent: float | None
    lack_of_fit_testable: bool
    runs_failed: int
    runs_diagnostics: Rows[RunDiagnostics] = Rows()
    block_effects: dict[str, float] | None = absent()
    terms_dropped: tuple[str, ...] = absent(())
    error_source: str | None = absent()
    inestimable: str = "refuse"
    weights: str = "equal"
    reduction: ReductionSteps | None = absent()
    canonical: Shape | None = None
    ridge: Rows[RidgeRow] | None = None
    box_cox: BoxCox | None = None
    second_opinion: Opinions | None = None
    diameters: Rows[AtDiameter] = absent(Rows())
    pure_error_note: str | None = None
    published: Audited | None = None
    notes: tuple[str, ...] = ()

    # ---- the fit

    @cached_property
    def scales(self) -> Coding:
        """The coding of the factors, for many points at once."""
        entries = self.factors
        return Coding(
            tuple(e.factor for e in entries), tuple(e.center for e in entries), tuple(e.half_step for e in entries)
        )

    @cached_property
    def fitted(self) -> Surface:
        """The surface, fitted to the runs that the result lists."""
        return self.refitted(self.design.runs)

    def refitted(self, answered: Sequence[Answered], further: Further = (), response: str = "force") -> Surface:
        """Fit a surface of the same terms to a response of these runs, in the design's order, and `further` points."""
        runs, new = self.design.runs, len(further)
        coded = [[run.coded[name] for name in self.names] for run in runs] + [list(map(float, x)) for x, _ in further]
        found = [run.outcome.response(response) for run in answered]
        values = [float("nan") if value is None else value for value in found] + [value for _, value in further]
        blocks = [run.block for run in runs] if any(run.block is not None for run in runs) else None
        known = circumstances(blocks, answered, response, new)
        terms = [row.term for row in self.coefficients]
        return fit_surface(coded, values, self.names, terms, *known, drop=self.inestimable == "drop")

    def force_at(self, coded: Mapping[str, Any]) -> Any:
        """Evaluate the surface where the factors have these coded values, numbers or arrays; N."""
        values = np.broadcast_arrays(*(np.asarray(coded[name], dtype=float) for name in self.names))
        points = np.column_stack([value.ravel() for value in values])
        return (term_columns(points) @ self.beta).reshape(values[0].shape)

    @cached_property
    def beta(self) -> Array:
        """Coefficients of every term of the full quadratic, zero where a term is not there."""
        known = {row.term: row.value for row in self.coefficients}
        return np.array([known.get(term, 0.0) for term in term_names(self.names)])

    def predict(self, levels: Mapping[str, float]) -> Prediction:
        """Return the force at these levels (units of the spec; other factors are passed over) with its intervals."""
        point = self.scales.to_coded([levels[name] for name in self.names])
        found = assess_point(self.fitted, point, radius=self.radius)
        return Prediction(found.predicted, found.mean_interval, found.prediction_interval, found.inside)

    def assess(self, study: Study, coded: Array) -> Assessment:
        """Return what the surface says of a coded point, and whether it lies inside ranges and design."""
        return assess_point(self.fitted, coded, *box_of(study, self.scales), self.radius)

    # ---- what others read

    def coefficient(self, term: str) -> Coefficient | None:
        """Return a term's coefficient."""
        return next((row for row in self.coefficients if row.term == term), None)

    def anova_row(self, source: str) -> AnovaRow | None:
        """Return a line of the analysis of variance."""
        return next((row for row in self.anova if row.source == source), None)

    def factor(self, name: str) -> FactorCoding:
        """Return how a factor is coded."""
        return next(entry for entry in self.factors if entry.factor == name)

    def symbols(self) -> dict[str, str]:
        """Return the symbol of every factor, its name where it has none."""
        return {entry.factor: entry.symbol or entry.factor for entry in self.factors}

    def tables(self) -> dict[str, Table]:
        """Return the analysis of variance with the coefficients beside it, and the runs."""
        terms = {row.term: to_json(row) for row in self.coefficients}
        rows = [{"source": "1", **terms["1"]}, *({**to_json(row), **terms.get(row.source, {})} for row in self.anova)]
        return {"rsm": Table.of((*_ANOVA, *_BESIDE), rows), "rsm_runs": self.design.table()}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every run, those of a joint fit's diameters first."""
        for part in self.diameters:
            for answered in part.runs:
                yield f"rsm {answered.run} at {part.diameter:g} mm", answered.outcome
        for run in self.design.runs:
            yield f"rsm {run.run}", run.outcome

    def summary(self) -> str:
        """Tell the factors and how well the surface fits."""
        fit = "" if self.r2 is None else f", R² {self.r2:.4f}"
        return f"force over {', '.join(self.names)} from {len(self.design.runs)} runs{fit}"


# ---- the stage


def fit_response_surface(
    study: Study,
    folder: StudyFolder,
    executor: RunExecutor,
    watch: Watch = ignore,
    solver: Solver | None = None,
) -> SurfaceResult:
    """Run the design of the surface over the factors that matter and fit it."""
    solver = solver or make_solver(study)
    with folder:
        screening = read_before(study, solver, folder)
        head = head_of(study, solver, folder, "rsm")
        names, chosen = surface_factors(study, solver, screening)
        design = surface_design(recentred(study, screening), solver, names)
        requests = design.requests(study.targets.calibrate_at)
        answers = answer_all(requests, solver, folder, executor, watch, study.runs)
        runs = weighed(study, runs_of(design, requests, answers, solver).runs)
        with reasons_given(requests, answers):
            fit, reduction = fit_terms(study, design, runs)
        result, described = _result(study, head, design, DesignRuns(design.kind, Rows(runs)), fit, reduction)
        if study.joint_targets:
            answering = partial(answer_all, solver=solver, folder=folder, executor=executor, watch=watch)
            parts = run_diameters(study, result, design, solver, partial(answering, policy=study.runs))
            result = replace(result, diameters=Rows(parts))
        remarks = [result.pure_error_note] if result.pure_error_note and fit.lack_of_fit_testable else []
        reduced = [] if reduction is None else [reduction.describe()]
        notes = [*chosen, *reduced, *fit.notes, *described, *censored_remarks(answers), *remarks]
        return leave(folder, replace(result, notes=(*notes, *sentences(result.published))))


def _result(
    study: Study, head: Head, design: Design, runs: DesignRuns, fit: Surface, reduction: Reduction | None
) -> tuple[SurfaceResult, list[str]]:
    """Return the result without what other diameters add, and what the shape and the scale of the force say."""
    beside, described = shape_of(study, design, fit)
    middle = study.midlevels()
    entries = [_entry(study, design, j) for j in range(len(design.names))]
    return SurfaceResult(
        head=head,
        names=design.names,
        factors=Rows(entries),
        coding={e.factor: CodedScale(e.center, e.half_step) for e in entries},
        fixed={name: level for name, level in middle.items() if name not in design.names},
        radius=design_radius(study, len(design.names)),
        design=runs,
        coefficients=Rows(fit.coefficients),
        anova=Rows(fit.anova),
        r2=fit.r2,
        adjusted_r2=fit.adjusted_r2,
        predicted_r2=fit.predicted_r2,
        adequate_precision=fit.adequate_precision,
        press=fit.press,
        cv_percent=fit.cv_percent,
        lack_of_fit_testable=fit.lack_of_fit_testable,
        runs_failed=fit.runs_failed,
        runs_diagnostics=Rows(fit.runs_diagnostics),
        block_effects=fit.block_effects or None,
        terms_dropped=fit.terms_dropped,
        error_source=None if fit.error_source == "residual" else fit.error_source,
        inestimable=study.rsm.inestimable,
        weights=study.rsm.weights,
        reduction=None if reduction is None else ReductionSteps(reduction.method, reduction.steps, reduction.dropped),
        canonical=beside.canonical,
        ridge=beside.ridge,
        box_cox=beside.box_cox,
        second_opinion=beside.second_opinion,
        pure_error_note=error_remark(runs),
        published=audit_surface(study, fit.anova, fit.coefficients),
    ), described


def _entry(study: Study, design: Design, j: int) -> FactorCoding:
    factor, coding = study.factor(design.names[j]), design.coding
    return FactorCoding(
        factor.name,
        coding.centre[j],
        coding.half_step[j],
        factor.symbol,
        factor.label,
        factor.unit,
        factor.low,
        factor.high,
    )


def read_before(study: Study, solver: Solver, folder: StudyFolder) -> ScreenResult | ClimbResult | None:
    """Return the screening, or the climb, that the surface follows; None where the spec names its factors."""
    before = stage_called("rsm").needs(study)
    if before == "climb":
        return read_fresh(study, solver, folder, ClimbResult)
    return read_fresh(study, solver, folder, ScreenResult) if before else None


def recentred(study: Study, before: ScreenResult | ClimbResult | None) -> Study:
    """Return the study with the coding that a climb found; what the spec itself codes stays."""
    if not isinstance(before, ClimbResult):
        return study
    found = {name: CodingEntry(center=e.center, half_step=e.half_step) for name, e in before.coding.items()}
    return study.model_copy(update={"rsm": study.rsm.model_copy(update={"coding": {**found, **study.rsm.coding}})})


def weighed(study: Study, runs: Sequence[A]) -> list[A]:
    """Add to the runs the weight that their scatter over mesh phases gives them, if the spec asks for it."""
    if study.rsm.weights != "phases":
        return list(runs)
    told = [(run.outcome.sd, run.outcome.phases) for run in runs]
    weights = moderated_weights([np.nan if sd is None else sd for sd, _ in told], [m or 0 for _, m in told])
    return [replace(run, weight=float(weight)) for run, weight in zip(runs, weights, strict=True)]


def fit_terms(study: Study, design: Design, runs: Sequence[DesignRun]) -> tuple[Surface, Reduction | None]:
    """Fit the surface to runs as the spec asks; returns it, and how its terms were chosen if they were."""
    rsm, drop = study.rsm, study.rsm.inestimable == "drop"
    blocks = [run.block for run in runs] if any(run.block is not None for run in runs) else None
    known = circumstances(blocks, runs, "force")
    forces = [float("nan") if run.force is None else run.force for run in runs]
    if rsm.reduce == "none":
        return fit_surface(design.coded, forces, design.names, None, *known, drop=drop), None
    reduced = reduce_surface(design.coded, forces, design.names, rsm.reduce, rsm.reduce_alpha, *known, drop=drop)
    return reduced.surface, reduced


def circumstances(
    blocks: Sequence[str | None] | None, answered: Sequence[Answered], response: str, further: int = 0
) -> tuple[list[float] | None, list[str] | None, Within | None]:
    """Return weights, blocks and scatter of runs as `fit_surface` takes them.

    Points added later count to the last block, with the mean weight; their scatter is not counted.
    """
    apart = None if blocks is None else [block or "" for block in blocks] + [blocks[-1] or ""] * further
    weights = within = None
    if response == "force" and any(run.weight is not None for run in answered):
        weights = [1.0 if run.weight is None else run.weight for run in answered] + [1.0] * further
    if response == "force" and any(run.outcome.sd is not None for run in answered):
        within = _within([run.outcome for run in answered], further)
    return weights, apart, within


def _within(outcomes: Sequence[Outcome], further: int) -> Within:
    most = max(outcome.phases or 0 for outcome in outcomes)
    empty = (np.nan,) * most
    forces = [empty if o.phase_forces is None else o.phase_forces for o in outcomes] + [empty] * further
    same = all(len(values) == most for values in forces)
    return Within(
        np.array([np.nan if o.sd is None else o.sd for o in outcomes] + [np.nan] * further),
        np.array([o.phases or 0 for o in outcomes] + [0] * further),
        np.array(forces, dtype=float) if same else None,
    )


@dataclass(frozen=True)
class Beside:
    """What stands beside a surface: its shape, the scale its response asks for, a second opinion."""

    canonical: Shape
    ridge: Rows[RidgeRow]
    box_cox: BoxCox | None
    second_opinion: Opinions | None


def shape_of(study: Study, design: Design, surface: Surface) -> tuple[Beside, list[str]]:
    """Return the shape of a surface, the scale its response asks for and a second opinion, with notes."""
    shape = analyse_shape(surface)
    radii = np.linspace(0.0, design_radius(study, len(design.names)), _RIDGE_POINTS)
    kept = [term in surface.terms for term in term_names(surface.names)]
    scale = box_cox(term_columns(surface.design)[:, kept], surface.response)
    other = second_opinion(surface) if len(surface.design) <= _MOST_RUNS else None
    ridge = Rows(_ridge_row(design.coding, point) for point in ridge_path(surface, radii))
    notes = [shape.describe()]
    notes += [scale.sentence] if scale is not None and scale.advised != 1.0 else []
    notes += [other.sentence] if other is not None and other.warns else []
    return Beside(_shape(design.coding, shape), ridge, scale, _opinions(other)), notes


def _shape(coding: Coding, found: Canonical) -> Shape:
    point = found.point
    return Shape(
        None if point is None else coding.by_name(point),
        None if point is None else coding.by_name(coding.to_natural(point)),
        found.predicted,
        found.radius,
        found.inside,
        found.kind,
        tuple(found.eigenvalues.tolist()),
        tuple(coding.by_name(axis) for axis in found.axes.T),
    )


def _ridge_row(coding: Coding, point: RidgePoint) -> RidgeRow:
    return RidgeRow(point.radius, coding.by_name(point.coded), point.predicted, point.standard_error)


def _opinions(other: SecondOpinion | None) -> Opinions | None:
    if other is None:
        return None
    return Opinions(other.polynomial_q2, other.process_q2, other.largest_difference, other.typical_difference)


def error_remark(design: DesignRuns) -> str | None:
    """Say what repeated runs, or mesh phases within the runs, tell; None if there are neither.

    A solver that computes gives equal answers to equal inputs; repeated runs that differ were not equal.
    """
    if phases := max((run.outcome.phases or 1 for run in design.runs), default=1) - 1:
        return f"Every force is the mean over {phases + 1} places of the mesh; their scatter is the pure error."
    groups: dict[tuple[float, ...], list[float]] = {}
    for run in design.runs:
        if run.force is not None:
            groups.setdefault(tuple(run.coded.values()), []).append(run.force)
    repeated = [forces for forces in groups.values() if len(forces) > 1]
    if not repeated:
        return None
    widest = max(repeated, key=lambda forces: max(forces) - min(forces))
    if max(widest) - min(widest) <= 1e-9 * max(map(abs, widest)):
        return "Repeated runs agree exactly: the solver is deterministic, and there is no pure error."
    return (
        f"{len(widest)} runs at the same levels gave {min(widest):g} to {max(widest):g} N. A deterministic "
        "solver gives one force for one set of levels, so these runs differed in something not recorded."
    )


def box_of(study: Study, coding: Coding) -> tuple[Array, Array]:
    """Return the factors' low and high ends, coded."""
    factors = [study.factor(name) for name in coding.names]
    return coding.to_coded([f.low for f in factors]), coding.to_coded([f.high for f in factors])


# ---- further diameters


def run_diameters(
    study: Study, result: SurfaceResult, design: Design, solver: Solver, answer: AnswerAll
) -> list[AtDiameter]:
    """Run the design at every diameter of the joint fit and fit the surfaces there, of the same terms as `result`."""
    return [_at_diameter(study, target.diameter, result, design, solver, answer) for target in study.joint_targets]


def _at_diameter(
    study: Study, diameter: float, result: SurfaceResult, design: Design, solver: Solver, answer: AnswerAll
) -> AtDiameter:
    requests = design.requests(diameter)
    answers = answer(requests)
    runs = weighed(
        study,
        [
            DiameterRun(run=request.row + 1, outcome=outcome_of(request, given, solver))
            for request, given in zip(requests, answers, strict=True)
        ],
    )
    with reasons_given(requests, answers):
        told = {name: _summary(result, runs, name, diameter) for name in study.invert.responses}
    further: dict[str, FitSummary] = {name: fit for name, fit in told.items() if name != "force"}
    return AtDiameter(diameter=diameter, runs=Rows(runs), fit=told["force"], responses=further or None)


def _summary(result: SurfaceResult, runs: Sequence[DiameterRun], response: str, diameter: float) -> FitSummary:
    """Return what is kept of the fit to one response."""
    silent = [run.run for run in runs if run.outcome.ok and run.outcome.response(response) is None]
    if silent:
        raise RunsFailed(
            f"{diameter:g} mm: the record of run {silent[0]} tells no {response}: it was made by another version or "
            "solver; take another study folder (--out), or leave the response out of invert.responses"
        )
    fit = result.refitted(runs, response=response)
    return FitSummary(
        Rows(fit.coefficients),
        fit.r2,
        fit.adjusted_r2,
        fit.predicted_r2,
        fit.press,
        fit.cv_percent,
        fit.runs_failed,
    )
