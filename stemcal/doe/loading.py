"""What statistics need that takes a while to load."""


def load() -> None:
    """Load the parts of SciPy and statsmodels that a study computes with."""
    import scipy.optimize
    import scipy.spatial
    import scipy.special
    import scipy.stats.qmc  # noqa: F401
    import statsmodels.regression.linear_model
    import statsmodels.stats.multitest  # noqa: F401
