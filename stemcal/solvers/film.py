"""Frames of the deforming stem during a shear test, packed so that they fit into the record of a run."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stemcal.arrays import Array, Mask
from stemcal.cutting.end_state import Shape, packed_text, unpacked_text
from stemcal.cutting.result import CuttingResult
from stemcal.fem.kernels.block import PLASTIC_STRAIN
from stemcal.fem.state import State

FRAMES = 24
LARGEST = 10_000  # largest number of nodes; of a finer mesh, only the final state is stored
_STEPS = 2000  # number of steps from 0 to the largest value; smaller differences are invisible in a picture


@dataclass(frozen=True)
class Frame:
    """Stem and tools at one time, with the blade travel in mm and the force on the blade in N."""

    travel: float
    force: float
    shape: Shape


@dataclass(frozen=True)
class _Moment:
    """State of the stem at an output: time (s), nodes (N, 3) in mm, mask of the remaining elements, plastic strains."""

    time: float
    nodes: Array
    standing: Mask
    plastic_strain: Array


class Film:
    """Records states of the stem, evenly spaced in time; if more than `FRAMES` come, every second one is dropped."""

    def __init__(self) -> None:
        self.every, self.seen = 1, 0
        self.moments: list[_Moment] = []

    def __call__(self, time: float, state: State) -> None:
        if self.seen % self.every == 0:
            standing = state.topology.standing.astype(bool)
            strain = state.lanes.gathered(state.body.state[:, PLASTIC_STRAIN])
            self.moments.append(_Moment(time, state.body.x.copy(), standing, strain))
            if len(self.moments) > FRAMES + 1:
                self.every *= 2
                self.moments = self.moments[::2]
        self.seen += 1

    def packed(self, result: CuttingResult) -> dict[str, Any]:
        """Return the frames as JSON values, with displacements from the initial shape; {} if the mesh is too fine."""
        shape, history = result.shape, result.history
        if shape is None or not self.moments or len(shape.nodes) > LARGEST:
            return {}
        moments, end = self.moments, float(history.time[-1])
        if moments[-1].time < end:  # the test ended between two frames, because the stem broke
            moments = [*moments, _Moment(end, shape.nodes, shape.standing, shape.plastic_strain)]
        times = [moment.time for moment in moments]
        moved = []
        for moment in moments:
            attached = np.zeros(len(shape.nodes), bool)
            attached[shape.hexes[moment.standing].ravel()] = True  # loose nodes fly far away and are not drawn
            moved.append(np.where(attached[:, None], moment.nodes - shape.reference, 0.0))
        return {
            "travel": _interpolated(times, history.time, history.travel),
            "force": _interpolated(times, history.time, history.force_filtered),
            "stroke": round(float(history.travel[-1]), 4),
            "standing": packed_text(np.packbits(np.array([moment.standing for moment in moments]), axis=1), "|u1"),
            "displacement": _quantised(np.array(moved)),
            "plastic_strain": _quantised(np.array([moment.plastic_strain for moment in moments])),
        }


def frames_of(shape: Shape, packed: Mapping[str, Any]) -> list[Frame]:
    """Return the frames in the output of `Film.packed`; `shape` is the final shape of the test."""
    count, elements = len(packed["travel"]), len(shape.hexes)
    bits = unpacked_text(packed["standing"], "|u1").reshape(count, -1)
    standing = np.unpackbits(bits, axis=1)[:, :elements].astype(bool)
    moved = _restored(packed["displacement"], count).reshape(count, -1, 3)
    strains = _restored(packed["plastic_strain"], count)
    return [
        Frame(
            packed["travel"][k],
            packed["force"][k],
            replace(
                shape,
                nodes=shape.reference + moved[k],
                standing=standing[k],
                plastic_strain=strains[k],
                # the blade, which is the first tool, was higher at this time; the supports are fixed
                tools=(shape.tools[0] + [0.0, packed["stroke"] - packed["travel"][k]], *shape.tools[1:]),
            ),
        )
        for k in range(count)
    ]


def _interpolated(times: list[float], known: Array, values: Array) -> list[float]:
    return [round(float(value), 4) for value in np.interp(times, known, values)]


def _quantised(values: Array) -> dict[str, Any]:
    """Return values (frame, …) as `step` and `counts`: changes from frame to frame, in whole numbers of steps."""
    step = float(np.abs(values).max(initial=0.0)) / _STEPS or 1.0
    counts = np.round(values / step)
    return {"step": step, "counts": packed_text(np.diff(counts, axis=0, prepend=np.zeros_like(counts[:1])), "<i2")}


def _restored(packed: Mapping[str, Any], frames: int) -> Array:
    counts = unpacked_text(packed["counts"], "<i2").reshape(frames, -1)
    return np.asarray(np.cumsum(counts, axis=0, dtype=float) * float(packed["step"]))
