"""Designed experiments on a scalar response: arrays in, results out, no files and no printing.

    designs      which runs to make, by name; built in `plackett_burman`, `factorial`, `definitive`, `composite`,
                 `box_behnken`, `space_filling` (`hadamard` and `galois` beneath); `augment` adds runs
    power        what a design can find before it is run
    aliases      what main effects of a screening design may hide
    coding       natural units ↔ coded units of the design
    screening    two-level effects: sums of squares, F, p, adjusted p; `lenth` for Lenth's method,
                 `error_term` for what effects are tested against
    surface      full quadratic in coded units, with intervals; `anova`, `influence`, `terms` for its parts;
                 `reduction` takes terms out, `canonical` finds its shape, `transform` judges the scale of the
                 response, `gaussian_process` gives a second opinion
    inversion    where the surface takes a target value, and how well that fixes the factors;
                 `rules` pick the point, `levelset` searches, `region` bounds
    validation   measured against simulated over the diameters
    printed      does a printed number agree with the computed one?
    regression   the least-squares fit under all of them

Every result is a frozen dataclass whose ``as_dict()`` holds plain Python numbers (``None`` where a quantity
has no value, never NaN).
"""
