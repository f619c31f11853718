"""The scatter of the mesh carried into prediction, ranges and profiles of an inversion, and the budget."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from stemcal.doe.calibration.joint_fit import fit_jointly
from stemcal.doe.calibration.mesh_scatter import MeshScatter
from stemcal.doe.calibration.misfit import Misfit, VarianceSource, best_fit
from stemcal.doe.calibration.profile import profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import t_quantile
from stemcal.doe.regression.surface import Surface
from stemcal.naming import FIRST
from stemcal.stages.invert.certainty import Measured, certainty_of, measured_of, misfit_over, priors_of
from stemcal.stages.invert.joint import joint_surfaces, measured_means
from stemcal.stages.invert.result import Certainty, InvertResult
from stemcal.stages.mesh.result import BudgetRow
from stemcal.stages.result import Interval
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import Study


@dataclass(frozen=True, eq=False)
class Carried:
    """An inversion's intervals with the scatter of the mesh in them."""

    means: Sequence[Measured]
    misfit: Misfit
    mean_interval: Interval | None
    prediction_interval: Interval | None
    ranges: dict[str, Interval]
    coded_ranges: dict[str, Interval]
    certainty: Certainty
    certainty_alone: Certainty | None

    @classmethod
    def of(
        cls,
        study: Study,
        surface: SurfaceResult,
        solution: InvertResult,
        mesh: MeshScatter,
        further: Mapping[str, MeshScatter],
    ) -> Carried:
        """Return the intervals of an inversion; `mesh` is the scatter of what its surface was fitted to.

        `further` has the scatter of travel and work.
        """
        coding, target = surface.scales, study.calibration_target
        region, point = surface.region(study), coding.point(solution.point.coded)
        response = measured_of(target, [FIRST], study.naming)
        jointly = bool(study.joint_targets)
        means = measured_means(study) if jointly else response
        plain = misfit_over(means, joint_surfaces(study, surface) if jointly else [surface.fitted], region)
        misfit = plain.with_mesh(mesh, fit_jointly(plain, region).misfit if jointly else 0.0, further)
        priors = priors_of(study, coding)
        misfit = misfit.with_priors(priors, region)
        known = certainty_of(study, coding, misfit, region, "joint" if jointly else "single", point)
        alone = None
        if jointly:
            there = response[0] in means
            own = misfit_over(response, [surface.fitted], region)
            own = own.with_mesh(mesh, 0.0).with_priors(priors, region)
            single = misfit.only([means.index(response[0])]) if there else own
            alone = certainty_of(study, coding, single, region, "single", point)
            coded, ranges = known.coded_intervals, known.intervals
        else:
            coded = _ranges(misfit, region, coding.names)
            ends = coding.to_natural(np.array([coded[name] for name in coding.names]).T).T
            ranges = {name: (float(a), float(b)) for name, (a, b) in zip(coding.names, ends, strict=True)}
        return cls(
            means,
            misfit,
            mesh_interval(surface.fitted, point, mesh, 0.0),
            mesh_interval(surface.fitted, point, mesh, 1.0),
            ranges,
            coded,
            known,
            alone,
        )

    def budget(self) -> list[BudgetRow]:
        """Return the sources of error at every diameter, of the force."""
        return [
            BudgetRow(
                mean.condition,
                source.name,
                float(source.variance[i]) ** 0.5,
                100.0 * float(source.variance[i] / sum(other.variance[i] for other in self.misfit.sources)),
                source.df if isfinite(source.df) else None,
                source.loading is not None,
            )
            for i, mean in enumerate(self.means)
            if mean.response == FIRST
            for source in self._sources_at(i)
        ]

    def _sources_at(self, i: int) -> list[VarianceSource]:
        """Return the sources of an observation's error; one of the laboratory is among them even without a part."""
        here = [source for source in self.misfit.sources if source.variance[i] > 0.0]
        laboratory = [source for source in self.misfit.sources if source.name == "laboratory"]
        return here if any(source in here for source in laboratory) else [*laboratory[:1], *here]


def _ranges(misfit: Misfit, region: Region, names: Sequence[str]) -> dict[str, Interval]:
    """Return the range of each factor over all points that give the target on a mesh at some place (95 %)."""
    of_mesh = [source for source in misfit.sources if source.name.startswith("mesh")]
    mesh_only = replace(misfit, priors=()).of_sources(of_mesh)
    profiles = profiles_of(mesh_only, region, best_fit(mesh_only, region))
    return {name: (profile.low, profile.high) for name, profile in zip(names, profiles, strict=True)}


def mesh_interval(surface: Surface, coded: object, mesh: MeshScatter, extra: float) -> Interval | None:
    """Return the 95 % interval of the mean over all places of the mesh, or of one simulation at any of them.

    ŷ·m ± t·√(s²·(extra·own + h) + v·ŷ²·(extra + 1/P)) with the mean factor m of P places and the relative variance v of
    one; `extra` is 1 for one simulation, own the scatter of the surface's runs. None for a saturated surface.
    """
    if surface.mean_square is None:
        return None
    x = np.asarray(coded, dtype=float)
    middle = float(surface.predict(x)[0]) * mesh.mean_factor
    parts = [
        (
            surface.mean_square * (extra * surface.own_scatter + float(surface.unscaled_variance(x)[0])),
            float(surface.df),
        ),
        (mesh.variance * middle**2 * (extra + 1.0 / mesh.placements), mesh.df),
    ]
    whole = sum(variance for variance, _ in parts)
    doubt = sum(variance**2 / df for variance, df in parts)
    half = t_quantile(0.95, whole**2 / doubt) * whole**0.5 if doubt > 0.0 else 0.0
    return middle - half, middle + half
