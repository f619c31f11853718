"""The localisation of a necking bar in the embedded solver and in OpenRadioss.

An eighth of a bar of length 12 ℓ, 0.5 % thinner in its middle, is pulled at its end. The material yields at 15 MPa with
little hardening, so the bar necks at once: over its breadth, or over one element if the elements are longer. The neck
is the same in both programs, but the programs average its plastic strain differently. The bar fails at a mean of 3 %.
For a neck with the elongation u that is narrow compared with ℓ and L, the mean is

    embedded        weight exp(−r²/ℓ²)         u / (ℓ √π)
    OpenRadioss     ε̄ − L² ∇²ε̄ = ε             u / (2 L)          equal for L = 0.886 ℓ

For a wide neck, the second moments of the two means are equal for L = ℓ/2. For the neck found by the embedded solver,
`radioss_length` computes L. OpenRadioss is run with this L and with the length of the decks.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import erf

from stemcal.fem.kernels.block import PLASTIC_STRAIN
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State, start
from stemcal.fem.stepper import simulate
from stemcal.processes.program import run_program
from stemcal.solvers.deck.keywords import Card, DeckForm, fitted, keyword
from stemcal.solvers.deck.model import STEM
from stemcal.solvers.deck.openradioss import installation
from stemcal.solvers.deck.writer import (
    DECK,
    ENGINE_INPUT,
    HISTORY,
    STARTER_INPUT,
    TABLE,
    TITLES,
    starter_around,
    stem_material,
)
from stemcal.solvers.options import DeckSolver
from stemcal.solvers.program import run_folder

Array = NDArray[np.float64]

LENGTH = 1.0  # ℓ, mm
HALF = 6.0  # of the bar, mm
WAIST = 0.005
SPEED, DURATION, OUTPUTS, SAFETY = 0.03, 2.0, 400, 0.9  # waves pass the half bar 300 times
_LAST = 20  # outputs over which the force is taken
LAW = Material(
    density=1e-2, elastic_modulus=1e4, poisson_ratio=0.3, yield_stress=15.0, tangent_modulus=5.0,
    hardening_parameter=1.0, failure_strain=0.03, internal_length=LENGTH,
)  # fmt: skip
# Breadths, and for each the elements: ℓ over these. A neck is no shorter than they.
SECTIONS = {1 / 8: (3, 5, 8), 1 / 2: (8, 12, 16), 1.0: (4, 6, 8), 2.0: (3, 4, 6)}


@dataclass(frozen=True)
class Pulled:
    """A bar when its first element goes: profiles over x (mm), each row of elements' mean strain, and the work done.

    `elongation` (mm) is the plastic one of the whole bar, `work` (mJ/mm²) per area of the whole section, the elastic
    energy less.
    """

    x: Array
    strain: Array
    mean: Array
    elongation: float
    work: float

    @property
    def neck(self) -> float:
        """The standard deviation of the strain about the middle, mm."""
        return float(np.sqrt(self.strain @ self.x**2 / self.strain.sum()))

    @property
    def zone(self) -> float:
        """∫ε̄ dx / max ε̄ of the whole bar, mm."""
        return float(2.0 * np.sum(self.mean) * (self.x[1] - self.x[0]) / self.mean.max())


def bar(breadth: float, size: float) -> tuple[Mesh, int]:
    """Return an eighth of a bar, its middle at x = 0, mirror planes y = 0 and z = 0, and its elements along x; mm."""
    across = max(1, round(0.5 * breadth / size))
    rows = round(HALF / size)
    mesh = brick((HALF, 0.5 * breadth, 0.5 * breadth), (rows, across, across))
    thinner = 1.0 - WAIST * 0.5 * (1.0 + np.cos(np.pi * mesh.nodes[:, :1] / HALF))
    return mesh.moved(np.hstack([mesh.nodes[:, :1], thinner * mesh.nodes[:, 1:]])), rows


def held(mesh: Mesh) -> NDArray[np.bool_]:
    """Return which components stand still or are driven: those normal to the mirror planes, and the end along x."""
    planes = np.abs(mesh.nodes) < 1e-9
    planes[:, 0] |= mesh.nodes[:, 0] > HALF - 1e-9
    return planes


def pulled_here(breadth: float, size: float, law: Material = LAW) -> Pulled:
    """Return what the embedded solver makes of a bar."""
    mesh, rows = bar(breadth, size)
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = SPEED * mesh.nodes[:, 0] / HALF
    seen: list[Array] = []

    def look(_time: float, state: State) -> None:
        seen.append(state.lanes.gathered(state.body.state)[:, PLASTIC_STRAIN].copy())

    how = Integration(outputs=OUTPUTS, safety=SAFETY)
    model = Model(mesh, law, held=held(mesh), velocity=velocity, integration=how, hourglass=0.01)
    history = simulate(model, DURATION, lambda _time, _force, deleted: deleted > 0, look)
    assert history.deleted[-1] > 0, "the bar was not parted"
    return pulled(mesh, rows, seen[-2], averaged(model, seen[-2]), history.time[:-1], history.external[:-1])


def averaged(model: Model, strain: Array) -> Array:
    """Return the mean strain around each element, by the solver's own passes of exchange."""
    exchange = start(model).exchange
    for _ in range(exchange.passes):
        strain = strain + (exchange.share * (strain[exchange.around] - strain[:, None])).sum(axis=1)
    return strain


