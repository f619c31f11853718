"""Designed experiments on a scalar response: arrays in, results out, no files and no printing.

    regression    the least-squares fit under all of them, and the full quadratic in coded units: intervals, `anova`,
                  `influence`, `terms`; `reduction` removes terms, `canonical` finds the stationary point;
                  `coding` natural ↔ coded units
    designs       which runs to make, by name (`catalogue`), each built in its own module; `extra_runs` adds runs,
                  `aliases` finds the interactions that main effects are aliased with
    screening     two-level effects: sums of squares, F and p; `lenth` for Lenth's method; `ascent` walks along their
                  slope
    calibration   where the surface takes a target value, or several fit what was measured, and how well that fixes
                  the factors: `inversion`, `joint_fit`, `profile`; `solution_set` gives the ranges,
                  `solution_rules` pick the point, `levelset` searches, `search_region` bounds; `approach`
                  chooses the next simulation
    validation    `comparison`: measured against simulated under every condition

Every result is a frozen dataclass of plain Python numbers and arrays, ``None`` where a quantity has no value.
"""
