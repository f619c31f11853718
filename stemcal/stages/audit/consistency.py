"""What a paper's own runs, equation, names and forces say of each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from stemcal.doe.regression.least_squares import Array, t_quantile
from stemcal.doe.regression.surface import fit_surface
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.stages.audit.found import Calibrated, Check, Consequence, Found
from stemcal.stages.audit.suspicions import EQUATION
from stemcal.stages.printed_tables import (
    Audited,
    Difference,
    audit_surface,
    printed_terms,
    printed_validation,
    table,
    term_of,
)
from stemcal.stages.result import DesignRun
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import Study

# A level is proposed in place of a printed one where this share of the printed cells that disagreed then agree.
_MENDED = 0.5
_STEPS = (-2, -1, 1, 2)
_LEVEL = "misprinted level of"
_FAR_PERCENT, _OUTSIDE_PERCENT = 5.0, 3.0
_STARRED = ((0.01, "**"), (0.05, "*"))


# ---- levels


def level_is_misprinted(study: Study, stages: Calibrated) -> Iterator[Found]:
    """A level of the runs that, changed in its last digits, makes the printed analysis come out."""
    surface, audited = stages.surface, stages.surface.published
    if audited is None or len(audited.differences) < 5:
        return
    best = max(_changed(study, surface), key=lambda change: change[0].agree, default=None)
    if best is None or best[0].agree - audited.agree < _MENDED * (audited.of - audited.agree):
        return
    found, name, printed, level = best
    sentence = (
        f"design: {name} {printed:g} should read {level:g}: with {printed:g} {audited.agree} of {audited.of} cells of "
        f"the printed surface come out, with {level:g} {found.agree}"
    )
    yield Found(f"design: {name} {printed:g}", "value", f"{printed:g}", f"{level:g}", sentence, "result", _cause(name))
    again = {(d.table, d.cell.label) for d in found.differences}
    for different in audited.differences:
        if (different.table, different.cell.label) not in again:
            yield _cell(different, "print", _cause(name))
    for different in found.differences:
        weight: Consequence = "result" if different.table == "coefficients" else "conclusion"
        yield _cell(different, weight, f"{different.table} {different.cell.label.split(' ')[0]}")


def _cell(different: Difference, consequence: Consequence, cause: str) -> Found:
    cell = different.cell
    computed = "none" if cell.value is None else f"{cell.value:.6g}"
    return Found(
        f"{different.table}: {cell.label}", cell.kind, cell.printed, computed, cell.sentence, consequence, cause
    )


def _cause(name: str) -> str:
    return f"{_LEVEL} {name}"


def _changed(study: Study, surface: SurfaceResult) -> Iterator[tuple[Audited, str, float, float]]:
    """Yield what agrees with each level of each factor changed by units of the last digit its levels have."""
    runs = [run for run in surface.design.runs if run.response is not None]
    natural = np.array([[run.levels[name] for name in surface.names] for run in runs])
    responses = [run.response or 0.0 for run in runs]
    for j, name in enumerate(surface.names):
        for level in np.unique(natural[:, j]).tolist():
            for step in _STEPS:
                other = round(level + step * _last_digit(level), 9)
                moved = natural.copy()
                moved[np.isclose(natural[:, j], level), j] = other
                fit = fit_surface(surface.scales.to_coded(moved), responses, surface.names, each_once=False)
                found = audit_surface(study, fit.anova, fit.coefficients)
                if found is not None:
                    yield found, name, level, other


def _last_digit(level: float) -> float:
    """Return one unit of the last digit that a level is printed with.

    >>> _last_digit(17.98), _last_digit(84.0)
    (0.01, 1.0)
    """
    text = f"{level:.9g}"
    return 10.0 ** -(len(text.split(".")[1]) if "." in text else 0)


def levels_are_swapped(study: Study, stages: Calibrated) -> Iterator[Found]:
    """A factor whose printed effect is that of the data with the other sign, of the same size: low and high swapped."""
    for audited in stages.published():
        signs = [d.cell for d in audited.differences if d.cell.kind == "sign" and d.table == "screening"]
        for cell in signs:
            name = cell.label.split(" ")[0]
            sentence = (
                f"{cell.sentence}; all else of its row agrees: low and high of {name} are swapped in runs or table"
            )
            yield Found(
                f"screening: {name}", "sign", cell.printed, f"{cell.value:.6g}", sentence, "result", f"screening {name}"
            )


# ---- surface and runs


def surface_contradicts_screening(_study: Study, stages: Calibrated) -> Iterator[Found]:
    """The surface where the screening had runs, against what these gave.

    The runs at one corner of the surface's factors scatter by the effects of the others, (e/2)² each.
    """
    surface, screen = stages.surface, stages.screen
    others = sum(0.25 * e.effect**2 for e in screen.effects if e.factor not in surface.names)
    worst: tuple[float, Found] | None = None
    for corner in _corners(stages):
        runs, coded = corner
        low, high = (float(end) for end in surface.fitted.prediction_interval(coded)[0])
        at = float(surface.fitted.predict(coded)[0])
        responses = [run.response or 0.0 for run in runs]
        apart = abs(at - float(np.mean(responses)))
        reach = 0.5 * (high - low) + t_quantile(0.95, max(screen.residual.df, 1)) * (others / len(runs)) ** 0.5
        if apart > reach and (worst is None or apart - reach > worst[0]):
            levels = ", ".join(f"{name} {runs[0].levels[name]:g}" for name in surface.names)
            given = f"{min(responses):g} to {max(responses):g} N" if len(responses) > 1 else f"{responses[0]:g} N"
            sentence = (
                f"surface against screening: at {levels} the surface gives {at:.0f} N, the screening runs {given}"
            )
            worst = (
                apart - reach,
                Found(
                    "surface against screening",
                    "value",
                    given,
                    f"{at:.0f} N",
                    sentence,
                    "result",
                    "surface and screening",
                ),
            )
    if worst is not None:
        yield worst[1]


def _corners(stages: Calibrated) -> Iterator[tuple[list[DesignRun], Array]]:
    """Yield the screening runs at each corner of the surface's factors, and where that is, coded for the surface."""
    surface = stages.surface
    runs = [run for run in stages.screen.design.runs if run.response is not None]
    if any(name not in runs[0].coded for name in surface.names):
        return
    for signs in product((-1.0, 1.0), repeat=len(surface.names)):
        at = [r for r in runs if all(abs(r.coded[n] - s) < 1e-6 for n, s in zip(surface.names, signs, strict=True))]
        if at:
            yield at, surface.scales.to_coded([at[0].levels[name] for name in surface.names])


