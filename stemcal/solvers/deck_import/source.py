"""What a keyword deck of a stem's shear test says: stem, blade and supports found, turned and put where ours are."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import UsageError
from stemcal.solvers.deck.fixed_width import LONG, STANDARD
from stemcal.solvers.deck.settings import settings_of
from stemcal.solvers.deck_import.cards import CARDS, known_name
from stemcal.solvers.deck_import.keyword_blocks import Block, blocks

Array = NDArray[np.float64]

# Ways that a blade's motion is given: vad 0 velocity, vad 2 displacement.
_SPEEDS, _BY_PLACE = (0.0, 2.0), 2.0
# How far a coarse mesh's section may be from round, as a share.
_ROUND = 0.06
_MOST_TOLD = 5
# How small and large a part may be, mm.
_SMALLEST, _LARGEST = 1e-3, 1e5
# mm, tonne and s in the units of a deck: length, mass, time.
UNITS = {"mm-t-s": (1.0, 1.0, 1.0), "mm-kg-ms": (1.0, 1e-3, 1e-3), "m-kg-s": (1e3, 1e-3, 1.0)}


class Source:
    """What a deck says: its cards, and the nodes of stem, blade and supports in our axes.

    Attributes
    ----------
    plastic : dict
        The stem's material, fields called as *MAT_024 does.
    motion : (part, axis, speed)
        The blade's part, the axis it moves along (0, 1, 2), its speed with its sign, mm/s.
    nodes : dict
        Nodes (N, 3) of ``stem``, ``blade`` and ``supports``, mm.
    symmetry : str
        Which part of the test the deck holds: ``none`` left out, ``half`` or ``quarter``; `nodes` are always whole.
    remarks : list of str
        What was read and could not be taken as it is.
    """

    def __init__(self, text: str, units: tuple[float, float, float]) -> None:
        self.length, mass, self.time = units
        self.stress = mass / (self.length * self.time**2)
        self.density = mass / self.length**3
        self.blocks = list(blocks(text))
        self.settings = settings_of(text)
        self.remarks: list[str] = []
        self.parts = {int(part["pid"]): part for part in self.all("PART")}
        self.rigid = {int(card["mid"]) for card in self.all("MAT_RIGID")}
        self.plastic = self._plastic()
        self.motion = self._motion()
        self.nodes = self._nodes()

    def named(self, *names: str) -> list[Block]:
        """Return the keywords of these names."""
        return [block for block in self.blocks if known_name(block.name) in names]

    def all(self, name: str) -> list[dict[str, float]]:
        """Return the fields of every keyword of a name."""
        return [self.fields(block) for block in self.named(name)]

    def first(self, name: str) -> dict[str, float]:
        """Return the fields of the first keyword of a name, zeros if there is none."""
        found = self.all(name)
        return found[0] if found else {field: 0.0 for names in CARDS[name] for field in names}

    def fields(self, block: Block) -> dict[str, float]:
        """Return the fields of all cards of a keyword."""
        found: dict[str, float] = {}
        for index, names in enumerate(CARDS[known_name(block.name)]):
            found |= block.fields(index, names)
        return found

    def _plastic(self) -> dict[str, float]:
        """Return the stem's material, fields called as *MAT_024 does."""
        used = {int(part["mid"]) for part in self.parts.values()}
        found, there = [], []
        for block in self.named("MAT_PLASTIC_KINEMATIC", "MAT_PIECEWISE_LINEAR_PLASTICITY"):
            card = self.fields(block)
            parts = [str(pid) for pid, part in self.parts.items() if part["mid"] == card["mid"]]
            there.append(f"*{block.name} {card['mid']:g} of {'part ' + ', '.join(parts) if parts else 'no part'}")
            if "src" in card:
                card |= {"c": card["src"], "p": card["srp"], "fail": card["fs"]}
            if int(card["mid"]) in used:
                found.append(card)
        if len(found) != 1:
            raise UsageError(
                f"{len(found)} parts of *MAT_003 or *MAT_024 where the stem is one (found: {_told(there)}); give the "
                "deck of one stem, with its material and its *PART in the same file"
            )
        (card,) = found
        if not (
            card["ro"] > 0.0 and card["e"] > card["etan"] >= 0.0 and 0.0 <= card["pr"] < 0.5 and card["sigy"] > 0.0
        ):
            given = ", ".join(f"{name} = {card[name]:g}" for name in ("ro", "e", "pr", "sigy", "etan"))
            raise UsageError(f"the stem's material is none that can be computed with: {given}; correct its card")
        return card

    @property
    def stem_section(self) -> int:
        """The section of the stem's part."""
        return next(int(part["secid"]) for part in self.parts.values() if part["mid"] == self.plastic["mid"])

    def _motion(self) -> tuple[int, int, float]:
        """Return the blade's part, the axis it moves along (0, 1, 2) and its speed with its sign."""
        motions = self.all("BOUNDARY_PRESCRIBED_MOTION_RIGID")
        moved = [card for card in motions if card["vad"] in _SPEEDS and int(card["dof"]) in (1, 2, 3)]
        if len(moved) != 1:
            there = [f"part {card['pid']:g} with dof {card['dof']:g} and vad {card['vad']:g}" for card in motions]
            raise UsageError(
                f"there are {len(moved)} blades (found: {_told(there)}); one rigid part moved along x, y or z by a "
                "velocity or a displacement is needed (*BOUNDARY_PRESCRIBED_MOTION_RIGID with dof 1 to 3, vad 0 or 2)"
            )
        card = moved[0]
        curve = next(
            (block for block in self.named("DEFINE_CURVE") if self.fields(block)["lcid"] == card["lcid"]), None
        )
        if curve is None:
            raise UsageError(
                f"*DEFINE_CURVE {card['lcid']:g} of the blade's motion is not in the deck; give it in the same file"
            )
        head = self.fields(curve)
        if len(curve.cards) < 2:
            raise UsageError(f"*DEFINE_CURVE {card['lcid']:g} of the blade's motion has no points; give two or more")
        points = [replace(curve, cards=(line,), width=LONG).fields(0, ("a", "o")) for line in curve.cards[1:]]
        values = _speeds(points, head["sfa"] or 1.0) if card["vad"] == _BY_PLACE else [point["o"] for point in points]
        if not values:
            raise UsageError(f"*DEFINE_CURVE {card['lcid']:g} has no two points at different times; give the motion")
        if np.ptp(values) > 1e-9 * np.abs(values).max():
            self.remarks.append(f"*DEFINE_CURVE {head['lcid']:g}: the blade's speed changes; its largest is taken")
        if (largest := max(values, key=abs)) == 0.0:
            raise UsageError("the blade does not move, its curve is zero; give its speed")
        speed = largest * (head["sfo"] or 1.0) * (card["sf"] or 1.0) * self.length / self.time
        return int(card["pid"]), int(card["dof"]) - 1, speed

    def _nodes(self) -> dict[str, Array]:
        """Return the nodes (N, 3) of stem, blade and supports, in our axes, mm."""
        table = self._table("NODE", (8, 16, 16, 16))
        place = {int(row[0]): row[1:4] * self.length for row in table}
        elements = self._elements()
        stem = next(pid for pid, part in self.parts.items() if part["mid"] == self.plastic["mid"])
        blade = self.motion[0]
        fixed = [pid for pid, part in self.parts.items() if int(part["mid"]) in self.rigid and pid != blade]
        groups = {"stem": [stem], "blade": [blade], "supports": fixed}
        found = {}
        for name, pids in groups.items():
            used = np.unique(elements[np.isin(elements[:, 1], pids), 2:])
            if not used.size:
                raise UsageError(f"the deck has no solid elements of {name}; all three are needed")
            if lost := [int(node) for node in used if int(node) not in place]:
                raise UsageError(
                    f"elements of {name} name {len(lost)} nodes that are not there, such as {lost[0]}; give them too"
                )
            found[name] = np.array([place[int(node)] for node in used])
            _refuse_odd_size(name, found[name])
        return self._turned(found)

    def _table(self, name: str, widths: tuple[int, ...]) -> Array:
        """Return the cards of all keywords of a name; their first column numbers them."""
        rows = [
            block.rows(widths if block.width == STANDARD else (block.width,) * len(widths), whole=(0,))
            for block in self.named(name)
        ]
        return np.concatenate(rows) if rows else np.zeros((0, len(widths)))

    def _elements(self) -> NDArray[np.int64]:
        """Return (E, 10): element, part and eight nodes, one card or two for each."""
        found: list[Array] = []
        for block in self.named("ELEMENT_SOLID"):
            cards = block.cards
            if cards and len(cards[0].split()) <= 2:
                cards = tuple(f"{a:16.16}{b}" for a, b in zip(cards[::2], cards[1::2], strict=False))
            found.append(replace(block, cards=cards).rows((8,) * 10, whole=range(10)))
        return (np.concatenate(found) if found else np.zeros((0, 10))).astype(np.int64)

    def _turned(self, nodes: dict[str, Array]) -> dict[str, Array]:
        """Return the nodes with the stem along x about the origin and the blade coming down along −z."""
        _, axis, speed = self.motion
        others = [i for i in range(3) if i != axis]
        along = max(others, key=lambda i: np.ptp(nodes["stem"][:, i]))
        turn = np.zeros((3, 3))
        turn[0, along], turn[2, axis] = 1.0, -np.sign(speed)
        turn[1] = np.cross(turn[2], turn[0])
        middle = 0.5 * (nodes["stem"].min(axis=0) + nodes["stem"].max(axis=0))
        turned = self._whole({name: (points - middle) @ turn.T for name, points in nodes.items()})
        lowest = turned["blade"][turned["blade"][:, 2] < turned["blade"][:, 2].min() + 1e-6, 0]
        if abs(float(lowest.mean())) > 1e-3 and abs(float(lowest.min())) > 1e-3:
            self.remarks.append(f"*NODE: the edge stands {lowest.mean():.3g} mm beside the middle of the stem")
        return turned

    def _whole(self, nodes: dict[str, Array]) -> dict[str, Array]:
        """Return the nodes of the whole test: what mirror planes along and across the stem left out is put back."""
        stem, found = nodes["stem"], dict(nodes)
        across = float(np.ptp(stem[:, 1]) / np.ptp(stem[:, 2]))
        along_blade = abs(across - 0.5) < _ROUND
        if not along_blade and abs(across - 1.0) > 2.0 * _ROUND:
            sides = " by ".join(f"{np.ptp(stem[:, i]):.3g}" for i in (1, 2))
            raise UsageError(
                f"the stem's section is {sides} mm across and along the blade's way, neither of a whole round stem "
                "nor of one halved lengthwise; give one of these"
            )
        if along_blade:  # the flat face is as high as the stem
            low, high = float(stem[:, 1].min()), float(stem[:, 1].max())
            plane = max((low, high), key=lambda y: np.ptp(stem[np.abs(stem[:, 1] - y) < 1e-6, 2]))
            found = {name: _mirrored(points, 1, plane, name == "stem") for name, points in found.items()}
        half = 0.5 * float(np.ptp(stem[:, 0]))
        edge = nodes["blade"][nodes["blade"][:, 2] < nodes["blade"][:, 2].min() + 1e-6, 0]
        across_stem = abs(abs(float(edge.mean())) - half) < _ROUND * half
        if across_stem and not along_blade:
            raise UsageError(
                "the stem is cut off under the blade, but not halved lengthwise; give it whole or a quarter"
            )
        if across_stem:
            plane = half if edge.mean() > 0.0 else -half
            found = {name: _mirrored(points, 0, plane, name != "blade") for name, points in found.items()}
        self.symmetry = "quarter" if across_stem else "half" if along_blade else "none"
        if self.symmetry != "none":
            self.remarks.append(
                f"*NODE: the deck is a {self.symmetry} model; the study's stem, force and blade are whole"
            )
        return found


