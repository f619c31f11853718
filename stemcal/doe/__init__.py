"""Design of experiments for a scalar response; functions take and return arrays and numbers, without files or output.

    designs       designs by name; `factorial` has two-level designs, `coding` converts natural to coded units and back
    effects       main effects of two-level designs, with tests (F, Lenth's method) and aliases
    regression    `least_squares`; `surface`, the quadratic model in coded units, full or reduced by backward
                  elimination, with `anova`; `canonical` analysis of the stationary point
    calibration   all factor settings with a given response (`solution_ranges`), or the fit to several means
                  (`likelihood`) and its `confidence_intervals`; `region` has the bounds, `search_path` chooses the next
                  simulation
    comparison    measured and simulated responses at all conditions, compared with each other and with a power law

Every result is a frozen dataclass of Python numbers and arrays; a quantity without a value is None.
"""
