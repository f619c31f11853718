"""A keyword deck of a stem's shear test, read as a study with the embedded solver; what does not fit is remarked on."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from stemcal.cutting import Blade, Stem, mesh_size, stem_mesh
from stemcal.errors import UsageError
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh
from stemcal.files.encodings import decode
from stemcal.files.plain import MIB, read_plain
from stemcal.solvers.deck.equivalents import contact_scale, nose_radius, wanted_step
from stemcal.solvers.deck.model import MOST_ELEMENTS
from stemcal.solvers.deck_import.cards import CARDS, known_name, passed_over
from stemcal.solvers.deck_import.keyword_blocks import Block
from stemcal.solvers.deck_import.shapes import blade_of, discretisation_of, stem_of, supports_of
from stemcal.solvers.deck_import.source import UNITS, Source
from stemcal.study.model import EmbeddedSolver
from stemcal.study.types.lengths import Length

Section = dict[str, Any]

_NOT_READ = {"KEYWORD", "TITLE"}
_LEAST_TSSFAC = 0.001
_STANDARD_QH, _STANDARD_SLSFAC, _STANDARD_TSSFAC = 0.1, 0.1, 0.9
# A conversion back is rounded to the digits that a person writes; it fits what was kept if it is so near.
_DIGITS, _CLOSE = 3, 2e-3
# A rate law of LS-DYNA's that has no effect.
_NO_RATE = {"strain_rate_c": 1e6, "strain_rate_p": 1.0}
_NEVER = 1000.0  # a failure strain
_MOST_BYTES = 100 * MIB


@dataclass(frozen=True)
class Imported:
    """What a deck says as a study does.

    Attributes
    ----------
    sections : dict
        Sections of the spec and their values in mm, t, s, N, MPa and degrees.
    fits : list of str
        Keywords that were read.
    leaves : list of str
        What the deck says and the study cannot.
    """

    sections: dict[str, Section]
    fits: list[str]
    leaves: list[str]


def read_deck(path: Path) -> str:
    """Return the text of a deck in UTF-8, UTF-16 or GBK.

    Raises
    ------
    UsageError
        If there is no plain file of text, or it is too large.
    """
    try:
        text = decode(read_plain(path, _MOST_BYTES))
    except (OSError, ValueError) as error:
        raise UsageError(f"{getattr(error, 'strerror', None) or error}; name a deck that is there") from None
    if text is None:
        raise UsageError("it is neither UTF-8 nor UTF-16 nor GBK text; save it as text in UTF-8")
    return text


def imported(text: str, units: str = "mm-t-s") -> Imported:
    """Return what a deck says as a study does.

    Raises
    ------
    UsageError
        If there is no stem, blade or support in it, or a card cannot be read.
    """
    deck = _Study(Source(text, UNITS[units]))
    sections = deck.sections()
    return Imported(sections, deck.fits(), deck.leaves())


class _Study:
    """A study while it is made from a deck."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.kept = source.settings
        self.stem: Stem = stem_of(source.nodes["stem"])
        self.blade, self.supports = self._blade(), supports_of(source.nodes["supports"])
        self.rests_at = 0.5 * self.supports.clearance + self.supports.fillet_radius
        self.how, self.is_our_mesh = discretisation_of(self.stem, source.nodes["stem"], self.rests_at)
        self.remarks = list(source.remarks)
        if not self.is_our_mesh:
            self.remarks.append("*NODE, *ELEMENT_SOLID: the stem is meshed otherwise than the embedded solver does")

    @cached_property
    def mesh(self) -> Mesh:
        """The stem as the study will mesh it, whole."""
        if mesh_size(self.stem, self.how).elements > MOST_ELEMENTS:
            raise UsageError(f"elements of {self.how.element_size:g} mm are too small for the stem; is --units right?")
        return stem_mesh(self.stem, self.how, self.rests_at)

    def _blade(self) -> Blade:
        """Return the blade; of a deck of stemcal's, with the edge that its nose stands for."""
        found, kept = blade_of(self.source.nodes["blade"]), self.kept
        nose = None if kept.edge_radius is None else max(kept.edge_radius, nose_radius(kept.edge_spread))
        is_spread = nose is not None and bool(np.isclose(found.edge_radius, nose, rtol=_CLOSE))
        radius = kept.edge_radius if is_spread and kept.edge_radius is not None else found.edge_radius
        return replace(found, edge_radius=radius)

    def sections(self) -> dict[str, Section]:
        """Return the sections of the study."""
        source, stem, blade = self.source, self.stem, self.blade
        material = self._material()
        law = Material(material["density"], material["elastic_modulus"], material["poisson_ratio"])
        solver = self._solver(law)
        lowest = float(source.nodes["blade"][:, 2].min())
        return {
            "specimen": {
                "outer_diameter": stem.outer_diameter,
                "diameter_ratio": stem.diameter_ratio,
                "length": stem.length,
            },
            "blade": {
                "length": max(_round(float(np.ptp(source.nodes["blade"][:, 1])), 9), self.kept.blade_length or 0.0),
                "width": blade.width,
                "thickness": blade.thickness,
                "edge_angle": blade.edge_angle,
                "bevel": blade.bevel,
                "edge_radius": blade.edge_radius,
                "edge_spread": self.kept.edge_spread,
            },
            "supports": {"clearance": self.supports.clearance, "fillet_radius": self.supports.fillet_radius},
            "loading": {
                "speed": abs(source.motion[2]),
                "duration": source.first("CONTROL_TERMINATION")["endtim"] * source.time,
                "gap": max(_round(lowest - 0.5 * stem.outer_diameter, 6), 0.0),
            },
            "contact": self._contact(law, solver),
            "material": material,
            "solver": solver,
        }

    def fits(self) -> list[str]:
        """Return the keywords that were read."""
        return list(dict.fromkeys(f"*{block.name}" for block in self.source.blocks if _is_read(block)))

    def leaves(self) -> list[str]:
        """Return what the deck says and the study cannot."""
        return [*self.remarks, *self._left()]

    def _left(self) -> Iterator[str]:
        for block in self.source.blocks:
            if known_name(block.name) in CARDS:
                yield from passed_over(block)
            elif not _is_read(block) and block.name not in _NOT_READ:
                yield f"*{block.name} at line {block.line} ({len(block.cards)} cards)"
        if not self.kept.model_fields_set:
            yield "edge spread and internal length: a deck has none, 0 mm is written and the force belongs to the mesh"

    def _material(self) -> dict[str, float]:
        source, card = self.source, self.source.plastic
        kept = 1.0 if self.kept.hardening_parameter is None else self.kept.hardening_parameter
        beta = card.get("beta", kept)
        density, factor = card["ro"] * source.density, self.kept.density_factor
        if card["fail"] <= 0.0:
            self.remarks.append(f"the stem's material has no failure strain: {_NEVER:g} is written")
        return {
            "density": density if factor == 1.0 else _round(density / factor, 6),
            "elastic_modulus": card["e"] * source.stress,
            "poisson_ratio": card["pr"],
            "yield_stress": card["sigy"] * source.stress,
            "tangent_modulus": card["etan"] * source.stress,
            "hardening_parameter": beta,
            **(self._printed_rate() or self._usual_rate()),
            "failure_strain": card["fail"] if card["fail"] > 0.0 else _NEVER,
            "internal_length": self.kept.internal_length,
        }

    def _printed_rate(self) -> dict[str, float]:
        """Return C and P of the printed rate law, if the deck was made from it and still says so."""
        card, c, p = self.source.plastic, self.kept.strain_rate_c, self.kept.strain_rate_p
        if self.kept.rate_law != "paper" or c is None or p is None:
            return {}
        same = card["c"] == 0.0 or bool(np.isclose(card["p"] * p, 1.0, rtol=_CLOSE))
        return {"strain_rate_c": c, "strain_rate_p": p} if same else {}

    def _usual_rate(self) -> dict[str, float]:
        c, p = self.source.plastic["c"] / self.source.time, self.source.plastic["p"]
        return {"strain_rate_c": c, "strain_rate_p": p} if c > 0.0 and p > 0.0 else dict(_NO_RATE)

    def _solver(self, law: Material) -> Section:
        source, kept, how = self.source, self.kept, self.how
        steps, interval = source.first("CONTROL_TIMESTEP"), source.first("DATABASE_RCFORC")["dt"]
        endtim = source.first("CONTROL_TERMINATION")["endtim"]
        optional = {"filter_window", "break_drop", "stop_after_peak"}
        found: Section = {
            "kind": "embedded",
            "rate_law": "paper" if self._printed_rate() else "cowper_symonds",
            "element_size": how.element_size,
            "elements_through_wall": how.through_wall,
            "edge_over": how.edge_over,
            "coarsening": how.coarsening,
            "coarsening_around": how.coarsening_around,
            "mass_scaling": kept.mass_scaling,
            "time_step": kept.time_step,
            "time_step_safety": _safety(steps["tssfac"] or _STANDARD_TSSFAC),
            "outputs": round(endtim / interval) if interval > 0.0 else 500,
            **kept.model_dump(include=optional, exclude_none=True),
            "hourglass": self._hourglass(),
        }
        given = abs(steps["dt2ms"]) * source.time
        if not np.isclose(wanted_step(_embedded(found), self.mesh, law), given, rtol=_CLOSE):
            found |= {"mass_scaling": 1.0, "time_step": _round(given * found["time_step_safety"], 4) or None}
        return found

    def _hourglass(self) -> float:
        card = self.source.first("CONTROL_HOURGLASS")
        if int(card["ihq"]) not in (4, 5):
            self.remarks.append(f"*CONTROL_HOURGLASS: ihq = {card['ihq']:g}; the stiffness form 4 is written")
        return float(card["qh"] or _STANDARD_QH)

    def _contact(self, law: Material, solver: Section) -> Section:
        source, blade = self.source, self.source.motion[0]
        found = [source.fields(block) for block in source.named(*(n for n in CARDS if n.startswith("CONTACT")))]
        if not found:
            self.remarks.append("there is no contact that can be read: the usual friction is written")
            return {}
        first = next((card for card in found if blade in (card["ssid"], card["msid"])), found[0])
        other = next((card for card in found if card is not first), first)
        for name in ("fs", "fd", "dc", "vdc"):
            if other[name] != first[name]:
                self.remarks.append(
                    f"*CONTACT: {name} is {first[name]:g} at the blade, {other[name]:g} at the supports"
                )
        return {
            "static_friction": first["fs"],
            "dynamic_friction": first["fd"],
            "decay": first["dc"] * source.time / source.length,
            "penalty": self._penalty(law, solver, other["sfs"] or 1.0),
            "damping": min(first["vdc"] / 100.0, 1.0),
        }

    def _penalty(self, law: Material, solver: Section, sfs: float) -> float:
        """Return p of p m/Δt² that is as stiff as the contact with the supports."""
        place = (self.rests_at, 0.0, -0.5 * self.stem.outer_diameter)
        per_share = contact_scale(_embedded(solver), self.mesh, law, 1.0, place)
        slsfac = self.source.first("CONTROL_CONTACT")["slsfac"] or _STANDARD_SLSFAC
        penalty = _round(slsfac * sfs / per_share, _DIGITS)
        if penalty > 1.0:
            self.remarks.append(f"*CONTACT: its stiffness is {penalty:g} m/Δt²; penalty 1 is the most")
        return min(penalty, 1.0)


def _is_read(block: Block) -> bool:
    return known_name(block.name) in CARDS or block.name in ("NODE", "ELEMENT_SOLID")


def _safety(tssfac: float) -> float:
    if not _LEAST_TSSFAC <= tssfac <= 1.0:
        raise UsageError(f"*CONTROL_TIMESTEP: tssfac is {tssfac:g}; a study can have {_LEAST_TSSFAC:g} to 1")
    return tssfac


def _embedded(section: Section) -> EmbeddedSolver:
    """Return the embedded solver of a section, as far as time step and contact need it."""
    names = ("mass_scaling", "time_step", "time_step_safety")
    return EmbeddedSolver(element_size=Length(section["element_size"]), **{name: section[name] for name in names})


def _round(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")
