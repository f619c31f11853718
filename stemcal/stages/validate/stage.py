"""The validation as a stage: whatever was measured is simulated with the calibrated parameters and compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stemcal.doe.validation.comparison import Validation, ValidationRow, compare_conditions
from stemcal.doe.validation.discrepancy import Discrepancy, ScaledPrediction, corrected, discrepancy, needed
from stemcal.doe.validation.null_model import formula_elsewhere
from stemcal.files.rows import Rows
from stemcal.folder.study_folder import StudyFolder
from stemcal.notes import Note
from stemcal.runs.outcome import Outcome, lower_bounds
from stemcal.runs.replicates import Scatter, merged, pooled, repeated
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.fresh import read_fresh
from stemcal.stages.invert.certainty import measured_of, misfit_over
from stemcal.stages.invert.joint import joint_surfaces, measured_means
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import Head
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate.result import (
    FromTable,
    FurtherRow,
    RangesChosenAfter,
    TooFewForDiscrepancy,
    ValidateResult,
    ValidateRow,
)
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import Study, Target


@a_stage(ValidateResult)
def validate(work: Work, head: Head) -> ValidateResult:
    """Simulate at every measured condition with the calibrated parameters."""
    parameters = calibrated_parameters(work.study, work.solver, work.folder)
    study, solver = work.study, work.solver
    requests = requests_at(study, parameters)
    answers = work.answers(requests)
    outcomes = merged(work.outcomes(requests, answers), study.replicates)
    found = _compared(study, outcomes, _scatter_of(outcomes))
    missed = _missed(work, found.rows)
    rows = _rows(study, found.rows, outcomes, missed)
    notes = [*found.notes, *_stage_notes(study, solver, missed), *lower_bounds(answers)]
    return _result(study, head, parameters, found, missed, rows, notes)


def _scatter_of(outcomes: Sequence[Outcome]) -> tuple[float, float] | None:
    """Return the relative scatter of simulated forces over their replicates, and its df."""
    found = pooled(outcomes)
    return None if found is None else (found.share, found.df)


def _compared(study: Study, outcomes: Sequence[Outcome], scatter: tuple[float, float] | None) -> Validation:
    targets = study.targets.means
    return compare_conditions(
        [target.condition for target in targets],
        [target.response for target in targets],
        [outcome.response for outcome in outcomes],
        [target.condition for target in study.joint_targets] or study.targets.calibrate_at,
        [(target.sd, target.n) for target in targets],
        study.targets.equivalent_within_percent,
        scatter,
        study.naming,
    )


@dataclass(frozen=True)
class _Missed:
    """What the model misses, if that is asked for: measured over simulated at the fitted diameters, and its scale.

    `seen` counts the directions of the parameters that these see.
    """

    asked: Literal["none", "scale", "process"]
    ratios: Mapping[float, float]
    seen: int
    scale: Discrepancy | None


def _missed(work: Work, compared: Sequence[ValidationRow]) -> _Missed:
    asked = work.study.invert.discrepancy
    ratios = {} if asked == "none" else _ratios(compared)
    seen = _directions_seen(work) if ratios else 1
    return _Missed(asked, ratios, seen, discrepancy(ratios, seen, smooth=asked == "process"))


def _rows(
    study: Study,
    compared: Sequence[ValidationRow],
    outcomes: Sequence[Outcome],
    missed: _Missed,
) -> list[ValidateRow]:
    scatters = {named.name: pooled(outcomes, named.name) for named in study.naming.further}
    return [
        replace(_row(study, target, row, outcome, scatters), corrected=_corrected(row, missed))
        for target, row, outcome in zip(study.targets.means, compared, outcomes, strict=True)
    ]


def _result(
    study: Study,
    head: Head,
    parameters: dict[str, float],
    found: Validation,
    missed: _Missed,
    rows: list[ValidateRow],
    notes: Sequence[Note],
) -> ValidateResult:
    errors = [abs(error) for row in rows for error in row.errors_percent]
    formula = _formula(found.rows) if study.naming.is_force_on_stems else None
    return ValidateResult(
        head=head,
        parameters=parameters,
        rows=Rows(rows),
        equivalent_within_percent=study.targets.equivalent_within_percent,
        max_abs_error_percent=max(errors, default=None),
        mean_abs_error_percent=float(np.mean(errors)) if errors else None,
        max_abs_error_percent_independent=found.max_abs_error_percent_independent,
        best_scaled_max_error_percent=found.best_scaled_max_error_percent,
        error_slope_percent_per_unit=found.error_slope_percent_per_unit,
        measured_exponent=found.measured_exponent,
        simulated_exponent=found.simulated_exponent,
        formula_max_abs_error_percent=formula,
        discrepancy=missed.scale,
        notes=tuple(notes),
    )


def _ratios(rows: Sequence[ValidationRow]) -> dict[float, float]:
    """Return measured over simulated force at the fitted diameters."""
    fitted = [row for row in rows if row.role == "calibration" and row.simulated]
    return {row.condition: row.measured / (row.simulated or 1.0) for row in fitted}


def _corrected(row: ValidationRow, missed: _Missed) -> ScaledPrediction | None:
    """Return what the other fitted diameters predict at one; nothing where there is no scale or no force."""
    if not row.simulated or len(missed.ratios) < needed(missed.seen):
        return None
    others = {condition: ratio for condition, ratio in missed.ratios.items() if condition != row.condition}
    return corrected(row.simulated, row.condition, others, missed.seen, missed.asked == "process")


def _directions_seen(work: Work) -> int:
    """Return how many directions of the parameters the fitted forces see, at least their level."""
    study = work.study
    if not study.joint_targets:
        return 1
    surface, solution = work.result(SurfaceResult), work.result(InvertResult)
    surfaces = joint_surfaces(study, surface)
    misfit = misfit_over(measured_means(study), surfaces, surface.region(study), jointly=True)
    responses = [i for i, mean in enumerate(measured_means(study)) if mean.leads]
    point = surface.scales.point(solution.point.coded)
    return max(1, misfit.only(responses).directions_seen(point)) if responses else 1


def _stage_notes(study: Study, solver: Solver, missed: _Missed) -> Iterator[Note]:
    """Find what the comparison itself does not know: how the ranges were chosen, where the answers come from."""
    if len(study.joint_targets) > 1 and study.invert.ranges_chosen == "after":
        yield RangesChosenAfter()
    if missed.asked != "none" and missed.scale is None:
        yield TooFewForDiscrepancy(needed(missed.seen), missed.seen)
    if solver.given_design("validate") is not None:
        yield FromTable()


def _formula(rows: Sequence[ValidationRow]) -> float | None:
    """Return the largest error of a·d^2.5 through the fitted forces at the others that were simulated."""
    done = [row for row in rows if row.simulated is not None]
    pairs = {
        fitted: [(row.condition, row.measured) for row in done if (row.role == "calibration") is fitted]
        for fitted in (True, False)
    }
    return formula_elsewhere(pairs[True], pairs[False])


def requests_at(study: Study, levels: Mapping[str, float]) -> list[Request]:
    """Return a request per measured diameter at these levels, or as many as the program is asked for."""
    targets = enumerate(study.targets.means)
    requests = [Request("validate", row, levels, target.condition, pictured=True) for row, target in targets]
    return repeated(requests, study.replicates)


def calibrated_parameters(study: Study, solver: Solver, folder: StudyFolder) -> dict[str, float]:
    """Return the level of every factor at the solution; refined if the spec asks for that."""
    if study.refine is not None:
        return read_fresh(study, solver, folder, RefineResult).parameters
    return read_fresh(study, solver, folder, InvertResult).parameters


def _row(
    study: Study,
    target: Target,
    compared: ValidationRow,
    outcome: Outcome,
    scatters: Mapping[str, Scatter | None],
) -> ValidateRow:
    margin = study.targets.equivalent_within_percent
    further = [
        FurtherRow.of(mean, value, margin, scatters.get(mean.response))
        for mean in measured_of(target, [named.name for named in study.naming.further], study.naming)
        if (value := outcome.of(mean.response)) is not None
    ]
    return ValidateRow(
        compared=compared,
        status=outcome.status,
        censored=outcome.censored,
        reason=outcome.reason,
        message=outcome.message,
        key=outcome.key,
        replicates=outcome.replicates,
        further=Rows(further),
    )
