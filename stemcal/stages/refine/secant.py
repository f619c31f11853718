"""Steps of the refinement without a response surface: Gauss–Newton steps with slopes between simulated points.

The start is mid-range, or the mean of a prior. One factor after the other is then changed by itself, as long as the
fitted means can determine a further factor. A factor is determined if it changes the means by more than the tolerance,
and not in the same proportions as the factors before it; all other factors stay at the start. The coded factors z run
from −1 to 1 over ln x, or over x if the range includes zero. From the best point, with responses y, the step s
minimizes the misfit of

    ln ŷ = ln y + J s

within a box about that point. After each step Broyden's formula updates the slopes J so that they reproduce the change
Δ ln y: J ← J + (Δ ln y − J s) sᵀ/(sᵀs) (Math. Comp. 19 (1965) 577).
"""

from collections.abc import Sequence

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.observations import FINEST, Uniforms, variances
from stemcal.stages.fitting import Measured
from stemcal.stages.loop import NO_PREDICTION, How, PointToTry, Predicted, Stopped
from stemcal.stages.refine.steps import _SETTLED, FIRST_RADIUS, MeanSteps, Trial
from stemcal.stages.rsm.options import RsmOptions
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST

_PROBE = 0.5  # coded: smallest change of a factor that is moved by itself
_END = 0.999  # coded: a factor beyond it is at the end of its range
_LONG_ENOUGH = 0.2  # coded: shorter steps show the roughness of the response rather than its slope
_SEEN = 2.0  # a factor is determined if it changes the means by this multiple of the tolerance
_WORTH = 0.05  # smallest relative reduction of the misfit that is worth the runs of a step
_USUAL_VARIATION = 0.03  # assumed coefficient of variation if no scatter was measured


