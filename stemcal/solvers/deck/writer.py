"""Write a shear test as a keyword deck: control, output, materials, parts, motion, contact and mesh.

All keywords are in the list of the OpenRadioss reader for LS-DYNA decks (in its sources:
hm_cfg_files/config/CFG/Keyword971_R14.1/data_hierarchy.cfg). ``*TITLE``, for example, is not.
"""

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from math import cos, radians, sin
from textwrap import wrap

import numpy as np

from stemcal.solvers.deck.equivalents import contact_scale, wanted_step
from stemcal.solvers.deck.keywords import Card, DeckForm, fitted, keyword
from stemcal.solvers.deck.model import BLADE, HOURGLASS, STEM, SUPPORTS, Deck
from stemcal.study.model.shear_test import DAMPING

# Files of a run, all of which are named after the deck.
DECK, STARTER_LISTING, ENGINE_INPUT, ENGINE_LISTING, HISTORY, TABLE = (
    *("run.k", "run_0000.out", "run_0001.rad", "run_0001.out"),
    *("runT01", "runT01.csv"),
)
STARTER_INPUT = "run_0000.rad"  # includes the deck and adds nonlocal failure
TITLES = "/TH/TITLE"  # writes titles of the time histories, which th_to_csv needs to convert impulses to forces

_STEEL_DENSITY = 7.8e-09  # density of blade and supports (Table 2 of the published study), t/mm³
# Tools with the law of the stem: density in units of the stem's density; yield stress (MPa) and failure strain, which
# are never reached.
_HEAVY, _NEVER = 100.0, 1e6
_NO_X, _NO_PLANE_MOTION, _NO_TRANSLATION, _NO_ROTATION = 1, 4, 7, 7
_ALONG_Y, _ALONG_Z, _VELOCITY = 2, 3, 0
_CLAMP = 4  # set of the nodes at the clamp; sets 1 to 3 are of stem, blade and supports
BLADE_CONTACT, SUPPORTS_CONTACT = 1, 2
_BY_PART_SET, _BY_PART = 2, 3


def deck_text(deck: Deck) -> str:
    """Return the text of a deck."""
    return "\n".join(_deck_lines(deck)) + "\n"


def _deck_lines(deck: Deck) -> Iterator[str]:
    yield from _head(deck)
    yield from _control(deck)
    for part in deck.layers:
        yield from stem_material(deck.material_of(part), deck.form, part)
    for part, mm in deck.nonlocal_lengths.items() if deck.form.for_ls_dyna else ():
        # average of the plastic strain increments over the part, with the default exponents p and q of LS-DYNA
        length = float(fitted(mm, 10))
        weight = {"idnl": part, "pid": part, "p": 8.0, "q": 2.0, "l": length, "nfreq": 100, "nhv": 1, "nhvt": 0}
        yield from keyword("MAT_NONLOCAL", weight, {"nl1": 1})
    # OpenRadioss uses nonlocal failure only if the first group of elements has it (``sforc3.F``). Groups are sorted by
    # their law number, and rigid bodies would be first. Therefore the tools have the law of the stem.
    held = deck.form.by_density
    yield from _held_tools(deck) if held else _tool_materials(deck)
    yield from _part_cards(deck, STEM if held else BLADE)
    yield from _clamp(deck)
    yield from _motion(deck, "SET" if held else "RIGID")
    yield from _contact_cards(deck)
    yield from _mesh(deck)
    yield "*END"


def _head(deck: Deck) -> Iterator[str]:
    yield "*KEYWORD"
    yield "$ Virtual shear test of a hollow stem, written by stemcal."
    yield "$ Units: mm, tonne, s, N, MPa."
    motion = "-z and +y" if deck.slide else "-z"
    yield f"$ Study {deck.study.name}, outer diameter {deck.diameter:g} mm. Blade motion: {motion}. Stem axis: x."
    for note in deck.notes:
        yield from wrap(f"Difference from the study: {note}.", 78, initial_indent="$ ", subsequent_indent="$   ")


