"""Values that are possible but probably mistakes, such as a wrong unit: outside the usual range of stems and blades."""

import math
from collections.abc import Iterator
from itertools import combinations
from statistics import median

from stemcal.formats import counted
from stemcal.study.model.growth import Growth, Interpolated, value_at
from stemcal.study.model.layers import layers_at
from stemcal.study.model.measured_targets import Target
from stemcal.study.model.shear_test import Relative
from stemcal.study.model.study import Study
from stemcal.study.rules.factors import extremes_of
from stemcal.study.types import units
from stemcal.study.types.factor import PARAMETERS, SETTINGS, in_unit
from stemcal.study.types.field_types import Length
from stemcal.study.types.solver_kind import ElementCounts
from stemcal.study.types.stage_kind import STAGES
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.vocabulary import DIAMETER, FIRST, FORCE, TRAVEL

_RANGES: dict[tuple[str, str], tuple[float, float, str]] = {
    (setting.section, name): (*setting.parameter.plausible, setting.parameter.unit)
    for name, setting in SETTINGS.items()
    if setting.parameter.unit != "1"
} | {
    ("specimen", "length"): (5, 1000, "mm"),
    ("specimen", "bore"): (0.1, 500, "mm"),
    ("blade", "width"): (1, 500, "mm"),
    ("blade", "edge_spread"): (0.05, 10, "mm"),
    ("material", "internal_length"): (0.05, 20, "mm"),
    ("loading", "duration"): (1e-5, 1000, "s"),
    ("loading", "stroke"): (0.01, 500, "mm"),
    ("solver", "element_size"): (0.05, 10, "mm"),
    ("solver", "filter_window"): (1e-5, 1, "s"),
    ("solver", "time_limit"): (1, 1e7, "s"),
    ("solver", "time_step"): (1e-6, 1e-3, "s"),
}
# Lowest, usual and highest exponent of the cutting force as a power of the diameter. A measured force is doubtful if it
# differs by more than the factor _FAR from all forces extrapolated with these exponents from the other targets.
_POWERS, _FAR = (1.5, 2.5, 3.5), 3.0
# Fewer elements through the wall than _THROUGH are doubtful; with a bore ratio above _THIN, fewer than _THROUGH_THIN.
_THROUGH, _THROUGH_THIN, _THIN = 3, 4, 0.6
# Largest element size relative to the internal length and to the edge spread.
_RESOLVED = 0.6
# Largest element size relative to the blade thickness. At 0.75 the error of the force is below 1 %; at 0.94 the force
# is 5 % too low, at 1.25 it is 11 % too low.
_OF_BLADE = 0.75
# In a whole cut, ends that reach at least this share of the diameter beyond the supports do not break or slide off.
_BEYOND = 0.6
_MOST_SHEAR = 0.05  # largest share of shear in a deflection
_LEAST_SCATTER = 3e-4  # smallest plausible ratio of standard deviation to mean
_SCATTER = 0.15  # a force that is less than this share below the expected force may be scatter
_MACHINE, _MOWER = 50.0, 1000.0  # mm/s: the fastest testing machine, the slowest mower
# Largest smoothed strain rate of a cut over speed/diameter; it was 3.9 to 5.4 in simulations without a rate law.
_RATE = 4.0
_RATIO = (1e-3, 2.0)  # plausible ratio of a stress across the axis to the stress along it
FALL = "the simulated values decrease by up to 10 % if the element size is reduced by a third"


def doubts(study: Study) -> list[Finding]:
    """Return a finding for each value that is probably, but not certainly, a mistake."""
    virtual = (_sizes, _speeds, _rates, _tests, _spans, _ends, _mesh)
    questions = (*virtual, _targets, _scatters, _outliers, _falls, _materials, _factors, _agreement)
    findings = [finding for question in questions for finding in question(study)]
    return [*findings, *(finding for stage in STAGES.with_(study.further) for finding in stage.doubts(study))]


def _sizes(study: Study) -> Iterator[Finding]:
    for path, (low, high, unit) in _RANGES.items():
        value = value_at(getattr(getattr(study, path[0]), path[1], None), study.specimen.outer_diameter, None, {})
        if value:  # 0 and an omitted value are plausible
            yield from doubt(path, value, low, high, unit)


def _speeds(study: Study) -> Iterator[Finding]:
    speeds: dict[NodePath, float] = {("loading", "speed"): study.loading.speed}
    speeds |= {("tests", index, "speed"): test.speed for index, test in enumerate(study.tests)}
    for path, speed in speeds.items():
        if _MACHINE < speed < _MOWER:
            message = f"the speed of {speed:g} mm/s exceeds the maximum speed of testing machines ({_MACHINE:g} mm/s)"
            yield Finding(path, message, "check the unit; testing machine speeds are usually given in mm/min")


