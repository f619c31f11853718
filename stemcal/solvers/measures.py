"""What a run tells beside its maximum force: the travel of the blade to the maximum, the work done by then, scatter."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def work_until(travel: ArrayLike, force: ArrayLike, end: float) -> float:
    """Integrate the force over the travel from first touch to `end`; N·mm, which is mJ.

    W = ∫₀ᵉⁿᵈ F du by the trapezoidal rule, the force at both ends interpolated.

    >>> work_until([-1.0, 0.0, 1.0, 2.0], [0.0, 0.0, 10.0, 20.0], 1.5)
    11.25
    """
    u, f = np.asarray(travel, dtype=float), np.asarray(force, dtype=float)
    inner = u[(u > 0.0) & (u < end)]
    points = np.concatenate([[0.0], inner, [max(end, 0.0)]])
    return float(np.trapezoid(np.interp(points, u, f), points))


def measures(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``travel`` (mm), ``work`` (mJ), ``phases`` and what each gave of a run's details, as far as these tell.

    Over several mesh phases they are means; otherwise the recorded curve is read.
    """
    if phases := details.get("phase_peaks"):
        found = {name: list(details[f"phase_{name}s"]) for name in ("travel", "work") if details.get(f"phase_{name}s")}
        means = {name: float(np.mean(values)) for name, values in found.items()}
        each = {f"phase_{name}s": values for name, values in found.items()}
        return {"phases": len(phases), "phase_responses": list(phases), **means, **each}
    if (end := details.get("peak_travel")) is None:
        return {}
    curve = details.get("curve")
    return {"travel": end, **({"work": work_until(curve["travel"], curve["force"], end)} if curve else {})}
