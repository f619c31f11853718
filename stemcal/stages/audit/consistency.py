"""What a paper's own runs, equation, names and forces say of each other."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from stemcal.doe.regression.least_squares import Array, t_quantile
from stemcal.doe.regression.surface import fit_surface
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.stages.audit.found import Calibrated, Check, Found
from stemcal.stages.audit.paper import cell_found
from stemcal.stages.audit.suspicions import EquationMissesTarget, SignDefiesLaw
from stemcal.stages.printed_tables import (
    Audited,
    Contradiction,
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
_FAR_PERCENT, _OUTSIDE_PERCENT = 5.0, 3.0
_STARRED = ((0.01, "**"), (0.05, "*"))


Ends = tuple[float, float]


# ---- levels


class MisprintedLevel(Contradiction):
    """A level that should read another, and how many cells of the surface's tables each of the two brings out."""

    factor: str
    printed: float
    level: float
    agree_printed: int
    agree: int
    of: int


class LevelsSwapped(Contradiction):
    """A printed effect has the other sign, while all else of its row agrees."""

    factor: str
    printed: str
    value: float

    @property
    def of_sign(self) -> bool:
        """It is about the sign."""
        return True


def level_is_misprinted(study: Study, stages: Calibrated) -> Iterator[Found]:
    """A level of the runs that, changed in its last digits, makes the printed analysis come out."""
    surface, audited = stages.surface, stages.surface.published
    if audited is None or len(audited.differences) < 5:
        return
    best = max(_changed(study, surface), key=lambda change: change[0].agree, default=None)
    if best is None or best[0].agree - audited.agree < _MENDED * (audited.of - audited.agree):
        return
    found, name, printed, level = best
    cause = f"misprint:{name}"
    misprint = MisprintedLevel(name, printed, level, audited.agree, found.agree, audited.of)
    yield Found(misprint, "result", cause)
    again = {_cell(different) for different in found.differences}
    for different in audited.differences:
        if _cell(different) not in again:
            yield Found(different, "print", cause)
    yield from map(cell_found, found.differences)


def _cell(different: Difference) -> tuple[str, str, str]:
    return different.table, different.cell.term, different.cell.column


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
        signs = [d.cell for d in audited.differences if d.of_sign and d.table == "screening"]
        for cell in signs:
            swapped = LevelsSwapped(cell.term, cell.printed, cell.value or 0.0)
            yield Found(swapped, "result", f"screening:{cell.term}")


# ---- surface and runs


class SurfaceContradictsScreening(Contradiction):
    """The surface at levels where the screening had runs, whose responses were from `low` to `high`."""

    levels: dict[str, float]
    surface: float
    low: float
    high: float


class NaturalBounds(Contradiction):
    """A coded equation bounded in natural values: what it gives for these, at the solution or else at a corner."""

    response: float
    at_solution: bool


class SolverMissesTarget(Contradiction):
    """The solver's own response where the target was solved for, and the surface's 95 % prediction interval."""

    simulated: float
    target: float
    percent: float
    interval: Ends | None
    outside: bool


class GrowthDiffers(Contradiction):
    """The exponents of the response over the condition with their 95 % intervals, which do not meet."""

    measured: float
    measured_interval: Ends
    simulated: float
    simulated_interval: Ends


def surface_contradicts_screening(_study: Study, stages: Calibrated) -> Iterator[Found]:
    """The surface where the screening had runs, against what these gave.

    The runs at one corner of the surface's factors scatter by the effects of the others, (e/2)² each.
    """
    surface, screen = stages.surface, stages.screen
    others = sum(0.25 * e.effect**2 for e in screen.effects if e.factor not in surface.names)
    worst, contradiction = 0.0, None
    for runs, coded in _corners(stages):
        low, high = (float(end) for end in surface.fitted.prediction_interval(coded)[0])
        at = float(surface.fitted.predict(coded)[0])
        responses = [run.response or 0.0 for run in runs]
        apart = abs(at - float(np.mean(responses)))
        reach = 0.5 * (high - low) + t_quantile(0.95, max(screen.residual.df, 1)) * (others / len(runs)) ** 0.5
        if apart - reach > worst:
            levels = {name: runs[0].levels[name] for name in surface.names}
            worst = apart - reach
            contradiction = SurfaceContradictsScreening(levels, at, min(responses), max(responses))
    if contradiction is not None:
        yield Found(contradiction, "result")


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
    yield Found(NaturalBounds(worst, None not in given), "method")


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
    yield Found(SolverMissesTarget(row, target, apart, interval, outside), "result")


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
    growth = GrowthDiffers(lab.value, (lab.low, lab.high), model.value, (model.low, model.high))
    yield Found(growth, "conclusion")


