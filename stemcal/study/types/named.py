"""Responses and conditions that a spec names itself, and targets written under these names.

Here these names end: the study has neutral ones (`Target.response`, `Target.condition`). Values are in the units that
the spec declares. Where there is no condition, every run is `NOWHERE`.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError, core_schema

from stemcal.naming import CUTTING, DIAMETER, FIRST, FORCE, NOWHERE, Named, Naming
from stemcal.study.types import units
from stemcal.study.types.field_types import MOST, Quantity, complain
from stemcal.study.types.placeholders import CHANCE

Wrong = tuple[tuple[str | int, ...], str, str]
"""Where something is wrong below a section, the message and the remedy."""
CONVERTED = "converted"  # in a context of reading: values are numbers in the declared units already
_BESIDE = ("sd", "n")  # what else an entry of the targets holds
_OF_TARGETS = ("calibrate_at", "values", "tolerance_percent")


class Declared(Protocol):
    """A response or a condition as a spec declares it."""

    name: str
    symbol: str
    label: str | None
    unit: str


def naming_of(responses: Sequence[Declared], conditions: Sequence[Declared] | None) -> Naming:
    """Return what a study calls what it calibrates to; no condition is meant where only responses are declared."""
    if not responses and conditions is None:
        return CUTTING
    condition = _named(conditions[0]) if conditions else None
    if not responses:
        return Naming(condition=condition)
    return Naming(condition, tuple(map(_named, responses)))


def _named(declared: Declared) -> Named:
    """Return what a spec declares; what it says of force and diameter as the shear test knows them is just these."""
    for own in (FORCE, DIAMETER):
        if (declared.name, declared.unit, declared.label) == (own.name, own.unit, None):
            return own
    label = declared.label or declared.name.replace("_", " ").capitalize()
    return Named(declared.name, label, declared.symbol, declared.unit)


def quantity(given: Any, named: Named) -> float:
    """Return a value in the unit of what it is of: a number, or a text with a unit that measures the same.

    Raises
    ------
    PydanticCustomError
        With message and remedy.
    """
    if isinstance(given, str):
        return _written(given, named)
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise complain("should be a number", f"write it like {named.text(1.0)!r}")
    return float(given)


def _written(given: str, named: Named) -> float:
    try:
        unit = units.parse_unit(named.unit)
    except units.UnitError:
        return _in_own_unit(given, named)
    try:
        value = units.parse(given, unit.dimension)
    except units.UnitError as error:
        raise complain(error.message, error.remedy) from None
    return float(f"{units.from_internal(value, unit.name):.12g}")


def _in_own_unit(given: str, named: Named) -> float:
    """Read a value in a unit that stemcal knows by name only."""
    text = given.strip().removesuffix(named.unit).strip()
    try:
        return float(text)
    except ValueError:
        raise complain(f"{given[:60]!r} is no value in {named.unit}", f"write it like '1 {named.unit}'") from None


class OwnCondition(Quantity):
    """A value of the condition: a stem's diameter, or what the spec declares in its place."""

    def read(self, given: Any, info: core_schema.ValidationInfo) -> float:
        """Return the value, of the diameter in mm; from Python any number, since it may be of what is declared."""
        if _is_converted(info) and isinstance(given, int | float) and abs(given) <= MOST:
            return float(given)
        naming = _naming(info)
        return super().read(given, info) if naming.condition == DIAMETER else _condition(given, naming)


class OwnResponse(Quantity):
    """A value of the first response: a force, or what the spec declares in its place."""

    def read(self, given: Any, info: core_schema.ValidationInfo) -> float:
        """Return the value, of a force in N."""
        if info.context is not None and _is_converted(info):
            return float(given)
        response = _naming(info).response
        return super().read(given, info) if response == FORCE else quantity(given, response)


def _is_converted(info: core_schema.ValidationInfo) -> bool:
    """Whether values are in the units of the study: from Python, or targets that `own_targets` has read."""
    return info.context is None or CONVERTED in info.context


def responses_by_name(given: Any, info: ValidationInfo) -> Any:
    """Return the responses of a list, `FIRST` for the first; all of them for ``all``."""
    if info.context is None:
        return given
    naming = _naming(info)
    known = [response.name for response in naming.responses]
    if given == "all":
        given = known
    if not isinstance(given, list | tuple) or not given or any(name not in known for name in given):
        raise complain("should be 'all' or a list of responses", f"choose among {', '.join(known)}")
    return tuple(FIRST if name == naming.response.name else name for name in given)


def _naming(info: core_schema.ValidationInfo) -> Naming:
    naming: Naming = (info.context or {}).get("naming", CUTTING)
    return naming


# ---- targets under their own names


def own_targets(given: Any, naming: Naming) -> tuple[Any, list[Wrong]]:
    """Return targets as the shear test spells them, and what is wrong with them: path, message, remedy.

    ``- {moisture: 12, angle: 32.6 deg, sd: 0.8 deg, n: 5, density: 650 kg/m3}`` is an entry; a list of them may stand
    for the whole section, which is calibrated to its first condition then.
    """
    whole = {"values": given} if isinstance(given, list) else given
    if not isinstance(whole, Mapping):
        return given, [((), "should be a list of measured means", f"begin with - {{{_example(naming)}}}")]
    findings: list[Wrong] = [
        ((key,), f"unknown key {key[:60]!r}", f"use {', '.join(_OF_TARGETS)}")
        for key in whole
        if key not in _OF_TARGETS
    ]
    entries = whole.get("values")
    if not isinstance(entries, list) or not entries:
        return None, [*findings, (("values",), "is empty", f"add an entry {{{_example(naming)}}}")]
    forces = []
    for index, entry in enumerate(entries):
        if not isinstance(entry, Mapping):
            findings.append((("values", index), "should be a mapping", f"write {{{_example(naming)}}}"))
            continue
        target, wrong = _entry(entry, naming)
        forces.append(target)
        findings += [(("values", index, *path), message, remedy) for path, message, remedy in wrong]
    if findings:
        return None, findings
    rest = {key: value for key, value in whole.items() if key == "tolerance_percent"}
    at = forces[0]["diameter"]
    if "calibrate_at" in whole:
        try:
            at = _condition(whole["calibrate_at"], naming)
        except PydanticCustomError as error:
            return None, [(("calibrate_at",), *_said(error))]
    elif len(forces) > 1:
        return None, [((), "'calibrate_at' is missing", f"write calibrate_at: and the means under values: {at:g}, say")]
    return {"calibrate_at": at, "forces": forces, **rest}, []


