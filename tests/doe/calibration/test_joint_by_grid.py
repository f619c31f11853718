"""The joint fit of several responses beside an independent one: weights by hand, every point of a dense grid."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import f as f_distribution

from stemcal.doe.calibration.joint_fit import fit_jointly
from stemcal.doe.calibration.misfit import Observation, misfit_of
from stemcal.doe.calibration.profile import profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.naming import FIRST

REACH, STEP = 1.2, 0.002
KINDS = (FIRST, FIRST, "travel", "work")
SIZE = {FIRST: 1.0, "travel": 0.01, "work": 0.7}


def quadratic(points):
    a, b = points[..., 0], points[..., 1]
    return np.stack([np.ones_like(a), a, b, a * b, a**2, b**2], axis=-1)


def responses(seed):
    """Return measured means, and per surface its response at the design, its coefficients and s²·(1 + p/n)."""
    rng, design = np.random.default_rng(seed), central_composite(2, 1, "rotatable")
    columns = quadratic(design)
    for kind in KINDS:
        truth = SIZE[kind] * np.array([100.0, *rng.normal(0, 12, 2), *rng.normal(0, 2, 3)])
        y = columns @ truth + SIZE[kind] * rng.normal(0.0, 0.5, len(design))
        beta, rss, _, _ = np.linalg.lstsq(columns, y, rcond=None)
        s2 = float(rss[0]) / (len(design) - 6)
        measured = float(quadratic(np.array([0.2, -0.1])) @ truth) * (1.0 + rng.normal(0.0, 0.02))
        yield kind, measured, design, y, beta, s2 * (1.0 + 6.0 / len(design))


def pooled_surfaces(found):
    """The error of the surfaces of a kind: one part of the measured value, the mean of all, since all have 3 df."""
    relative = [part[-1] / part[1] ** 2 for part in found]
    mean = {kind: np.mean([r for r, k in zip(relative, KINDS, strict=True) if k == kind]) for kind in KINDS}
    return np.array([mean[kind] * part[1] ** 2 for kind, part in zip(KINDS, found, strict=True)])


def weights_by_hand(found, sd, n):
    """(cv·mean)²/n of the laboratory, cv of the kind or of all; the least degrees of freedom of sums with the surface.

    An sd whose n is not told is known as it is: so are then all of its kind.
    """
    measured = np.array([part[1] for part in found])
    if all(value is None for value in sd):
        return measured**2, None
    told = [
        (kind, (s / m) ** 2, (count or 1) - 1)
        for kind, m, s, count in zip(KINDS, measured, sd, n, strict=True)
        if s is not None
    ]
    laboratory, df = [], {}
    for (kind, m, *_), s, count in zip(found, sd, n, strict=True):
        own = [one for one in told if one[0] == kind] or told
        counted = all(freedom for *_, freedom in own)
        df[kind] = sum(freedom for *_, freedom in own) if counted else np.inf
        pooled = sum(freedom * square for _, square, freedom in own) / df[kind]
        square = pooled if counted else (s / m) ** 2
        laboratory.append(square * m**2 / (count or 1))
    surface = pooled_surfaces(found)
    share = np.array(laboratory) / (laboratory + surface)
    mean_share = {kind: share[[kind == other for other in KINDS]].mean() for kind in df}
    return laboratory + surface, min(
        1.0 / (part**2 / df[kind] + (1 - part) ** 2 / (3 * KINDS.count(kind))) for kind, part in mean_share.items()
    )


def own_by_hand(found, sd, n):
    """Each observation's variance by its own sd with its degrees of freedom; the surfaces' variances, of 3 df."""
    variance, _ = weights_by_hand(found, sd, n)
    surface = np.array([part[-1] for part in found])
    laboratory, freedom = variance - pooled_surfaces(found), []
    for i, kind in enumerate(KINDS):
        members = [j for j, other in enumerate(KINDS) if other == kind and sd[j] is not None]
        members = members or [j for j in range(len(KINDS)) if sd[j] is not None]
        counted = all((n[j] or 1) > 1 for j in members)
        own = sd[i] is not None and (n[i] or 1) > 1
        laboratory[i] = sd[i] ** 2 / n[i] if own else laboratory[i]
        freedom.append((n[i] - 1 if own else sum(n[j] - 1 for j in members)) if counted else np.inf)
    return variance, laboratory, np.array(freedom), surface


def slopes_by_hand(found, x):
    step = 1e-5 * np.eye(2)
    return np.array([[(quadratic(x + e) - quadratic(x - e)) @ part[4] / 2e-5 for e in step] for part in found])


def allowed_by_hand(found, sd, n, x):
    """F(1, ν) times the variance by each one's own sd over that by the pooled one, ν after Satterthwaite; by factor."""
    variance, laboratory, freedom, surface = own_by_hand(found, sd, n)
    root = np.sqrt(variance)
    allowed = []
    for g in (np.linalg.pinv(slopes_by_hand(found, x) / root[:, None]) / root) ** 2:
        total = float(g @ (laboratory + surface))
        doubt = float(np.sum((g * laboratory) ** 2 / freedom)) + float(np.sum((g * surface) ** 2)) / 3
        allowed.append(total / float(g @ variance) * f_distribution.ppf(0.95, 1, total**2 / doubt))
    return allowed


