"""Pieces with an axis or with layers: composite beams and bars, a shear-soft beam, a layered tube under pressure."""

import shutil
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from layers_in_calculix import HEMP, STEMS, stiffnesses, timoshenko
from pieces import RATIO, E, material, piece
from test_three_point_bending import Couples

from stemcal.cutting.build import materials, stem_mesh
from stemcal.cutting.parts import Discretisation, Stem
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.laboratory.axial import Axial
from stemcal.laboratory.build import LaboratoryTest, build_piece, rounded
from stemcal.laboratory.perform import perform
from stemcal.laboratory.radial_compression import RadialCompression
from stemcal.laboratory.three_point_bending import ThreePointBending

SKIN = Material(1.1e-9, 6.0 * E, 0.3)


def skinned(test: LaboratoryTest, thickness: float = 0.5, skin: Material = SKIN) -> LaboratoryTest:
    return replace(test, stem=replace(test.stem, layers=(thickness,)), outer=(skin,))


def composite(power: int, ratio: float, thickness: float = 0.5) -> float:
    """Return Σ E (R^power − r^power) of pith and skin of 8 mm."""
    under = 4.0 - thickness
    return E * (under**power - (4.0 * ratio) ** power) + SKIN.elastic_modulus * (4.0**power - under**power)


@pytest.mark.parametrize("ratio", [RATIO, 0.0], ids=["hollow", "solid"])
@pytest.mark.parametrize("thickness", [0.3, 0.5, 1.0])
def test_two_layers_pull_as_a_composite_bar(ratio: float, thickness: float) -> None:
    """EA = Σ Eᵢ Aᵢ between lubricated ends, both layers of one Poisson's ratio; the slope within 0.5 %.

    Both are stretched alike: F = EA/L u (1 − (1 + 4ν) u/2L).
    """
    kind = Axial("tension", "lubricated")
    test = skinned(piece(kind, material(), 16.0, 0.05, 8.0 / 12.0, ratio), thickness)
    found = perform(test).responses["slope"]
    exact = pi * composite(2, ratio, thickness) / 16.0 * (1.0 - (1.0 + 4.0 * 0.3) * 0.35 * 0.05 / 16.0)
    assert found == pytest.approx(exact, rel=0.005)


@pytest.mark.parametrize("ratio", [RATIO, 0.0], ids=["hollow", "solid"])
@pytest.mark.parametrize("size", [1.0, 0.5])
def test_two_layers_bend_as_a_composite_beam(ratio: float, size: float) -> None:
    """M = EI κ in even bending by couples, EI = Σ Eᵢ Iᵢ; 0.5 %."""
    test = rounded(skinned(piece(Couples(20.0), material(), 24.0, 0.01, size, ratio)))
    history = simulate(build_piece(test), test.loading.duration)
    turned = test.loading.speed * history.time
    late = turned > 0.002
    work = np.polyfit(turned[late] ** 2, history.external[late], 1)[0]  # of a quarter of the piece, W = EI θ²/2L
    assert 2.0 * 24.0 * float(work) == pytest.approx(0.25 * pi * composite(4, ratio), rel=0.005)


def test_a_layered_wall_bends_as_its_layers_together() -> None:
    """The wall of a ring is thickened so that its points have Σ E (w (z − z₀)² + w³/12) about the neutral line."""
    test = skinned(piece(RadialCompression(), material(), 4.0, 0.1, 0.5, 0.6, through_wall=8))
    stem = rounded(test).stem
    assert stem.outer_diameter > 8.0
    counts = (6, 3)  # of the pith's 1.1 and the skin's 0.5 mm, of which each has three at least
    inner, middle, outer = stem.radii
    w = np.repeat([(middle - inner) / 6, (outer - middle) / 3], counts)
    z = np.cumsum(w) - 0.5 * w
    moduli = np.repeat([E, SKIN.elastic_modulus], counts)
    z0 = np.average(z, weights=moduli * w)
    found = float(moduli * w @ (z - z0) ** 2)
    pith, skin = 1.1, 0.5
    neutral = (E * pith * pith / 2 + SKIN.elastic_modulus * skin * (pith + skin / 2)) / (E * pith + 6 * E * skin)
    exact = E * (pith**3 / 12 + pith * (pith / 2 - neutral) ** 2)
    exact += SKIN.elastic_modulus * (skin**3 / 12 + skin * (pith + skin / 2 - neutral) ** 2)
    assert found == pytest.approx(exact, rel=1e-9)


SPANS = [6, pytest.param(12, marks=pytest.mark.slow), pytest.param(24, marks=pytest.mark.slow)]


@pytest.mark.parametrize("diameters", SPANS)
def test_a_shear_soft_beam_is_timoshenkos(diameters: int) -> None:
    """Hemp, E/G = 54, without nose and rollers: 1/(L³/48EI + L/4κGA), of which shear is 68, 34 and 12 %; 2 %.

    Found: +1.3 % at 6 diameters, where the middle section, which cannot warp, is a part of the span (CalculiX +3.0).
    """
    span = 8.0 * diameters
    found, _ = stiffnesses("hemp", span, calculix=False)
    assert found == pytest.approx(timoshenko(HEMP, span), rel=0.02)