def equation_takes_coded_values(study: Study, stages: Calibrated) -> Iterator[Found]:
    """A coded equation bounded in natural values gives forces that no one means."""
    published, surface = study.published, stages.surface
    if published is None or published.coefficients is None or published.bounds != "natural":
        return
    printed = printed_terms(study, published.coefficients)
    beta = np.array([printed.get(term_of(study, term), np.nan) for term in term_names(surface.names)])
    if not np.all(np.isfinite(beta)):
        return
    ends = [(study.factor(name).low, study.factor(name).high) for name in surface.names]
    given = [published.solution.get(name) for name in surface.names]
    points = [given] if None not in given else list(product(*ends))
    responses = term_columns(np.array(points, dtype=float)) @ beta
    worst = float(responses[int(np.argmax(np.abs(responses)))])
    where = "at the printed solution" if None not in given else "at a corner of the ranges"
    sentence = (
        "equation: its coefficients are for coded values, its bounds are natural ones; in natural values "
        f"it gives {worst:,.0f} N {where}"
    ).replace("-", "\u2212")
    yield Found("equation: bounds", "setup", "natural bounds", f"{worst:.6g} N", sentence, "method", "natural bounds")


def solver_misses_target(study: Study, stages: Calibrated) -> Iterator[Found]:
    """The solver's own force at the calibration diameter against the target that was solved for."""
    row = _calibrated_row(study, stages)
    target = study.calibration_target.response
    if row is None:
        return
    apart, interval = 100.0 * (row - target) / target, stages.inversion.point.prediction_interval
    outside = interval is not None and not interval[0] <= row <= interval[1]
    if abs(apart) <= (_OUTSIDE_PERCENT if outside else _FAR_PERCENT):
        return
    told = (
        ""
        if interval is None
        else (
            f"; {'outside' if outside else 'inside'} the surface's 95 % prediction interval, {interval[0]:.1f} to "
            f"{interval[1]:.1f} N"
        )
    )
    sentence = (
        f"validation: at the calibration diameter the solver gives {row:g} N where {target:g} N was solved for "
        f"({apart:+.1f} %{told}): the parameters do not give the target"
    ).replace("-", "\u2212")
    yield Found(
        "validation: calibration diameter",
        "value",
        f"{row:g} N",
        f"{target:g} N",
        sentence,
        "result",
        "force at target",
    )


