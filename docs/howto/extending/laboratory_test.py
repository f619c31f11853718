# ruff: noqa: D100, D101, I001
# fmt: off
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from stemcal.cutting.build import stem_mesh
from stemcal.laboratory import Kind
from stemcal.study.model.laboratory_kind import LaboratoryKind, PieceSection

class StretchSection(PieceSection):
    kind: Literal["stretch"] = "stretch"

class Stretch(LaboratoryKind):
    name, options = "stretch", StretchSection

    def make(self, section, diameter):
        return Stretched()

@dataclass(frozen=True)
class Stretched(Kind):
    PERIODS: ClassVar[float] = 120.0

    def slowest_period(self, stem, wave_speed):
        return 2.0 * stem.length / wave_speed

    def mesh(self, stem, how):
        return stem_mesh(stem, how)

    def driven(self, mesh, stem):
        ends = np.isclose(np.abs(mesh.nodes[:, 0]), 0.5 * stem.length)
        return np.repeat(ends[:, None], 3, axis=1)

    def motion(self, mesh, stem, loading, laws):
        return loading.speed / stem.length * mesh.nodes * [1.0, 0.0, 0.0]
