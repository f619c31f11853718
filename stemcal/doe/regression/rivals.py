"""Three surfaces through the same runs under the same cross-validation: quadratic, Gaussian process, neural network.

All runs of a point are left out together: a run that repeats one left out would give its response away. Up to
`_ONE_BY_ONE` points are left out one by one, more in `_FOLDS` parts drawn with a fixed seed. Nothing is tuned to the
runs: the settings of the network are those below whatever the runs are.

Source of the comparison: T. Hastie, R. Tibshirani and J. Friedman, The Elements of Statistical Learning, 2nd ed.,
Springer 2009, section 7.10.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.regression.copies import same_points
from stemcal.doe.regression.gaussian_process import MOST_RUNS, fit_process
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.errors import UsageError
from stemcal.files.rows import Rows

NEURONS, NETWORKS = 6, 5  # tanh units of the hidden layer; networks of different starts, whose mean predicts
_WEIGHT_DECAY, _STEPS = 0.01, 2000
_ONE_BY_ONE, _FOLDS = 40, 10
Predict = Callable[[Array], Array]
Truths = NDArray[np.bool_]


@dataclass(frozen=True)
class Rival:
    """How a kind of surface predicts runs left out, and how close it comes to those it is fitted to (`r2`)."""

    method: str
    predicted_r2: float | None
    rms_error: float
    largest_error: float
    r2: float | None


@dataclass(frozen=True)
class Comparison:
    """Rivals under the same `folds`; `passed_over` runs stay in every fit, for the quadratic needs them."""

    rivals: Rows[Rival]
    folds: int
    runs: int
    passed_over: int


def require_networks() -> None:
    """Raise `UsageError` if scikit-learn is not installed."""
    try:
        import sklearn.neural_network  # noqa: F401
    except ImportError:
        raise UsageError(
            'rsm.compare needs scikit-learn; install it with pip install "stemcal[compare]", or leave the key out'
        ) from None


def compare_surfaces(surface: Surface) -> Comparison | None:
    """Cross-validate three kinds of surface on the runs of one; None where nothing can be left out, or with blocks.

    Beyond `MOST_RUNS` there is no Gaussian process.
    """
    from threadpoolctl import threadpool_limits

    x, y = surface.design, surface.response
    kept = [term in surface.terms for term in term_names(surface.names)]
    methods: dict[str, Callable[[Array, Array], Predict]] = {
        "quadratic": lambda x, y: _quadratic(x, y, kept),
        "gaussian_process": lambda x, y: fit_process(x, y).predict,
        "neural_network": _networks,
    }
    if len(y) > MOST_RUNS:
        del methods["gaussian_process"]
    folds = [fold for fold in _folds(same_points(x)) if _carries(x[~fold], kept)]
    if not folds or np.ptp(y) == 0.0:
        return None
    judged: Truths = np.any(folds, axis=0)
    with threadpool_limits(1):  # several threads take up to fifty times as long on matrices as small as these
        rivals = [_rival(method, fit, x, y, folds, judged) for method, fit in methods.items()]
    return Comparison(Rows(rivals), len(folds), int(judged.sum()), int((~judged).sum()))


def _rival(
    method: str, fit: Callable[[Array, Array], Predict], x: Array, y: Array, folds: Sequence[Truths], judged: Truths
) -> Rival:
    errors = np.zeros(len(y))
    for fold in folds:
        errors[fold] = y[fold] - fit(x[~fold], y[~fold])(x[fold])
    left, rest = errors[judged], y - fit(x, y)(x)
    largest = float(np.abs(left).max())
    return Rival(method, _explained(left, y[judged]), float(np.sqrt(np.mean(left**2))), largest, _explained(rest, y))


def _explained(errors: Array, y: Array) -> float | None:
    """1 − Σe²/Σ(y − ȳ)²."""
    spread = float(np.sum((y - y.mean()) ** 2))
    return 1.0 - float(errors @ errors) / spread if spread > 0.0 else None


def _folds(point: NDArray[np.int64]) -> list[Truths]:
    """Return which of n runs each fold leaves out, (n,) truth values: whole points only."""
    points = np.unique(point)
    parts = np.array_split(np.random.default_rng(0).permutation(points), min(_FOLDS, len(points)))
    groups = [[one] for one in points] if len(points) <= _ONE_BY_ONE else parts
    return [np.isin(point, group) for group in groups]


def _carries(x: Array, kept: Sequence[bool]) -> bool:
    """Whether these runs determine the terms of the quadratic."""
    return bool(np.linalg.matrix_rank(term_columns(x)[:, kept]) == sum(kept)) if len(x) else False


def _quadratic(x: Array, y: Array, kept: Sequence[bool]) -> Predict:
    beta = np.linalg.lstsq(term_columns(x)[:, kept], y, rcond=None)[0]
    return lambda points: np.asarray(term_columns(points)[:, kept] @ beta)


def _networks(x: Array, y: Array) -> Predict:
    """Return the mean of several networks of one hidden layer; they see the response as standard scores."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.neural_network import MLPRegressor

    mean, scale = y.mean(), y.std() or 1.0
    settings = {"hidden_layer_sizes": (NEURONS,), "activation": "tanh", "solver": "lbfgs", "max_iter": _STEPS}
    nets = [MLPRegressor(**settings, alpha=_WEIGHT_DECAY, random_state=seed) for seed in range(NETWORKS)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        for net in nets:
            net.fit(x, (y - mean) / scale)
    return lambda points: np.asarray(mean + scale * np.mean([net.predict(points) for net in nets], axis=0))
