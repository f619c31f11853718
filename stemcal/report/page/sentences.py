"""What a study asked, what came out and how sure it is, in sentences made from the stage files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stemcal.doe.validation.null_model import compared
from stemcal.naming import Naming
from stemcal.report.numbers import fixed, interval, probability, short, significant
from stemcal.report.verdict import WITHHELD
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import InvertResult, JointFitted
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import StageResult
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import ValidateResult
from stemcal.words import an, counted, joined

AGREES = 10  # percent
_AGREEING = (RefineResult, ValidateResult)
_CLAIMING = (InvertResult, MeshResult, *_AGREEING)


def outcome_of(result: StageResult, holds: bool = True) -> list[str]:
    """Return what came out of a stage, in a sentence; no claim of agreement where the study does not bear it."""
    return [_outcome(result)] if holds or not isinstance(result, _AGREEING) else []


def certainty(results: Results, holds: bool = True) -> list[str]:
    """Return how sure it is, as far as the finished stages tell; no interval where the study is not calibrated."""
    told = [result for result in results.done() if holds or not isinstance(result, _CLAIMING)]
    sentences = [sentence for result in told for sentence in _certainty(result)]
    return sentences if holds else [*sentences, WITHHELD]


def _outcome(result: StageResult) -> str:
    match result:
        case ScreenResult():
            return _screening_outcome(result)
        case ClimbResult():
            return _climb_outcome(result)
        case SurfaceResult():
            return _surface_outcome(result)
        case InvertResult():
            return _calibration_outcome(result)
        case RefineResult():
            return _refinement_outcome(result)
        case ValidateResult():
            return _validation_outcome(result)
    return result.summary()


def _certainty(result: StageResult) -> list[str]:
    match result:
        case ScreenResult():
            return _screening_certainty(result)
        case SurfaceResult():
            return _surface_certainty(result)
        case InvertResult():
            return _calibration_certainty(result)
        case MeshResult():
            return list(result.notes[: 1 + len(result.sizes)])
        case ValidateResult():
            return _validation_certainty(result)
    return []


def _screening_outcome(stage: ScreenResult) -> str:
    runs, effects = stage.design.runs, {e.factor: e for e in stage.effects}
    begin = f"Of {counted(len(effects), 'factor')}, screened in {counted(len(runs), 'run')},"
    chosen = sorted(stage.significant, key=lambda name: -abs(effects[name].effect))
    if not chosen:
        return f"{begin} none moved the {stage.naming.response.long} significantly."
    shares = [f"{name} ({fixed(effects[name].contribution_percent, 1)} %)" for name in chosen]
    return f"{begin} these moved the {stage.naming.response.long} (share of the sum of squares): {joined(shares)}."


def _surface_outcome(stage: SurfaceResult) -> str:
    runs = [run.response for run in stage.design.runs if run.response is not None]
    return (
        f"A quadratic surface over {joined(stage.names)} was fitted to {counted(len(runs), 'run')} "
        f"between {significant(min(runs))} and {significant(max(runs))}{stage.naming.response.beside}."
    )


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


def _screening_certainty(stage: ScreenResult) -> list[str]:
    margin = stage.lenth.me if stage.lenth is not None else None
    chosen = [e for e in stage.effects if e.factor in stage.significant]
    if margin is None or not chosen:
        return []
    firm = [e.factor for e in chosen if abs(e.effect) > margin]
    weak = [e.factor for e in chosen if abs(e.effect) <= margin]
    sentences = []
    if firm:
        sentences.append(f"Lenth's method, which needs no residual, confirms {joined(firm)}.")
    if weak:
        also = "It" if firm else "Lenth's method"
        sentences.append(f"{also} does not confirm {joined(weak)}: treat as doubtful.")
    largest = (stage.lenth.sme if stage.lenth is not None else None) or margin
    lost = [e.factor for e in chosen if (e.p_holm or 0.0) >= stage.alpha and abs(e.effect) <= largest]
    if lost:
        sentences.append(f"Among all {len(stage.effects)} factors at once, {joined(lost)} may be chance (Holm, Lenth).")
    return sentences


def _surface_certainty(stage: SurfaceResult) -> list[str]:
    if stage.r2 is None:
        return [
            f"All runs gave the same {stage.naming.response.noun}: there is nothing that the surface could explain."
        ]
    text = (
        f"The surface explains {fixed(100 * stage.r2, 1)} % of the variation between its runs"
        f" (R² {fixed(stage.r2, 3)}, predicted R² {fixed(stage.predicted_r2, 3)})"
    )
    lack = stage.anova_row("Lack of fit")
    if not stage.lack_of_fit_testable or lack is None or lack.p is None:
        return [f"{text}; its lack of fit cannot be tested."]
    verdict = "misses something (lack of fit is significant" if lack.p < 0.05 else "shows no lack of fit ("
    return [f"{text} and {verdict}{', ' if verdict.endswith('t') else ''}p = {probability(lack.p)})."]


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
        null = stage.joint.null
        beside = [] if null is None else [compared(null, stage.joint.max_abs_error_percent, left_out)]
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
