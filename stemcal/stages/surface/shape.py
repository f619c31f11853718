"""What stands beside a surface: its shape and the scale its response asks for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.blocks import block_columns
from stemcal.doe.regression.canonical import Canonical, analyse_shape, ridge_path
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.sobol import SobolIndex, sobol_indices
from stemcal.doe.regression.surface import PREDICTS, Surface
from stemcal.doe.regression.terms import term_columns, term_names
from stemcal.doe.regression.transform import BoxCox, box_cox
from stemcal.files.rows import Rows
from stemcal.stages.design import Design, design_radius
from stemcal.study.model import Study

_RIDGE_POINTS = 5


@dataclass(frozen=True)
class Shape:
    """Stationary point (None where there is no single one) and principal axes of a surface.

    `kind` is a plane, maximum, minimum or saddle; with a `ridge` it is nearly level along some axis.
    """

    coded: dict[str, float] | None
    natural: dict[str, float] | None
    predicted: float | None
    coded_radius: float | None
    inside: bool
    kind: str
    ridge: bool
    eigenvalues: tuple[float, ...]
    axes: tuple[dict[str, float], ...]


@dataclass(frozen=True)
class RidgeRow:
    """Where the surface is highest at a distance from the centre; no standard error of a saturated fit."""

    radius: float
    coded: dict[str, float]
    predicted: float
    standard_error: float | None


@dataclass(frozen=True)
class Beside:
    """What stands beside a surface: its shape and the scale its response asks for."""

    canonical: Shape
    ridge: Rows[RidgeRow]
    box_cox: BoxCox | None
    sobol: tuple[SobolIndex, ...]


def shape_of(study: Study, design: Design, surface: Surface, blocks: Sequence[str | None]) -> Beside:
    """Return the shape of a surface and the scale its response asks for.

    `blocks` are those of the runs that succeeded; the scale is judged with the same blocks as the fit has.
    """
    shape = analyse_shape(surface)
    radii = np.linspace(0.0, design_radius(study, len(design.names)), _RIDGE_POINTS)
    kept = [term in surface.terms for term in term_names(surface.names)]
    apart, _ = block_columns(blocks if any(blocks) else None, np.ones(len(surface.design), dtype=bool))
    scale = box_cox(np.column_stack([term_columns(surface.design)[:, kept], apart]), surface.response)
    by_name = design.coding.by_name
    ridge = [RidgeRow(p.radius, by_name(p.coded), p.predicted, p.standard_error) for p in ridge_path(surface, radii)]
    factors = [study.factor(name) for name in design.names]
    ends = (design.coding.to_coded([getattr(f, end) for f in factors]) for end in ("low", "high"))
    predicts = (surface.predicted_r2 or 0.0) >= PREDICTS
    indices = sobol_indices(surface.names, surface.beta.copy(), *ends) if predicts else ()
    return Beside(_shape(design.coding, shape), Rows(ridge), scale, indices)


def _shape(coding: Coding, found: Canonical) -> Shape:
    point = found.point
    return Shape(
        None if point is None else coding.by_name(point),
        None if point is None else coding.by_name(coding.to_natural(point)),
        found.predicted,
        found.radius,
        found.inside,
        found.kind,
        found.ridge,
        tuple(found.eigenvalues.tolist()),
        tuple(coding.by_name(axis) for axis in found.axes.T),
    )