def _rates(study: Study) -> Iterator[Finding]:
    """Question the law 1 + (ε̇/C)^P if ε̇ approaches C: above C, the factor becomes large and depends on the mesh."""
    if study.solver.rate != "paper":
        return
    least = {factor.name: factor.low for factor in study.factors if factor.name == "strain_rate_c"}
    each = {d: study.parameters({**study.midlevels(), **least}, d)["strain_rate_c"] for d in _conditions(study)}
    diameter, c = min(each.items(), key=lambda of_diameter: of_diameter[0] * of_diameter[1])
    cuts = {("tests", index, "speed"): test.speed for index, test in enumerate(study.tests) if test.is_further_cut}
    own: dict[NodePath, float] = {("loading", "speed"): max(extremes_of(study, study.factors, "speed"))}
    for path, speed in (own | cuts).items():
        rate = _RATE * speed / diameter
        if 0.0 < c <= rate:
            message = (
                f"at {speed:g} mm/s and a diameter of {diameter:g} mm, strain rates reach about {rate:.0f}/s, but "
                f"`rate_law: paper` is valid only well below C = {c:.3g}/s"
            )
            yield Finding(path, message, "write `rate_law: cowper_symonds` under `solver`")


def _tests(study: Study) -> Iterator[Finding]:
    for index, test in enumerate(study.tests):
        late = [kind.name for kind in test.responses if kind.varies_with_mesh and kind.name in test.measured]
        if test.is_further_cut and late:
            yield Finding(("tests", index), f"{' and '.join(late)}: {FALL}", "fit only the maximum force")
        for key, (low, high) in test.plausible.items():
            if (length := getattr(test, key)) is not None:
                mm = length.at(study.targets.calibrate_at) if isinstance(length, Length) else length
                yield from doubt(("tests", index, key), mm, low, high, "mm")


def _spans(study: Study) -> Iterator[Finding]:
    """Question a bending span that is too short for a stem with fibres, whose shear modulus is small."""
    diameter = study.targets.calibrate_at
    stem = layers_at(study, {}, diameter) if study.is_layered else ()
    softness = [law.along["elastic_modulus"] / law.across["shear_modulus"] for law in stem if law.across is not None]
    for index, test in enumerate(study.tests if softness else ()):
        over = test.shear_over_bending(diameter, study.specimen.ratio_at(diameter), max(softness))
        if (share := over / (1.0 + over)) > _MOST_SHEAR:
            span = test.span.at(diameter)  # type: ignore[attr-defined]
            enough = span * math.sqrt(over * (1.0 / _MOST_SHEAR - 1.0))
            message = (
                f"{100 * share:.0f} % of the deflection is due to shear (E/G = {max(softness):.3g}), so the slope also "
                "depends on the shear modulus"
            )
            remedy = f"for {100 * _MOST_SHEAR:.0f} % or less, use a span of {enough:.0f} mm ({enough / diameter:.0f} d)"
            yield Finding(("tests", index, "span"), message, remedy)


def _whole_cuts(study: Study) -> Iterator[Study]:
    """Yield the study, and the study with each further cutting test in its place, at both ends of all factors."""
    for end in ("low", "high") if study.loading.until == "severed" else ():
        cut = study.at({factor.name: getattr(factor, end) for factor in study.factors})
        yield from (cut, *(cut.model_copy(update=test.in_place_of(cut)) for test in study.tests))


def _ends(study: Study) -> Iterator[Finding]:
    """Question a specimen whose ends are too near to the supports in a whole cut."""
    thickest, spans = max(_conditions(study)), [cut for cut in _whole_cuts(study) if cut.supports.kind == "span"]
    apart = [cut.supports.clearance + 2.0 * (cut.supports.fillet_radius + _BEYOND * thickest) for cut in spans]
    if (least := max(apart, default=0.0)) * (1.0 - 1e-9) > study.specimen.length:
        message = f"the ends of a {thickest:g} mm stem can break or slide off the supports, which lowers its force"
        yield Finding(("specimen", "length"), message, f"use at least {math.ceil(least)} mm")


