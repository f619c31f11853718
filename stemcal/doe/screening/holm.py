"""p-values adjusted for testing many effects at once: Holm's correction, and that of Benjamini and Hochberg."""

from collections.abc import Sequence


def adjusted_p(p: Sequence[float | None], method: str) -> list[float | None]:
    """Adjust p-values for testing all of them at once: ``holm`` or ``fdr_bh`` (Benjamini–Hochberg)."""
    known = [value for value in p if value is not None]
    if len(known) < len(p) or not known:
        return [None] * len(p)
    from statsmodels.stats.multitest import multipletests

    return [float(value) for value in multipletests(known, method=method)[1]]
