"""Designed experiments on a scalar response: arrays in, results out, no files and no printing.

    designs       the runs of a design, by its name; `factorial` has those of two levels, `coding` converts natural ↔
                  coded units
    effects       of factors at two levels, with their tests, and the interactions that they are aliased with; `lenth`
                  for Lenth's method
    regression    `least_squares`, the fit under all of them; `surface`, the full quadratic in coded units, with `anova`
                  and the influence of each run; `backward_elimination` removes terms, `canonical` finds the stationary
                  point
    calibration   all solutions for one target value and the ranges of the factors over them (`level_set`), or
                  the fit to several measured values (`likelihood`) with its `confidence_intervals`; `region` has the
                  bounds, `search_path` chooses the next simulation
    comparison    measured against simulated under every condition, and against a formula

Every result is a frozen dataclass of plain Python numbers and arrays, ``None`` where a quantity has no value.
"""
