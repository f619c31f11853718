"""Explicit finite elements: hexahedra, plasticity with erosion, rigid tools, contact with friction.

Consistent units throughout: mm, tonne, s, hence N, MPa and mJ. Nothing here depends on stems, studies or YAML.
"""