def _mirrored(points: Array, axis: int, plane: float, always: bool) -> Array:
    """Return points (N, 3) with the plane at 0 of the axis, and images; what reaches as far on both sides is whole."""
    moved = points.copy()
    moved[:, axis] -= plane
    beyond = sorted((-float(moved[:, axis].min()), float(moved[:, axis].max())))
    if not always and beyond[0] > 0.5 * beyond[1]:
        return moved
    image = moved.copy()
    image[:, axis] *= -1.0
    return np.unique(np.round(np.concatenate([moved, image]), 9), axis=0)


def _speeds(points: list[dict[str, float]], stretched: float) -> list[float]:
    """Return the slopes of a displacement over time, points of a curve with the scale of its abscissa."""
    pairs = [(a, b) for a, b in pairwise(points) if b["a"] > a["a"]]
    return [(b["o"] - a["o"]) / (b["a"] - a["a"]) / stretched for a, b in pairs]


def _told(found: list[str]) -> str:
    return "; ".join(found[:_MOST_TOLD]) or "none"


def _refuse_odd_size(name: str, nodes: Array) -> None:
    """Refuse nodes (N, 3) that lie in a plane, or a part that no laboratory has."""
    sides = np.ptp(nodes, axis=0)
    if sides.min() <= 0.0:
        raise UsageError(f"the nodes of {name} lie in a plane; solid elements are needed")
    if sides.min() < _SMALLEST or sides.max() > _LARGEST or np.abs(nodes).max() > _LARGEST:
        size = " by ".join(f"{side:.3g}" for side in sides)
        raise UsageError(f"the nodes of {name} reach over {size} mm; is --units right?")
