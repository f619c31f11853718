"""A study and a solver whose answers are known; the solver is picklable, so that workers can use it."""

import base64
import json
import os
import signal
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stemcal.errors import SimulationFailed
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

SPEC = """\
name: known
factors:
  - {name: density, unit: kg/m3, low: 1000, high: 1200}
  - {name: elastic_modulus, unit: MPa, low: 800, high: 1200}
  - {name: poisson_ratio, low: 0.2, high: 0.4}
  - {name: yield_stress, unit: MPa, low: 10, high: 20, expected_sign: "+"}
  - {name: tangent_modulus, unit: MPa, low: 0.4, high: 0.6}
  - {name: hardening_parameter, low: 0, high: 0.1}
  - {name: strain_rate_c, unit: 1/s, low: 80, high: 100}
  - {name: strain_rate_p, low: 4, high: 12}
  - {name: failure_strain, low: 0.01, high: 0.05, expected_sign: "+"}
targets:
  - {diameter: 7 mm, force: 84.21875 N}
  - {diameter: 8 mm, force: 110 N}
  - {diameter: 10 mm, force: 171.875 N}
"""


TESTS = Path(__file__).parent
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS.parent), str(TESTS)])}
"""For processes that tests start: they find stemcal and this module, installed or not."""
PYTHON = json.dumps([sys.executable, "-S"])[1:-1]
"""The first words of a command in a spec; without the packages of the site Python starts in a quarter of the time."""


# Two unknown factors, the rest of the material given: for specs that go on after it.
TWO_FACTORS = """\
name: two-factors
factors:
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
  - {name: failure_strain, low: 0.01, high: 0.05}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8}
"""


def make_study(folder: Path, extra: str = "") -> Study:
    """Write the spec of a study with nine factors and read it."""
    path = folder / "known.yaml"
    path.write_text(SPEC + extra, encoding="utf-8")
    return load_study(path)


def force(levels: dict[str, float], diameter: float) -> float:
    """F = (100 + 20·a + 8·b + 3·b² + a small a·b, and hints of others)·(d/8)², a and b coded by the range.

    a = (σy − 15)/5, b = (εf − 0.03)/0.02; at b = 0 and the others at mid-level F = (100 + 20·a)·(d/8)².
    """
    a = (levels["yield_stress"] - 15.0) / 5.0
    b = (levels["failure_strain"] - 0.03) / 0.02
    c = (levels["strain_rate_c"] - 90.0) / 10.0
    e = (levels["elastic_modulus"] - 1000.0) / 200.0
    return (100.0 + 20.0 * a + 8.0 * b + 3.0 * b * b + 0.5 * a * b + 0.1 * c - 0.2 * e) * (diameter / 8.0) ** 2


@dataclass(frozen=True)
class FakeSolver(Solver):
    """Answers `force`; writes a line per run to `witness`, takes `seconds`, misbehaves where told to.

    `trouble` maps a row of the screening to what happens there; `accident`, a file, lets it happen only once.
    """

    witness: Path | None = None
    seconds: float = 0.0
    trouble: dict[int, str] = field(default_factory=dict)
    accident: Path | None = None
    version: int = 1

    def identity(self, request: Request) -> dict[str, Any]:
        """Levels, diameter, version."""
        return {"kind": "fake", "version": self.version, "levels": dict(request.levels), "diameter": request.condition}

    def cost_estimate(self, request: Request) -> float:
        """Grow with the stem's cross-section."""
        return 10.0 * (request.condition / 8.0) ** 2

    def solve(self, request: Request) -> Answer:
        """Answer, or misbehave."""
        if self.witness is not None:
            with self.witness.open("ab") as file:
                file.write(f"{request.stage} {request.row}\n".encode())
        time.sleep(self.seconds)
        trouble = self.trouble.get(request.row) if request.stage == "screen" else None
        if trouble is not None and self._due(request.row):
            return _misbehave(trouble, request)
        return Answer("ok", response=force(dict(request.levels), request.condition), details={"steps": 7})

    def _due(self, row: int) -> bool:
        if self.accident is None:
            return True
        mark = self.accident.with_suffix(f".{row}")
        if mark.exists():
            return False
        mark.touch()
        return True


def _misbehave(trouble: str, request: Request) -> Answer:
    match trouble:
        case "rising":
            return Answer("ok", response=force(dict(request.levels), 8.0), details={"stroke_was_enough": False})
        case "hang":
            time.sleep(60.0)
        case "nan":
            return Answer("ok", response=float("nan"))
        case "failed":
            return Answer("failed", reason="inverted", message="element 17 turned inside out at 3 ms")
        case "simulation":
            raise SimulationFailed("energy_drift", "energy drift 40 %")
        case "raise":
            raise ValueError("no such thing")
        case "exit":
            os._exit(3)
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "segfault":
            import ctypes

            ctypes.string_at(0)
    raise AssertionError(trouble)


def lines(witness: Path) -> list[str]:
    """Return what a witness saw."""
    return witness.read_text(encoding="utf-8").splitlines() if witness.exists() else []


class SpecSolver(FakeSolver):
    """In the place of the embedded solver: nothing but the spec determines what it answers."""

    of_spec_alone = True


POINT = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAXhzq5QAAAABJRU5ErkJggg==")


def leave_blank(patch: Any) -> None:
    """Leave every figure empty, by pytest's patch: an SVG of nothing, a PNG of one white point."""
    from stemcal.drawing.plot import Plot

    patch.setattr(Plot, "document", '<svg viewBox="0 0 1 1"></svg>')
    patch.setattr(Plot, "readings", [])
    patch.setattr(Plot, "pixels", POINT)
