"""The published model as a keyword deck: stem, blade and supports, their contact, how they move and what is kept.

No keyword but those that OpenRadioss's reader of LS-DYNA decks lists, too: hm_cfg_files/config/CFG/Keyword971_R14.1/
data_hierarchy.cfg in its sources, where ``*TITLE``, for one, is commented out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from stemcal.cutting import Blade, Discretisation, Stem, Supports, mesh_size, stem_mesh
from stemcal.errors import UsageError
from stemcal.fem.kernels.search import FACES
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh
from stemcal.solvers.deck.fixed_width import fitted, keyword
from stemcal.solvers.deck.tools import blade_mesh, supports_mesh
from stemcal.study.model import EmbeddedSolver, Study
from stemcal.study.outside import LsDynaSolver

__all__ = ["BLADE", "STEM", "SUPPORTS", "deck_lines", "deck_text"]

# Numbers of the parts, and of their materials.
STEM, BLADE, SUPPORTS = 1, 2, 3
# Steel of blade and supports (Table 2 of the published study): t/mm³, MPa, ν.
_STEEL = {"ro": 7.8e-09, "e": 207000.0, "pr": 0.3}
_MOST_ELEMENTS = 2e6  # a file of some hundred megabytes
_HOURGLASS = {"viscous": 1, "stiffness": 4}
_FORMULATION = {"one_point": 1, "full": 2}
_BY_PART = 3
_NO_PLANE_MOTION, _NO_TRANSLATION, _NO_ROTATION = 4, 7, 7
_ALONG_Z, _VELOCITY, _CURVE = 3, 0, 1


def deck_text(study: Study, levels: Mapping[str, float], diameter: float) -> str:
    """Return the whole deck of a shear test at given levels (units of the spec) and stem diameter (mm)."""
    return "\n".join(deck_lines(study, levels, diameter)) + "\n"


def deck_lines(study: Study, levels: Mapping[str, float], diameter: float) -> Iterator[str]:
    """Yield the lines of the deck.

    Raises
    ------
    UsageError
        If the study's solver is neither embedded nor LS-DYNA: its factors are then no stem material.
    """
    solver = study.solver
    if not isinstance(solver, EmbeddedSolver | LsDynaSolver):
        raise UsageError(f"a deck needs `solver: {{kind: embedded}}` or lsdyna; this spec has kind {solver.kind}")
    study = study.at(levels)
    parts = _parts(study, solver, diameter)
    given = study.parameters(levels)
    yield from _head(study, solver, diameter)
    yield from _control(study, solver, given, parts.stem)
    yield from _output(study.loading.duration / solver.outputs)
    yield from _materials(given)
    yield from _part_cards(solver)
    yield from _motion(study)
    yield from _contacts(study)
    yield from _mesh(parts)
    yield "*END"


@dataclass(frozen=True)
class _Parts:
    stem: Mesh
    blade: Mesh
    supports: Mesh


def _parts(study: Study, solver: EmbeddedSolver | LsDynaSolver, diameter: float) -> _Parts:
    """Return the meshes: the whole stem, no symmetry."""
    stem = Stem(diameter, study.specimen.diameter_ratio, study.specimen.length)
    b = study.blade
    blade = Blade(b.thickness, b.width, b.edge_angle, b.edge_radius, b.bevel)
    size = solver.element_size.at(diameter) if isinstance(solver, EmbeddedSolver) else solver.element_size
    how = Discretisation(size, solver.elements_through_wall, symmetry="none")
    if isinstance(solver, EmbeddedSolver):
        how = replace(
            how,
            edge_over=solver.edge_over,
            coarsening=solver.coarsening,
            coarsening_around=solver.coarsening_around,
        )
    elements = mesh_size(stem, how).elements
    if elements > _MOST_ELEMENTS:
        raise UsageError(
            f"the deck's stem would have {elements:.3g} elements of {size:g} mm, at most {_MOST_ELEMENTS:.0e} are "
            "written; take coarser elements (solver.element_size) or a shorter specimen"
        )
    supports = Supports(study.supports.clearance, study.supports.fillet_radius)
    lowest = 0.5 * diameter + study.loading.gap
    return _Parts(stem_mesh(stem, how), blade_mesh(blade, b.length, lowest, size), supports_mesh(supports, stem, size))


def _head(study: Study, solver: EmbeddedSolver | LsDynaSolver, diameter: float) -> Iterator[str]:
    yield "*KEYWORD"
    yield "$ Virtual shear test of a hollow stem, written by stemcal."
    yield "$ Units: mm, tonne, s, N, MPa."
    yield f"$ Study {study.name}, outer diameter {diameter:g} mm. Blade down along -z, stem along x."
    if isinstance(solver, EmbeddedSolver):
        yield "$ Without edge spread and internal length of the embedded solver: the force belongs to this mesh."
    if isinstance(solver, EmbeddedSolver) and solver.rate_law == "paper":
        yield "$ LS-DYNA's rate law is 1 + (rate/C)^(1/P); the study asks for 1 + (rate/C)^P."


def _control(
    study: Study, solver: EmbeddedSolver | LsDynaSolver, given: Mapping[str, float], stem: Mesh
) -> Iterator[str]:
    yield from keyword("CONTROL_TERMINATION", {"endtim": study.loading.duration})
    scaled = solver.mass_scaling > 1.0
    step = -float(f"{_time_step(stem, given) * sqrt(solver.mass_scaling):.3g}") if scaled else 0.0
    yield from keyword(
        "CONTROL_TIMESTEP", {"dtinit": 0.0, "tssfac": solver.time_step_safety, "isdo": 0, "tslimt": 0.0, "dt2ms": step}
    )
    form = solver.hourglass.form
    yield from keyword("CONTROL_HOURGLASS", {"ihq": _HOURGLASS[form], "qh": solver.hourglass.coefficient})
    yield from keyword("CONTROL_ENERGY", {"hgen": 2, "rwen": 2, "slnten": 2, "rylen": 1})


def _time_step(mesh: Mesh, given: Mapping[str, float]) -> float:
    """Return V / (A c) of the smallest element, s: its volume over its largest face and the speed of sound."""
    faces = mesh.nodes[mesh.hexes[:, FACES]]
    diagonals = faces[..., 2, :] - faces[..., 0, :], faces[..., 3, :] - faces[..., 1, :]
    areas = 0.5 * np.linalg.norm(np.cross(*diagonals), axis=-1)
    material = Material(given["density"], given["elastic_modulus"], given["poisson_ratio"])
    length = float((mesh.volumes() / areas.max(axis=1)).min())
    return length * sqrt(material.density / material.p_wave_modulus)


def _output(interval: float) -> Iterator[str]:
    for name in ("GLSTAT", "RCFORC"):
        yield from keyword(f"DATABASE_{name}", {"dt": interval, "binary": 1})
    yield from keyword("DATABASE_BINARY_D3PLOT", {"dt": 10.0 * interval})


def _materials(given: Mapping[str, float]) -> Iterator[str]:
    """Yield *MAT_003 of the stem with the nine parameters as they are, and the steel of the tools."""
    elastic = {"mid": STEM, "ro": given["density"], "e": given["elastic_modulus"], "pr": given["poisson_ratio"]}
    plastic = {
        "sigy": given["yield_stress"],
        "etan": given["tangent_modulus"],
        "beta": given["hardening_parameter"],
    }
    rate = {"src": given["strain_rate_c"], "srp": given["strain_rate_p"], "fs": given["failure_strain"], "vp": 0.0}
    yield from keyword("MAT_PLASTIC_KINEMATIC", elastic | plastic, rate)
    for part, held in ((BLADE, _NO_PLANE_MOTION), (SUPPORTS, _NO_TRANSLATION)):
        steel = {"mid": part, **_STEEL, "n": 0.0, "couple": 0.0, "m": 0.0}
        held_card = {"cmo": 1.0, "con1": held, "con2": _NO_ROTATION}
        axes = dict.fromkeys(("lco", "a2", "a3", "v1", "v2", "v3"), 0.0)
        yield from keyword("MAT_RIGID", steel, held_card, axes)


def _part_cards(solver: EmbeddedSolver | LsDynaSolver) -> Iterator[str]:
    form = _FORMULATION[solver.element if isinstance(solver, EmbeddedSolver) else "one_point"]
    yield from keyword("SECTION_SOLID", {"secid": STEM, "elform": form})
    yield from keyword("SECTION_SOLID", {"secid": BLADE, "elform": 1})
    for title, part in (("stem", STEM), ("blade", BLADE), ("supports", SUPPORTS)):
        section = STEM if part == STEM else BLADE
        yield from keyword("PART", {"pid": part, "secid": section, "mid": part}, title=title)


def _motion(study: Study) -> Iterator[str]:
    """Yield the constant speed of the blade: minus one times a curve, whose columns hold all digits."""
    motion = {"pid": BLADE, "dof": _ALONG_Z, "vad": _VELOCITY, "lcid": _CURVE, "sf": -1.0}
    yield from keyword("BOUNDARY_PRESCRIBED_MOTION_RIGID", motion)
    yield from keyword("DEFINE_CURVE", {"lcid": _CURVE})
    for time in (0.0, 2.0 * study.loading.duration):
        yield f"{time!r:>20}{study.loading.speed!r:>20}"


def _contacts(study: Study) -> Iterator[str]:
    """Yield blade and stem, interface 1, then stem and supports, interface 2."""
    c = study.contact
    friction = {"fs": c.static_friction, "fd": c.dynamic_friction, "dc": c.decay, "vc": 0.0}
    friction |= {"vdc": float(f"{100 * c.damping:.12g}"), "penchk": 0, "bt": 0.0, "dt": 1e20}
    scales = {"sfs": 1.0, "sfm": 1.0, "sst": 0.0, "mst": 0.0, "sfst": 1.0, "sfmt": 1.0, "fsf": 1.0, "vsf": 1.0}
    erosion = {"isym": 0, "erosop": 1, "iadj": 1}
    yield from keyword("CONTACT_ERODING_SURFACE_TO_SURFACE", _pair(BLADE), friction, scales, erosion)
    yield from keyword("CONTACT_AUTOMATIC_SURFACE_TO_SURFACE", _pair(SUPPORTS), friction, scales)


def _pair(tool: int) -> dict[str, int]:
    kinds = {"sstyp": _BY_PART, "mstyp": _BY_PART, "sboxid": 0, "mboxid": 0, "spr": 1, "mpr": 1}
    return {"ssid": STEM, "msid": tool, **kinds}


def _mesh(parts: _Parts) -> Iterator[str]:
    meshes = {STEM: parts.stem, BLADE: parts.blade, SUPPORTS: parts.supports}
    yield "*NODE"
    yield "$#   nid               x               y               z"
    first = 1
    for mesh in meshes.values():
        for number, point in enumerate(mesh.nodes.tolist(), start=first):
            yield f"{number:8d}" + "".join(f"{fitted(value, 15):>16}" for value in point)
        first += len(mesh.nodes)
    yield "*ELEMENT_SOLID"
    yield "$#   eid     pid      n1      n2      n3      n4      n5      n6      n7      n8"
    yield from _elements(meshes)


def _elements(meshes: Mapping[int, Mesh]) -> Iterable[str]:
    node = element = 1
    for part, mesh in meshes.items():
        for number, corners in enumerate((mesh.hexes + node).tolist(), start=element):
            yield f"{number:8d}{part:8d}" + "".join(f"{corner:8d}" for corner in corners)
        node, element = node + len(mesh.nodes), element + len(mesh.hexes)
