"""What a simulation leaves behind: forces and energies over time, and the body as it ended."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class History:
    """Rows over time; energies in mJ (N·mm), forces in N.

    Attributes
    ----------
    time : array (R,)
        End of each output interval, s; the first row is the start.
    force : array (R, T, 3)
        Mean force of the body on each tool over the interval that ends there: impulse over its length.
    height : array (R, T)
        z of each tool, mm.
    kinetic, internal, hourglass, eroded, external : array (R,)
        Energies. `internal` and `hourglass` are of standing elements, `eroded` what eroded elements and nodes took
        with them, `external` the work of tools and loads.
    held : array (R, 3, T)
        What of that work contact holds or has turned into heat: the surface of each tool by penalty springs and
        damping, its edge, and the friction of both. No share of it can be negative but by numerical error.
    deleted : array (R,)
        Eroded elements.
    steps : int
        Time steps taken.
    x : array (N, 3)
        Where the nodes ended.
    state : array (E, rows)
        State of the elements, as in `kernels.block`.
    standing : array (E,)
        Which elements are left.
    added_mass : float
        What scaling and the wanted time step have added to the body's mass, over its true mass.
    """

    time: Array
    force: Array
    height: Array
    kinetic: Array
    internal: Array
    hourglass: Array
    eroded: Array
    external: Array
    held: Array
    deleted: NDArray[np.int64]
    steps: int
    x: Array
    state: Array
    standing: NDArray[np.bool_]
    added_mass: float

    @property
    def contact(self) -> Array:
        """All that contact holds (R,), mJ."""
        return np.asarray(self.held.sum(axis=(1, 2)))

    @property
    def balance(self) -> Array:
        """Kinetic + internal + hourglass + eroded + contact − external − what there was at the start, mJ."""
        held = self.kinetic + self.internal + self.hourglass + self.eroded + self.contact
        return np.asarray(held - held[0] - self.external)

    def drift_percent(self, until: int | None = None) -> float:
        """Return the largest |balance| before row `until` as a percentage of the largest energy that went through."""
        scale = max(np.abs(self.external[:until]).max(), self.kinetic[:until].max(), 1e-30)
        return float(100.0 * np.abs(self.balance[:until]).max() / scale)

    def row(self, name: str) -> Array:
        """Return one row of the elements' state as (E,), in the order of the mesh."""
        from stemcal.fem.kernels import block

        return np.asarray(self.state[:, getattr(block, name)].copy())
