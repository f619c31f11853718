"""Rules across a spec, a function each that yields what is wrong in a `Draft`; likely slips are in `plausible`."""

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
    """A study of which some sections may be missing, because they are wrong.

    A rule that reads a missing section or field gets `Missing`, and ends (see `reading.read`).
    `factors` and `tests` hold the valid ones by their index; `names` are the names of all factors, valid or not.
    """

    study: Study
    factors: dict[int, Factor] = field(default_factory=dict)
    tests: dict[int, LaboratorySection] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    naming: Vocabulary = CUTTING

    @property
    def kind(self) -> SolverKind:
        """The kind of the solver, and so what that can do."""
        return self.study.kind

    @property
    def layers(self) -> tuple[LayerSection, ...]:
        """The layers of the stem; none while they cannot be read."""
        return field_or_none(self.study, "layers") or ()

    @property
    def places(self) -> dict[str, Place]:
        """The material parameters by the names that they have as factors, with their places in the spec."""
        material = field_or_none(self.study, "material")
        if self.kind.has_layers:
            return places(material, self.layers)
        return stem_places(self.kind.parameters or PARAMETERS, material)

    @property
    def growing(self) -> dict[str, Growth]:
        """The material parameters that follow the diameter, by the names that they have as factors."""
        layers = {f"{layer.name}_{name}": one for layer in self.layers for name, one in layer.growing().items()}
        layers |= {f"{one.name}_thickness": one.thickness for one in self.layers if isinstance(one.thickness, Growth)}
        return {**self.study.material.growing(), **layers}

    @property
    def diameters(self) -> dict[NodePath, float]:
        """Every stem diameter of the spec with its place, mm."""
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
        """Return the mistake of an unknown factor."""
        message = f"{name[:60]!r} is not a factor of this study"
        return Finding(path, message, did_you_mean(name, self.names), at_key)