def pulled(mesh: Mesh, rows: int, strain: Array, mean: Array, time: Array, work: Array) -> Pulled:
    """Return what is told of the last output before an element goes.

    `strain` and `mean` are of the elements, `time` and `work` (mJ, of the eighth) of all outputs until then.
    """
    size, volumes = HALF / rows, mesh.volumes()
    row = (mesh.nodes[mesh.hexes].mean(axis=1)[:, 0] / size).astype(int)
    per_row = np.bincount(row, volumes)
    along_bar = [np.bincount(row, volumes * value) / per_row for value in (strain, mean)]
    pull = SPEED * time
    force = float(np.gradient(work, pull)[-_LAST:].mean())
    elastic = force * float(np.sum(size**2 / per_row)) / LAW.elastic_modulus  # F Σ h / E A
    section = float(per_row[0] / size)
    return Pulled(
        size * (np.arange(rows) + 0.5),
        *along_bar,
        2.0 * (float(pull[-1]) - elastic),
        2.0 * (float(work[-1]) - 0.5 * force * elastic) / section,
    )


def radioss_length(here: Pulled) -> float:
    """Return the L with which OpenRadioss finds the failure strain in the middle of the same neck, mm."""

    def off(length: float) -> float:
        return float(radioss_mean(here, length)[0]) - LAW.failure_strain

    return float(brentq(off, 0.1 * LENGTH, 2.0 * LENGTH))


def radioss_mean(neck: Pulled, length: float) -> Array:
    """Return what OpenRadioss makes of a profile: ε̄ − L² ∇²ε̄ = ε over the stretched elements of the half bar.

    Its elements have one point each, where ε̄ is the mean of their nodes and ∇ε̄ the difference (``sfint_reg.F``).
    """
    rows, size = len(neck.strain), HALF / len(neck.strain)
    left, right = np.eye(rows, rows + 1), np.eye(rows, rows + 1, 1)
    mean, slope = 0.5 * (left + right), (right - left) / (size * np.exp(neck.strain))[:, None]
    at_nodes = np.linalg.solve(mean.T @ mean + length**2 * slope.T @ slope, mean.T @ neck.strain)
    return np.asarray(mean @ at_nodes)


def gaussian_mean(neck: Pulled) -> float:
    """Return the mean of a profile in its middle by the weight exp(−x²/ℓ²) itself: Σ ε (erf b/ℓ − erf a/ℓ)."""
    edges = HALF / LENGTH * np.arange(len(neck.strain) + 1) / len(neck.strain)
    return float(neck.strain @ np.diff(erf(edges)))


# ---- OpenRadioss


