"""The fit of a surface stage, and what stands beside it: fewer terms, shape, scale, a second opinion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.stages.layout import Design, design_radius
from stemcal.stages.turning import circumstances
from stemcal.study.model import Study

if TYPE_CHECKING:
    from stemcal.doe.surface import Surface

_RIDGE_POINTS = 5
_MOST_RUNS = 150  # beyond this a Gaussian process takes longer than it is worth


def fit_terms(
    study: Study, design: Design, runs: Sequence[Mapping[str, Any]]
) -> tuple[Surface, dict[str, Any], list[str]]:
    """Fit the surface to runs as the spec asks; returns it, what the stage tells beside it, and notes."""
    from stemcal.doe.reduction import reduce_surface
    from stemcal.doe.surface import fit_surface

    rsm, known = study.rsm, circumstances(runs, runs, "force")
    forces = [float("nan") if run["force"] is None else run["force"] for run in runs]
    told, drop = {"inestimable": rsm.inestimable, "weights": rsm.weights}, rsm.inestimable == "drop"
    if rsm.reduce == "none":
        whole = fit_surface(design.coded, forces, design.names, drop=drop, **known)
        return whole, told, []
    reduced = reduce_surface(design.coded, forces, design.names, rsm.reduce, rsm.reduce_alpha, **known, drop=drop)
    return reduced.surface, {**told, "reduction": reduced.as_dict()}, [reduced.describe()]


def beside(study: Study, design: Design, surface: Surface) -> tuple[dict[str, Any], list[str]]:
    """Return the shape of a surface, the scale its response asks for and a second opinion, with notes."""
    import numpy as np

    from stemcal.doe.canonical import analyse_shape, ridge_path
    from stemcal.doe.gaussian_process import second_opinion
    from stemcal.doe.terms import term_columns, term_names
    from stemcal.doe.transform import box_cox

    shape = analyse_shape(surface)
    radii = np.linspace(0.0, design_radius(study, len(design.names)), _RIDGE_POINTS)
    kept = [term in surface.terms for term in term_names(surface.names)]
    scale = box_cox(term_columns(surface.design)[:, kept], surface.response)
    other = second_opinion(surface) if len(surface.design) <= _MOST_RUNS else None
    told = {
        "canonical": shape.as_dict(design.coding),
        "ridge": [point.as_dict(surface.names) for point in ridge_path(surface, radii)],
        "box_cox": None if scale is None else scale.as_dict(),
        "second_opinion": None if other is None else other.as_dict(),
    }
    notes = [shape.describe()]
    notes += [scale.sentence] if scale is not None and scale.advised != 1.0 else []
    notes += [other.sentence] if other is not None and other.warns else []
    return told, notes
