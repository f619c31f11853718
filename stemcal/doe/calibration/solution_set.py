"""All points where the surface takes the target value, and the range of each factor over them."""

from dataclasses import dataclass

from stemcal.doe.calibration.levelset import Objective, coordinate, optimise
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface


@dataclass(frozen=True, eq=False)
class SolutionSet:
    """The points x of a region where the surface takes the target value, with some of them to start from, `seeds`."""

    surface: Surface
    target: float
    region: Region
    seeds: Array

    def best(self, objective: Objective) -> list[Array]:
        """Local optima over the solution set, best first."""
        return optimise(objective, self.seeds, self.region, self.surface, self.target)

    def coded_ranges(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest value of each factor over the set."""
        return tuple(map(self._coded_range, range(self.region.k)))

    def _coded_range(self, j: int) -> tuple[float, float]:
        least, greatest = (self.best(coordinate(j, sign, self.region.k))[0][j] for sign in (1.0, -1.0))
        return float(least), float(greatest)
