"""The content of a deck: the meshes, the materials of the stem, and the differences from the study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import floor, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.build import counter_edge, layers_of, materials, mesh_size, stem_mesh
from stemcal.cutting.constraints import held_components
from stemcal.cutting.parts import Blade, Discretisation, ShearTest, Stem, Supports, rate_filter
from stemcal.errors import UsageError
from stemcal.fem.material import Layers, Material
from stemcal.fem.mesh import Mesh
from stemcal.fem.tools import POINTS_PER_FACE
from stemcal.formats import series
from stemcal.solvers.deck import equivalents
from stemcal.solvers.deck.keywords import WIDTH, DeckForm, fitted, form_of
from stemcal.solvers.deck.tools import blade_mesh, supports_mesh
from stemcal.solvers.options import DeckSolver, EmbeddedSolver
from stemcal.study.model.layers import LayerValues, layers_at
from stemcal.study.model.shear_test import GAP
from stemcal.study.model.study import Study
from stemcal.study.types.factor import PARAMETERS

_MOST_ELEMENTS = 2e6  # largest number of elements in a deck, whose file then has several hundred megabytes
_BLADE_OVER_STEM = 1.5  # length of the blade in a deck, in stem diameters; its ends do not touch the stem
# Distance of a rounded edge from the nearest row of nodes, in element sizes of the spec. The force depends on it by
# ±5 %: it has its extremes over a row and midway between two rows. At a quarter it is close to the mean, since the
# distance of the rows under the edge is mostly 4 to 10 % less than the element size (`cutting.build`).
_NOSE_BESIDE = 0.25
# Largest element size as a share of `edge_spread`. With larger elements, the rounded edge cuts at too large a force.
_RESOLVED = 0.6
# Names of the parameters in the material card of the stem, in the order of `PARAMETERS`.
_FIELDS = ("ro", "e", "pr", "sigy", "etan", "beta", "c", "p", "fail")

# Hourglass coefficient QH (type 4) in decks for solvers of kind `deck`, with coarse elements and local failure.
HOURGLASS = 0.05
# Numbers of the parts and of their materials.
STEM, BLADE, SUPPORTS = 1, 2, 3


@dataclass(frozen=True)
class _Parts:
    """The meshes of the whole stem, without symmetry, and of the tools; a stem that is only clamped has no supports.

    rest: Place along the axis where the stem rests on a support, mm; clamped: numbers of the nodes at the clamp.
    """

    stem: Mesh
    blade: Mesh
    supports: Mesh | None
    rest: float
    clamped: NDArray[np.int64]

    @property
    def tools(self) -> dict[int, Mesh]:
        """The meshes of the tools by part number."""
        return {BLADE: self.blade} | ({} if self.supports is None else {SUPPORTS: self.supports})


@dataclass(frozen=True)
class Deck:
    """The deck of a shear test at given levels (in the units of the spec) and stem diameter (mm)."""

    study: Study
    levels: Mapping[str, float]
    diameter: float
    form: DeckForm

    @classmethod
    def of(cls, study: Study, levels: Mapping[str, float], diameter: float, form: DeckForm | None = None) -> Deck:
        """Return the deck in a form, by default that for the solver of the study.

        Raises `UsageError` if a deck cannot represent the test: the solver does not simulate stems, or the material is
        not isotropic.
        """
        if not isinstance(study.solver, EmbeddedSolver | DeckSolver):
            kind = study.solver.kind
            raise UsageError(f"a deck requires a solver of kind `embedded` or `deck`; this spec uses kind `{kind}`")
        diameter, study = study.stem_at(levels, diameter), study.at(levels)
        if any(layer.across is not None for layer in layers_at(study, levels, diameter)):
            raise UsageError(
                "a deck has isotropic materials: the laws of LS-DYNA and OpenRadioss for fibres (such as *MAT_157 and "
                "LAW93) are not those of the study, and their force is unknown; remove `transverse` from the spec"
            )
        return cls(study, levels, diameter, form or form_of(study))

    @cached_property
    def solver(self) -> EmbeddedSolver | DeckSolver:
        """The options of the solver, scaled for the speed of the blade."""
        assert isinstance(self.study.solver, EmbeddedSolver | DeckSolver)
        return self.study.solver.at_speed(self.study.loading.speed)

    @cached_property
    def layers(self) -> dict[int, LayerValues]:
        """The layers of the stem by part number, from the outside to the inside; the innermost is the part `STEM`."""
        layers = layers_at(self.study, self.levels, self.diameter)
        return dict(zip([*range(SUPPORTS + 1, SUPPORTS + len(layers)), STEM], layers, strict=True))

    @cached_property
    def layer_of(self) -> NDArray[np.int64]:
        """Part number of each element of the stem (E,)."""
        *outer, inner = map(self._law, self.layers.values())
        material = materials(self.parts.stem, self._stem, inner, tuple(outer))
        layer = material.of if isinstance(material, Layers) else np.zeros(len(self.parts.stem.hexes), dtype=int)
        return np.array([*self.layers])[::-1][layer]

    @property
    def _stem(self) -> Stem:
        specimen, thicknesses = self.study.specimen, [layer.thickness for layer in self.layers.values()]
        return Stem(self.diameter, specimen.ratio_at(self.diameter), specimen.length, tuple(thicknesses[:-1]))

    @cached_property
    def parameters(self) -> dict[str, float]:
        """The nine material parameters of the innermost layer, with the values of the study."""
        return self.layers[STEM].along

    @property
    def law(self) -> Material:
        """Elastic law of the outermost layer."""
        return self._law(next(iter(self.layers.values())))

    @property
    def fastest(self) -> Material:
        """Elastic law of the layer with the largest wave speed, which determines the time step."""
        return max(map(self._law, self.layers.values()), key=lambda law: law.p_wave_modulus / law.density)

    def _law(self, layer: LayerValues) -> Material:
        return Material(layer.along["density"], layer.along["elastic_modulus"], layer.along["poisson_ratio"])

    @property
    def edge_spread(self) -> float:
        """Length over which the force of the edge is spread in the study, mm; 0 if the deck ignores it."""
        return self.study.blade.edge_spread.at(self.diameter) if self._has_lengths else 0.0

    @property
    def internal_length(self) -> float:
        """Length over which failure is averaged in the innermost layer, mm; 0 if the deck ignores it."""
        return self.layers[STEM].internal_length if self._has_lengths else 0.0

    @property
    def _has_lengths(self) -> bool:
        return isinstance(self.solver, EmbeddedSolver) or self.form.lengths

    @property
    def nose(self) -> float:
        """Radius of the edge in the deck, mm: that of the blade, or a larger one that replaces the edge spread."""
        radius = self.study.blade.edge_radius
        return max(radius, equivalents.nose_radius(self.edge_spread)) if self.form.lengths else radius

    @property
    def is_sharp(self) -> bool:
        """Whether the edge is a line, with the same number of nodes per stem element as in the embedded solver.

        With only one node per element, OpenRadioss cut stems of 11 mm at 0.62 and 0.73 times the correct force.
        """
        return self.nose == self.study.blade.edge_radius

    @property
    def edge_share(self) -> float:
        """Factor for the contact stiffness p m/Δt² of the blade (penalty p, nodal mass m); 1 for a rounded edge.

        A sharp edge has four points per element face. In the embedded solver, each point has the stiffness p M/Δt² with
        M = ¼ m/(1 + η²). η is its position across the face, −1 < η < 1, and 1 + η² = 4 Σ N² for the shape functions N.
        The factor is ¼ · π/4, since the mean of 1/(1 + η²) is π/4. For OpenRadioss, it is converted.
        """
        if not self.is_sharp:
            return 1.0
        share = 0.25 * pi / POINTS_PER_FACE
        if self.form.for_ls_dyna:
            return share
        top = (0.0, 0.0, 0.5 * self.diameter)
        return share / equivalents.share_in_openradioss(self.parts.stem, self.parts.blade, top)

    @property
    def nonlocal_length(self) -> float:
        """Length in the nonlocal failure card of the innermost layer, mm, as the program defines it; 0 without card."""
        return self.nonlocal_lengths.get(STEM, 0.0)

    @property
    def nonlocal_lengths(self) -> dict[int, float]:
        """Lengths in the cards of nonlocal failure, mm, by part number; parts without a card are left out."""
        lengths = {part: layer.internal_length for part, layer in self.layers.items()} if self.form.lengths else {}
        program, size = self.form.program, self._element_size
        converted = {part: equivalents.nonlocal_length(mm, program, size) for part, mm in lengths.items()}
        return {part: length for part, length in converted.items() if length > 0.0}

    @cached_property
    def density_factor(self) -> float:
        """Factor for the density of the stem, used instead of added nodal mass if `form.by_density`; otherwise 1."""
        return equivalents.density_factor(self.solver, self.parts.stem, self.fastest) if self.form.by_density else 1.0

    @cached_property
    def material(self) -> dict[str, float]:
        """Values ``ro e pr sigy etan beta c p fail`` that the material card of the innermost layer contains."""
        return self.material_of(STEM)

    def material_of(self, part: int) -> dict[str, float]:
        """Return the values of the material card of a part of the stem, rounded to the width of a field."""
        values = self.layers[part].along
        c, p = values["strain_rate_c"], values["strain_rate_p"]
        c, p = equivalents.rate_constants(self._rate_law, c, p, self._strain_rate)
        density = values["density"] * self.density_factor
        values = {**values, "density": density, "strain_rate_c": c, "strain_rate_p": p}
        named = zip(_FIELDS, (values[name] for name in PARAMETERS), strict=True)
        return {name: float(fitted(value, WIDTH)) for name, value in named}

    @property
    def card(self) -> dict[str, float]:
        """The values that the program uses: `material`, but the density of the study, and β = 1 in OpenRadioss."""
        isotropic = {} if self.form.for_ls_dyna else {"beta": 1.0}
        density = self.material["ro"] if self.density_factor == 1.0 else self.parameters["density"]
        return {**self.material, **isotropic, "ro": density}

    @cached_property
    def parts(self) -> _Parts:
        """Meshes of the stem, the blade and the supports."""
        study, diameter, stem, b = self.study, self.diameter, self._stem, self.study.blade
        blade = Blade(b.thickness, b.width, b.edge_angle, self.nose, b.bevel)
        how = _discretisation(self.solver, diameter)
        elements = mesh_size(stem, how).elements
        if elements > _MOST_ELEMENTS:
            raise UsageError(
                f"the stem would have {elements:.3g} elements (element size {how.element_size:g} mm), more than the "
                f"limit of {_MOST_ELEMENTS:.0e}; increase `solver.element_size` or use a shorter specimen"
            )
        supports = Supports(**dict(study.supports))
        lowest, size = 0.5 * diameter + GAP, how.element_size
        slide, stroke = self.slide, study.loading.stroke_at(diameter)
        length = _BLADE_OVER_STEM * diameter + slide
        edge = blade_mesh(blade, length, lowest, size, stroke, POINTS_PER_FACE if self.is_sharp else None)
        beside = 0.0 if self.is_sharp else _NOSE_BESIDE * size
        if beside or slide:  # before the slide, the part of the edge that is still to come is at y < 0
            edge = edge.moved(edge.nodes + np.array([beside, -0.5 * slide, 0.0]))
        if not self.is_sharp and supports.kind == "counter_edge":
            flank = 0.5 * b.thickness if b.bevel == "both" else b.edge_radius
            # the gap remains that of the study if a rounded edge makes the blade thicker
            supports = replace(supports, clearance=supports.clearance - flank - float(edge.nodes[:, 0].min()))
        test = ShearTest(self.law, stem=stem, blade=blade, supports=supports, discretisation=how)
        mesh = stem_mesh(stem, how, layers=layers_of(test))
        clamped = 1 + np.flatnonzero(held_components(mesh, test)[:, 0])
        knife = counter_edge(test) if supports.kind == "counter_edge" else None
        blocks = None if supports.kind == "clamped" else supports_mesh(supports, stem, size, knife, slide)
        rest = supports.rests_at if knife is None else -knife - supports.fillet_radius
        return _Parts(mesh, edge, blocks, rest, clamped)

    @property
    def slide(self) -> float:
        """Distance that the blade slides along its edge, in the direction y, mm."""
        loading, angle = self.study.loading, radians(self.study.blade.sliding_angle)
        return loading.speed * loading.duration_at(self.diameter) * sin(angle)

    @cached_property
    def notes(self) -> list[str]:
        """Sentences on the differences of the deck from the study."""
        first = (*self._of_layers(), *self._whole_cut(), *self._not_run(), *self._without_lengths())
        return [*first, *self._hardening(), *self._rate(), *self._rate_filter()]

    @property
    def _element_size(self) -> float:
        return self.solver.element_size.at(self.diameter)

    @property
    def _rate_law(self) -> str:
        solver = self.solver
        return solver.rate_law if isinstance(solver, EmbeddedSolver) else solver.law

    @property
    def _strain_rate(self) -> float:
        """Largest strain rate of an element, 1/s: blade speed over the length of the shortest element."""
        return self.study.loading.speed / equivalents.shortest(self.parts.stem)

    def _of_layers(self) -> Iterator[str]:
        if len(self.layers) > 1:
            names = [layer.name for layer in self.study.layers]
            parts = series(f"{name} {part}" for name, part in zip(names, self.layers, strict=True))
            yield (
                f"the layers are separate parts that share nodes ({parts}); their contact stiffness and time step are "
                "those of the outer and of the stiffest layer, and these decks were not run"
            )

    def _whole_cut(self) -> Iterator[str]:
        if self.study.loading.until == "severed":
            yield (
                "the deck deletes elements over the whole stroke, but in the study the stem parts under the edge "
                "(`until: severed`), so only the force up to the first fracture is comparable"
            )

    def _not_run(self) -> Iterator[str]:
        names = {"span": [], "clamped": ["a clamp"], "counter_edge": ["a clamp", "a fixed knife"]}
        new = [*names[self.study.supports.kind], *(["a sliding blade"] if self.slide else [])]
        if new:
            yield f"decks with {series(new)} were not run in LS-DYNA or OpenRadioss"
        if "a fixed knife" in new and not self.is_sharp:
            place = -self.parts.rest - self.study.supports.fillet_radius
            yield f"the fixed knife is at {place:.3g} mm from the plane of the cut, next to the rounded blade"

    def _without_lengths(self) -> Iterator[str]:
        lengths = {"edge_spread": self.edge_spread, "internal_length": self.internal_length}
        of_study = [f"{name} ({length:.3g} mm)" for name, length in lengths.items() if length > 0.0]
        if not of_study:
            return
        if not self.form.lengths:
            yield f"the deck has no card for {' and '.join(of_study)}, so the force depends on the mesh"
        else:
            most = _RESOLVED * self.edge_spread
            yield (
                f"an edge radius of {self.nose:.3g} mm and a nonlocal length of {self.nonlocal_length:.3g} mm replace "
                f"{' and '.join(of_study)}; the resulting force is similar to that of the embedded solver"
            )
            if self._element_size > most:
                yield (
                    f"an element size of {self._element_size:.3g} mm is too large for the edge radius, so the force is "
                    f"too high; reduce `solver.element_size` to at most {floor(1e3 * most) / 1e3:g} mm"
                )
        if self.form.for_ls_dyna and self.form.lengths and self.internal_length > 0.0:
            yield "*MAT_NONLOCAL averages history variable 1, the plastic strain; the card is untested in LS-DYNA"
        if self.density_factor > 1.0:
            yield (
                f"the density of the stem is multiplied by {self.density_factor:.4g} because added nodal mass "
                "would make the nonlocal field in OpenRadioss diverge"
            )

    def _hardening(self) -> Iterator[str]:
        beta = self.parameters["hardening_parameter"]
        if not self.form.for_ls_dyna and beta < 1.0 and self.parameters["tangent_modulus"] > 0.0:
            kinematic = 100.0 * (1.0 - beta)
            yield f"*MAT_024 uses isotropic hardening; in the study, {kinematic:g} % of the hardening is kinematic"

    def _rate(self) -> Iterator[str]:
        if self._rate_law != "paper":
            return
        c, p = self.parameters["strain_rate_c"], self.parameters["strain_rate_p"]
        law = f"1 + (rate/C)^{p:g}"
        if self.material["c"] > 0.0:
            power = self.material["p"]
            yield f"the rate law {law} is written in the LS-DYNA form, 1 + (rate/C)^(1/P), with P = {power:g}"
        else:
            most = (self._strain_rate / c) ** p
            yield f"the rate law {law} is omitted because it changes the yield stress by at most {100.0 * most:.1g} %"

    def _rate_filter(self) -> Iterator[str]:
        if isinstance(self.solver, EmbeddedSolver) and self.material["c"] > 0.0:
            time = rate_filter(self.diameter, self.study.loading.speed)
            of = "plastic strain (VP = 1)" if self.form.for_ls_dyna else "total strain (VP = 0)"
            yield (
                f"the card uses the unsmoothed rate of {of}, so vibration of light elements increases the yield "
                f"stress; in the study, the strain rate is smoothed over {time:.3g} s"
            )


def _discretisation(solver: EmbeddedSolver | DeckSolver, diameter: float) -> Discretisation:
    size = solver.element_size.at(diameter)
    if isinstance(solver, DeckSolver):
        return Discretisation(size, solver.elements_through_wall, symmetry="none", edge_over="elements")
    return Discretisation(
        size,
        solver.elements_through_wall,
        symmetry="none",
        edge_over=solver.edge_over,
        coarsening=solver.coarsening,
        coarsening_around=solver.coarsening_around,
    )
