"""Refinement on smooth problems with exact solutions: the error falls with the square of the element size."""

from math import pi, sin, sqrt

import numpy as np
from driven import NO_VISCOSITY, record

from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model

E, NU, RHO, SIDE = 1000.0, 0.3, 1e-9, 8.0


def lame_mode_error(count: int) -> float:
    """Return the relative L2 error of the nodes' displacement at 0.3 periods of a plate's Lamé mode."""
    mesh = brick((SIDE, SIDE, SIDE / count), (count, count, 1))
    k = pi / SIDE
    x, y = k * mesh.nodes[:, 0], k * mesh.nodes[:, 1]
    shape = np.stack([np.cos(x) * np.sin(y), -np.sin(x) * np.cos(y), np.zeros_like(x)], axis=1)
    material = Material(RHO, E, NU)
    omega = sqrt(2.0) * k * sqrt(material.shear_modulus / RHO)
    amplitude = 1e-6 * SIDE
    model = Model(mesh, material, velocity=amplitude * omega * shape, viscosity=NO_VISCOSITY,
                  integration=Integration(safety=0.5), hourglass=0.1)  # fmt: skip
    (end,), (found,) = record(model, np.array([0.3 * 2.0 * pi / omega]), lambda state: state.body.x - mesh.nodes)
    wanted = amplitude * sin(omega * end) * shape
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(amplitude * shape))


def test_lame_mode_of_a_free_square_plate() -> None:
    """u = A cos(πx/a) sin(πy/a), v = −A sin(πx/a) cos(πy/a): free of traction on all faces, ω = √2 (π/a) √(G/ρ).

    Lamé's equivoluminal modes (Graff, *Wave Motion in Elastic Solids*, sec. 8.1.5), exact for any ν. Rates between
    8, 16 and 32 elements must be 2 within 0.2 and the error below 0.5 % at 32.
    """
    errors = np.array([lame_mode_error(count) for count in (8, 16, 32)])
    rates = np.log2(errors[:-1] / errors[1:])
    np.testing.assert_allclose(rates, 2.0, atol=0.2)
    assert errors[-1] < 0.005


def axial_frequency(count: int) -> float:
    """Return the first axial frequency of a bar held at one end, as a fraction of c π/2L, from its zero crossings."""
    length = 16.0
    size = length / count
    mesh = brick((length, size, size), (count, 1, 1))
    c = sqrt(E / RHO)
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 1:] = True
    held[mesh.nodes[:, 0] < 1e-9, 0] = True
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = 1e-6 * c * np.sin(0.5 * pi * mesh.nodes[:, 0] / length)
    model = Model(mesh, Material(RHO, E, 0.0), held=held, velocity=velocity, viscosity=NO_VISCOSITY,
                  integration=Integration(safety=0.1))  # type: ignore[arg-type]  # fmt: skip
    period = 4.0 * length / c
    times, tip = record(model, np.linspace(0.0, 2.6 * period, 1041)[1:], lambda state: state.body.x[-1, 0] - length)
    up = np.flatnonzero((tip[:-1] < 0.0) & (tip[1:] >= 0.0))[:2]
    zeros = times[up] - tip[up] * (times[up + 1] - times[up]) / (tip[up + 1] - tip[up])
    return float(period / (zeros[1] - zeros[0]))


def test_first_axial_frequency_of_a_bar() -> None:
    """ω = (2c/h) sin(πh/4L) for lumped masses (Hughes 1987, sec. 9.1), so 1 − (π/4n)²/6 of the exact c π/2L.

    The time step of a tenth raises it by a hundredth of that error. Rate 2 within 0.1, the error itself within 3 %.
    """
    counts = np.array([4, 8, 16])
    errors = np.array([1.0 - axial_frequency(int(n)) for n in counts])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.1)
    np.testing.assert_allclose(errors, (pi / 4.0 / counts) ** 2 / 6.0, rtol=0.05)