class SecantSteps(MeanSteps):
    """Steps towards the fitted means, with slopes estimated from the simulated points."""

    def __init__(self, study: Study, tolerance_percent: float) -> None:
        super().__init__(study)
        chosen = study.of(RsmOptions).factors
        self.factors = [study.factor(name) for name in (study.names if isinstance(chosen, str) else chosen)]
        self.by_ratio = np.array([factor.low > 0.0 for factor in self.factors])
        low, high = (self._scaled([getattr(factor, end) for factor in self.factors]) for end in ("low", "high"))
        self.centre, self.half_range = 0.5 * (low + high), 0.5 * (high - low)
        self.logarithmic = bool(np.all(self.measured > 0.0))
        self.precision = np.diag(_weights(self.means))
        self.least_change = _SEEN * tolerance_percent / 100.0
        self.slopes = np.zeros((len(self.means), len(self.factors)))
        self.untried, self.determined = list(range(len(self.factors))), list[int]()
        self.probe: int | None = None
        self.reach = FIRST_RADIUS

    @property
    def undetermined(self) -> tuple[str, ...]:
        return tuple(factor.name for j, factor in enumerate(self.factors) if j not in self.determined)

    def first(self) -> PointToTry:
        """Return the middle of all ranges; for a factor with a prior, its mean."""
        middle = self._scaled([factor.prior.mean if factor.prior else factor.centre for factor in self.factors])
        return self._point((middle - self.centre) / self.half_range, "middle")

    def learn(self, trial: Trial) -> bool:
        """Update the slopes from a trial; return False if a factor that it changed alone has no separate effect."""
        probe, base = self.probe, self.best if self.trials else trial
        self.probe, s = None, trial.coded - base.coded
        change = self._level(trial.responses) - self._level(base.responses) - self.slopes @ s
        if probe is not None:
            if not self._is_seen(change):
                return False  # the point cannot be the result
            self.slopes[:, probe] = change / s[probe]
            self.determined.append(probe)
        elif np.linalg.norm(s) >= _LONG_ENOUGH:
            self.slopes += np.outer(change, s) / (s @ s)
        self.trials.append(trial)
        self.reach = self.shrunk(self.reach) if probe is None else self.reach
        return True

    def next(self) -> PointToTry | None:
        """Return a change of one more factor if the means can determine it, else a step; after a failed run go back."""
        if self.failed:
            aside = np.full(len(self.factors), 0.5 * (-1.0) ** len(self.visited))
            return self._point(0.5 * (self.visited[-1] + (self.best.coded if self.trials else aside)), "back")
        if self.untried and len(self._free()) < len(self.means):
            self.probe = self.untried.pop(0)
            return self._point(self._probed(self.probe), "probe")
        return self._step()

    def end(self) -> Stopped:
        """Return `out_of_reach` if all determined factors are at ends of their ranges."""
        return "out_of_reach" if self.determined and not self._free() else "settled"

    def _probed(self, j: int) -> Array:
        """Return the best point with factor j moved so far that a proportional response would reach the target."""
        point, factor, sign = self.best.coded.copy(), self.factors[j], 1.0
        gap = float(np.mean(self._level(self.measured) - self._level(self.best.responses)))
        if self.by_ratio[j] or factor.expected_sign:
            sign = -1.0 if (gap < 0.0) != (factor.expected_sign == "-") else 1.0
        size = abs(gap) / self.half_range[j] if self.by_ratio[j] and self.logarithmic else 0.0
        moved = min(max(point[j] + sign * min(max(size, _PROBE), 1.0), -1.0), 1.0)
        has_room = abs(moved - point[j]) >= 0.5 * _PROBE  # otherwise the factor moves in the other direction
        point[j] = moved if has_room else point[j] - sign * _PROBE
        return point

    def _is_seen(self, change: Array) -> bool:
        """Check that the part of a `change` of the means that other factors cannot cause exceeds `least_change`."""
        known = self.slopes[:, self._free()]
        own = change - known @ np.linalg.lstsq(known, change, rcond=None)[0] if known.size else change
        size = 1.0 if self.logarithmic else float(np.mean(np.abs(self.measured))) or 1.0
        return bool(np.sqrt(np.mean(own**2)) > self.least_change * size)

    def _free(self) -> list[int]:
        """Return the indices of the determined factors that are not at an end of their range."""
        return [j for j in self.determined if abs(self.best.coded[j]) < _END]

    def _step(self) -> PointToTry | None:
        from scipy.optimize import least_squares

        if not (moving := self.determined):
            return None
        start, near = self.best.coded, np.zeros(len(self.factors))

        def gaps(step: Array) -> Array:
            near[moving] = step
            return np.asarray(np.sqrt(np.diag(self.precision)) * (self.measured - self._expected(start + near)))

        bounds = np.maximum(-1.0 - start, -self.reach)[moving], np.minimum(1.0 - start, self.reach)[moving]
        nothing = np.zeros(len(moving))
        solution = least_squares(gaps, nothing, bounds=bounds, method="dogbox")  # this method may start at a bound
        if 2.0 * solution.cost > (1.0 - _WORTH) * float(gaps(nothing) @ gaps(nothing)):
            return None
        near[moving] = solution.x
        while min(float(np.linalg.norm(start + near - place)) for place in self.visited) < _SETTLED:
            near *= 0.5
            if np.linalg.norm(near) < _SETTLED:
                return None
        return self._point(np.clip(start + near, -1.0, 1.0), "secant")

    def _expected(self, z: Array) -> Array:
        level = self._level(self.best.responses) + self.slopes @ (z - self.best.coded)
        return np.asarray(np.exp(level) if self.logarithmic else level, dtype=float)

    def _level(self, responses: Array) -> Array:
        """Return ln y if all means are positive, else y; a response that is not positive counts as very small."""
        return np.asarray(np.log(np.maximum(responses, 1e-9 * self.measured)) if self.logarithmic else responses)

    def _scaled(self, values: Sequence[float]) -> Array:
        return np.asarray(np.where(self.by_ratio, np.log(np.where(self.by_ratio, values, 1.0)), values))

    def _point(self, z: Array, how: How) -> PointToTry:
        values = zip(self.means, self._expected(z).tolist(), strict=True) if how == "secant" else ()
        predicted: dict[float, Predicted] = dict.fromkeys(self.conditions, NO_PREDICTION)
        predicted |= {mean.condition: (value, None) for mean, value in values if mean.response == FIRST}
        scaled = self.centre + self.half_range * z
        natural = zip(self.factors, np.where(self.by_ratio, np.exp(scaled), scaled).tolist(), strict=True)
        levels = {factor.name: float(f"{level:.12g}") for factor, level in natural}
        return PointToTry({**self.study.midlevels(), **levels}, how, z, predicted)


def _weights(means: Sequence[Measured]) -> Array:
    """Return the weight n/(s·value)² of each mean; its coefficient of variation s is shrunk towards the common one."""
    n, value = np.array([mean.n or 1 for mean in means]), np.array([mean.value for mean in means])
    squared = (np.array([np.nan if mean.sd is None else mean.sd for mean in means]) / value) ** 2
    df = np.where(n > 1, n - 1.0, np.inf)
    known = variances(squared, df, Uniforms()) if np.any(squared > 0.0) else np.full((1, len(n)), _USUAL_VARIATION**2)
    return np.asarray(np.mean(1.0 / np.maximum(known, FINEST**2), axis=0) * n / value**2)
