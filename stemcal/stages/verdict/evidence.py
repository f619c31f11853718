"""What a study is judged by: its results, the physics of its runs, its records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from stemcal.folder import StudyFolder
from stemcal.naming import Names
from stemcal.stages.result import Judged, R
from stemcal.stages.results import Results
from stemcal.stages.validate.options import ValidateOptions
from stemcal.stages.verdict.physics import Physics
from stemcal.study.model import Study

BEYOND_DOUBT = 0.001  # p of a contradiction below which no parameters are reported


@dataclass(frozen=True)
class Evidence:
    """What the rules look at."""

    study: Study
    results: Results
    physics: Physics
    folder: StudyFolder

    def of(self, kind: type[R]) -> R | None:
        """Return the result of a stage by its class, if it is done."""
        return self.results.of(kind)

    @property
    def names(self) -> Names:
        """Names and units of the study."""
        return Names(self.study.naming)

    @property
    def equivalent_percent(self) -> float:
        """The percentage within which measured and simulated values count as equal."""
        return float(self.study.of(ValidateOptions).tolerance_percent)

    @property
    def judged(self) -> list[Judged]:
        """Measured against simulated at every condition that was simulated with the parameters found here."""
        return [one for result in self.results.done for one in result.judged(self.study)]

    @cached_property
    def mostly_off(self) -> bool:
        """Whether more than half of what was compared is off by more than the percentage, fitted or not.

        It decides between a reservation and not calibrated, the same however many conditions were fitted.
        """
        sizes = [row.size for row in self.judged if row.error_percent is not None]
        sizes = sizes or [abs(error) for result in self.results.done for error in result.misses]
        return 2 * sum(size > self.equivalent_percent for size in sizes) > len(sizes)

    @property
    def records(self) -> Iterator[Mapping[str, Any]]:
        """The records of the study folder, of all stages."""
        found = map(self.folder.peek, self.folder.keys())
        yield from (record for record in found if record is not None)