def _mesh(study: Study) -> Iterator[Finding]:
    """Question elements that are too large for the edge spread, the internal length or the blade, and lengths of 0."""
    mesh = study.solver.mesh
    if mesh is None or not study.solver.has_lengths:
        return
    yield from _wall(study, mesh)
    conditions = _conditions(study)
    for path, length in study.lengths.items():
        least = min(conditions, key=length.at)
        if length.at(least) == 0.0:
            message = f"without `{path[1]}`, the force depends on the mesh"
            remedy = "write `edge_spread: d/9.5` under `blade` and `internal_length: d/4.5` under `material`"
            yield Finding(path, message, remedy)
            continue
        coarse = [d for d in conditions if mesh.element_size.at(d) > _RESOLVED * length.at(d) * (1.0 + 1e-9)]
        if coarse:
            whole = f"`{'.'.join(path)}` ({length}) at a diameter of {coarse[0]:g} mm"
            message = f"the element size of {mesh.element_size} exceeds {_RESOLVED:g} times {whole}"
            remedy = f"use at most {_RESOLVED * length.at(coarse[0]):.2g} mm; otherwise, the force depends on the mesh"
            yield Finding(("solver", "element_size"), message, remedy)
    blade = min((cut.blade.thickness for cut in _whole_cuts(study)), default=math.inf)
    if (size := max(map(mesh.element_size.at, conditions))) > _OF_BLADE * blade * (1.0 + 1e-9):
        message = f"the element size of {size:.3g} mm exceeds {_OF_BLADE:g} times the blade thickness ({blade:g} mm)"
        remedy = f"use at most {_OF_BLADE * blade:.2g} mm; otherwise, the force of a whole cut is too low"
        yield Finding(("solver", "element_size"), message, remedy)


def _wall(study: Study, mesh: ElementCounts) -> Iterator[Finding]:
    if mesh.through_wall is not None and mesh.through_wall >= _THROUGH:
        return
    for diameter in () if study.layers else _conditions(study):
        if (ratio := study.specimen.ratio_at(diameter)) == 0.0:
            continue
        wall = 0.5 * diameter * (1.0 - ratio)
        elements = min(wall / mesh.element_size.at(diameter), 1e300)  # finite even for a tiny element size
        count = mesh.through_wall or max(1, math.ceil(elements - 1e-9))
        if count < (_THROUGH_THIN if ratio > _THIN else _THROUGH):
            message = (
                f"the {wall:.3g} mm wall has only {counted(count, 'element')} through its thickness, so the force "
                "depends on the mesh"
            )
            remedy = f"write `elements_through_wall: {_THROUGH_THIN}` in the `solver` section"
            yield Finding(("solver", "element_size"), message, remedy)
            return


def _conditions(study: Study) -> list[float]:
    if "outer_diameter" in study.names and study.kind.parameters:
        return extremes_of(study, study.factors, "outer_diameter")
    return sorted({study.targets.calibrate_at, *(target.condition for target in study.targets.means)})


def _targets(study: Study) -> Iterator[Finding]:
    for target in study.targets.means:
        path = ("targets", target.row)
        if study.naming.condition == DIAMETER:
            yield from doubt((*path, "diameter"), target.condition, 1, 100, "mm")
        if study.naming.response == FORCE:
            yield from doubt((*path, "force"), target.response, 1, 1e5, "N")
        if 0.0 in (target.sd, *(mean.sd for mean in target.further.values())):
            message = "the mean has a standard deviation of 0 and therefore dominates a joint fit"
            yield Finding((*path, "sd"), message, "omit `sd` if the standard deviation is unknown")
        travel, _ = target.mean_of(TRAVEL.name)
        stroke = study.loading.stroke_at(target.condition)
        if TRAVEL.name in study.fitted_responses and travel is not None and travel > stroke:
            message = f"the travel of {travel:g} mm exceeds the simulated blade travel of {stroke:.3g} mm"
            yield Finding((*path, "travel"), message, f"increase `loading.{''.join(study.loading.written)}`")


def _scatters(study: Study) -> Iterator[Finding]:
    for target in study.targets.means:
        for named in study.naming.responses:
            mean, sd = target.mean_of(FIRST if named == study.naming.response else named.name)
            if mean and sd and not named.apart and not _LEAST_SCATTER <= sd / mean <= 1.0:
                message = f"a standard deviation of {named.text(sd)} is not plausible for a mean of {named.text(mean)}"
                yield Finding(("targets", target.row, named.name), message, "check both values and their units")


def _outliers(study: Study) -> Iterator[Finding]:
    targets = study.targets.means
    if len(targets) < 2 or not study.kind.parameters:
        return
    for target in targets:
        expected = [
            other.response * (target.condition / other.condition) ** power
            for other in targets
            if other is not target
            for power in _POWERS
        ]
        if target.response > _FAR * max(expected) or target.response < min(expected) / _FAR:
            message = (
                f"the force of {target.response:g} N for a diameter of {target.condition:g} mm is far from the "
                f"force of about {median(expected):.3g} N expected from the other targets"
            )
            yield Finding(("targets", target.row, "force"), message, "check the decimal point and the unit")


