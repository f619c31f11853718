"""Frames of a simulation for ParaView: every so many outputs one .vtu file, and a .pvd file that lists them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.block import PLASTIC_STRAIN, STRESS
from stemcal.fem.state import State
from stemcal.fem.vtu import write_pvd, write_vtu

Array = NDArray[np.float64]


class FrameWriter:
    """Called at the outputs of a simulation, writes every `every`-th of them to `folder`, eroded elements left out.

    Points carry their displacement (mm) and velocity (mm/s), cells stress (xx, yy, zz, xy, yz, zx in MPa), von Mises
    stress, plastic strain and the number of their element.
    """

    def __init__(self, folder: Path, every: int = 1) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.every = every
        self._seen = 0
        self._start: Array | None = None
        self._frames: list[tuple[float, str]] = []

    def __call__(self, time: float, state: State) -> None:
        """Write a frame if it is the turn of one."""
        if self._start is None:
            self._start = state.body.x.copy()
        if self._seen % self.every == 0:
            name = f"frame-{len(self._frames):04d}.vtu"
            self._write(self.folder / name, state, self._start)
            self._frames.append((time, name))
            write_pvd(self.folder / "frames.pvd", self._frames)
        self._seen += 1

    def _write(self, path: Path, state: State, start: Array) -> None:
        standing = np.flatnonzero(state.topology.standing)
        rows = state.lanes.gathered(state.body.state)[standing]
        stress = rows[:, STRESS : STRESS + 6]
        write_vtu(
            path,
            state.body.x,
            state.topology.hexes[standing],
            {"displacement": state.body.x - start, "velocity": state.body.v},
            {
                "stress": stress,
                "von_mises": von_mises(stress),
                "plastic_strain": rows[:, PLASTIC_STRAIN],
                "element": standing,
            },
        )


def von_mises(stress: Array) -> Array:
    """Return √(3/2 s:s) of symmetric tensors (…, 6) in the order xx, yy, zz, xy, yz, zx."""
    mean = stress[..., :3].mean(axis=-1, keepdims=True)
    normal = np.sum((stress[..., :3] - mean) ** 2, axis=-1)
    return np.asarray(np.sqrt(1.5 * (normal + 2.0 * np.sum(stress[..., 3:] ** 2, axis=-1))))
