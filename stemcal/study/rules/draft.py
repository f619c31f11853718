"""A spec half read: the sections that are valid by themselves, for rules that look across them."""

from dataclasses import dataclass, field
from typing import NamedTuple

from stemcal.naming import CUTTING, DIAMETER, Naming
from stemcal.study import model
from stemcal.study.types.strict_yaml import NodePath
from stemcal.words import did_you_mean


class Finding(NamedTuple):
    """Something wrong at `path`; `at_key` when the key itself is at fault."""

    path: NodePath
    message: str
    remedy: str = ""
    at_key: bool = False


@dataclass(frozen=True)
class Draft:
    """Valid sections; None where a section is not valid, so that each rule checks what there is.

    `factors` and `tests` hold the valid ones by their index; `names` are the names of all, valid or not.
    """

    factors: dict[int, model.Factor] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    naming: Naming = CUTTING
    responses: tuple[model.OwnQuantity, ...] | None = None
    conditions: tuple[model.OwnQuantity, ...] | None = None
    specimen: model.SpecimenSection | None = None
    blade: model.BladeSection | None = None
    supports: model.SupportsSection | None = None
    contact: model.ContactSection | None = None
    material: model.MaterialSection | None = None
    tests: dict[int, model.LaboratorySection] = field(default_factory=dict)
    solver: model.AnySolver | None = None
    targets: model.Targets | None = None
    machine: model.MachineSection | None = None
    screen: model.ScreenOptions | None = None
    rsm: model.RsmOptions | None = None
    invert: model.InvertOptions | None = None
    refine: model.RefineOptions | None = None
    climb: model.ClimbOptions | None = None

    @property
    def rate_law(self) -> str | None:
        """The rate law that the spec chooses, where its solver lets it."""
        if isinstance(self.solver, model.DeckSolver):
            return self.solver.law
        return self.embedded.rate_law if self.embedded else None

    @property
    def embedded(self) -> model.EmbeddedSolver | None:
        """The embedded solver, if that is what answers."""
        return self.solver if isinstance(self.solver, model.EmbeddedSolver) else None

    @property
    def growing(self) -> dict[str, model.Growth | model.Grades]:
        """The material parameters that follow the diameter."""
        return self.material.growing() if self.material else {}

    @property
    def stem_solver(self) -> str:
        """The name of the solver if its factors are parameters of the stem's material, else an empty text."""
        if self.embedded is not None:
            return "embedded"
        if not isinstance(self.solver, model.DeckSolver):
            return ""
        return "LS-DYNA" if self.solver.program == "lsdyna" else "OpenRadioss"

    @property
    def diameters(self) -> dict[NodePath, float]:
        """Every stem diameter of the spec with its place, mm."""
        found: dict[NodePath, float] = {}
        if self.specimen is not None:
            found["specimen", "outer_diameter"] = self.specimen.outer_diameter
        if self.targets is not None and self.naming.condition == DIAMETER:
            for target in self.targets.means:
                found["targets", target.row, "diameter"] = target.condition
        return found

    def unknown_factor(self, path: NodePath, name: str, at_key: bool = True) -> Finding:
        """Return that no factor is called so."""
        message = f"{name[:60]!r} is not a factor of this study"
        return Finding(path, message, did_you_mean(name, self.names), at_key)
