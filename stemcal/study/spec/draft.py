"""A spec half read: the sections that are valid by themselves, for rules that look across them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from stemcal.naming import CUTTING, DIAMETER, Naming
from stemcal.study.model import (
    Blade,
    ClimbOptions,
    Condition,
    Contact,
    EmbeddedSolver,
    Factor,
    Failure,
    InvertOptions,
    Material,
    MeshOptions,
    Published,
    RefineOptions,
    Response,
    RsmOptions,
    ScreenOptions,
    Specimen,
    Supports,
    TableSolver,
    Targets,
)
from stemcal.study.outside import CommandSolver, DeckSolver, LsDynaSolver, OpenRadiossSolver
from stemcal.study.spec.strict_yaml import NodePath

__all__ = ["Draft", "Finding"]


class Finding(NamedTuple):
    """Something wrong at `path`; `at_key` when the key itself is at fault."""

    path: NodePath
    message: str
    remedy: str = ""
    at_key: bool = False


@dataclass(frozen=True)
class Draft:
    """Valid sections; None where a section is not valid, so that each rule checks what there is.

    `factors` holds the valid ones by their index; `names` are the names of all, valid or not.
    """

    factors: dict[int, Factor] = field(default_factory=dict)
    names: tuple[str, ...] = ()
    naming: Naming = CUTTING
    responses: tuple[Response, ...] | None = None
    conditions: tuple[Condition, ...] | None = None
    specimen: Specimen | None = None
    blade: Blade | None = None
    supports: Supports | None = None
    contact: Contact | None = None
    material: Material | None = None
    failure: Failure | None = None
    solver: EmbeddedSolver | TableSolver | CommandSolver | LsDynaSolver | OpenRadiossSolver | None = None
    targets: Targets | None = None
    screen: ScreenOptions | None = None
    rsm: RsmOptions | None = None
    invert: InvertOptions | None = None
    published: Published | None = None
    refine: RefineOptions | None = None
    mesh: MeshOptions | None = None
    climb: ClimbOptions | None = None

    @property
    def embedded(self) -> EmbeddedSolver | None:
        """The embedded solver, if that is what answers."""
        return self.solver if isinstance(self.solver, EmbeddedSolver) else None

    @property
    def is_cut(self) -> bool:
        """Whether the stem is parted on the plane of the cut, in place of elements that fail."""
        return self.failure is not None and self.failure.kind == "toughness"

    @property
    def stem_solver(self) -> str:
        """The name of the solver if its factors are parameters of the stem's material, else an empty text."""
        if self.embedded is not None:
            return "embedded"
        if not isinstance(self.solver, DeckSolver):
            return ""
        return "LS-DYNA" if isinstance(self.solver, LsDynaSolver) else "OpenRadioss"

    @property
    def diameters(self) -> dict[NodePath, float]:
        """Every stem diameter of the spec with its place, mm."""
        found: dict[NodePath, float] = {}
        if self.specimen is not None:
            found["specimen", "outer_diameter"] = self.specimen.outer_diameter
        if self.targets is not None and self.naming.condition == DIAMETER:
            for index, target in enumerate(self.targets.forces):
                found["targets", "forces", index, "diameter"] = target.diameter
        return found