def _control(deck: Deck) -> Iterator[str]:
    solver, stem, law = deck.solver, deck.parts.stem, deck.fastest
    yield from keyword("CONTROL_TERMINATION", {"endtim": deck.study.loading.duration_at(deck.diameter)})
    step = 0.0 if deck.form.by_density else -wanted_step(solver, stem, law) + 0.0
    limits = {"dtinit": 0.0, "tssfac": solver.time_step_safety, "isdo": 0, "tslimt": 0.0, "dt2ms": step}
    yield from keyword("CONTROL_TIMESTEP", limits)
    yield from keyword("CONTROL_HOURGLASS", {"ihq": 4, "qh": getattr(solver, "hourglass", HOURGLASS)})
    yield from keyword("CONTROL_ENERGY", {"hgen": 2, "rwen": 2, "slnten": 2, "rylen": 1})
    # slsfac = 1, so that only the factors of each contact apply, as in OpenRadioss, which does not read slsfac
    checks = dict.fromkeys(("rwpnal", "islchk", "shlthk", "penopt", "thkchg", "orien", "enmass"), 0)
    yield from keyword("CONTROL_CONTACT", {"slsfac": 1.0, **checks})
    interval = deck.study.loading.duration_at(deck.diameter) / deck.solver.outputs
    for name in ("GLSTAT", "RCFORC"):
        yield from keyword(f"DATABASE_{name}", {"dt": interval, "binary": 1})
    if deck.form.pictures:
        yield from keyword("DATABASE_BINARY_D3PLOT", {"dt": 10.0 * interval})


def stem_material(value: Mapping[str, float], form: DeckForm, part: int = STEM) -> Iterator[str]:
    """Yield the material of the stem: *MAT_003 with the nine parameters, or *MAT_024 with failure (OpenRadioss)."""
    elastic = {"mid": part, "ro": value["ro"], "e": value["e"], "pr": value["pr"]}
    plastic = {"sigy": value["sigy"], "etan": value["etan"]}
    if form.for_ls_dyna:
        rate = {"src": value["c"], "srp": value["p"], "fs": value["fail"], "vp": float(value["c"] > 0.0)}
        cards: list[Card] = [elastic | plastic | {"beta": value["beta"]}, rate]
        yield from keyword("MAT_PLASTIC_KINEMATIC", *cards)
        return
    failing = elastic | plastic | {"fail": value["fail"], "tdel": 0.0}
    rate = {"c": value["c"], "p": value["p"], "lcss": 0, "lcsr": 0, "vp": 0.0}
    curve: list[Card] = [{f"{name}{i}": 0.0 for i in range(1, 9)} for name in ("eps", "es")]
    yield from keyword("MAT_PIECEWISE_LINEAR_PLASTICITY", failing, rate, *curve)


def _tool_materials(deck: Deck) -> Iterator[str]:
    """Yield the rigid materials of blade and supports. Their moduli, those of the stem, affect only the contact."""
    moduli = {"e": deck.law.elastic_modulus, "pr": deck.law.poisson_ratio}
    for part in deck.parts.tools:
        held = _NO_TRANSLATION if part == SUPPORTS else _NO_X if deck.slide else _NO_PLANE_MOTION
        tool = {"mid": part, "ro": _STEEL_DENSITY, **moduli, "n": 0.0, "couple": 0.0, "m": 0.0}
        held_card = {"cmo": 1.0, "con1": held, "con2": _NO_ROTATION}
        axes = dict.fromkeys(("lco", "a2", "a3", "v1", "v2", "v3"), 0.0)
        yield from keyword("MAT_RIGID", tool, held_card, axes)


def _held_tools(deck: Deck) -> Iterator[str]:
    """Yield elastic tools with the law of the stem, which are so heavy that they do not reduce the time step."""
    law, parts = deck.law, deck.parts
    value = {**deck.material, "ro": _HEAVY * deck.material["ro"], "sigy": _NEVER, "etan": 0.0, "c": 0.0, "fail": _NEVER}
    first = 1 + len(parts.stem.nodes)
    for part, mesh in parts.tools.items():
        yield from stem_material({**value, "e": law.elastic_modulus, "pr": law.poisson_ratio}, deck.form, part)
        nodes = {"b1beg": first, "b1end": first + len(mesh.nodes) - 1}
        yield from keyword("SET_NODE_LIST_GENERATE", {"sid": part}, nodes)
        first += len(mesh.nodes)
        yield from _held(part, free="" if part == SUPPORTS else "yz" if deck.slide else "z")


