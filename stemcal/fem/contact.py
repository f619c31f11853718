"""Rigid tools and the contact law, as a user of the solver writes them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.contact import EdgeArrays, FrictionNumbers, ToolArrays


@dataclass(frozen=True)
class Tool:
    """A rigid tool that moves along z: a convex polygon in (x, z), swollen by a radius, drawn out along y.

    Parameters
    ----------
    corners : tuple of (x, z)
        Counter-clockwise, in the tool's own frame, mm.
    radius : float
        Radius of all its edges: a point is inside if it is nearer than this to the polygon, mm.
    height, speed : float
        z of the frame's origin at the start (mm) and its velocity (mm/s).
    edge : float or None
        x of a cutting edge whose lowest line is z = 0 of the frame; its points then meet the body's faces.
    """

    corners: tuple[tuple[float, float], ...]
    radius: float
    height: float = 0.0
    speed: float = 0.0
    edge: float | None = None

    def __post_init__(self) -> None:
        """Refuse a polygon that is not convex and counter-clockwise."""
        points = np.asarray(self.corners)
        sides = np.roll(points, -1, axis=0) - points
        after = np.roll(sides, -1, axis=0)
        if not np.all(sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0] > 0.0):
            raise ValueError("the corners of a tool must be convex and counter-clockwise")


@dataclass(frozen=True)
class Contact:
    """Penalty contact with Coulomb friction, μ = μ_d + (μ_s − μ_d) exp(−decay·|v|).

    `penalty` is the contact stiffness as a share of m/Δt², with each node's mass m and the stable time step Δt of the
    start; `damping` is its share of critical damping.
    """

    static_friction: float = 0.0
    dynamic_friction: float = 0.0
    decay: float = 0.0
    penalty: float = 0.25
    damping: float = 0.5

    def numbers(self) -> FrictionNumbers:
        """Return the constants as the kernels see them."""
        return FrictionNumbers(self.static_friction, self.dynamic_friction, self.decay, self.penalty, self.damping)


def tool_arrays(tools: tuple[Tool, ...], nodes: int) -> ToolArrays:
    """Return the tools as arrays; shorter polygons repeat their last corner."""
    most = max((len(tool.corners) for tool in tools), default=1)
    corners = np.zeros((len(tools), most, 2))
    for t, tool in enumerate(tools):
        corners[t, : len(tool.corners)] = tool.corners
        corners[t, len(tool.corners) :] = tool.corners[-1]
    return ToolArrays(
        corners=corners,
        radius=np.array([tool.radius for tool in tools], dtype=float),
        height=np.array([tool.height for tool in tools], dtype=float),
        speed=np.array([tool.speed for tool in tools], dtype=float),
        traction=np.zeros((len(tools), nodes, 3)),
        force=np.zeros((len(tools), 3)),
    )


def edge_arrays(tools: tuple[Tool, ...], x: NDArray[np.float64], size: float, per_face: int = 4) -> EdgeArrays:
    """Return sample points along the first tool edge, `per_face` to an element of the given size.

    They lie symmetric about y = 0 and reach one element past the body.
    """
    tool = next((t for t, tool in enumerate(tools) if tool.edge is not None), -1)
    spacing = size / per_face
    first = int(np.floor((x[:, 1].min() - size) / spacing)) if tool >= 0 else 0
    last = int(np.ceil((x[:, 1].max() + size) / spacing)) if tool >= 0 else 1
    y = np.asarray((np.arange(first, last) + 0.5) * spacing, dtype=np.float64)
    edge = tools[tool].edge if tool >= 0 else None
    return EdgeArrays(
        tool=tool,
        x=0.0 if edge is None else float(edge),
        y=y,
        per_face=float(per_face),
        traction=np.zeros((2 * y.size, 3)),
        depth=size,
    )