def _falls(study: Study) -> Iterator[Finding]:
    if not study.naming.is_force_on_stems:
        return
    far = {finding.path[1] for finding in _outliers(study)}
    stems = [target for target in study.targets.means if target.response > 0.0 and target.row not in far]
    stems.sort(key=lambda target: target.condition)
    pairs = [(_shortfall(*pair), *pair) for pair in combinations(stems, 2)]
    short, thin, thick = max(pairs, key=lambda pair: pair[0], default=(0.0, None, None))
    if short > 0.0 and thin is not None and thick is not None:
        message = (
            f"the force falls from {thin.response:g} N for a diameter of {thin.condition:g} mm to {thick.response:g} N "
            f"for {thick.condition:g} mm, but cutting forces increase with the diameter"
        )
        remedy = "check that both rows are measurements of the same stems, and delete rows left over from a template"
        yield Finding(("targets", thick.row, "force"), message, remedy)


def _shortfall(thin: Target, thick: Target) -> float:
    """Return the shortfall of the force of the thicker stem minus its tolerance; 0 if the force increases.

    The shortfall is ln(F expected / F), with F ~ d^1.5 expected; the tolerance is 2 standard errors, at least 15 %.
    """
    if thick.response >= thin.response:
        return 0.0
    squares = sum(((target.sd or 0.0) / target.response) ** 2 / (target.n or 1) for target in (thin, thick))
    grown = thin.response * (thick.condition / thin.condition) ** min(_POWERS)
    return math.log(grown / thick.response) - max(2.0 * math.sqrt(squares), _SCATTER)


def _materials(study: Study) -> Iterator[Finding]:
    for place in study.places.values():
        parameter, fixed, path = place.parameter, place.value, place.path
        if isinstance(fixed, Relative) and fixed.is_ratio:
            yield from doubt(path, fixed.value, *_RATIO, "1")
            continue
        fixed = fixed.value if isinstance(fixed, Relative) else fixed
        if isinstance(fixed, Length | Interpolated):
            for diameter in _conditions(study):
                yield from doubt(path, fixed.at(diameter), *parameter.plausible, parameter.unit)
        elif fixed is not None and not isinstance(fixed, Growth):
            yield from doubt(path, units.from_internal(fixed, parameter.unit), *parameter.plausible, parameter.unit)
    for name, growth in study.material.growing().items():
        yield from doubt(("material", name, "at"), growth.at, 1, 100, "mm")
        parameter, diameters = PARAMETERS[name], _conditions(study)
        values = [units.from_internal(study.parameters({}, d)[name], parameter.unit) for d in diameters]
        for value in {min(values), max(values)}:
            yield from doubt(("material", name), value, *parameter.plausible, parameter.unit)


def _factors(study: Study) -> Iterator[Finding]:
    for index, factor in enumerate(study.factors):
        path = ("factors", index)
        try:
            unit = units.parse_unit(factor.unit)
        except units.UnitError as error:
            meant = error.remedy if "did you mean" in error.remedy else "the levels are used without unit conversion"
            yield Finding((*path, "unit"), error.message, meant)
            continue
        place = study.places.get(factor.name)
        parameter = place.parameter if place else None
        is_ratio = parameter is not None and parameter.relative and unit.dimension == "dimensionless"
        if parameter is None or not (is_ratio or unit.dimension == parameter.dimension):
            continue
        usual = (_RATIO, "1") if is_ratio else (parameter.plausible, parameter.unit)
        for level in ("low", "high"):
            shown = units.from_internal(factor.internal(getattr(factor, level)), usual[1])
            yield from doubt((*path, level), shown, *usual[0], usual[1])


def _agreement(study: Study) -> Iterator[Finding]:
    at, stem = study.targets.calibrate_at, study.specimen.outer_diameter
    written = "outer_diameter" in study.specimen.model_fields_set
    if study.naming.condition == DIAMETER and written and not math.isclose(at, stem, rel_tol=1e-9):
        message = f"the parameters are calibrated at a diameter of {at:g} mm, not at {stem:g} mm"
        remedy = "add a row for this diameter to `targets`, or omit `outer_diameter`"
        yield Finding(("specimen", "outer_diameter"), message, remedy)


def doubt(path: NodePath, value: float, low: float, high: float, unit: str) -> Iterator[Finding]:
    """Yield a finding if a value is outside its plausible range from `low` to `high`, all in `unit`."""
    if low * (1 - 1e-9) <= value <= high * (1 + 1e-9):
        return
    usual = f"{low:g} to {in_unit(high, unit)}"
    message = f"{in_unit(value, unit)} is outside the usual range for stems and blades ({usual})"
    yield Finding(path, message, "check the unit")
