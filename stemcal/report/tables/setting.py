"""What was held while the factors were varied: the virtual shear test, the other parameters, what was measured."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from stemcal.files.rows import Column, Table
from stemcal.naming import MOST_LISTED, Named, Names
from stemcal.numbers import short, significant, unit_written
from stemcal.report.tables.columns import condition
from stemcal.study.model import Study
from stemcal.study.model.growth import Growth
from stemcal.study.types.solver_kind import Explicit
from stemcal.words import series

_UNITS = {"density": (1e12, "kg/m3"), "strain_rate_c": (1.0, "1/s")}  # from internal units; the others below
_STRESSES = ("elastic_modulus", "yield_stress", "tangent_modulus")


def setting_tables(study: Study) -> list[Table]:
    """Return the factors, what stood still next to them, and what was measured."""
    tables = [factors_table(study), _measured(study)]
    if (how := study.solver.explicit) is not None:
        tables.append(_values("Part", _virtual_test(study, how), "Virtual shear test"))
    if study.material.given() or study.material.growing():
        tables.append(_values("Parameter", _material(study), "Material held"))
    return tables


def grown_table(study: Study, levels: Mapping[str, float]) -> Table:
    """Return what the growing parameters are for each measured stem, at these levels of the factors."""

    def value(name: str) -> Callable[[float], float]:
        scale, _ = _scaled(name)
        return lambda diameter: scale * study.parameters(levels, diameter)[name]

    columns = [replace(one, of=lambda diameter: diameter) for one in condition(study.naming)] + [
        Column(name, name.replace("_", " ").capitalize(), _scaled(name)[1], significant, value(name))
        for name in study.material.growing()
    ]
    return Table.of(
        columns,
        sorted(target.condition for target in study.targets.means),
        "Calibrated material of each stem",
        claims=True,
    )


def _values(head: str, values: dict[str, str], title: str) -> Table:
    columns = Column("name", head), Column("value", "Value")
    return Table(columns, tuple(values.items()), title, long=True, detail=True)


def factors_table(study: Study) -> Table:
    """Return the screened factors with their levels."""
    columns = [
        Column("symbol", ""),
        Column("name", "Factor"),
        Column("label", "Meaning"),
        Column("unit", "Unit", form=unit_written, words=True),
        Column("low", "Low", form=short),
        Column("high", "High", form=short),
    ]
    return Table.of(columns, study.factors, "Factors")


def _measured(study: Study) -> Table:
    naming, targets = study.naming, study.targets.means
    fitted = [target.condition for target in study.joint_targets or (study.calibration_target,)]

    def other(named: Named) -> list[Column]:
        means = Column(named.name, named.capital, named.written, short, lambda target: target.mean_of(named.name)[0])
        if all(target.mean_of(named.name)[1] is None for target in targets):
            return [means]
        sds = Column(f"sd of {named.name}", "SD", named.written, short, lambda target: target.mean_of(named.name)[1])
        return [means, sds]

    unit = naming.response.written
    columns = [
        *condition(naming),
        Column("response", naming.response.capital if naming.others else "Measured", unit, short),
        Column("sd", "SD", unit, short),
        *(column for named in naming.others for column in other(named)),
        Column("n", "n", form=short),
    ]
    strong, foot = frozenset[int](), []
    if naming.condition is not None and 1 < len(fitted) == len(targets):
        foot = ["The parameters are fitted jointly to all measurements."]
    elif naming.condition is not None:
        strong = frozenset(i for i, target in enumerate(targets) if target.condition in fitted)
        foot = [f"The fit uses the values in bold ({Names(naming).conditions(fitted)})."]
    responses = [one.long for one in (naming.response, *naming.others)]
    title = f"Measured {series(responses) if len(responses) <= MOST_LISTED else f'{len(responses)} responses'}"
    return Table.of(columns, targets, title, foot, strong=strong).shortened("The spec")


def _virtual_test(study: Study, solver: Explicit) -> dict[str, str]:
    """Return each part of the virtual shear test and how it is simulated."""
    blade, supports, contact, law = study.blade, study.supports, study.contact, {"paper": "as printed in the paper"}
    rate = study.solver.rate or "none"
    loading, stem = study.loading, study.specimen
    stroke = f"for {loading.duration:g} s" if loading.stroke is None else f"over {loading.stroke}"
    bore = f"bore {stem.diameter_ratio:g} of it" if stem.diameter_ratio > 0.0 else "solid"
    wall = "wall a factor" if "wall_thickness" in study.names else bore
    bevels, part = ("both sides", "quarter") if blade.bevel == "both" else ("one side", "half")
    rubbing = f"{contact.static_friction:g} at rest, {contact.dynamic_friction:g} sliding"
    return {
        "Stem": f"{stem.outer_diameter:g} mm, {wall}, {stem.length:g} mm long",
        "Blade": f"{blade.thickness:g} mm thick, edge of {blade.edge_angle:g}°, {bevels} bevelled",
        "Edge radius": f"{short(blade.edge_radius)} mm",
        "Supports": f"{supports.clearance:g} mm apart, edges rounded by {supports.fillet_radius:g} mm",
        "Loading": f"{significant(60.0 * loading.speed)} mm/min {stroke}",
        "Friction": "a factor" if "stem_friction" in study.names else rubbing,
        "Model": f"{part}, mirrored; elements of {solver.element_size}",
        "Edge spread": f"{study.blade.edge_spread}",
        "Internal length": f"{study.material.internal_length}",
        "Strain-rate law": law.get(rate, rate.replace("_", "–")),
        "Mass scaling": f"× {short(solver.mass_scaling)}",
    }


def _material(study: Study) -> dict[str, str]:
    rows = {}
    for name, value in study.material.given().items():
        rows[name] = _written(name, value)
    for name, growth in study.material.growing().items():
        if isinstance(growth, Growth):
            given = "a factor" if growth.value is None else _written(name, growth.value)
            exponent = growth.exponent if isinstance(growth.exponent, str) else short(growth.exponent)
            rows[name] = f"{given} at {growth.at:g} mm, times (d / {growth.at:g} mm)^{exponent}"
        else:
            diameters, values = zip(*growth.rows, strict=True)
            told = ", ".join(_written(name, value) for value in values)
            rows[name] = f"{told} at {', '.join(map(short, diameters))} mm, interpolated linearly"
    return rows


def _scaled(name: str) -> tuple[float, str]:
    return _UNITS.get(name, (1.0, "MPa" if name in _STRESSES else ""))


def _written(name: str, value: float) -> str:
    scale, unit = _scaled(name)
    return f"{short(scale * value)} {unit_written(unit)}".strip()
