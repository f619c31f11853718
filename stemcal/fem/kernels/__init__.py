"""Compiled kernels: functions of numbers and arrays, compiled by numba.

`block` defines the layout of the elements' data, `compile` the options of numba's compiler. The physics of one element
is in `hexahedron`, `plasticity`, `fibres` and `hourglass` as pure functions of scalars and tuples.
"""
