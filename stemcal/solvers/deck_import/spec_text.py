"""The text of a spec from what a deck says."""

from collections.abc import Iterator
from math import pi, sqrt
from pathlib import Path
from typing import Any

from stemcal.errors import SpecError, UsageError
from stemcal.files.showing import in_a_line
from stemcal.solvers.deck_import.importing import Imported, Section
from stemcal.study.reading.emitting import yaml_text
from stemcal.study.reading.read import read_study

# Units of the spec's quantities by their key; what is not here is a pure number or a word.
_UNITS = {
    **dict.fromkeys(("outer_diameter", "length", "width", "thickness", "edge_radius", "edge_spread"), "mm"),
    **dict.fromkeys(("clearance", "fillet_radius", "gap", "element_size", "internal_length", "failure_length"), "mm"),
    **dict.fromkeys(("duration", "time_step", "filter_window"), "s"),
    **dict.fromkeys(("elastic_modulus", "yield_stress", "tangent_modulus"), "MPa"),
    "edge_angle": "deg",
    "speed": "mm/s",
    "decay": "s/mm",
    "density": "kg/m3",
    "strain_rate_c": "1/s",
}
_KG_PER_M3 = 1e12  # of t/mm³
# What is offered to calibrate, from so much below to so much above the deck's value.
_FACTORS = {"yield_stress": "MPa", "failure_strain": None}
_SPAN = 0.3


def spec_text(deck: Imported, name: str, source: str) -> str:
    """Return a spec called `name`: what the deck of the file `source` says, and places for what it cannot.

    Raises
    ------
    UsageError
        If no study can have the deck's values.
    """
    text = "\n".join(_parts(deck, name, source))
    try:
        read_study(text.encode(), Path(f"{name}.yaml"))
    except SpecError as error:
        wrong = (f"{problem.path}: {problem.message}" for problem in error.problems)
        raise UsageError(f"no study can have its values: {'; '.join(wrong)}; correct the deck's cards") from None
    return text


def _parts(deck: Imported, name: str, source: str) -> Iterator[str]:
    yield _comment(f"stemcal study, read from {source} by `stemcal import-deck`.")
    if deck.leaves:
        yield _comment("")
        yield _comment("What the deck says and this study cannot:")
        yield from (_comment(f"- {sentence}") for sentence in deck.leaves)
    yield ""
    yield yaml_text({"schema_version": 1, "name": name})
    yield _comment(
        f"The deck's values stand in the middle; the ranges, {_SPAN:.0%} to either side, are yours to choose."
    )
    material = dict(deck.sections["material"])
    yield yaml_text({"factors": [_factor(name, unit, material.pop(name)) for name, unit in _FACTORS.items()]})
    for section, values in {**deck.sections, "material": material}.items():
        if values:
            yield yaml_text({section: _section(values)})
    diameter = _quantity("outer_diameter", deck.sections["specimen"]["outer_diameter"])
    yield _comment("No deck knows the measured force: what one cross-section bears in shear holds its place.")
    forces = [{"diameter": diameter, "force": f"{_shear_force(deck):.2g} N"}]
    yield yaml_text({"targets": {"calibrate_at": diameter, "forces": forces}})


def _shear_force(deck: Imported) -> float:
    """Return A σy/√3 of the stem's cross-section, N."""
    stem = deck.sections["specimen"]
    area = 0.25 * pi * stem["outer_diameter"] ** 2 * (1.0 - stem["diameter_ratio"] ** 2)
    return float(area * deck.sections["material"]["yield_stress"] / sqrt(3.0))


def _comment(text: str) -> str:
    return f"# {in_a_line(text)}".rstrip()


def _factor(name: str, unit: str | None, value: float) -> Section:
    low, high = (_number(float(f"{value * share:.12g}")) for share in (1.0 - _SPAN, 1.0 + _SPAN))
    return {"name": name, **({"unit": unit} if unit else {}), "low": low, "high": high}


def _section(values: Section) -> Section:
    return {key: _section(part) if isinstance(part, dict) else _quantity(key, part) for key, part in values.items()}


def _quantity(key: str, value: Any) -> Any:
    if value is None or isinstance(value, bool | str):
        return value
    number = _number(float(f"{value * _KG_PER_M3:.12g}") if key == "density" else value)
    return f"{number!r} {_UNITS[key]}" if key in _UNITS else number


def _number(value: float) -> int | float:
    """Return a whole number where it is one."""
    return int(value) if float(value).is_integer() and abs(value) < 1e15 else float(value)
