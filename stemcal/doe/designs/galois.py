"""Finite fields GF(q) of prime-power order, as far as Paley's constructions need them."""

from itertools import product

import numpy as np

from stemcal.doe.regression.least_squares import Array

Element = tuple[int, ...]
_MOST_DEGREE = 3  # a polynomial of degree 2 or 3 without roots is irreducible


def prime_power(q: int) -> tuple[int, int] | None:
    """Write q as p^m with p prime and m ≤ 3; None if it is none.

    >>> prime_power(27), prime_power(28)
    ((3, 3), None)
    """
    for m in range(1, _MOST_DEGREE + 1):
        p = round(q ** (1.0 / m))
        if p**m == q and is_prime(p):
            return p, m
    return None


def is_prime(q: int) -> bool:
    """Tell by trial division."""
    return q > 1 and all(q % divisor for divisor in range(2, int(q**0.5) + 1))


def jacobsthal(q: int) -> Array:
    """Return Q with Q[i, j] = χ(aⱼ − aᵢ): 0 on the diagonal, +1 where the difference is a square, else −1.

    The elements a run through GF(q), for a prime q in the order 0, 1, …, q − 1, so that Q is circulant.
    QQᵀ = qI − J; Q is symmetric for q mod 4 = 1 and skew for q mod 4 = 3 (Paley 1933).
    """
    known = prime_power(q)
    if known is None or q % 2 == 0:
        raise ValueError(f"{q} is no odd prime power")
    p, m = known
    elements: list[Element] = list(product(range(p), repeat=m))
    modulus = _irreducible(p, m)
    squares = {_times(a, a, modulus, p) for a in elements if any(a)}
    zero = (0,) * m

    def character(a: Element) -> float:
        return 0.0 if a == zero else 1.0 if a in squares else -1.0

    return np.array([[character(_minus(b, a, p)) for b in elements] for a in elements])


def _minus(a: Element, b: Element, p: int) -> Element:
    return tuple((x - y) % p for x, y in zip(a, b, strict=True))


def _times(a: Element, b: Element, modulus: Element, p: int) -> Element:
    """Multiply polynomials (lowest power first) modulo the monic `modulus`, given without its leading 1."""
    m = len(modulus)
    full = [0] * (2 * m - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            full[i + j] += x * y
    for top in range(2 * m - 2, m - 1, -1):
        for i, c in enumerate(modulus):
            full[top - m + i] -= full[top] * c
    return tuple(value % p for value in full[:m])


def _irreducible(p: int, m: int) -> Element:
    """Return the first monic polynomial of degree m over Z_p that has no root, without its leading 1."""
    if m == 1:
        return (0,)
    for tail in product(range(p), repeat=m):
        if all((sum(c * x**i for i, c in enumerate(tail)) + x**m) % p for x in range(p)):
            return tail
    raise ValueError(f"no irreducible polynomial of degree {m} over Z_{p}")