# ---- names and laws


class ImpossibleShearModulus(Contradiction):
    """A range called shear modulus, and the one of E/(2(1 + ν)) that the ranges of E and ν allow; moduli in `unit`."""

    called: str
    unit: str
    range: Ends
    elastic: Ends
    poisson: Ends
    possible: Ends


class InvertedExponent(Contradiction):
    """The rate law printed with P for 1/P: by how much each raises the yield stress at 1 1/s, of C and P at centre."""

    c: float
    p: float
    printed_percent: float
    usual_percent: float


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
            moduli = ImpossibleShearModulus(
                name, factor.unit, (factor.low, factor.high), (e.low, e.high), (nu.low, nu.high), (low, high)
            )
            yield Found(moduli, "method")


def exponent_is_inverted(study: Study, _stages: Calibrated) -> Iterator[Found]:
    """The strain-rate law printed with P where the usual law has 1/P."""
    if study.published is None or study.published.rate_law != "paper" or "strain_rate_p" not in study.names:
        return
    c, p = study.factor("strain_rate_c"), study.factor("strain_rate_p")
    rate = 1.0
    printed, usual = (1.0 + (rate / c.centre) ** exponent for exponent in (p.centre, 1.0 / p.centre))
    percents = 100.0 * (printed - 1.0), 100.0 * (usual - 1.0)
    yield Found(InvertedExponent(c.centre, p.centre, *percents), "method")


# ---- tests


class StarsDiffer(Contradiction):
    """The stars of a term in a table, as printed and as its p-value asks for."""

    table: str
    term: str
    printed: str
    due: str
    p: float


class LackOfFitRestsOnRun(Contradiction):
    """The p-value of the lack of fit, and the one without a run, from 1, with its response."""

    p: float
    run: int
    response: float
    p_without: float


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
                yield Found(StarsDiffer(name, term, printed, due, p), "conclusion", f"{name}:{term}")


def lack_of_fit_rests_on_one_run(_study: Study, stages: Calibrated) -> Iterator[Found]:
    """A lack of fit that one run left out makes significant, far from it before."""
    row = stages.surface.anova_row("Lack of fit")
    if row is None or row.p is None or row.p < 0.1:
        return
    without = [(run, run.lack_of_fit_p_without) for run in stages.surface.runs_diagnostics]
    changed = [(run, p) for run, p in without if p is not None and p < 0.02]
    if len(changed) != 1:
        return
    run, p = changed[0]
    yield Found(LackOfFitRestsOnRun(row.p, run.run, run.response, p), "conclusion")


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
    last: dict[object, Found] = {_place(one.fact) or number: one for number, one in enumerate(found)}
    wrong = [one for one in last.values() if _in_equation(one.fact) and one.consequence == "result"]
    if len(wrong) == 1:
        cause = wrong[0].cause
        last = {at: _caused(one, cause, EquationMissesTarget) for at, one in last.items()}
    return sorted(last.values(), key=lambda one: not isinstance(one.fact, MisprintedLevel))


def _place(fact: Contradiction) -> tuple[str, ...]:
    """Return where in the paper a fact is found, if another may be found there."""
    match fact:
        case Difference():
            return _cell(fact)
        case LevelsSwapped(factor=factor) | SignDefiesLaw(stage="screen", factor=factor):
            return "screen", factor
    return ()


def _in_equation(fact: Contradiction) -> bool:
    return isinstance(fact, Difference) and fact.table == "coefficients"


def _caused(found: Found, cause: str, kind: type[Contradiction]) -> Found:
    return replace(found, cause=cause) if isinstance(found.fact, kind) else found