def chance_by_hand(found, sd, n, x, least):
    """The misfit over its mean tr(QΩ), F of tr(QΩ)²/tr(QΩQΩ) over Satterthwaite's degrees of freedom."""
    variance, laboratory, freedom, surface = own_by_hand(found, sd, n)
    slopes, root = slopes_by_hand(found, x), np.sqrt(variance)
    left = np.eye(len(found)) - (slopes / root[:, None]) @ np.linalg.pinv(slopes / root[:, None])
    form = left / root[:, None] / root @ np.diag(laboratory + surface)
    mean, q = float(np.trace(form)), np.diag(left) / variance
    doubt = float(np.sum((q * laboratory) ** 2 / freedom)) + float(np.sum((q * surface) ** 2)) / 3
    return f_distribution.sf(least / mean, mean**2 / float(np.trace(form @ form)), mean**2 / doubt)


def looser_by_hand(found, sd, n, points):
    """The mean variance at (m, 2) points over that at the runs: of the surfaces s²(1 + h) over s²(1 + p/n)."""
    variance, _ = weights_by_hand(found, sd, n)
    columns, at = quadratic(found[0][2]), quadratic(points)
    h = np.einsum("ij,jk,ik->i", at, np.linalg.inv(columns.T @ columns), at)
    share = np.mean(pooled_surfaces(found) / variance)
    return 1.0 + share * ((1.0 + h) / (1.0 + 6.0 / len(columns)) - 1.0)


@pytest.mark.parametrize("radius", [None, 1.2])
@pytest.mark.parametrize("sd", [(2.0, None, 0.02, None), (2.0, 3.0, 0.02, 1.0), (None,) * 4])
def test_fit_and_intervals_are_those_of_a_dense_grid(sd, radius) -> None:
    n, found = (6, None, 6, 4), list(responses(1))
    observations = [
        Observation(fit_surface(design, y, ["a", "b"]), measured, s, count, kind)
        for (kind, measured, design, y, *_), s, count in zip(found, sd, n, strict=True)
    ]
    misfit, region = misfit_of(observations), Region(np.full(2, -REACH), np.full(2, REACH), radius)
    variance, _ = weights_by_hand(found, sd, n)
    assert misfit.variance == pytest.approx(variance, rel=1e-9)
    fit = fit_jointly(misfit, region)

    axis = np.linspace(-REACH, REACH, round(2 * REACH / STEP) + 1)
    points = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    columns = quadratic(points)
    rise = sum((part[1] - columns @ part[4]) ** 2 / v for part, v in zip(found, variance, strict=True))
    rise = np.where(np.linalg.norm(points, axis=-1) <= (radius or np.inf), rise, np.inf)
    assert fit.misfit == pytest.approx(rise.min(), rel=1e-3, abs=1e-3) and fit.misfit <= rise.min()
    told = any(value is not None for value in sd)
    by_hand = chance_by_hand(found, sd, n, fit.coded, fit.misfit) if told else None
    assert fit.p_value == (pytest.approx(by_hand, rel=1e-4) if told else None)
    flat = fit.misfit * f_distribution.ppf(0.95, 1, 2) / 2
    allowed = allowed_by_hand(found, sd, n, fit.coded) if told else [flat, flat]
    for j, profile in enumerate(profiles_of(misfit, region, fit.coded)):
        least = np.take_along_axis(points, rise.argmin(axis=1 - j, keepdims=True)[..., None], axis=1 - j).reshape(-1, 2)
        looser = looser_by_hand(found, sd, n, least) if told else 1.0
        inside = axis[(rise.min(axis=1 - j) - fit.misfit) / looser <= allowed[j]]
        assert (profile.low, profile.high) == pytest.approx((inside[0], inside[-1]), abs=1.5 * STEP)
        assert profile.bounded == (inside[0] > -REACH, inside[-1] < REACH)
