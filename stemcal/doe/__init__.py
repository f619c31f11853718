"""Designed experiments on a scalar response: arrays in, results out, no files and no printing.

    regression    the least-squares fit under all of them, and the full quadratic in coded units: intervals, `anova`,
                  `influence`, `terms`; `reduction` takes terms out, `canonical` finds its shape, `transform` judges
                  the scale of the response; `coding` natural ↔ coded units
    designs       which runs to make, by name (`catalogue`), each built in a module of its own; `d_optimal` adds runs,
                  `aliases` says what main effects may hide, `power` what a design can find before it is run
    screening     two-level effects: sums of squares, F, p, adjusted p; `lenth` for Lenth's method, `error_term` for
                  what effects are tested against; `ascent` walks along their slope
    calibration   where the surface takes a target value, or several fit what was measured, and how well that fixes
                  the factors: `inversion`, `joint_fit`, `profile`; `solution_set` gives the ranges,
                  `solution_rules` pick the point, `levelset` searches, `search_region` bounds; `approach`
                  says where to simulate next
    validation    `comparison`: measured against simulated under every condition

Every result is a frozen dataclass of plain Python numbers and arrays, ``None`` where a quantity has no value.
"""
