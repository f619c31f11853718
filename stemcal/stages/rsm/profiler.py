"""Data for the profiler of the report, whose script evaluates the response surfaces.

It evaluates ŷ = φᵀβ with the intervals ŷ ± t·√(φᵀCφ) of the mean and ŷ ± t·√(own + φᵀCφ) of one further run, where φ
are the terms of the full quadratic at the coded levels, C = s²(XᵀX)⁻¹, and own is the variance of a single run.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from stemcal.doe.comparison import NORMAL
from stemcal.doe.regression.least_squares import t_quantile
from stemcal.doe.regression.section import AnySurface, Section
from stemcal.formats import unit_written
from stemcal.stages.fitting import FactorCoding, Measured, fitted_surfaces, measured_means
from stemcal.stages.rsm.result import RsmResult
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST, Wording, capital

MOST = 24
"""Largest number of surfaces in the report; `rsm.json` contains all."""


def profiler_data(
    study: Study, rsm: RsmResult, values: Mapping[str, float], holds: bool, present: Mapping[str, float] | None = None
) -> dict[str, Any]:
    """Return the data of the profiler, in types of JSON; it starts at the levels `values`, by default at the centre.

    Intervals are included if the study is calibrated (`holds`). `present` has the levels of the present cutter.
    """
    goal = study.goal is not None
    before = {entry.factor: entry.center for entry in rsm.factors} if present is None else present
    pairs = zip(measured_means(study), fitted_surfaces(study, rsm), strict=True)
    surfaces = [(mean, fit) for mean, fit in pairs if not mean.named.apart]
    if goal:  # the prediction at the present cutter replaces the measured mean
        x = rsm.scales.to_coded([before[name] for name in rsm.names])
        surfaces = [(replace(mean, value=float(fit.predict(x)[0])), fit) for mean, fit in surfaces]
    calibrated = [(mean.response, mean.condition) for mean, _ in surfaces[:MOST]]
    first = (FIRST, study.calibration_target.condition)
    return {
        "factors": [_factor(rsm, entry, values) for entry in rsm.factors],
        "radius": rsm.radius,
        "called": ("Optimal" if goal else "Calibrated") if values else "Centre",
        "holds": holds and not goal,
        "kept": [["Present", [before[name] for name in rsm.names]]] if goal else [],
        "against": ["Present", "less", "more"] if goal else ["Measured", "too low", "too high"],
        "surfaces": [_surface(study, mean, fit) for mean, fit in surfaces[:MOST]],
        "first": calibrated.index(first) if first in calibrated else 0,
        "more": len(surfaces[MOST:]),
    }


def _factor(rsm: RsmResult, entry: FactorCoding, values: Mapping[str, float]) -> dict[str, Any]:
    ends = (rsm.coding[entry.factor].natural(coded) for coded in rsm.drawn_between(entry.factor))
    unit = unit_written(entry.unit)
    return {
        "name": entry.factor,
        "label": entry.label or entry.factor,
        "unit": f" {unit}" if unit else "",
        "center": entry.center,
        "half": entry.half_step,
        "low": entry.low,
        "high": entry.high,
        "ends": list(ends),
        "at": values.get(entry.factor, entry.center),
    }


def _surface(study: Study, mean: Measured, surface: AnySurface) -> dict[str, Any]:
    """Return the data of a surface and its runs; `error` is the 95 % half-width of the measured mean."""
    fit = surface.whole if isinstance(surface, Section) else surface
    known, s2 = fit.mean_square is not None and fit.df > 0, fit.mean_square or 0.0
    half_width = 0.0  # t·s/√n; with the normal quantile if n is not given
    if mean.sd is not None:
        n = mean.n or 1
        half_width = float((t_quantile(0.95, n - 1) if n > 1 else NORMAL) * mean.sd / n**0.5)
    command = f"stemcal simulate SPEC --diameter {mean.condition:g}"
    simulated = study.naming.is_cutting and study.kind.simulates_stems
    return {
        "label": f"{capital(mean.named.long)}{Wording(study.naming).at(mean.condition)}",
        "unit": mean.named.unit_suffix,
        "beta": fit.beta.tolist(),
        "covariance": (s2 * fit.unscaled_covariance).tolist() if known else None,
        "own": s2 * fit.own_scatter if known else None,
        "t": t_quantile(0.95, fit.df) if known else None,
        **_where(surface),
        "measured": mean.value,
        "sd": mean.sd or 0.0,
        "error": half_width,
        "simulate": command if simulated and mean.response == FIRST else "",
    }


def _where(surface: AnySurface) -> dict[str, Any]:
    """Return the runs of a surface; for a section, its place on the surface over factors and conditions."""
    if not isinstance(surface, Section):
        return {"runs": [[*x, y] for x, y in zip(surface.design.tolist(), surface.response.tolist(), strict=True)]}
    factors, start, rate, exponents = surface.place.coordinates
    seen = {"factors": factors, "start": start.tolist(), "rate": rate.tolist(), "exponents": exponents}
    seen |= {"condition": surface.place.condition, "logarithm": surface.logarithm}
    return {"runs": [], "place": seen}
