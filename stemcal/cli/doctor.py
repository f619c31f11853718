"""`stemcal doctor`: is this machine ready?"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import typer

from stemcal.cli.console import note, say, say_json, waiting
from stemcal.cli.session import AsJson

if TYPE_CHECKING:
    from stemcal.registry import Registry


EXTRAS = {"dask": "distributed", "docs": "sphinx"}
PACKAGES = ("numpy", "scipy", "numba", "pandas", "statsmodels", "pydantic", "matplotlib", "jinja2", "typer", "rich")


@dataclass(frozen=True)
class Finding:
    """One thing looked at; `ok` None is for what may well be missing."""

    what: str
    found: str
    ok: bool | None = True


def doctor(as_json: AsJson = False) -> None:
    """Check the installation and run a self-test.

    Example: [bold]stemcal doctor[/bold]
    """
    from stemcal.fem.warm import is_compiled
    from stemcal.report.progress import COMPILING

    if not as_json and not is_compiled():
        note(COMPILING)
    with waiting("looking", as_json):
        findings = [found for look in CHECKS for found in look()]
    if as_json:
        rows = [asdict(found) for found in findings]
        say_json({"ok": all(f.ok is not False for f in findings), "found": rows})
    else:
        from rich.table import Table

        marks = {True: "ok", False: "WRONG", None: "-"}
        table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
        for found in findings:
            table.add_row(marks[found.ok], found.what, found.found)
        say(table)
    if any(found.ok is False for found in findings):
        raise typer.Exit(1)


def _versions() -> Iterator[Finding]:
    import platform
    import sys
    from importlib.metadata import PackageNotFoundError, version

    from stemcal.version import __version__

    yield Finding("stemcal", __version__)
    yield Finding("python", f"{platform.python_version()} on {platform.platform()}", sys.version_info >= (3, 11))
    for name in PACKAGES:
        try:
            yield Finding(name, version(name))
        except PackageNotFoundError:
            yield Finding(name, "missing; run `pip install --force-reinstall .` in the clone", False)


def _extras() -> Iterator[Finding]:
    from importlib.util import find_spec

    for extra, module in EXTRAS.items():
        there = find_spec(module) is not None
        hint = "installed" if there else f'not installed (optional); run `pip install ".[{extra}]"` in the clone'
        yield Finding(f"extra {extra}", hint, True if there else None)


def _plugins() -> Iterator[Finding]:
    from stemcal.doe.designs.catalogue import SURFACES
    from stemcal.stages.stage import STAGES
    from stemcal.study.model import SOLVERS, TESTS

    registries: dict[str, Registry[Any]] = {
        "stage": STAGES,
        "solver": SOLVERS,
        "design": SURFACES,
        "laboratory test": TESTS,
    }
    for noun, found in registries.items():
        for one in found.external:
            yield Finding(f"{noun} {one.name}", found.version_of(one.name))
        for name, reason in found.broken.items():
            yield Finding(f"{noun} {name}", f"skipped: {reason}", None)


def _machine() -> Iterator[Finding]:
    import os
    import shutil
    from pathlib import Path

    yield Finding("cores", f"{os.cpu_count() or 1}")
    free = shutil.disk_usage(Path.cwd()).free / 2**30
    yield Finding("disk", f"{free:.1f} GiB free here", free > 0.2)


def _cache() -> Iterator[Finding]:
    import tempfile
    from pathlib import Path

    from stemcal.fem.kernels.compile import CACHE

    temporary = CACHE.parent == Path(tempfile.gettempdir())
    hint = f"{CACHE} is temporary: set STEMCAL_CACHE_DIR to a folder that only you can write"
    yield Finding("cache", hint if temporary else str(CACHE), None if temporary else True)


def _fonts() -> Iterator[Finding]:
    from stemcal.report.figures.style import installed_fonts

    chinese = [name for name in installed_fonts() if name not in ("DejaVu Sans", "sans-serif")]
    found = ", ".join(chinese) or (
        "none found: Chinese names appear as boxes in PNG and PDF figures; install a font such as fonts-noto-cjk "
        "(Debian, Ubuntu) or google-noto-sans-cjk-fonts (Fedora)"
    )
    yield Finding("Chinese fonts", found, True if chinese else None)


def _solvers() -> Iterator[Finding]:
    """Look at what the kinds of solvers need."""
    from stemcal.study.model import SOLVERS

    for kind in SOLVERS.all:
        yield from (Finding(*part) for part in kind.ready())


def _solver() -> Iterator[Finding]:
    """Stretch a plastic bar: beyond yield εₚ = (ε − σ_y/E)(1 − E_t/E)."""
    import time

    from stemcal.fem.warm import warm

    warm()
    began = time.perf_counter()
    strain, known = stretched_bar()
    error = abs(strain / known - 1.0)
    took = time.perf_counter() - began
    text = f"plastic strain {strain:.5f}, exact {known:.5f}, error {100 * error:.2f} %, {took:.1f} s"
    yield Finding("self-test: solver", text, bool(error < 0.01))


def stretched_bar() -> tuple[float, float]:
    """Return the plastic strain of a bar stretched by the solver, and the exact one."""
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
    strain = float(np.log1p(speed * duration))
    known = (strain - yield_stress / modulus) * (1.0 - tangent / modulus)
    return float(simulate(bar, duration).row("PLASTIC_STRAIN")[0]), known


CHECKS: tuple[Callable[[], Iterator[Finding]], ...] = (
    _versions, _extras, _plugins, _machine, _cache, _fonts, _solvers, _solver
)  # fmt: skip
