"""Material law in one element: cyclic tension, yield stress versus strain rate, erosion."""

from __future__ import annotations

import numpy as np
from driven import NO_VISCOSITY, advance, row, stretched
from test_erosion import CUBE, pulled
from test_plasticity import LAWS, NU, RATES, E, bilinear, closed_form_reversal, cycle, material, scaled_yield
from test_plasticity import wanted_yield as exact_yield

from stemcal.fem.kernels.block import ALIVE
from stemcal.fem.material import Material
from stemcal.fem.model import Model
from stemcal.fem.state import start
from verification import figures
from verification.case import Case, Drawing, Topic

BETAS = (0.0, 0.5, 1.0)
PER_LEG = 300
LAW_NAMES = {"cowper_symonds": "Cowper and Symonds", "paper": "as printed in the paper"}


def tension() -> Topic:
    """Pull one element through yield, reverse, and push it through yield."""
    source = "Krieg and Key 1976, closed form"
    cases, loops = [], {}
    for beta in BETAS:
        path, found, exact = loop(beta)
        corners = dict(zip(("first yield", "at 5 %", "yield in compression", "at −3 %"),
                           range(PER_LEG - 1, 4 * PER_LEG, PER_LEG), strict=True))  # fmt: skip
        cases += [
            Case(f"β = {beta:g}: {name}", found[step], exact[step], 1e-4, source, "MPa", relative=False)
            for name, step in corners.items()
        ]
        loops[beta] = (path, found, *closed_form_reversal(beta))
    text = (
        "The cyclic tension test uses one element under uniaxial stress with E = 1000 MPa, σy = 10 MPa and Et = 50 "
        "MPa. In the cyclic tension test, the element is strained first to 5 % and then to −3 %. If the hardening "
        "parameter β is 0, the width of the elastic range is constant; if β is 1, the centre of the elastic range is "
        "constant."
    )
    caption = "Stress versus strain over one loading cycle: computed values (points) and closed-form solution (lines)."
    return Topic("Cyclic tension", text, tuple(cases), (Drawing("loops", figures.loops(loops), caption),))


def loop(beta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the path of strain, and the axial stress along it as computed and as exact."""
    path = cycle(closed_form_reversal(beta)[0], PER_LEG)
    axial, _ = bilinear(path, beta)
    lateral = -NU * axial / E - 0.5 * (path - axial / E)
    model = Model(CUBE, material(beta), viscosity=NO_VISCOSITY, hourglass=0.1)
    _, found = stretched(model, np.stack([path, lateral, lateral], axis=1))
    return path, found[:, 0], axial


def rate() -> Topic:
    """Compare the yield stress at given strain rates under both laws."""
    fastest = {(law, c, p): max(r for w, k, q, r in RATES if (w, k, q) == (law, c, p)) for law, c, p, _ in RATES}
    cases = [
        Case(f"{LAW_NAMES[law]}: C = {c:g} 1/s, P = {p:g}, at {r:g} 1/s", scaled_yield(law, c, p, r),
             exact_yield(law, c, p, r), 1e-6, "Cowper and Symonds 1957" if law != "paper" else "the paper's formula",
             "MPa")
        for (law, c, p), r in fastest.items()
    ]  # fmt: skip
    curves = {LAW_NAMES[law]: yield_curve(law) for law in LAWS}
    text = (
        "One element without hardening (σy = 10 MPa) is stretched at a constant strain rate and constant volume. "
        "According to the Cowper–Symonds law, the yield stress is multiplied by 1 + (ε̇/C)^(1/P). According to the "
        "rate law printed in the paper, the yield stress is multiplied by 1 + (ε̇/C)^P. The strain rate ε̇ in both "
        "rate laws is the norm of the strain-rate tensor. At the speed of the shear test, the rate law printed in the "
        "paper does not change the yield stress."
    )
    caption = (
        "Yield stress versus axial strain rate for C = 80 1/s and P = 4: computed values (points) and formula (lines)."
    )
    return Topic(
        "Yield stress versus strain rate", text, tuple(cases), (Drawing("rate", figures.rate(curves), caption),)
    )


def yield_curve(law: str, c: float = 80.0, p: float = 4.0) -> tuple[np.ndarray, ...]:
    """Return rates with formula, and rates with what the element gave; up to where 5 % of strain still yield."""
    fine = np.geomspace(1e-3, 200.0, 200)
    rates = np.concatenate([np.geomspace(1e-3, 10.0, 9), np.geomspace(20.0, 160.0, 7)])
    fine, rates = (r[[exact_yield(law, c, p, float(x)) < 0.03 * E for x in r]] for r in (fine, rates))
    formula = np.array([exact_yield(law, c, p, float(r)) for r in fine])
    return fine, formula, rates, np.array([scaled_yield(law, c, p, float(r)) for r in rates])


def erosion() -> Topic:
    """Count the steps to failure; weigh the energy that goes with the element."""
    cases = []
    for limit in (0.0095, 0.0305, 0.0495):
        step = failure_step(limit)
        expected = int(np.ceil((limit + 0.01) / 1e-3 - 1e-6))
        text = f"failure strain {limit:g}, step of failure"
        cases.append(Case(text, step, expected, 0.0, "definition, ε = εp + σy/3G", relative=False))
    history = pulled(CUBE, 0.06, 60)
    work = 0.5 * 10.0**2 / 1000.0 + 10.0 * 0.03
    cases.append(Case("energy of the deleted element", history.eroded[-1], work, 0.01, "σy²/2E + σy εf", "mJ"))
    text = (
        "One element without hardening is strained in steps of 0.1 %. The element must be deleted in the first step "
        "in which its effective plastic strain reaches the failure strain. A deleted element must exert no force. In "
        "the energy balance, the energy of the deleted element must be counted as eroded energy."
    )
    return Topic("Erosion at the failure strain", text, tuple(cases))


def failure_step(limit: float, step: float = 1e-3) -> int:
    """Return the number of the step in which a cube in isochoric tension fails; σ_y/3G = 1 %."""
    state = start(Model(CUBE, Material(1e-9, 1000.0, 0.25, 12.0, failure_strain=limit),
                        viscosity=NO_VISCOSITY))  # type: ignore[arg-type]  # fmt: skip
    for n in range(1, 1000):
        advance(state, CUBE.nodes * np.exp(n * step * np.array([1.0, -0.5, -0.5])))
        if row(state, ALIVE)[0] == 0.0:
            return n
    return -1
