"""What a study asked, what came out and how sure it is, in sentences made from the stage files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stemcal.report.numbers import fixed, interval, probability, short, significant

Stage = Mapping[str, Any]
Stages = Mapping[str, Stage]
AGREES = 10  # percent


def listed(words: Sequence[str]) -> str:
    """Join words as a sentence does.

    >>> listed(["a"]), listed(["a", "b"]), listed(["a", "b", "c"])
    ('a', 'a and b', 'a, b and c')
    """
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def counted(count: int, noun: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "run"), counted(12, "run")
    ('1 run', '12 runs')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def outcome(stages: Stages) -> list[str]:
    """Return what came out, a sentence per finished stage."""
    return [_OUTCOME[name](stage) for name, stage in stages.items()]


def certainty(stages: Stages) -> list[str]:
    """Return how sure it is, as far as the finished stages tell."""
    return [sentence for name, stage in stages.items() for sentence in _CERTAINTY[name](stage)]


def _screening_outcome(stage: Stage) -> str:
    runs, effects = stage["design"]["runs"], {e["factor"]: e for e in stage["effects"]}
    begin = f"Of {counted(len(effects), 'factor')}, screened in {counted(len(runs), 'run')},"
    chosen = sorted(stage["significant"], key=lambda name: -abs(effects[name]["effect"]))
    if not chosen:
        return f"{begin} none moved the maximum force significantly."
    shares = [f"{name} ({fixed(effects[name]['contribution_percent'], 1)} %)" for name in chosen]
    return f"{begin} these moved the maximum force (share of the sum of squares): {listed(shares)}."


def _surface_outcome(stage: Stage) -> str:
    runs = [run["force"] for run in stage["design"]["runs"] if run["force"] is not None]
    return (
        f"A quadratic surface over {listed(stage['names'])} was fitted to {counted(len(runs), 'run')} "
        f"between {significant(min(runs))} and {significant(max(runs))} N."
    )


def _calibration_outcome(stage: Stage) -> str:
    values = [f"{name} = {significant(value)}" for name, value in stage["solution"].items()]
    if "joint" in stage:
        return (
            f"Fitted to {counted(len(stage['joint']['rows']), 'diameter')} together, the surfaces miss the measured "
            f"forces by at most {fixed(stage['joint']['max_abs_error_percent'], 1)} %, at {listed(values)}."
        )
    return f"The surface meets the measured {short(stage['target'])} N at {listed(values)}."


def _climb_outcome(stage: Stage) -> str:
    verdict = "passed" if stage["passed"] else "did not reach"
    return (
        f"Stepping {listed(stage['names'])} together, {counted(len(stage['rows']), 'run')}, {verdict} the target; step "
        f"{stage['best_step']} came nearest, {fixed(abs(stage['error_percent']), 1)} % from it."
    )


def _refinement_outcome(stage: Stage) -> str:
    verdict = "within" if stage["converged"] else "not within"
    return (
        f"Simulating at the solution and correcting it, {counted(len(stage['rows']), 'run')}, ended "
        f"{fixed(abs(stage['error_percent']), 2)} % from the target, {verdict} the tolerance of "
        f"{short(stage['tolerance_percent'])} %."
    )


def _no_certainty(_stage: Stage) -> list[str]:
    return []


def _validation_outcome(stage: Stage) -> str:
    rows = stage["rows"]
    worst, mean = (fixed(stage[f"{kind}_abs_error_percent"], 1) for kind in ("max", "mean"))
    return (
        f"Over {counted(len(rows), 'diameter')}, simulated and measured force differ by at most "
        f"{worst} %, {mean} % on average."
    )


def _screening_certainty(stage: Stage) -> list[str]:
    margin = (stage.get("lenth") or {}).get("me")
    chosen = [e for e in stage["effects"] if e["factor"] in stage["significant"]]
    if margin is None or not chosen:
        return []
    firm = [e["factor"] for e in chosen if abs(e["effect"]) > margin]
    weak = [e["factor"] for e in chosen if abs(e["effect"]) <= margin]
    sentences = []
    if firm:
        sentences.append(f"Lenth's method, which needs no residual, confirms {listed(firm)}.")
    if weak:
        also = "It" if firm else "Lenth's method"
        sentences.append(f"{also} does not confirm {listed(weak)}: treat as doubtful.")
    return sentences


def _surface_certainty(stage: Stage) -> list[str]:
    if stage["r2"] is None:
        return ["All runs gave the same force: there is nothing that the surface could explain."]
    text = (
        f"The surface explains {fixed(100 * stage['r2'], 1)} % of the variation between its runs"
        f" (R² {fixed(stage['r2'], 3)}, predicted R² {fixed(stage['predicted_r2'], 3)})"
    )
    lack = next((row for row in stage["anova"] if row["source"] == "Lack of fit"), None)
    if not stage["lack_of_fit_testable"] or lack is None or lack["p"] is None:
        return [f"{text}; its lack of fit cannot be tested."]
    verdict = "misses something (lack of fit is significant" if lack["p"] < 0.05 else "shows no lack of fit ("
    return [f"{text} and {verdict}{', ' if verdict.endswith('t') else ''}p = {probability(lack['p'])})."]


def _calibration_certainty(stage: Stage) -> list[str]:
    expected = stage["prediction_interval"]
    sentences = [
        f"A simulation with the calibrated parameters should give {interval(expected)} N (95 % prediction interval)."
        if expected is not None
        else "The surface has as many terms as runs: nothing tells how far a simulation may miss its prediction."
    ]
    if "joint" in stage:
        left_out = stage["joint"]["max_abs_left_out_error_percent"]
        known = stage["certainty"]["sentences"] + stage["certainty_alone"]["sentences"]
        return [*known, f"A diameter predicted from a fit to the others is missed by at most {fixed(left_out, 1)} %."]
    if len(stage["solution"]) > 1:
        ranges = [f"{name} {interval(bounds)}" for name, bounds in stage["ranges"].items()]
        sentences.append(
            "One measured force cannot fix several parameters: other combinations meet it as well, with "
            f"{listed(ranges)}. The rule {stage['rule'].replace('_', ' ')} chose this one."
        )
        known = stage.get("certainty", {})
        sentences += [*known.get("sentences", []), *known.get("direction_sentences", [])]
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


def _validation_certainty(stage: Stage) -> list[str]:
    independent = [row for row in stage["rows"] if row["role"] != "calibration"]
    errors = [abs(row["error_percent"]) for row in independent if row["error_percent"] is not None]
    if not errors:
        return ["No diameter besides the calibration's could be compared: nothing checks the result."]
    return [
        f"At the {counted(len(errors), 'diameter')} not used for calibration the error reaches "
        f"{fixed(max(errors), 1)} %; {_how_many(errors)} within {AGREES} %."
    ]


_OUTCOME = {
    "screen": _screening_outcome,
    "rsm": _surface_outcome,
    "invert": _calibration_outcome,
    "climb": _climb_outcome,
    "refine": _refinement_outcome,
    "validate": _validation_outcome,
}
_CERTAINTY = {
    "screen": _screening_certainty,
    "rsm": _surface_certainty,
    "invert": _calibration_certainty,
    "climb": _no_certainty,
    "refine": _no_certainty,
    "validate": _validation_certainty,
}
