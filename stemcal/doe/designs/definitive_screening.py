"""Definitive screening: three levels in about twice as many runs as factors.

Main effects are clear of each other, of every two-factor interaction and of every square, and no interaction
is aliased fully with another. Sources: B. Jones and C. J. Nachtsheim, J. Quality Technology 43 (2011), 1–15;
by conference matrices, L. Xiao, D. K. J. Lin and F. Bai, J. Quality Technology 44 (2012), 2–8.
"""

import numpy as np

from stemcal.doe.designs.hadamard import conference
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError
from stemcal.notes import Note, Weight


class OneSpareColumn(Note, weight=Weight.USE):
    """One column without a factor is all that main effects are tested against: one degree of freedom.

    Two more centre runs make it three where repeated runs differ (`with_centre` runs in all), two more columns where
    they do not (`with_columns`).
    """

    runs: int
    factors: int
    with_centre: int
    with_columns: int


def definitive_screening(k: int, runs: int | None = None) -> Array:
    """Stack C, −C and the centre, C a conference matrix of order m ≥ k; columns beyond k carry no factor.

    Parameters
    ----------
    runs : int, optional
        By default those of the smallest order. More make columns without a factor, which give the error of the
        main effects, and runs beyond two for each column repeat the centre.

    Returns
    -------
    array (runs, k)
        Levels −1, 0, +1.
    """
    if not 1 <= k <= 100:
        raise UsageError(f"definitive screening: {k} factors; 1 to 100 are possible")
    order = max(4, k + k % 2)
    while (matrix := conference(order)) is None:
        order += 2
    least = 2 * order + 1
    if runs is None:
        runs = least
    if runs < least:
        raise UsageError(f"screen.runs: definitive-screening has {least} runs or more for {k} factors, not {runs}")
    larger = (conference(m) for m in range((runs - 1) // 4 * 2, order, -2))
    matrix = next((found for found in larger if found is not None), matrix)
    return np.vstack([matrix, -matrix, np.zeros((runs - 2 * len(matrix), len(matrix)))])[:, :k] + 0.0


def spare_column_note(design: Array) -> list[Note]:
    """Warn of a definitive screening with one column without a factor and no repeated centre run.

    Of studies in which nothing matters, such a design of five factors in 13 runs ends with a square or an interaction
    in three of ten.
    """
    n, k = design.shape
    centre = ~np.any(design, axis=1)
    three_levels = bool(np.any(design[~centre] == 0.0))
    if not three_levels or centre.sum() != 1 or k % 2 == 0 or n != 2 * k + 3:
        return []
    return [OneSpareColumn(n, k, n + 2, n + 4)]
