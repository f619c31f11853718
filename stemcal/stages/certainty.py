"""How well the measured forces fix the parameters: profiles, intervals, posterior, sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stemcal.study.model import Study, Target

if TYPE_CHECKING:
    from stemcal.doe.coding import Coding
    from stemcal.doe.misfit import Misfit
    from stemcal.doe.posterior import Posterior
    from stemcal.doe.profile import Profile
    from stemcal.doe.region import Region
    from stemcal.doe.regression import Array
    from stemcal.doe.surface import Surface

SAMPLES_KEPT = 500


@dataclass(frozen=True)
class Measured:
    """A measured mean at one diameter: of the ``force``, or of ``travel`` or ``work`` to the maximum force."""

    diameter: float
    response: str
    value: float
    sd: float | None = None
    n: int | None = None

    @property
    def label(self) -> str:
        """Name it as sentences do."""
        return f"{self.diameter:g} mm" if self.response == "force" else f"{self.response} at {self.diameter:g} mm"


def measured_of(target: Target, responses: Sequence[str]) -> list[Measured]:
    """Return what was measured of these responses at one diameter."""
    sd = {"force": target.sd, "travel": target.travel_sd, "work": target.work_sd}
    given = {name: getattr(target, name) for name in responses}
    return [Measured(target.diameter, name, value, sd[name], target.n) for name, value in given.items() if value]


def misfit_over(measured: Sequence[Measured], surfaces: Sequence[Surface]) -> Misfit:
    """Return the misfit of measured means, each with its surface."""
    from stemcal.doe.misfit import Observation, misfit_of

    return misfit_of(
        [
            Observation(mean.label, surface, mean.value, mean.sd, mean.n, mean.response)
            for mean, surface in zip(measured, surfaces, strict=True)
        ]
    )


def certainty(study: Study, coding: Coding, misfit: Misfit, region: Region, source: str) -> dict[str, Any]:
    """Return what the data of `misfit` leave possible; `source` names them in sentences.

    Returns
    -------
    dict
        ``intervals`` (95 %, profile likelihood) and ``profiles`` by factor in natural units, ``free`` the factors
        that the data say nothing about, ``directions`` along which nothing changes, ``posterior`` if the spec asks.
    """
    from stemcal.doe.misfit import best_fit
    from stemcal.doe.profile import identifiability, profiles_of, unseen_directions

    best = best_fit(misfit, region)
    profiles = profiles_of(misfit, region, best)
    unseen = unseen_directions(misfit, best)
    natural = [_natural(coding, j, (p.low, p.high)) for j, p in enumerate(profiles)]
    shown = [_shown(study, p.factor, ends) for p, ends in zip(profiles, natural, strict=True)]
    names = coding.names
    return {
        "source": source,
        "scatter": misfit.scatter,
        "level": 0.95,
        "intervals": dict(zip(names, natural, strict=True)),
        "coded_intervals": {p.factor: [p.low, p.high] for p in profiles},
        "bounded": {p.factor: list(p.bounded) for p in profiles},
        "share": {p.factor: p.share for p in profiles},
        "free": [p.factor for p in profiles if p.free],
        "profiles": {p.factor: _curve(coding, j, p) for j, p in enumerate(profiles)},
        "directions": [dict(zip(names, map(float, row), strict=True)) for row in unseen],
        "direction_sentences": [_unseen(study, coding, row) for row in unseen],
        "posterior": _posterior(coding, misfit, region) if study.invert.posterior else None,
        "sentences": [identifiability(source, profiles, shown)],
    }


def _natural(coding: Coding, j: int, coded: Sequence[float]) -> list[float]:
    return [coding.centre[j] + coding.half_step[j] * float(value) for value in coded]


def _shown(study: Study, name: str, ends: Sequence[float]) -> str:
    unit = study.factor(name).unit
    return f"{ends[0]:.4g} to {ends[1]:.4g}" + ("" if unit == "1" else f" {unit}")


def _unseen(study: Study, coding: Coding, direction: Array) -> str:
    """Say what moves together along a direction that no measurement sees, in natural units.

    The largest part moves by one half step; parts below a twentieth of it are left out.
    """
    from stemcal.doe.profile import moved_together

    steps = [value * half for value, half in zip(moved_together(direction), coding.half_step, strict=True)]
    units = [study.factor(name).unit for name in coding.names]
    moves = [
        f"{name} {step:+.3g}{'' if unit == '1' else f' {unit}'}".replace("-", "−")
        for name, step, unit in zip(coding.names, steps, units, strict=True)
        if step != 0.0
    ]
    return f"Not seen: {' with '.join(moves)} changes no measured response here (to first order)."


def _curve(coding: Coding, j: int, profile: Profile) -> dict[str, Any]:
    values = _natural(coding, j, profile.values.tolist())
    return {"values": values, "rise": profile.rise.tolist(), "allowed": profile.allowed}


def _posterior(coding: Coding, misfit: Misfit, region: Region) -> dict[str, Any]:
    from stemcal.doe.posterior import sample_posterior

    found = sample_posterior(misfit, region)
    ends = found.interval()
    return {
        "mean": {name: _natural(coding, j, [found.mean[j]])[0] for j, name in enumerate(found.names)},
        "sd": {name: float(coding.half_step[j] * found.sd[j]) for j, name in enumerate(found.names)},
        "intervals": {name: _natural(coding, j, ends[j].tolist()) for j, name in enumerate(found.names)},
        "correlation": found.correlation.tolist(),
        "acceptance": found.acceptance,
        "effective_samples": found.effective,
        "samples": _samples(coding, found),
        "notes": found.notes,
    }


def _samples(coding: Coding, found: Posterior) -> dict[str, list[float]]:
    """Return a few samples by factor, natural units, for a corner plot."""
    kept = coding.to_natural(found.thinned(SAMPLES_KEPT))
    return {name: [float(f"{value:.6g}") for value in kept[:, j]] for j, name in enumerate(found.names)}