@pytest.mark.parametrize("diameters", [6, 12])
def test_the_start_has_the_shear_of_a_soft_beam(diameters: int) -> None:
    """At a quarter of the span, of the speed in the middle: (11/16 + s/2)/(1 + s), s = (L/4κGA)/(L³/48EI).

    Without fibres, to the bit 11/16, the cubic line of a slender beam.
    """
    span = 8.0 * diameters
    soft = timoshenko(HEMP, span) / timoshenko(replace(HEMP, transverse=None, poisson_ratio=-1.0 + 1e-12), span)
    s = 1.0 / soft - 1.0  # ν → −1: G grows without bound
    for law, wanted in ((HEMP, (11.0 / 16.0 + 0.5 * s) / (1.0 + s)), (material(), 11.0 / 16.0)):
        test = piece(ThreePointBending(span), law, 1.2 * span, 1.0, 1.0)
        x = np.array([[0.0, 0.0, 0.0], [0.25 * span, 0.0, 0.0], [0.5 * span, 0.0, 0.0], [0.55 * span, 0.0, 1.0]])
        mesh = Mesh(x, np.zeros((0, 8), dtype=np.int32))
        v = test.kind.motion(mesh, test.stem, test.loading, test.laws)
        assert v[0, 2] == pytest.approx(-1.0, rel=1e-12) and v[2, 2] == pytest.approx(0.0, abs=1e-12)
        assert -v[1, 2] == pytest.approx(wanted, rel=1e-6 if law is HEMP else 1e-15)
        assert v[3, 0] / v[3, 2] == pytest.approx(-1.0 / (0.05 * span), rel=1e-9)  # overhangs turn, they do not shear


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
@pytest.mark.parametrize("diameters", [6, 12])
@pytest.mark.parametrize("name", STEMS)
def test_calculix_bends_as_stiffly(name: str, diameters: int) -> None:
    """The same mesh with fibres, a skin, a skin with fibres; 2 %."""
    found, other = stiffnesses(name, 8.0 * diameters)
    assert found == pytest.approx(other, rel=0.02)


@pytest.mark.parametrize("soft", [True, False], ids=["soft core", "stiff core"])
def test_a_two_layer_tube_under_pressure(soft: bool) -> None:
    """Lamé's cylinder of two layers: the bore widens, plane strain, by the solution of both layers' constants; 2 %.

    u = A r + B/r in each; σ_r = 2 (λ+μ) A − 2μ B/r²; at the interface u and σ_r are continuous.
    """
    inner, middle, outer, pressure = 1.64, 2.8, 4.0, 0.5
    laws = [Material(1e-9, modulus, 0.3) for modulus in ((200.0, 1000.0) if soft else (1000.0, 200.0))]
    stem = Stem(8.0, inner / 4.0, 1.0, layers=(outer - middle,))
    how = Discretisation(0.35, symmetry="quarter", edge_over="nodes")
    mesh = stem_mesh(stem, how, layers=np.array([0.0, 0.35]))
    radius = np.linalg.norm(mesh.nodes[:, 1:], axis=1)
    on = np.isclose(radius, inner)
    turn = np.arctan2(mesh.nodes[on, 2], mesh.nodes[on, 1])
    turns, place = np.unique(turn.round(9), return_inverse=True)
    arcs = np.gradient(turns)
    arcs[[0, -1]] *= 0.5
    share = arcs[place] * inner * 0.35 / 2.0
    loads = np.zeros_like(mesh.nodes)
    loads[on, 1:] = pressure * share[:, None] * mesh.nodes[on, 1:] / inner
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 0] = True
    held[np.abs(mesh.nodes[:, 1]) < 1e-9, 1] = True
    model = Model(mesh, materials(mesh, stem, laws[0], (laws[1],)), loads=loads, held=held, settling=0.3,
                  integration=Integration(mass_scaling=1.0, outputs=100))  # fmt: skip
    widened = simulate(model, 3e-4).x[:, 1:]
    centred = widened[on] - widened[on].mean(axis=0)
    found = float(np.ptp(centred[:, 1]) / 2.0 - inner)
    rows, right = [], []
    for r, one in ((inner, 0), (outer, 1)):
        lame, mu = laws[one].lame_modulus, laws[one].shear_modulus
        row = np.zeros(4)
        row[2 * one : 2 * one + 2] = 2.0 * (lame + mu), -2.0 * mu / r**2
        rows.append(row)
        right.append(-pressure if one == 0 else 0.0)
    displaced, pressed = np.zeros(4), np.zeros(4)
    for i, sign in ((0, 1.0), (1, -1.0)):
        displaced[2 * i : 2 * i + 2] = sign * middle, sign / middle
        lame, mu = laws[i].lame_modulus, laws[i].shear_modulus
        pressed[2 * i : 2 * i + 2] = sign * 2.0 * (lame + mu), -sign * 2.0 * mu / middle**2
    A, B, *_ = np.linalg.solve(np.array([*rows, displaced, pressed]), np.array([*right, 0.0, 0.0]))
    assert found == pytest.approx(A * inner + B / inner, rel=0.02)


def test_a_ring_squeezed_across_its_fibres_has_the_modulus_across() -> None:
    """The slope follows E_T, not E_L: with E_T alone halved it halves, within 3 %."""
    hollow = piece(RadialCompression(), HEMP, 4.0, 0.05, 0.5, 0.7, through_wall=8, coarsening_around=4.0)
    softer = replace(HEMP, transverse=replace(HEMP.transverse, elastic_modulus=44.0))  # type: ignore[type-var]
    stiffer = replace(HEMP, elastic_modulus=2.0 * HEMP.elastic_modulus)
    slopes = [perform(replace(hollow, material=one)).responses["slope"] for one in (HEMP, softer, stiffer)]
    assert slopes[1] == pytest.approx(0.5 * slopes[0], rel=0.03)
    assert slopes[2] == pytest.approx(slopes[0], rel=0.03)
