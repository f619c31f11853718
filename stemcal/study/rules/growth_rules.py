"""Rules on material parameters that follow the diameter; each function yields what it finds wrong."""

from collections.abc import Iterator, Sequence

from stemcal.study.model import EMBEDDED, MOST_EXPONENT, PARAMETERS, Factor, Grades, Growth
from stemcal.study.rules.draft import Draft, Finding
from stemcal.study.rules.factors import reached
from stemcal.study.types import units
from stemcal.words import did_you_mean


def growth_has_one_value(draft: Draft) -> Iterator[Finding]:
    """The value at `at` is given, or that of a factor; a table by grade leaves nothing to a factor."""
    for name, growth in draft.growing.items() if draft.stem_solver else ():
        path = ("material", name)
        if name in draft.names and growth.value is not None:
            remedy = "remove its value here, or the factor" if isinstance(growth, Growth) else "remove one of them"
            yield Finding(path, f"{name} is a factor too", remedy, at_key=True)
        elif name not in draft.names and growth.value is None:
            low, high = PARAMETERS[name].plausible
            unit = "" if PARAMETERS[name].unit == "1" else f" {PARAMETERS[name].unit}"
            remedy = f"add value: … ({low:g} to {high:g}{unit}), or make {name} a factor"
            yield Finding(path, f"{name} has no value at its diameter", remedy, at_key=True)


def exponents_are_factors(draft: Draft) -> Iterator[Finding]:
    """An exponent with a name is a factor, a pure number, and no parameter of its own."""
    known = {factor.name: index for index, factor in draft.factors.items()}
    for name, growth in draft.growing.items():
        path, exponent = ("material", name, "exponent"), getattr(growth, "exponent", None)
        if not isinstance(exponent, str):
            continue
        if exponent in EMBEDDED:
            free = [factor for factor in draft.names if factor not in EMBEDDED]
            yield Finding(path, f"{exponent} is a parameter itself", did_you_mean(exponent, free or ["growth"]))
        elif exponent not in draft.names:
            message = f"{exponent[:60]!r} is neither a number nor a factor of this study"
            yield Finding(path, message, f"add it to factors: {{name: {exponent[:40]}, low: -1, high: 2}}")
        elif exponent in known and (wrong := _wrong_exponent(draft.factors[known[exponent]])):
            yield Finding(("factors", known[exponent]), *wrong)


def grades_reach(draft: Draft) -> Iterator[Finding]:
    """A table by grade holds all diameters of the study."""
    for name, growth in draft.growing.items():
        low, high = growth.known_between
        outside = sorted({d for d in draft.diameters.values() if not low * (1 - 1e-9) <= d <= high * (1 + 1e-9)})
        if isinstance(growth, Grades) and outside:
            message = f"the grades, {low:g} to {high:g} mm, leave out {', '.join(f'{d:g}' for d in outside[:5])} mm"
            yield Finding(("material", name), message, f"add a grade at {outside[0]:g} mm")


def growth_is_physical(draft: Draft) -> Iterator[Finding]:
    """At every diameter, for all levels, a growing parameter has a value that a material can have."""
    for name in draft.growing if draft.stem_solver else ():
        parameter = PARAMETERS[name]
        for value in sorted({units.from_internal(value, parameter.unit) for value in reached(draft, name)}):
            if wrong := parameter.outside(value):
                unit = "" if parameter.unit == "1" else f" {parameter.unit}"
                message = f"among the diameters of this study it becomes {value:.4g}{unit}, which {wrong}"
                yield Finding(("material", name), message, "correct value, exponent or their ranges")
                break


def growth_is_seen(draft: Draft) -> Iterator[Finding]:
    """A surface that varies an exponent is fitted at another diameter than the one where it changes nothing."""
    if draft.targets is None or draft.invert is None or draft.rsm is None or isinstance(draft.rsm.factors, str):
        return
    joint: Sequence[float] | str = draft.invert.conditions or [draft.targets.calibrate_at]
    fitted = [target.condition for target in draft.targets.means] if isinstance(joint, str) else joint
    for name, growth in draft.growing.items():
        if not isinstance(growth, Growth) or growth.exponent not in draft.rsm.factors or growth.exponent in EMBEDDED:
            continue
        if all(abs(d - growth.at) < 1e-9 * growth.at for d in fitted):
            message = f"at {growth.at:g} mm, the only diameter that is fitted, {growth.exponent} changes nothing"
            remedy = "write diameters: all under invert, or another diameter as `at`"
            yield Finding(("material", name, "at"), message, remedy)


def _wrong_exponent(factor: Factor) -> tuple[str, str] | None:
    """Return what keeps a factor from being an exponent, and the remedy."""
    if factor.unit != "1":
        return "an exponent is a pure number", "remove its unit"
    if max(abs(factor.low), abs(factor.high)) > MOST_EXPONENT:
        return f"{factor.low:g} to {factor.high:g} are no exponents", f"stay within ±{MOST_EXPONENT:g}"
    return None
