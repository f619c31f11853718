"""Several measured means at once: the parameters that fit them all.

At a condition (a diameter) each response (force, travel and work to the maximum force) has a surface of its own.
"""

from collections.abc import Iterator, Sequence

from stemcal.doe.calibration.contradiction import LEVEL, allowed_by_others, contradiction, out_of_reach
from stemcal.doe.calibration.joint_fit import JointFit, best_worst_error, fit_jointly, leave_one_out
from stemcal.doe.calibration.misfit import Misfit, best_fit
from stemcal.doe.calibration.profile import chance_of_rise
from stemcal.doe.calibration.ridge import presses_outwards
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.doe.validation.null_model import null_model
from stemcal.files.rows import Rows
from stemcal.naming import FIRST
from stemcal.stages.invert.certainty import (
    Measured,
    certainty_of,
    changes_along,
    measured_of,
    misfit_over,
    prior_rows,
    priors_of,
)
from stemcal.stages.invert.result import (
    Contradicted,
    FlatDirection,
    InvertResult,
    JointFitted,
    JointRow,
    MachineContradicted,
    MachineFound,
    Mean,
    Point,
)
from stemcal.stages.result import Head, Interval
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import MachineSection, Study

_NORMAL = 1.96  # of a normal distribution 95 % are within so many standard deviations
_UNTOLD = 1e-4  # of the variance of what is known of the machine: of less the curves tell nothing


def measured_means(study: Study) -> list[Measured]:
    """Return what the joint fit is made to: every response measured at its diameters."""
    return [
        mean for target in study.joint_targets for mean in measured_of(target, study.invert.responses, study.naming)
    ]


def joint_surfaces(study: Study, surface: SurfaceResult, further: Sequence[tuple[Array, Array]] = ()) -> list[Surface]:
    """Return the surface of every measured mean, in their order; `further` are points and the responses there."""
    at = {part.condition: part for part in surface.conditions}
    return [
        surface.refitted(at[mean.condition].runs, [(x, float(found[i])) for x, found in further], mean.response)
        for i, mean in enumerate(measured_means(study))
    ]


def misfit_of_study(study: Study, surface: SurfaceResult) -> Misfit:
    """Return the misfit of everything that the parameters are fitted to, priors among it."""
    region, jointly = surface.region(study), bool(study.joint_targets)
    means = measured_means(study) if jointly else measured_of(study.calibration_target, [FIRST], study.naming)
    surfaces = joint_surfaces(study, surface) if jointly else [surface.fitted]
    return misfit_over(means, surfaces, region).with_priors(priors_of(study, surface.scales), region)


def solve_jointly(study: Study, head: Head, surface: SurfaceResult) -> InvertResult:
    """Return the parameters that fit all diameters and responses of the spec best."""
    coding, means, target = surface.scales, measured_means(study), study.calibration_target
    region = surface.region(study)
    priors = priors_of(study, coding)
    misfit = misfit_of_study(study, surface)
    fit = fit_jointly(misfit, region)
    first = measured_of(target, [FIRST], study.naming)
    if first[0] in means:
        single = misfit.alone(means.index(first[0]), fit.misfit)
    else:  # a joint fit may leave the force at the calibration diameter out
        single = misfit_over(first, [surface.fitted], region).with_priors(priors, region)
    point = Point.of(surface.assess(study, fit.coded), coding)
    known = certainty_of(study, coding, misfit, region, "joint", fit.coded)
    return InvertResult.of(
        study,
        head,
        surface.radius,
        point,
        known,
        rule="joint_least_squares",
        joint=_fitted(study, means, misfit, region, fit, coding),
        certainty_alone=certainty_of(study, coding, single, region, "single", fit.coded),
        priors=prior_rows(study, coding),
        notes=(
            *(FlatDirection(changes_along(coding, row), known.units) for row in fit.flat),
            *machine_found(study.machine, misfit, best_fit(misfit, region)),
        ),
    )


