"""Any program as a solver: templates in, a number out.

`templates` is what a run is given: files with the factors' values written into them. `readers` finds a series of
numbers in what it leaves, `reductions` makes one number of it. `rooms` are the folders that runs work in; `solver`
takes a run from beginning to end and names its failures.
"""

from __future__ import annotations

from stemcal.solvers.command.solver import Command

__all__ = ["Command"]
