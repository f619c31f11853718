"""Compiled kernels: free functions on numbers and arrays, numba only.

`block` holds the machinery (which row of a block's scratch is what, and how numba compiles); the physics of one
element is in `hexahedron`, `plasticity` and `hourglass` as pure functions of scalars and tuples.
"""
