"""What a study asked, what came out and how sure it is, in sentences made from the stage files."""

from __future__ import annotations

from collections.abc import Mapping

from stemcal.naming import Naming
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import InvertResult, JointFitted
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import ValidateResult
from stemcal.text import mesh, screening, surface, validation
from stemcal.text.names import Names
from stemcal.text.numbers import fixed, interval, short, significant
from stemcal.text.results import withheld
from stemcal.words import an, counted, joined

_AGREEING = (RefineResult, ValidateResult)
_CLAIMING = (InvertResult, MeshResult, *_AGREEING)


def outcome_of(result: StageResult, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return what came out of a stage, in a sentence; no claim of agreement where the study does not bear it."""
    if isinstance(result, ScreenResult):
        return screening.outcome(result, Names(result.naming, labels or {}))
    if isinstance(result, SurfaceResult):
        return surface.outcome(result, Names(result.naming, labels or {}))
    if isinstance(result, MeshResult):
        return mesh.certainty(result, Names(result.naming, labels or {}))
    if not holds and isinstance(result, _AGREEING):
        return []
    if isinstance(result, ValidateResult):
        return validation.outcome(result, Names(result.naming, labels or {}))
    return [_outcome(result)]


def certainty(results: Results, holds: bool = True, labels: Mapping[str, str] | None = None) -> list[str]:
    """Return how sure it is, as far as the finished stages tell; no interval where the study is not calibrated."""
    told = [result for result in results.done() if holds or not isinstance(result, _CLAIMING)]
    sentences = [sentence for result in told for sentence in _certainty(result, labels or {})]
    return sentences if holds else [*sentences, withheld()]


def _outcome(result: StageResult) -> str:
    match result:
        case ClimbResult():
            return _climb_outcome(result)
        case InvertResult():
            return _calibration_outcome(result)
        case RefineResult():
            return _refinement_outcome(result)
    return result.summary()


def _certainty(result: StageResult, labels: Mapping[str, str]) -> list[str]:
    match result:
        case ScreenResult():
            return screening.certainty(result, Names(result.naming, labels))
        case SurfaceResult():
            return surface.certainty(result, Names(result.naming, labels))
        case InvertResult():
            return _calibration_certainty(result)
        case MeshResult():
            return mesh.certainty(result, Names(result.naming, labels))
        case ValidateResult():
            return validation.certainty(result, Names(result.naming, labels))
    return []


def _calibration_outcome(stage: InvertResult) -> str:
    values = [f"{name} = {significant(value)}" for name, value in stage.point.solution.items()]
    naming = stage.naming
    if stage.joint is not None:
        return (
            f"Fitted to {_fitted_together(stage.joint, naming)} together, the surfaces miss the measured "
            f"{_missed(stage.joint, naming)}, at {joined(values)}."
        )
    return f"The surface meets the measured {short(stage.target)}{naming.response.beside} at {joined(values)}."


def _fitted_together(joint: JointFitted, naming: Naming) -> str:
    """Count what parameters were fitted to: the diameters, or the responses where there is no condition."""
    if naming.condition is not None:
        return naming.counted(len({row.condition for row in joint.rows}))
    return counted(len(joint.rows), "response")


def _missed(joint: JointFitted, naming: Naming) -> str:
    """Name what was measured of the responses, and by how much the surfaces miss each."""
    errors: dict[str, list[float]] = {}
    for row in joint.rows:
        errors.setdefault(row.response, []).append(abs(row.error_percent))
    return joined([f"{naming.named(name).plural} by at most {fixed(max(each), 1)} %" for name, each in errors.items()])


def _climb_outcome(stage: ClimbResult) -> str:
    verdict = "passed" if stage.passed else "did not reach"
    return (
        f"Stepping {joined(stage.names)} together, {counted(len(stage.rows), 'run')}, {verdict} the target; step "
        f"{stage.best_step} came nearest, {fixed(abs(stage.error_percent), 1)} % from it."
    )


def _refinement_outcome(stage: RefineResult) -> str:
    verdict = "within" if stage.converged else "not within"
    return (
        f"Simulating at the solution and correcting it, {counted(len(stage.rows), 'run')}, ended "
        f"{fixed(abs(stage.error_percent), 2)} % from the target, {verdict} the tolerance of "
        f"{short(stage.tolerance_percent)} %."
    )


def _calibration_certainty(stage: InvertResult) -> list[str]:
    expected, naming = stage.point.prediction_interval, stage.naming
    sentences = [
        f"A simulation with the calibrated parameters should give {interval(expected)}{naming.response.beside} "
        "(95 % prediction interval)."
        if expected is not None
        else "The surface has as many terms as runs: nothing tells how far a simulation may miss its prediction."
    ]
    if stage.joint is not None:
        left_out = stage.joint.max_abs_left_out_error_percent
        known = [sentence for part in stage.known for sentence in part.sentences]
        beside = [said.sentence for said in validation.beside_formulas(stage.joint, Names(naming))]
        one = an(naming.condition_noun).capitalize() if naming.condition is not None else "A response"
        left = f"{one} predicted from a fit to the others is missed by at most {fixed(left_out, 1)} %."
        return [*known, left, *beside]
    if len(stage.point.solution) > 1:
        sentences.append(
            f"One measured {naming.response.noun} cannot fix several parameters: other combinations meet it as well. "
            f"The rule {stage.rule.replace('_', ' ')} chose this one."
        )
        if stage.certainty is not None:
            sentences += [*stage.certainty.sentences, *stage.certainty.direction_sentences]
    return sentences
