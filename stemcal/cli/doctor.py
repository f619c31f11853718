"""`stemcal doctor`: the state of the installation on this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from stemcal.cli.console import note, say, say_json, waiting
from stemcal.cli.session import AsJson

if TYPE_CHECKING:
    from stemcal.registry import Registry

_PACKAGES = ("numpy", "scipy", "numba", "pandas", "statsmodels", "pydantic", "matplotlib", "rich")

Finding = tuple[str, str, bool | None]
"""A part of the installation, its state, and whether it is correct; None if an optional part is missing."""


def doctor(as_json: AsJson = False) -> None:
    """Check the installation and run a self-test.

    Example: [bold]stemcal doctor[/bold]
    """
    import platform
    from importlib.metadata import version

    from stemcal.fem.warm import is_compiled
    from stemcal.report.progress import COMPILING
    from stemcal.study.types.solver_kind import SOLVERS
    from stemcal.version import __version__

    if not as_json and not is_compiled():
        note(COMPILING)
    with waiting("checking the installation", as_json):
        solvers = (part for kind in SOLVERS.all for part in kind.ready())
        python = f"{platform.python_version()} on {platform.platform()}"
        versions = {"stemcal": __version__, "python": python, **{name: version(name) for name in _PACKAGES}}
        present = [(name, number, True) for name, number in versions.items()]
        findings: list[Finding] = [*present, *_plugins(), *_folders(), *solvers, _self_test()]
    sound = all(ok is not False for _, _, ok in findings)
    if as_json:
        say_json({"ok": sound, "found": [{"what": part, "found": state, "ok": ok} for part, state, ok in findings]})
    else:
        from rich.table import Table

        table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
        for part, state, ok in findings:
            table.add_row({True: "ok", False: "WRONG", None: "-"}[ok], part, state)
        say(table)
    if not sound:
        raise typer.Exit(1)


def _plugins() -> list[Finding]:
    from stemcal.doe.designs import SURFACES
    from stemcal.responses import RESPONSES
    from stemcal.stages.stage import STAGES
    from stemcal.study.model.laboratory_kind import TESTS
    from stemcal.study.types.solver_kind import SOLVERS

    findings: list[Finding] = []
    named: dict[str, Registry[Any]] = {"stage": STAGES, "solver": SOLVERS, "design": SURFACES, "laboratory test": TESTS}
    named |= {"response": RESPONSES}
    for noun, registry in named.items():
        findings += [(f"{noun} {item.name}", registry.version_of(item.name), True) for item in registry.external]
        findings += [(f"{noun} {name}", f"skipped: {reason}", None) for name, reason in registry.broken.items()]
    return findings


def _folders() -> list[Finding]:
    import tempfile
    from pathlib import Path

    from stemcal.drawing.style import installed_fonts
    from stemcal.fem.kernels.compile import CACHE

    temporary = CACHE.parent == Path(tempfile.gettempdir())
    hint = f"{CACHE} is temporary: set `STEMCAL_CACHE_DIR` to a folder that only you can write to"
    chinese = [name for name in installed_fonts() if name not in ("DejaVu Sans", "sans-serif")]
    missing = (
        "none was found, so Chinese names appear as boxes in PNG and PDF figures; install a font such as "
        "fonts-noto-cjk (Debian, Ubuntu) or google-noto-sans-cjk-fonts (Fedora)"
    )
    return [
        ("cache", hint if temporary else str(CACHE), None if temporary else True),
        ("Chinese fonts", ", ".join(chinese) or missing, bool(chinese) or None),
    ]


def _self_test() -> Finding:
    """Compare the plastic strain of a stretched bar with the exact εₚ = (ε − σ_y/E)(1 − E_t/E)."""
    import numpy as np

    from stemcal.fem.material import Material
    from stemcal.fem.mesh import brick
    from stemcal.fem.model import Integration, Model
    from stemcal.fem.stepper import simulate

    modulus, yield_stress, tangent, speed, duration = 1000.0, 10.0, 50.0, 50.0, 1.0e-3
    mesh = brick((1.0, 1.0, 1.0), (1, 1, 1))
    held = np.isclose(mesh.nodes, 0.0)  # mirror planes
    held[:, 0] = True  # the velocity of both ends is prescribed
    velocity = np.zeros_like(mesh.nodes)
    velocity[:, 0] = speed * mesh.nodes[:, 0]
    bar = Model(
        mesh=mesh,
        material=Material(1.0e-9, modulus, 0.3, yield_stress, tangent, hardening_parameter=1.0),
        integration=Integration(outputs=10, precision="mixed"),
        held=held,
        velocity=velocity,
    )
    known = (float(np.log1p(speed * duration)) - yield_stress / modulus) * (1.0 - tangent / modulus)
    strain = float(simulate(bar, duration).row("PLASTIC_STRAIN")[0])
    error = abs(strain / known - 1.0)
    text = f"plastic strain {strain:.5f}, exact value {known:.5f}, error {100 * error:.2f} %"
    return "self-test: solver", text, bool(error < 0.01)
