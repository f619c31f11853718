"""The analysis of the stage validate: simulate all conditions with the calibrated parameters, and compare."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from stemcal.doe.comparison import Validation, compare_conditions, formula_elsewhere, standard_error
from stemcal.errors import UsageError
from stemcal.formats import interval, significant
from stemcal.notes import Note
from stemcal.runs.record import Outcome, lower_bound_notes, merged
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Request, Solver
from stemcal.solvers.replicates import repeated
from stemcal.stages.design import StageRuns
from stemcal.stages.fitting import Measured, measured_of
from stemcal.stages.fresh import calibrated_parameters
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.result import Head
from stemcal.stages.stage import has_surface
from stemcal.stages.validate.options import ValidateOptions
from stemcal.stages.validate.result import FurtherRow, ValidateResult, ValidateRow
from stemcal.stages.verdict.words import predicted_note
from stemcal.stages.work import Work, a_stage
from stemcal.storage.rows import Rows
from stemcal.study.model.measured_targets import Target
from stemcal.study.model.study import Study
from stemcal.vocabulary import CUTTING, TRAVEL, Wording

_TRAVEL_PERCENT = 25.0  # a larger error shows that measured and simulated travel are different quantities


@a_stage(ValidateResult)
def validate(work: Work, head: Head) -> ValidateResult:
    """Simulate at every measured condition with the calibrated parameters."""
    study, solver = work.study, work.solver
    parameters = calibrated_parameters(study, solver, work.folder)
    runs = work.outcomes(requests_at(study, parameters))
    outcomes, targets = merged(runs, study.solver.repeats), study.targets.means
    compared = compare_conditions(
        [target.condition for target in targets],
        [target.response for target in targets],
        [outcome.response for outcome in outcomes],
        [target.condition for target in study.joint_targets] or study.targets.calibrate_at,
        [(target.sd, target.n) for target in targets],
        study.naming,
    )
    left_out = work.result(InvertResult).left_out if has_surface(study) else {}
    rows = [
        ValidateRow(
            compared=replace(row, left_out_percent=left_out.get(row.condition)),
            outcome=outcome,
            further=_further(study, target, outcome),
        )
        for target, row, outcome in zip(targets, compared.rows, outcomes, strict=True)
    ]
    notes = [*compared.notes, *_from_table(study, solver), *lower_bound_notes(runs)]
    result = _result(study, head, parameters, compared, rows)
    return replace(result, notes=(*validate_notes(result), *notes))


def _result(
    study: Study, head: Head, parameters: dict[str, float], compared: Validation, rows: list[ValidateRow]
) -> ValidateResult:
    errors = [abs(error) for row in rows for error in row.errors_percent]
    simulated = [row for row in compared.rows if row.simulated is not None]
    fitted, held_out = (  # F = a·dᵇ is fitted to the first; the second give its error
        [(r.condition, r.measured, standard_error(r.measured, r.sd, r.n)) for r in simulated if r.role == role]
        for role in ("fitted", "held_out")
    )
    return ValidateResult(
        head=head,
        parameters=parameters,
        rows=Rows(rows),
        tolerance_percent=study.of(ValidateOptions).tolerance_percent,
        worst_percent=max(errors, default=None),
        mean_abs_error_percent=float(np.mean(errors)) if errors else None,
        worst_held_out_percent=compared.worst_held_out_percent,
        error_slope_percent_per_unit=compared.error_slope_percent_per_unit,
        measured_exponent=compared.measured_exponent,
        simulated_exponent=compared.simulated_exponent,
        formula=formula_elsewhere(fitted, held_out) if study.naming.is_force_on_stems else None,
    )


def _from_table(study: Study, solver: Solver) -> Iterator[Note]:
    """Yield a note if the responses are from a table without all levels, so perhaps from other parameter values."""
    if (table := solver.given_design("validate")) and len(table[0]) < len(study.factors):
        text = (
            f"The simulated {study.naming.response.long} was read from a table, so it may have been calculated with "
            "parameter values that differ from the calibrated values."
        )
        yield Note("from_table", "warning", text)


def requests_at(study: Study, levels: Mapping[str, float]) -> list[Request]:
    """Return requests at these levels for every measured condition, with the replicates of a stochastic program."""
    targets = enumerate(study.targets.means)
    requests = [Request("validate", row, levels, target.condition, pictured=True) for row, target in targets]
    return repeated(requests, study.solver.repeats)


def foresee(study: Study, solver: Solver, folder: StudyFolder | None) -> StageRuns:
    """Return a run per condition, at the solution if it is known, otherwise at mid-levels."""
    levels = None
    if folder is not None:
        with suppress(UsageError):
            levels = calibrated_parameters(study, solver, folder)
    middle = study.midlevels() if levels is None else levels
    return StageRuns("validate", requests_at(study, middle), settled=levels is not None)


def _further(study: Study, target: Target, outcome: Outcome) -> Rows[FurtherRow]:
    """Return comparisons of further measured responses, and of the travel of curves, which is not fitted."""
    means = measured_of(target, [named.name for named in study.naming.further], study.naming)
    if (way := target.travel_of_curves) is not None and TRAVEL.name not in target.further:
        means.append(Measured(target.condition, TRAVEL.name, way.value, way.sd, way.n, CUTTING))
    return Rows(FurtherRow.of(mean, value) for mean in means if (value := outcome.of(mean.response)) is not None)


def validate_notes(stage: ValidateResult) -> Iterator[Note]:
    """Yield notes on the fitted values, the growth of the force with the diameter, a power law, and the travel."""
    names = Wording(stage.naming)
    if stage.fitted:
        where = names.at(*stage.fitted) if names.has_condition else " of a fitted response"
        values = "these measurements" if names.has_condition and len(stage.fitted) > 1 else "the same measurement"
        text = f"The error{where} is not an independent check because the parameters were fitted to {values}."
        yield Note("fitted", "info", text)
    lab, model = stage.measured_exponent, stage.simulated_exponent
    if lab is not None and model is not None:
        growths = f"as d^{lab.value:.2f}, and the simulated force as d^{model.value:.2f}"
        yield Note("growth", "info", f"The measured force increases with diameter d {growths}.")
    if stage.prediction is not None:
        yield predicted_note("held_out", stage.prediction, names)
    yield from _travel(stage)


def _travel(stage: ValidateResult) -> Iterator[Note]:
    further = [row for compared in stage.rows for row in compared.further]
    rows = [row for row in further if row.response == TRAVEL.name and not row.judged]
    errors = [abs(row.error_percent) for row in rows if row.error_percent is not None]
    if not errors or min(errors) <= _TRAVEL_PERCENT:
        return
    each = ([getattr(row, name) for row in rows] for name in ("measured", "simulated"))
    measured, simulated = (
        significant(values[0], 3) if len(set(values)) == 1 else interval((min(values), max(values)), 3)
        for values in each
    )
    text = (
        f"The measured travel at maximum force is {measured} mm, and the simulated travel is {simulated} mm. Measured "
        "travel also contains the deformation of the testing machine and the settling of the stem on its supports; "
        "simulated travel depends on the mesh. The parameters were not fitted to the travel."
    )
    yield Note("travel_differs", "caution", text)
