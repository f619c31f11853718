"""Hadamard matrices (HHᵀ = nI, entries ±1) and conference matrices (CCᵀ = (m − 1)I, zero diagonal).

Sources: R. E. A. C. Paley, On Orthogonal Matrices, J. Math. and Phys. 12 (1933), 311–320; J. J. Sylvester,
Phil. Mag. 34 (1867); J. M. Goethals and J. J. Seidel, J. Austral. Math. Soc. 11 (1970), 343–344.
"""

import numpy as np

from stemcal.doe.designs.galois import jacobsthal, prime_power
from stemcal.doe.regression.least_squares import Array

# First rows of the four circulants of a Goethals–Seidel array whose columns never alias fully: no product of
# two columns equals a third. Doubling the matrix of order 20 would.
_GOETHALS_SEIDEL = {40: ("+++++--+--", "++++--+---", "++++-++++-", "++-+-+-+--")}


def hadamard(n: int) -> Array | None:
    """Return a Hadamard matrix of order n with a first column of ones, or None if no construction here fits.

    Preferred are those that alias least: Paley's first (n − 1 a prime power), his second (n/2 − 1 one), the
    stored arrays, and doubling last.
    """
    if n in (1, 2):
        return np.array([[1.0, 1.0], [1.0, -1.0]])[:n, :n]
    if n % 4:
        return None
    if (n - 1) % 4 == 3 and prime_power(n - 1):
        return _standard(_paley_first(n - 1))
    if n in _GOETHALS_SEIDEL:
        return _standard(_goethals_seidel(_GOETHALS_SEIDEL[n]))
    if (n // 2 - 1) % 4 == 1 and prime_power(n // 2 - 1):
        return _standard(_paley_second(n // 2 - 1))
    half = hadamard(n // 2)
    return None if half is None else np.kron(half, np.array([[1.0, 1.0], [1.0, -1.0]]))


def _standard(h: Array) -> Array:
    """Make the first column all ones."""
    return np.asarray(h * h[:, :1])


def _bordered(q: int) -> Array:
    """Return the Jacobsthal matrix with a border of ones: skew for q mod 4 = 3, symmetric for 1."""
    c = np.zeros((q + 1, q + 1))
    c[0, 1:] = 1.0
    c[1:, 0] = 1.0 if q % 4 == 1 else -1.0
    c[1:, 1:] = jacobsthal(q)
    return c


def _paley_first(q: int) -> Array:
    """H = I + C with C the skew conference matrix of order q + 1."""
    return np.asarray(np.eye(q + 1) + _bordered(q))


def _paley_second(q: int) -> Array:
    """H = C ⊗ [[1, 1], [1, −1]] + I ⊗ [[1, −1], [−1, −1]] of order 2(q + 1), C symmetric."""
    c = _bordered(q)
    off = np.kron(c, np.array([[1.0, 1.0], [1.0, -1.0]]))
    return np.asarray(off + np.kron(np.eye(q + 1), np.array([[1.0, -1.0], [-1.0, -1.0]])))


def _goethals_seidel(rows: tuple[str, ...]) -> Array:
    """Put four circulants A, B, C, D and the reversal R in the array of Goethals and Seidel."""
    a, b, c, d = (_circulant(row) for row in rows)
    r = np.fliplr(np.eye(len(a)))
    return np.block(
        [
            [a, b @ r, c @ r, d @ r],
            [-b @ r, a, d.T @ r, -c.T @ r],
            [-c @ r, -d.T @ r, a, b.T @ r],
            [-d @ r, c.T @ r, -b.T @ r, a],
        ]
    )


def _circulant(row: str) -> Array:
    first = np.array([1.0 if sign == "+" else -1.0 for sign in row])
    return np.array([np.roll(first, shift) for shift in range(len(first))])


def conference(m: int) -> Array | None:
    """Return a conference matrix of even order m, or None if no construction here fits (as for 22 and 34)."""
    if m == 2:
        return np.array([[0.0, 1.0], [1.0, 0.0]])
    if m % 2 or m < 2:
        return None
    if prime_power(m - 1):
        return _bordered(m - 1)
    half = conference(m // 2)
    if half is None or not np.array_equal(half, -half.T):
        return None
    eye = np.eye(m // 2)
    return np.block([[half, half + eye], [half - eye, -half]])  # skew again: order 16 from 8
