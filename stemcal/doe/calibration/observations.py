"""What was measured, each mean with its surface, and draws of the errors of all means together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.calibration.scatter import FINEST, Contrasts, Uniforms, chi_squared, variances
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.errors import UsageError
from stemcal.naming import FIRST

Scatter = Literal["measured", "pooled", "misfit", "surface"]
_WIDEST = 1.0  # relative scatter above which a laboratory measures nothing


@dataclass(frozen=True, eq=False)
class Observation:
    """A measured mean with the surface that predicts it; `kind` is what was measured.

    Without `n` the standard deviation `sd` counts as known. Observations of the same `specimens`, by their name, have
    one covariance matrix, in which they are uncorrelated. `systematic` has, by its name, by how much one standard
    deviation of what moves all specimens alike moves the mean, of other conditions too.
    """

    surface: Surface
    measured: float
    sd: float | None = None
    n: int | None = None
    kind: str = FIRST
    specimens: str = ""
    systematic: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Errors:
    """Draws of the errors: `laboratory` (draws, m, m), and those of the surfaces of each kind with their contrasts."""

    laboratory: Array
    surfaces: tuple[tuple[NDArray[np.intp], Contrasts, Array, Array, Array], ...]
    scatter: Scatter

    @property
    def surface_error_known(self) -> bool:
        """Whether the surfaces of every kind have residual degrees of freedom, or were shown exact by none."""
        return all(told.df > 0 for _, told, *_ in self.surfaces)

    def at(self, x: Array) -> Array:
        """Return draws of V at a point, (draws, m, m)."""
        found = self.laboratory.copy()
        for mine, told, common, separate, chance in self.surfaces:
            k, n = told.leverages(x)
            part = common[:, None, None] * k
            diagonal = np.arange(len(mine))
            part[:, diagonal, diagonal] += separate[:, None] * np.diag(k) + chance * n
            found[:, mine[:, None], mine] += part * np.outer(told.scale, told.scale)
        return found


def errors_of(observations: Sequence[Observation], spare: int) -> Errors:
    """Draw the errors of observations; with `spare` more of them than factors they determine an unknown scatter."""
    uniform, m = Uniforms(), len(observations)
    measured = np.array([o.measured for o in observations])
    n = np.array([o.n or 1 for o in observations])
    cv2 = np.array([np.nan if o.sd is None else (o.sd / o.measured) ** 2 for o in observations])
    df = np.where(n > 1, n - 1.0, np.inf)
    known = np.isfinite(cv2)
    scatter: Scatter = "measured" if known.all() else "pooled" if known.any() else "misfit" if spare > 0 else "surface"
    kinds = np.array([o.kind for o in observations])
    if scatter == "misfit":
        even = np.exp(np.log(FINEST) + (np.log(_WIDEST) - np.log(FINEST)) * uniform())
        relative = np.repeat(even[:, None] ** 2, m, axis=1)
    elif scatter == "surface":
        relative = np.full((uniform.draws, m), FINEST**2)
    else:
        whole = all(known[kinds == kind].any() for kind in set(kinds.tolist()))
        relative = np.empty((uniform.draws, m))
        for group in dict.fromkeys(kinds.tolist()) if whole else [""]:
            mine = kinds == group if whole else np.full(m, True)
            relative[:, mine] = variances(cv2[mine], df[mine], uniform) / n[mine]
    laboratory = np.zeros((uniform.draws, m, m))
    laboratory[:, np.arange(m), np.arange(m)] = relative * measured**2
    groups = list(dict.fromkeys(o.specimens for o in observations if o.specimens))
    for group in groups:
        mine = np.flatnonzero([o.specimens == group for o in observations])
        factors = len(observations[0].surface.names) / len(groups)
        laboratory[:, mine[:, None], mine] = _of_specimens([observations[i] for i in mine.tolist()], factors, uniform)
    for u in loadings(observations).values():
        laboratory += np.outer(u, u)
    surfaces = []
    for kind in dict.fromkeys(kinds.tolist()):
        mine = np.flatnonzero(kinds == kind)
        told = Contrasts.of([observations[i].surface for i in mine.tolist()])
        chance = told.by_chance(uniform)
        surfaces.append((mine, told, *told.missed(chance, uniform), chance))
    return Errors(laboratory, tuple(surfaces), scatter)


def loadings(observations: Sequence[Observation]) -> dict[str, Array]:
    """Return by how much one standard deviation of each shared error moves every observation, (m,)."""
    names = dict.fromkeys(name for o in observations for name in o.systematic)
    return {name: np.array([o.systematic.get(name, 0.0) for o in observations]) for name in names}


def _of_specimens(observations: Sequence[Observation], factors: float, uniform: Uniforms) -> Array:
    """Return draws of the covariance matrix of the means of p responses of the same n specimens, (draws, p, p).

    Σ⁻¹ has a Wishart distribution about S⁻¹ of n − 2 − p + 2k degrees of freedom, k ≤ p the factors that the means
    determine: then their intervals are those of C. R. Rao, Proc. Fifth Berkeley Symp. 1 (1967) 355, with Student's t of
    n − 1 − p + k. By M. S. Bartlett (Proc. R. Soc. Edinb. 53 (1933) 260) it is S^(−1/2) A Aᵀ S^(−1/2), A triangular.
    """
    from scipy.special import ndtri

    p, n = len(observations), min(o.n or 1 for o in observations)
    if n <= p:
        raise UsageError(
            f"joint fit: {n} specimens cannot determine the covariance of {p} responses; measure at least {p + 1}"
        )
    df = max(n - 2.0 - p + 2.0 * min(factors, p), float(p))
    a = np.zeros((uniform.draws, p, p))
    for i in range(p):
        a[:, i, i] = np.sqrt(chi_squared(uniform(), df - i))
        for j in range(i):
            a[:, i, j] = ndtri(uniform())
    root = np.array([max(o.sd or 0.0, FINEST * o.measured) for o in observations]) * ((n - 1.0) / n) ** 0.5
    found = np.linalg.inv(a @ a.transpose(0, 2, 1)) * np.outer(root, root)
    return np.asarray(found)
