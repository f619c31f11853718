"""One design and one surface over the factors and the conditions that are fitted together."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from math import exp, log

import numpy as np

from stemcal.doe import designs
from stemcal.doe.coding import Coding, term_columns
from stemcal.doe.regression.section import bend_freedom, bend_of, fit_whole, left_out_percent
from stemcal.errors import UsageError
from stemcal.formats import counted
from stemcal.notes import Note
from stemcal.stages.design import Design
from stemcal.stages.fitting import ConditionAxis
from stemcal.stages.result import DesignRun
from stemcal.stages.rsm.options import RsmOptions, dimensions, growing_with
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST, Wording

_BEND_FREEDOM = 3  # residual degrees of freedom that `bend_of` needs to detect a bend of some percent


def condition_axis(study: Study, names: Sequence[str]) -> ConditionAxis:
    """Return the coding of the condition: the outermost runs are at the lowest and the highest fitted condition."""
    fitted = [target.condition for target in study.joint_targets]
    low, high, logarithmic = min(fitted), max(fitted), min(fitted) > 0.0
    if logarithmic:
        low, high = log(low), log(high)
    half_step = 0.5 * (high - low) / study.of(RsmOptions).reach(dimensions(study, names))
    name = study.naming.condition.name if study.naming.condition is not None else "condition"
    at = study.targets.calibrate_at
    return ConditionAxis(name, 0.5 * (low + high), half_step, logarithmic, at, growing_with(study, names))


def over_design(study: Study, coding: Coding) -> Design:
    """Return the design over the factors and the condition; exponents of power laws of the condition do not vary."""
    options, axis = study.of(RsmOptions), condition_axis(study, coding.names)
    held = [exponent for exponent, _ in axis.growing.values()]
    varied = [j for j, name in enumerate(coding.names) if name not in held]
    coded = designs.surface_runs(len(varied) + 1, options.chosen()).copy()  # the cached design must not change
    values = (axis.center + axis.half_step * coded[:, -1]).tolist()
    conditions = tuple(float(f"{exp(value) if axis.logarithmic else value:.4g}") for value in values)
    coded[:, -1] = [axis.coded(condition) for condition in conditions]
    levels = np.zeros((len(coded), len(coding.names)))
    levels[:, varied] = coded[:, :-1]
    whole = Coding(
        (*(coding.names[j] for j in varied), axis.name),
        (*(coding.centre[j] for j in varied), axis.center),
        (*(coding.half_step[j] for j in varied), axis.half_step),
    )
    each = coding.runs(levels, study.midlevels())
    return Design("rsm", options.design, whole, coded, each, conditions=conditions, held=tuple(held))


def runs_of_both(study: Study, names: Sequence[str], design: Design) -> Note | None:
    """Return a note with the numbers of runs for one surface over all conditions and for one surface per condition."""
    options, conditions = study.of(RsmOptions), {target.condition for target in study.joint_targets}
    if len(conditions) < 2:
        return None
    sizes = len(names) + 1 - len(growing_with(study, names)), len(names)
    condition, text = study.naming.condition.noun if study.naming.condition is not None else "condition", ""
    with suppress(UsageError):  # the design does not exist for this number of factors
        joint, each = (len(np.unique(designs.surface_runs(k, options.chosen()), axis=0)) for k in sizes)
        text = (
            f"One response surface over factors and {condition} (`rsm.over: conditions`) needs {counted(joint, 'run')};"
            f" a response surface at each of {len(conditions)} {condition}s needs {each * len(conditions)}. "
        )
    if design.conditions and bend_freedom(term_columns(design.coded), design.coded[:, -1]) < _BEND_FREEDOM:
        text += (
            f"This design alone rarely or never shows a bend of the response over the {condition}; the verdict "
            "therefore also uses the simulations of the validation."
        )
    return Note("surface_runs", "info", text.strip()) if text else None


def scaled(axis: ConditionAxis, study: Study, design: Design, runs: Sequence[DesignRun]) -> ConditionAxis:
    """Return the axis with the responses whose logarithm has the smaller error of left-out runs in a quadratic fit."""
    errors, logarithms, bend = {}, [], None
    for name in study.fitted_responses:
        values = np.array([run.number(name) for run in runs])
        scales = (False, True) if np.nanmin(values, initial=np.inf) > 0.0 else (False,)
        fits = [(fit_whole(design.coded, values, design.names, None, scale), scale) for scale in scales]
        plain, logged = (*(left_out_percent(*fit) for fit in fits), None)[:2]
        errors[name] = plain, logged
        logarithms += [name] if logged is not None and (plain is None or logged < plain) else []
        bend = bend_of(*fits[name in logarithms]) if name == FIRST else bend
    return replace(axis, logarithms=tuple(logarithms), left_out_percent=errors, bend=bend)


def notes_of(axis: ConditionAxis, names: Wording) -> Iterator[Note]:
    """Yield a note on the choice between the first response and its logarithm."""
    plain, logged = axis.left_out_percent[FIRST]
    if plain is not None and logged is not None:
        chosen = f"the logarithm of the {names.response.long}" if FIRST in axis.logarithms else names.response.long
        text = (
            f"The response surface is a quadratic of {chosen}: when each run in turn is left out, its error is "
            f"{plain:.2g} % for the {names.response.long} and {logged:.2g} % for its logarithm (root mean square)."
        )
        yield Note("response_scale", "info", text)
