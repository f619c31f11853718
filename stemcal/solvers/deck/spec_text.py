"""The text of a spec from what a deck says."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from stemcal.solvers.deck.importing import Imported, Section

__all__ = ["spec_text"]

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
    """Return a spec called `name`: what the deck of the file `source` says, and places for what it cannot."""
    return "\n".join(_lines(deck, name, source)) + "\n"


def _lines(deck: Imported, name: str, source: str) -> Iterator[str]:
    yield f"# stemcal study, read from {source} by `stemcal import-deck`."
    if deck.leaves:
        yield "#"
        yield "# What the deck says and this study cannot:"
        yield from (f"# - {sentence}" for sentence in deck.leaves)
    yield ""
    yield "schema_version: 1"
    yield f"name: {json.dumps(name, ensure_ascii=False)}"
    yield ""
    yield f"# The deck's values stand in the middle; the ranges, {_SPAN:.0%} to either side, are yours to choose."
    yield "factors:"
    material = dict(deck.sections["material"])
    for factor, unit in _FACTORS.items():
        value = material.pop(factor)
        low, high = (_text(float(f"{value * share:.12g}")) for share in (1.0 - _SPAN, 1.0 + _SPAN))
        yield f"  - {{name: {factor}{f', unit: {unit}' if unit else ''}, low: {low}, high: {high}}}"
    for section, values in {**deck.sections, "material": material}.items():
        if values:
            yield ""
            yield f"{section}:"
            yield from _section(values, "  ")
    diameter = _quantity("outer_diameter", deck.sections["specimen"]["outer_diameter"])
    yield ""
    yield "# No deck knows the measured force: 100 N holds its place."
    yield "targets:"
    yield f"  calibrate_at: {diameter}"
    yield f"  forces: [{{diameter: {diameter}, force: 100 N}}]"


def _section(values: Section, indent: str) -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, dict):
            inner = ", ".join(f"{name}: {_quantity(name, part)}" for name, part in value.items())
            yield f"{indent}{key}: {{{inner}}}"
        else:
            yield f"{indent}{key}: {_quantity(key, value)}"


def _quantity(key: str, value: Any) -> str:
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, str):
        return value
    number = float(f"{value * _KG_PER_M3:.12g}") if key == "density" else value
    return f"{_text(number)} {_UNITS[key]}" if key in _UNITS else _text(number)


def _text(value: float) -> str:
    """Return the shortest text of a number."""
    return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))
