"""What was held while the factors were varied: the virtual shear test, the other parameters, what was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.report.numbers import short, significant, unit_written
from stemcal.report.tables.sheet import Sheet, place_cell, place_head
from stemcal.words import joined

if TYPE_CHECKING:
    from stemcal.study.model import EmbeddedSolver, Study

Rows = tuple[tuple[str, str], ...]
_UNITS = {"density": (1e12, "kg/m3"), "strain_rate_c": (1.0, "1/s")}  # from internal units; the others below
_STRESSES = ("elastic_modulus", "yield_stress", "tangent_modulus")


def setting_sheets(study: Study) -> list[Sheet]:
    """Return the factors, what stood still beside them, and what was measured."""
    sheets = [_factors(study), _measured(study)]
    if study.solver.kind == "embedded":
        parts = _parts(study) + _solver(study, study.solver)
        sheets.append(Sheet("The virtual shear test", ("Part", "Value"), parts, texts=2, long=True, detail=True))
    if study.material.given():
        sheets.append(Sheet("Material held", ("Parameter", "Value"), _material(study), texts=2, long=True, detail=True))
    return sheets


def _factors(study: Study) -> Sheet:
    rows = tuple((f.symbol, f.name, f.label, unit_written(f.unit), short(f.low), short(f.high)) for f in study.factors)
    return Sheet("Factors", ("", "Factor", "Meaning", "Unit", "Low", "High"), rows, texts=4)


def _measured(study: Study) -> Sheet:
    at, naming, targets = study.targets.calibrate_at, study.naming, study.targets.forces
    rows = tuple(
        (
            *place_cell(naming, target.diameter),
            short(target.force),
            short(target.sd),
            *(short(value) for other in naming.others for value in target.mean_of(other.name)),
            str(target.n or "–"),
        )
        for target in targets
    )
    strong = frozenset(i for i, t in enumerate(targets) if t.diameter == at and naming.condition is not None)
    others = (head for other in naming.others for head in (other.heading(), other.headed("SD")))
    first = naming.response.heading() if naming.others else naming.response.headed("Measured")
    columns = (*place_head(naming), first, naming.response.headed("SD"), *others, "n")
    foot = (f"Bold: what the parameters are fitted to ({naming.place(at)}).",) if strong else ()
    title = f"Measured {joined([response.long for response in (naming.response, *naming.others)])}"
    return Sheet(title, columns, rows, texts=0, foot=foot, strong=strong)


def _parts(study: Study) -> Rows:
    stem, blade, supports, loading, contact = (
        study.specimen, study.blade, study.supports, study.loading, study.contact,
    )  # fmt: skip
    bevel = "both sides bevelled" if blade.bevel == "both" else "one side bevelled"
    bore = "wall a factor" if "wall_thickness" in study.names else f"bore {short(stem.diameter_ratio)} of it"
    rubbing = f"{short(contact.static_friction)} at rest, {short(contact.dynamic_friction)} sliding"
    return (
        (
            "Stem",
            f"{short(stem.outer_diameter)} mm, {bore}, {short(stem.length)} mm long",
        ),
        ("Blade", f"{short(blade.thickness)} mm thick, edge of {short(blade.edge_angle)}°, {bevel}"),
        ("Edge radius", f"{short(blade.edge_radius)} mm"),
        ("Supports", f"{short(supports.clearance)} mm apart, edges rounded by {short(supports.fillet_radius)} mm"),
        ("Loading", f"{significant(60.0 * loading.speed)} mm/min for {short(loading.duration)} s"),
        ("Friction", "a factor" if "stem_friction" in study.names else rubbing),
    )


def _solver(study: Study, solver: EmbeddedSolver) -> Rows:
    whole = {"none": "whole stem", "half": "half, mirrored", "quarter": "quarter, mirrored"}
    return (
        ("Model", f"{whole[solver.symmetry]}; elements of {solver.element_size}"),
        *_failure(study),
        ("Strain-rate law", solver.rate_law.replace("_", "–").replace("paper", "as printed in the paper")),
        ("Mass scaling", f"{short(solver.mass_scaling)} times"),
    )


def _failure(study: Study) -> Rows:
    law = study.failure
    if law.kind == "strain":
        return (("Edge spread", f"{study.blade.edge_spread}"), ("Internal length", f"{study.material.internal_length}"))
    strength = "a factor" if law.strength is None else f"{short(law.strength)} MPa"
    toughness = "a factor" if law.toughness is None else f"{short(law.toughness)} kJ/m²"
    return (("Failure", "by toughness (experimental)"), ("Strength", strength), ("Toughness", toughness))


def _material(study: Study) -> Rows:
    rows = []
    for name, value in study.material.given().items():
        scale, unit = _UNITS.get(name, (1.0, "MPa" if name in _STRESSES else ""))
        rows.append((name, f"{short(scale * value)} {unit_written(unit)}".strip()))
    return tuple(rows)
