"""Rules that concern several keys of a spec: functions that yield mistakes (in `plausible`, likely ones) in a draft."""

from dataclasses import dataclass, field

from stemcal.formats import did_you_mean
from stemcal.study.model.growth import Growth
from stemcal.study.model.laboratory_kind import LaboratorySection
from stemcal.study.model.layers import LayerSection, Place, places, stem_places
from stemcal.study.model.study import Study
from stemcal.study.types.factor import PARAMETERS, Factor
from stemcal.study.types.field_types import field_or_none
from stemcal.study.types.solver_kind import SolverKind
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.study.types.units import fits
from stemcal.vocabulary import CUTTING, DIAMETER, Vocabulary


@dataclass(frozen=True)
class Draft:
    """A study in which invalid sections and fields are missing.

    A rule that reads a missing section or field ends with the exception `Missing` (see `reading.read`). `factors` and
    `tests` are the valid factors and tests by their index in the spec; `names` contains the names of all factors.
    """

    study: Study
    factors: dict[int, Factor] = field(default_factory=dict)
    tests: dict[int, LaboratorySection] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    naming: Vocabulary = CUTTING

    @property
    def kind(self) -> SolverKind:
        return self.study.kind

    @property
    def layers(self) -> tuple[LayerSection, ...]:
        """Layers of the stem; empty if the section is invalid."""
        return field_or_none(self.study, "layers") or ()

    @property
    def places(self) -> dict[str, Place]:
        """All parameters that the solver has, with their places in the spec, by their names as factors."""
        material = field_or_none(self.study, "material")
        if self.kind.has_layers:
            return places(material, self.layers)
        return stem_places(self.kind.parameters or PARAMETERS, material)

    @property
    def growing(self) -> dict[str, Growth]:
        """Parameters that are powers of the diameter, by their names as factors."""
        growing = self.study.material.growing()
        for layer in self.layers:
            growing |= {f"{layer.name}_{name}": growth for name, growth in layer.growing().items()}
            if isinstance(layer.thickness, Growth):
                growing[f"{layer.name}_thickness"] = layer.thickness
        return growing

    @property
    def diameters(self) -> dict[NodePath, float]:
        """All stem diameters in the spec, mm, by their place in the spec."""
        sizes: dict[NodePath, float] = {}
        if specimen := field_or_none(self.study, "specimen"):
            sizes["specimen", "outer_diameter"] = specimen.outer_diameter
        if self.naming.condition == DIAMETER and (targets := field_or_none(self.study, "targets")):
            for target in targets.means:
                sizes["targets", target.row, "diameter"] = target.condition
        for index, factor in self.factors.items() if self.kind.parameters else ():
            if factor.name == "outer_diameter" and fits(factor.unit, "length"):
                sizes |= {("factors", index, end): factor.internal(getattr(factor, end)) for end in ("low", "high")}
        return sizes

    def unknown_factor(self, path: NodePath, name: str, at_key: bool = True) -> Finding:
        """Return the finding for the name of an unknown factor; `at_key`: the name is a key, not a value."""
        message = f"{name[:60]!r} is not a factor of this study"
        return Finding(path, message, did_you_mean(name, self.names), at_key)
