"""Curves of two diameters, one machine: what a joint fit to them tells of it. Planted: F*(1 − (1 − u/u*)^m)."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import workflow
from fakes import TWO_FACTORS, FakeSolver

from stemcal.doe.calibration.likelihood import fit
from stemcal.doe.calibration.observations import Observation
from stemcal.doe.calibration.region import Region
from stemcal.doe.designs.composite import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.executors import InlineExecutor
from stemcal.folder import StudyFolder
from stemcal.measured.curve_modes import Curve
from stemcal.note import Note
from stemcal.solvers.measures import curve_scores
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.invert.analysis import machine_contradicted
from stemcal.study.model import MachineSection, Study
from stemcal.study.reading import load_study


def curve(force: float, travel: float, power: float) -> Curve:
    """Return a curve that breaks at its end."""
    u = np.linspace(0.0, travel, 300)
    return np.append(u, travel + 1e-3), np.append(force * (1.0 - (1.0 - u / travel) ** power), 0.0)


@dataclass(frozen=True)
class Cutting(FakeSolver):
    """F* = 100 + 20a and u* = 1 + 0.2b, times d/8; m = 2."""

    study: Study | None = None

    def solve(self, request: Request) -> Answer:
        assert self.study is not None
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        size = request.condition / 8.0
        travel, force = curve(size * (100.0 + 20.0 * a), size * (1.0 + 0.2 * b), 2.0)
        scores = curve_scores(self.study.targets.modes_at(request.condition), travel, force)
        return Answer("ok", response=float(force.max()), details={"responses": scores})


def found_in(folder: Path, late: float) -> list[Note]:
    """Return what a fit says of a machine of 1500 N/mm, stated ± 150 N/mm, whose curves begin late, stated ± 0.01 mm.

    They settle by so much (mm) while the force rises from the preload of 5 N to twice that.
    """
    random = np.random.default_rng(6)
    for size in (7.0, 8.0):
        for i in range(12):
            force, travel, power = np.exp(random.normal(0.0, 0.02, 3)) * (size / 8.0 * 105.0, size / 8.0 * 1.05, 2.0)
            u, f = curve(force, travel, power)
            way = u + f / 1500.0 + late * np.clip(f / 5.0 - 1.0, 0.0, 1.0)
            rows = "".join(f"{x:.6f},{y:.5f}\n" for x, y in zip(way, f, strict=True))
            text = "Displacement (mm),Load (N)\n" + rows
            (folder / f"{size:g}mm-{i}.csv").write_text(text, encoding="utf-8")
    spec = folder / "curves.yaml"
    spec.write_text(
        f"{TWO_FACTORS}rsm: {{factors: [yield_stress, failure_strain], centre_points: 1}}\n"
        "machine: {stiffness: 1500 N/mm, stiffness_sd: 150 N/mm, toe_sd: 0.01 mm}\ntargets:\n"
        "    - {diameter: 7 mm, curves: 7mm-*.csv}\n    - {diameter: 8 mm, curves: 8mm-*.csv}\n"
        "invert: {diameters: all}\n",
        encoding="utf-8",
    )
    study = load_study(spec)
    solver, out = Cutting(study=study), StudyFolder(folder / "out")
    workflow.run_stage("rsm", study, out, InlineExecutor(), solver=solver)
    notes = workflow.run_stage("invert", study, out, solver=solver).notes
    return [note for note in notes if note.kind.startswith("machine_")]


def test_a_machine_as_it_was_stated_is_not_contradicted(tmp_path: Path) -> None:
    assert found_in(tmp_path, 0.0) == []


def test_curves_that_begin_later_than_was_stated_contradict_it(tmp_path: Path) -> None:
    """They begin 0.04 mm late, which is four times the stated standard deviation of the toe."""
    (toe,) = found_in(tmp_path, 0.04)
    assert toe.kind == "machine_contradicted" and re.search(r"toe .* by [34]\.\d standard deviations", toe.text)


RANDOM, RUNS = np.random.default_rng(27), central_composite(2, centre_points=1)
SLOPES, GIVE, SD = RANDOM.uniform(-8.0, 8.0, (10, 2)), RANDOM.uniform(-3.0, 3.0, 10), RANDOM.uniform(2.0, 4.0, 10)
SURFACES = [fit_surface(RUNS, 100.0 + RUNS @ slope, ("x", "y")) for slope in SLOPES]
REGION = Region(np.full(2, -20.0), np.full(2, 20.0), None)


def of_a_machine(z: float, scatter: float) -> list[Note]:
    """Return what ten responses tell of a machine of 1500 N/mm, as stated, whose compliance is z·sd/k² less."""
    values = 100.0 + scatter * SD * RANDOM.normal(size=10) + z * GIVE
    observed = [
        Observation(surface, y, spread, None, f"r{i}", "", {"stiffness": u})
        for i, (surface, y, spread, u) in enumerate(zip(SURFACES, values, scatter * SD, GIVE, strict=True))
    ]
    return list(machine_contradicted(MachineSection(stiffness=1500.0, stiffness_sd=150.0), fit(observed, REGION)))


@pytest.mark.parametrize(("off", "share"), [(0.0, 0.05), (16.0, 1.0)])
def test_a_machine_that_is_as_stated_is_contradicted_in_one_of_twenty_studies(off: float, share: float) -> None:
    """Curves that tell little of it, z = 0 ± 0.9 after them, move z by 0.46 only; where it is far off, in every one."""
    found = [of_a_machine(off + RANDOM.normal(), 4.0) for _ in range(24)]
    assert np.mean([bool(notes) for notes in found]) == pytest.approx(share, abs=0.08)
