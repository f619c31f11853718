"""LS-DYNA as a solver: a deck in, the force of a contact out."""

from stemcal.solvers.lsdyna.solver import LsDyna

__all__ = ["LsDyna"]
