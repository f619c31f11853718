"""OpenRadioss as a solver: a deck in, starter and engine, the force of a contact out."""

from stemcal.solvers.openradioss.solver import OpenRadioss

__all__ = ["OpenRadioss"]