def _clamp(deck: Deck) -> Iterator[str]:
    """Yield the set of the nodes at the clamp, eight per card, and the constraint that holds them."""
    if len(nodes := deck.parts.clamped):
        rows = np.split(nodes, range(8, len(nodes), 8))
        cards: list[Card] = [{f"nid{i}": int(node) for i, node in enumerate(row, 1)} for row in rows]
        yield from keyword("SET_NODE_LIST", {"sid": _CLAMP}, *cards)
        yield from _held(_CLAMP)


def _held(nodes: int, free: str = "") -> Iterable[str]:
    """Return the lines that hold a set of nodes in all directions but `free`; the nodes of solids do not rotate."""
    held = {f"dof{axis}": 0 if axis in free else 1 for axis in "xyz"} | dict.fromkeys(("dofrx", "dofry", "dofrz"), 0)
    return keyword("BOUNDARY_SPC_SET", {"nsid": nodes, "cid": 0, **held})


def _part_cards(deck: Deck, tools: int) -> Iterator[str]:
    yield from keyword("SECTION_SOLID", {"secid": STEM, "elform": 1})
    if tools != STEM:
        yield from keyword("SECTION_SOLID", {"secid": tools, "elform": 1})
    names = [layer.name for layer in deck.study.layers] or ["stem"]
    for title, part in zip([*names, "blade", "supports"], [*deck.layers, *deck.parts.tools], strict=False):
        section = STEM if part in deck.layers else tools
        yield from keyword("PART", {"pid": part, "secid": section, "mid": part}, title=title)


def _motion(deck: Deck, of: str) -> Iterator[str]:
    """Yield the blade speeds V cos θ downwards and V sin θ along the edge, with the sliding angle θ.

    Each is ±1 times a curve, which has room for all digits. `of`: RIGID (body) or (node) SET.
    """
    loading, angle = deck.study.loading, radians(deck.study.blade.sliding_angle)
    ways = {_ALONG_Z: (-1.0, cos(angle)), **({_ALONG_Y: (1.0, sin(angle))} if angle else {})}
    for curve, (dof, (sign, share)) in enumerate(ways.items(), 1):
        motion = {"pid" if of == "RIGID" else "nsid": BLADE, "dof": dof, "vad": _VELOCITY, "lcid": curve, "sf": sign}
        yield from keyword(f"BOUNDARY_PRESCRIBED_MOTION_{of}", motion)
        yield from keyword("DEFINE_CURVE", {"lcid": curve})
        for time in (0.0, 2.0 * loading.duration_at(deck.diameter)):
            yield f"{fitted(time, 20):>20}{fitted(loading.speed * share, 20):>20}"


def _contact_cards(deck: Deck) -> Iterator[str]:
    """Yield the lines of the contacts: blade and stem, then supports and stem."""
    c, radius = deck.study.contact, 0.5 * deck.diameter
    friction = {"fs": c.static_friction, "fd": c.dynamic_friction, "dc": c.decay, "vc": 0.0}
    friction |= {"vdc": float(f"{100 * DAMPING:.12g}"), "penchk": 0, "bt": 0.0, "dt": 1e20}
    erosion = {"isym": 0, "erosop": 1, "iadj": 1}
    blade = friction, _scales(deck, c.penalty * deck.edge_share, (0.0, 0.0, radius)), erosion
    supports = friction, _scales(deck, c.penalty, (deck.parts.rest, 0.0, -radius))
    if layered := len(deck.layers) > 1:
        parts = {f"pid{i}": part for i, part in enumerate(sorted(deck.layers), 1)}
        yield from keyword("SET_PART_LIST", {"sid": STEM}, parts)
    kinds = {"sstyp": _BY_PART_SET if layered else _BY_PART, "mstyp": _BY_PART}
    kinds |= {"sboxid": 0, "mboxid": 0, "spr": 1, "mpr": 1}
    for number, name, tool, title, cards in (
        (BLADE_CONTACT, "ERODING", BLADE, "blade and stem", blade),
        (SUPPORTS_CONTACT, "AUTOMATIC", SUPPORTS, "supports and stem", supports),
    ):
        if tool not in deck.parts.tools:
            continue
        heading, sides = f"{number:10d}{title}", {"ssid": STEM, "msid": tool, **kinds}
        yield from keyword(f"CONTACT_{name}_SURFACE_TO_SURFACE_ID", sides, *cards, title=heading)