def _calibrated_row(study: Study, stages: Calibrated) -> float | None:
    """Return the simulated force at the calibration diameter, as computed or as printed."""
    rows = [] if stages.validation is None else stages.validation.compared
    if not rows and study.published is not None and study.published.validation is not None:
        rows = list(printed_validation(study, study.published.validation)[0].rows)
    at = study.targets.calibrate_at
    return next((row.simulated for row in rows if abs(row.condition - at) < 1e-6), None)


def growth_differs(study: Study, stages: Calibrated) -> Iterator[Found]:
    """How force grows with the diameter, in the laboratory and in the model: their 95 % intervals do not meet."""
    found = stages.validation
    if found is None or found.measured_exponent is None or found.simulated_exponent is None:
        return
    lab, model = found.measured_exponent, found.simulated_exponent
    if lab.low is None or lab.high is None or model.low is None or model.high is None:
        return
    if lab.low <= model.high and model.low <= lab.high:
        return
    sentence = (
        f"validation: measured force grows as d^{lab.value:.2f} ({lab.low:.2f} to {lab.high:.2f}), simulated as "
        f"d^{model.value:.2f} ({model.low:.2f} to {model.high:.2f}): no parameters fit all diameters"
    )
    yield Found(
        "validation: growth", "value", f"d^{model.value:.2f}", f"d^{lab.value:.2f}", sentence, "conclusion", "growth"
    )


# ---- names and laws


def shear_modulus_is_impossible(study: Study, _stages: Calibrated) -> Iterator[Found]:
    """A factor called shear modulus whose range no E and ν of the study allow: G = E/(2(1 + ν))."""
    called = study.published.called if study.published is not None else {}
    for factor in study.factors:
        name = called.get(factor.name, factor.label)
        if "shear modulus" not in name.lower() or not {"elastic_modulus", "poisson_ratio"} <= set(study.names):
            continue
        e, nu = study.factor("elastic_modulus"), study.factor("poisson_ratio")
        low, high = e.low / (2.0 * (1.0 + nu.high)), e.high / (2.0 * (1.0 + nu.low))
        same = factor.unit == e.unit
        if same and (factor.high < low or factor.low > high):
            sentence = (
                f"factors: {name} of {factor.low:g} to {factor.high:g} {factor.unit} is impossible with E of {e.low:g} "
                f"to {e.high:g} {e.unit} and Poisson's ratio of {nu.low:g} to {nu.high:g}: E/(2(1 + ν)) is {low:.0f} "
                f"to {high:.0f} {e.unit}; it is the tangent modulus of the hardening law"
            )
            printed = f"{factor.low:g} to {factor.high:g} {factor.unit}"
            computed = f"{low:.0f} to {high:.0f} {e.unit}"
            yield Found(f"factors: {name}", "law", printed, computed, sentence, "method", f"called {name}")