def machine_found(machine: MachineSection, misfit: Misfit, x: Array) -> Iterator[MachineFound]:
    """Yield what the fit tells of the machine: z deviations of its compliance or of the toe."""
    known = ("stiffness", machine.stiffness or 0.0, machine.stiffness_sd), ("toe", 0.0, machine.toe_sd)
    for of, stated, sd in known:
        if told := misfit.told_of(of, x):
            z, spread = told
            scatter = max(1.0 - spread**2, _UNTOLD)
            kind = MachineFound
            if chance_of_rise(z**2 / scatter, misfit.scale_df) < LEVEL:  # then by the curves alone
                kind, z, spread = MachineContradicted, z / scatter, spread / scatter**0.5
            ends = [z - _NORMAL * spread, z + _NORMAL * spread]
            low, high = (_stiffness(stated, sd, end) if stated else sd * end for end in ends)
            yield kind(of, stated, sd, low, high)


def _stiffness(stated: float, sd: float, z: float) -> float | None:
    """Return k of the compliance 1/k₀ − z·sd/k₀²; None where that is not above 0, as a rigid machine's."""
    compliance = (1.0 - z * sd / stated) / stated
    return 1.0 / compliance if compliance > 0.0 else None


def _fitted(
    study: Study, means: Sequence[Measured], misfit: Misfit, region: Region, fit: JointFit, coding: Coding
) -> JointFitted:
    conditions, naming = [mean.condition for mean in means], study.naming
    several, own = len(set(conditions)) > 1, not naming.is_cutting
    tests = [study.test_of(mean.response) for mean in means]
    apart = len(set(tests)) > 1  # then a test is held out, at all its conditions
    groups = tests if apart else conditions if several else None
    left_out = leave_one_out(misfit, region, groups) if apart or several or not own else []
    intervals = allowed_by_others(misfit, region, tests) if apart else [None] * len(means)
    responses = [i for i, mean in enumerate(means) if mean.leads]
    worst, where = best_worst_error(misfit.only(responses), region)
    every = _rows(means, fit, left_out, intervals)
    rows = Rows(every[i] for i in responses)
    first = [row for mean, row in zip(means, every, strict=True) if mean.response == FIRST]
    measured = [row.condition for row in first], [row.measured for row in first]
    return JointFitted(
        rows=rows,
        further=Rows(row for i, row in enumerate(every) if i not in responses),
        scatter="misfit" if misfit.scatter == "joint" else misfit.scatter,
        misfit=fit.misfit if misfit.scatter not in ("misfit", "joint") or misfit.tests_priors else None,
        df=fit.df,
        p=fit.p_value,
        max_abs_error_percent=max(abs(row.error_percent) for row in rows),
        max_abs_left_out_error_percent=max((abs(left_out[i]) for i in responses), default=None) if left_out else None,
        best_worst_error_percent=worst,
        best_worst_solution=coding.by_name(coding.to_natural(where)),
        null=null_model(*measured) if naming.is_force_on_stems else None,
        contradiction=_contradiction(means, misfit, region),
        out_of_reach=Rows(Mean(means[i].named.name, means[i].condition) for i in out_of_reach(misfit, region)),
        separated=not len(fit.flat),
        presses_outwards=presses_outwards(misfit, region, fit.coded),
    )


def _contradiction(means: Sequence[Measured], misfit: Misfit, region: Region) -> Contradicted | None:
    found = contradiction(misfit, region)
    if found is None:
        return None
    mean, (low, high) = means[found.index], found.allowed
    return Contradicted(mean.named.name, mean.condition, mean.value, low, high, found.standard_errors, found.p)


def _rows(
    means: Sequence[Measured], fit: JointFit, left_out: Sequence[float], intervals: Sequence[Interval | None]
) -> list[JointRow]:
    without: Sequence[float | None] = left_out or [None] * len(means)
    return [
        JointRow(
            mean.condition,
            mean.named.name,
            mean.named.unit,
            mean.value,
            mean.sd,
            mean.n,
            float(predicted),
            float(error),
            apart,
            interval,
        )
        for mean, predicted, error, apart, interval in zip(
            means, fit.predicted, fit.errors_percent, without, intervals, strict=True
        )
    ]
