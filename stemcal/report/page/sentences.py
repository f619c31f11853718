"""What a study asked, what came out and how sure it is, in sentences made from the stage files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import ValidateResult
from stemcal.text import calibration, climb, mesh, refinement, screening, surface
from stemcal.text.names import Names
from stemcal.text.numbers import fixed
from stemcal.text.results import withheld
from stemcal.words import joined

AGREES = 10  # percent
_AGREEING = (RefineResult, ValidateResult)
_CLAIMING = (InvertResult, MeshResult, *_AGREEING)


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return what came out of a stage, in a sentence; no claim of agreement where the study does not bear it."""
    if isinstance(result, _AGREEING) and not holds:
        return []
    return _outcome(result, Names(result.naming, labels or {}))


def certainty(results: Results, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return how sure it is, as far as the finished stages tell; no interval where the study is not calibrated."""
    told = [result for result in results.done() if holds or not isinstance(result, _CLAIMING)]
    sentences = [sentence for result in told for sentence in _certainty(result, Names(result.naming, labels or {}))]
    return sentences if holds else [*sentences, withheld()]


def _outcome(result: StageResult, names: Names) -> list[str]:
    match result:
        case ScreenResult():
            return screening.outcome(result, names)
        case ClimbResult():
            return climb.outcome(result, names)
        case SurfaceResult():
            return surface.outcome(result, names)
        case InvertResult():
            return calibration.outcome(result, names)
        case RefineResult():
            return refinement.outcome(result, names)
        case MeshResult():
            return mesh.certainty(result, names)
        case ValidateResult():
            return [_validation_outcome(result)]
    return [result.summary()]


def _certainty(result: StageResult, names: Names) -> list[str]:
    match result:
        case ScreenResult():
            return screening.certainty(result, names)
        case SurfaceResult():
            return surface.certainty(result, names)
        case InvertResult():
            return calibration.certainty(result, names)
        case MeshResult():
            return mesh.certainty(result, names)
        case ValidateResult():
            return _validation_certainty(result)
    return []


def _validation_outcome(stage: ValidateResult) -> str:
    rows, naming = stage.rows, stage.naming
    worst, mean = fixed(stage.max_abs_error_percent, 1), fixed(stage.mean_abs_error_percent, 1)
    if naming.condition is None:
        return f"Simulated and measured {joined([*_apart(stage)])}."
    what = "responses" if naming.others else naming.response.noun
    return (
        f"Over {naming.counted(len(rows))}, simulated and measured {what} differ by at most "
        f"{worst} %, {mean} % on average."
    )


def _apart(stage: ValidateResult) -> Iterator[str]:
    """Say of each response by how much simulation and measurement differ."""
    (row,) = stage.rows
    yield f"{stage.naming.response.noun} differ by {_size(row.compared.error_percent)}"
    yield from (f"{stage.naming.named(one.response).noun} by {_size(one.error_percent)}" for one in row.further)


def _size(error_percent: float | None) -> str:
    return f"{fixed(None if error_percent is None else abs(error_percent), 1)} %"


def _how_many(errors: Sequence[float]) -> str:
    """Return how many errors are small enough, as a sentence goes on.

    >>> _how_many([2.0, 20.0]), _how_many([20.0]), _how_many([1.0, 2.0])
    ('1 of 2 lies', 'none lies', 'all lie')
    """
    good = sum(error <= AGREES for error in errors)
    if good in (0, len(errors)):
        return "all lie" if good else "none lies"
    return f"{good} of {len(errors)} {'lies' if good == 1 else 'lie'}"


def _validation_certainty(stage: ValidateResult) -> list[str]:
    independent = [row for row in stage.compared if row.role != "calibration"]
    naming = stage.naming
    errors = [abs(row.error_percent) for row in independent if row.error_percent is not None]
    if not errors:
        if naming.condition is None:
            return ["Only what the parameters were fitted to could be compared: nothing checks the result."]
        return [f"No {naming.condition_noun} besides the calibration's could be compared: nothing checks the result."]
    told = (
        f"At the {naming.counted(len(errors))} not used for calibration the error reaches "
        f"{fixed(max(errors), 1)} %; {_how_many(errors)} within {AGREES} %."
    )
    return [told, *([stage.beside_formula] if stage.beside_formula else [])]