def exponent_is_inverted(study: Study, _stages: Calibrated) -> Iterator[Found]:
    """The strain-rate law printed with P where the usual law has 1/P."""
    if study.published is None or study.published.rate_law != "paper" or "strain_rate_p" not in study.names:
        return
    c, p = study.factor("strain_rate_c"), study.factor("strain_rate_p")
    rate = 1.0
    printed, usual = (1.0 + (rate / c.centre) ** exponent for exponent in (p.centre, 1.0 / p.centre))
    sentence = (
        f"law: 1 + (rate/C)^P is printed, the law of Cowper and Symonds has 1/P; at 1 1/s, C {c.centre:g} and P "
        f"{p.centre:g}, the first raises the yield stress by {100.0 * (printed - 1.0):.2g} %, the second by "
        f"{100.0 * (usual - 1.0):.0f} %"
    )
    yield Found("law: strain rate", "law", "(rate/C)^P", "(rate/C)^(1/P)", sentence, "method", "rate law")


# ---- tests


def stars_differ(study: Study, stages: Calibrated) -> Iterator[Found]:
    """Printed stars against the p-values of the data: two below 0.01, one below 0.05."""
    published = study.published
    if published is None:
        return
    screened = {effect.factor: effect.p for effect in stages.screen.effects}
    analysed = {term_of(study, row.source): row.p for row in stages.surface.as_published}
    for name, path, p_of in (("screening", published.screening, screened), ("anova", published.anova, analysed)):
        if path is None:
            continue
        header, rows = table(path)
        if "stars" not in header:
            continue
        for cells in rows:
            term, printed = term_of(study, cells[0]), cells[header.index("stars")].strip()
            p = p_of.get(term)
            due = "" if p is None else next((stars for level, stars in _STARRED if p < level), "")
            if p is not None and printed != due:
                sentence = f"{name}: {term} is printed with {_stars(printed)}, its p of {p:.2g} asks for {_stars(due)}"
                yield Found(
                    f"{name}: stars of {term}", "value", printed or "none", due or "none", sentence, "conclusion",
                    f"{name} {term}",
                )  # fmt: skip


def _stars(stars: str) -> str:
    return {"": "no star", "*": "one star"}.get(stars, "two stars")


def lack_of_fit_rests_on_one_run(_study: Study, stages: Calibrated) -> Iterator[Found]:
    """A lack of fit that one run left out makes significant, far from it before."""
    row = stages.surface.anova_row("Lack of fit")
    if row is None or row.p is None or row.p < 0.1:
        return
    told = [(run, run.lack_of_fit_p_without) for run in stages.surface.runs_diagnostics]
    changed = [(run, p) for run, p in told if p is not None and p < 0.02]
    if len(changed) != 1:
        return
    run, p = changed[0]
    sentence = (
        f"lack of fit: its p of {row.p:.3f} rests on run {run.run} ({run.response:g} N); without that run it is {p:.3f}"
    )
    yield Found("lack of fit", "design", f"p {row.p:.3f}", f"p {p:.3f}", sentence, "conclusion", "lack of fit")


CONSISTENCY: tuple[Check, ...] = (
    level_is_misprinted,
    levels_are_swapped,
    surface_contradicts_screening,
    solver_misses_target,
    growth_differs,
    stars_differ,
    lack_of_fit_rests_on_one_run,
    equation_takes_coded_values,
    shear_modulus_is_impossible,
    exponent_is_inverted,
)


def explained(found: list[Found]) -> list[Found]:
    """Tell each cell once, as it is with a misprinted level mended; a level or a term stands with what it explains."""
    last = {one.place: one for one in found}
    wrong = [one for one in last.values() if one.place.startswith("coefficients:") and one.consequence == "result"]
    if len(wrong) == 1 and (equation := last.get(EQUATION)) is not None:
        last[EQUATION] = replace(equation, cause=wrong[0].cause)
    return sorted(last.values(), key=lambda one: not (one.cause.startswith(_LEVEL) and one.consequence == "result"))
