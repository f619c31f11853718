"""LS-DYNA as a solver: a deck in, the force of a contact out."""

from __future__ import annotations

from stemcal.solvers.lsdyna.solver import LsDyna

__all__ = ["LsDyna"]