def _example(naming: Naming) -> str:
    where = "" if naming.condition is None else f"{naming.condition.name}: …, "
    return f"{where}{naming.response.name}: …, sd: …, n: …"


def _entry(entry: Mapping[str, Any], naming: Naming) -> tuple[dict[str, Any], list[Wrong]]:
    """Return one measured mean with the keys of the study, and what is wrong with it."""
    findings: list[Wrong] = []

    def read(key: str, named: Named) -> float | None:
        try:
            return _checked(quantity(entry[key], named), named, key)
        except PydanticCustomError as error:
            findings.append(((key,), *_said(error)))
            return None

    target: dict[str, Any] = {"diameter": NOWHERE, "n": entry.get("n"), "further": {}}
    known = [] if naming.condition is None else [naming.condition.name]
    if naming.condition is not None:
        if naming.condition.name in entry:
            target["diameter"] = read(naming.condition.name, naming.condition)
        else:
            findings.append(((), f"{naming.condition.name!r} is missing", f"add {naming.condition.name}: …"))
    for named in naming.responses:
        key = named.name
        scatter = "sd" if named is naming.response else f"{key}_sd"
        known += [key, scatter, *(["n"] if named is naming.response else [])]
        value = read(key, named) if key in entry else None
        if value is not None and value <= 0.0:
            findings.append(((key,), f"{named.text(value)} must be above 0", "errors are told in per cent of it"))
        sd = read(scatter, named) if scatter in entry else None
        if named is naming.response:
            target |= {"force": value, "sd": sd}
            if key not in entry:
                findings.append(((), f"{key!r} is missing", f"add {key}: …"))
        elif value is not None:
            target["further"][key] = {"value": value, "sd": sd}
        elif scatter in entry:
            findings.append(((scatter,), f"there is no {key} that it is the scatter of", f"add {key}: …"))
    if not (target["n"] is None or (isinstance(target["n"], int) and target["n"] >= 1)):
        findings.append(
            (("n",), f"{str(target['n'])[:60]} is not a number of specimens", "write a whole number above 0")
        )
    declare = "" if naming.condition else ", or declare it: conditions: [{{name: {key}, unit: …}}]"
    findings += [
        ((key,), f"unknown key {str(key)[:60]!r}", f"use {', '.join(known)}{declare.format(key=str(key)[:60])}")
        for key in entry
        if key not in known
    ]
    return target, findings


def _checked(value: float, named: Named, key: str) -> float:
    """Refuse what cannot be computed with: errors are told in per cent of the mean."""
    if not abs(value) <= MOST:
        raise complain(f"{value:g} is beyond what can be computed with", "check number and unit")
    if key in ("sd", f"{named.name}_sd") and value < 0.0:
        raise complain(f"{named.text(value)} is no scatter", "write a value of 0 or more")
    return value


def _condition(given: Any, naming: Naming) -> float:
    if naming.condition is not None:
        return quantity(given, naming.condition)
    if given == NOWHERE:
        return NOWHERE
    raise complain("the study has no conditions", "declare one under conditions, or remove this")


def _said(error: PydanticCustomError) -> tuple[str, str]:
    context = error.context or {}
    return str(context.get("message", "")), str(context.get("remedy", ""))


def as_in_spec(path: tuple[str | int, ...], naming: Naming, as_list: bool) -> tuple[str | int, ...]:
    """Return the path that a spec writes for one inside the study.

    >>> as_in_spec(("targets", "forces", 0, "force"), Naming(None, (Named("angle", "", "", "deg"),)), True)
    ('targets', 0, 'angle')
    """
    if naming.is_cutting or path[:1] != ("targets",):
        return path
    steps = list(path[1:])
    if steps[:1] == ["forces"]:
        condition = "" if naming.condition is None else naming.condition.name
        names: dict[str | int, str] = {"forces": "values", "force": naming.response.name, "diameter": condition}
        steps = [names.get(step, step) for step in steps]
    return ("targets", *(steps[1:] if as_list and steps[:1] == ["values"] else steps))


def declared_once(naming: Naming, factors: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield names that stand for two things, with what they clash with."""
    taken = {**dict.fromkeys(_BESIDE, "a key of targets"), **dict.fromkeys(CHANCE, "a placeholder")}
    taken |= dict.fromkeys(factors, "a factor")
    condition = [] if naming.condition is None else [naming.condition]
    for named in (*naming.responses, *condition):
        if named.name in taken:
            yield named.name, taken[named.name]
        scatter = {f"{named.name}_sd": f"the scatter of {named.name}"} if named in naming.further else {}
        first = {FIRST: "the first response in files"} if named == naming.response else {}
        taken |= {named.name: "another response or condition", **scatter, **first}
