"""Designed experiments on a scalar response: arrays in, results out, no files and no printing.

    designs      which runs to make: Plackett–Burman, central composite
    aliases      what main effects of a screening design may hide
    coding       natural units ↔ coded units of the design
    screening    two-level effects: sums of squares, F, p, adjusted p; `lenth` for Lenth's method
    surface      full quadratic in coded units, with intervals; `anova`, `influence`, `terms` for its parts
    inversion    where the surface takes a target value, and how well that fixes the factors;
                 `rules` pick the point, `levelset` searches, `region` bounds
    validation   measured against simulated over the diameters
    printed      does a printed number agree with the computed one?
    regression   the least-squares fit under all of them

Every result is a frozen dataclass whose ``as_dict()`` holds plain Python numbers (``None`` where a quantity
has no value, never NaN).
"""