def _scales(deck: Deck, share: float, place: tuple[float, float, float]) -> dict[str, float]:
    factor = float(f"{contact_scale(deck.solver, deck.parts.stem, deck.law, share, place):.4g}")
    unused = {"sst": 0.0, "mst": 0.0, "sfst": 1.0, "sfmt": 1.0, "fsf": 1.0, "vsf": 1.0}
    return {"sfs": factor, "sfm": factor, **unused}


def _mesh(deck: Deck) -> Iterator[str]:
    stem, tools = deck.parts.stem, deck.parts.tools
    yield "*NODE"
    yield "$#   nid               x               y               z"
    points = chain.from_iterable(mesh.nodes.tolist() for mesh in (stem, *tools.values()))
    for number, point in enumerate(points, 1):
        yield f"{number:8d}" + "".join(f"{fitted(value, 15):>16}" for value in point)
    yield "*ELEMENT_SOLID"
    yield "$#   eid     pid      n1      n2      n3      n4      n5      n6      n7      n8"
    parts = deck.layer_of.tolist()
    corners, first = (stem.hexes + 1).tolist(), 1 + len(stem.nodes)
    for part, mesh in tools.items():
        parts += [part] * len(mesh.hexes)
        corners += (mesh.hexes + first).tolist()
        first += len(mesh.nodes)
    for number, (part, nodes) in enumerate(zip(parts, corners, strict=True), 1):
        yield f"{number:8d}{part:8d}" + "".join(f"{node:8d}" for node in nodes)


def starter_around(name: str, lengths: Mapping[int, float]) -> str:
    """Return the starter input that includes the deck file `name` (run.k) and the nonlocal `lengths` (mm) of parts."""
    heading = f"#{'LENGTH':>19}{'LE_MAX':>20}"
    cards = ((f"/NONLOCAL/MAT/{part}", heading, f"{length!r:>20}{0:>20}") for part, length in lengths.items())
    units = f"{'Mg':>20}{'mm':>20}{'s':>20}"
    head = ["#RADIOSS STARTER", "/BEGIN", name.rpartition(".")[0] or name, f"{2022:10d}{0:10d}", units, units]
    return "\n".join([*head, "/INCLUDE_LS-DYNA/", name, *chain.from_iterable(cards), "/END", ""])


def engine_text(deck: Deck, run: str) -> str:
    """Return the engine input of a run: the duration of the stroke, the outputs, and the time step of the elements."""
    duration = deck.study.loading.duration_at(deck.diameter)
    lines = [f"/RUN/{run}/1/", f"{duration!r}", "/TFILE/4", f"{duration / deck.solver.outputs!r}"]
    lines += ["/DT", f"{deck.solver.time_step_safety!r} 0", "/PARITH/OFF", TITLES, "/PRINT/-1000", ""]
    return "\n".join(lines)


def material_text(deck: Deck, comments: Iterable[str]) -> str:
    """Return an include file: comments, wrapped to 78 columns, and the material card of the stem."""
    wrapped = [wrap(text, 78, initial_indent="$ ", subsequent_indent="$   ") for text in comments]
    return "\n".join(["*KEYWORD", *chain.from_iterable(wrapped), *stem_material(deck.material, deck.form), "*END", ""])