def deck_lines(mesh: Mesh) -> Iterator[str]:
    """Yield the bar's deck, its cards as those of a stem's deck."""
    value = {"ro": LAW.density, "e": LAW.elastic_modulus, "pr": LAW.poisson_ratio, "sigy": LAW.yield_stress}
    value |= {"etan": LAW.tangent_modulus, "c": 0.0, "p": 1.0, "fail": LAW.failure_strain}
    yield "*KEYWORD"
    yield from keyword("CONTROL_TERMINATION", {"endtim": DURATION})
    step: Card = {"dtinit": 0.0, "tssfac": SAFETY, "isdo": 0, "tslimt": 0.0, "dt2ms": 0.0}
    yield from keyword("CONTROL_TIMESTEP", step)
    yield from keyword("CONTROL_HOURGLASS", {"ihq": 4, "qh": 0.01})
    yield from keyword("CONTROL_ENERGY", {"hgen": 2, "rwen": 2, "slnten": 2, "rylen": 1})
    yield from keyword("DATABASE_GLSTAT", {"dt": DURATION / OUTPUTS, "binary": 1})
    yield from stem_material(value, DeckForm(lengths=True))
    yield from keyword("SECTION_SOLID", {"secid": STEM, "elform": 1})
    yield from keyword("PART", {"pid": STEM, "secid": STEM, "mid": STEM}, title="bar")
    end = 1 + np.flatnonzero(mesh.nodes[:, 0] > HALF - 1e-9)
    yield from keyword("SET_NODE_LIST_GENERATE", {"sid": 1}, {"b1beg": int(end[0]), "b1end": int(end[-1])})
    motion = {"nsid": 1, "dof": 1, "vad": 0, "lcid": 1, "sf": 1.0}
    yield from keyword("BOUNDARY_PRESCRIBED_MOTION_SET", motion)
    yield from keyword("DEFINE_CURVE", {"lcid": 1})
    for time in (0.0, 2.0 * DURATION):
        yield f"{time!r:>20}{SPEED!r:>20}"
    for number, planes in enumerate(np.abs(mesh.nodes) < 1e-9, start=1):
        if planes.any():
            dofs = dict(zip(("dofx", "dofy", "dofz"), map(int, planes), strict=True))
            yield from keyword(
                "BOUNDARY_SPC_NODE", {"nid": number, "cid": 0, **dofs, "dofrx": 0, "dofry": 0, "dofrz": 0}
            )
    for number, x in enumerate(mesh.nodes[:, 0].tolist(), start=1):
        if x > 1e-9:
            start = {"nid": number, "vx": SPEED * x / HALF, "vy": 0.0, "vz": 0.0, "vxr": 0.0, "vyr": 0.0, "vzr": 0.0}
            yield from keyword("INITIAL_VELOCITY_NODE", start)
    yield "*NODE"
    for number, point in enumerate(mesh.nodes.tolist(), start=1):
        yield f"{number:8d}" + "".join(f"{fitted(value, 15):>16}" for value in point)
    yield "*ELEMENT_SOLID"
    for number, corners in enumerate((mesh.hexes + 1).tolist(), start=1):
        yield f"{number:8d}{STEM:8d}" + "".join(f"{corner:8d}" for corner in corners)
    yield "*END"


def histories_asked(elements: int) -> Iterator[str]:
    """Yield the starter's cards that ask for strain, mean strain and standing of every element over time."""
    yield from ("/TH/BRIC/1", "strain", f"{'OFF':<10}{'PLAS':<10}{'NL_PLAS':<10}")
    yield from (f"{number:10d}" for number in range(1, elements + 1))


def pulled_there(breadth: float, size: float, share: float) -> Pulled:
    """Return what OpenRadioss makes of a bar, with a nonlocal length of `share` ℓ."""
    mesh, rows = bar(breadth, size)
    length = share * LENGTH
    options, folder = DeckSolver(program="openradioss"), run_folder(None, {})
    there = installation(options, Path.cwd())
    (folder / DECK).write_text("\n".join(deck_lines(mesh)) + "\n", "utf-8")
    further = "\n".join([*histories_asked(len(mesh.hexes)), "/END"])
    (folder / STARTER_INPUT).write_text(starter_around(DECK, {1: length}).replace("/END", further), "utf-8")
    engine = (
        "/RUN/run/1/",
        f"{DURATION}",
        "/TFILE/4",
        f"{DURATION / OUTPUTS}",
        "/DT",
        f"{SAFETY} 0",
        "/PARITH/OFF",
        TITLES,
    )
    for command in ([there.starter, "-i", STARTER_INPUT, "-np", "1"], [there.engine, "-i", ENGINE_INPUT]):
        ended = run_program(command, folder, there.environment, 3600.0)
        assert ended.code == 0, f"{ended.output} ({folder})"
        (folder / ENGINE_INPUT).write_text("\n".join([*engine, "/PRINT/-1000", ""]), "utf-8")
    run_program([there.th_to_csv, HISTORY], folder, there.environment, 3600.0)
    table = pd.read_csv(folder / TABLE, skipinitialspace=True)
    shutil.rmtree(folder, ignore_errors=True)
    standing, strain, mean = (history_of(table, name) for name in ("OFF", "PLAS", "NL_PLAS"))
    gone = np.flatnonzero((standing < 1.0).any(axis=1))
    assert len(gone), "the bar was not parted"
    last = gone[0] - 1
    time, work = (table[name].to_numpy(dtype=float)[: last + 1] for name in ("time", "EXTERNAL WORK"))
    return pulled(mesh, rows, strain[last], mean[last], time, work)


def history_of(table: pd.DataFrame, name: str) -> Array:
    """Return a value of every element over time (rows, elements)."""
    columns = [column for column in table.columns if column.startswith("strain") and column.split()[-1] == name]
    return table[columns].to_numpy(dtype=float)
