"""The table of responses: name, label, symbol, unit, the tests that have this response, and its value for a curve.

To add a response, add an entry to `TABLE` or, in another package, a `Response` with an entry point in the group
``stemcal.responses``. A response that a spec declares for an external program (`responses:`) has no entry, because the
program returns its value. All values of a response, measured and simulated, are in its `unit`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from stemcal.arrays import Array
from stemcal.errors import UsageError
from stemcal.registry import Registry

CUT = "cut"  # the cutting test of the study
FURTHER_CUT = "cutting"  # the kind of other cutting tests, in the section `tests` of a spec
PIECE = "piece"
"""All kinds of tests of a piece of stem; each kind also has its own name, such as ``three-point-bending``."""

_SECANT = (0.2, 0.5)  # fractions of the maximum force between which the slope of a curve is fitted
_FEWEST = 3  # smallest number of points for a slope


@dataclass(frozen=True)
class ForceTravel:
    """The force over the travel in one test of a stem, simulated or measured.

    The curve of a laboratory test ends when the specimen breaks, that of the cutting test at the end of the stroke. It
    is empty if a run record has no curve. `numbers` contains values that the solver reports, such as ``break_travel``
    and responses that do not follow from the curve; it is empty for a measured curve.
    """

    travel: Array  # (n,), mm
    force: Array  # (n,), N
    peak_force: float  # maximum force until the break, N; NaN if not reported
    peak_travel: float  # travel at the maximum force, mm
    diameter: float  # outer diameter of the stem, mm
    kind: str = CUT  # `CUT`, or the kind of the laboratory test
    numbers: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def until_break(cls, travel: Array, force: Array, diameter: float, kind: str) -> Self:
        """Return the curve of a laboratory test (mm, N) that ends at the break."""
        peak = int(np.argmax(force))
        return cls(travel, force, float(force[peak]), float(travel[peak]), diameter, kind)


@dataclass(frozen=True)
class Response:
    """One response of a test of a stem."""

    name: str  # key in `targets`, in tables and in files
    label: str  # heading
    symbol: str  # symbol in equations
    unit: str  # unit of all values
    of: Callable[[ForceTravel], float | None]  # returns the value from a curve, in `unit`; None if it has no value
    meaning: str  # description of the key in the reference of the spec
    tests: frozenset[str] = frozenset({CUT, FURTHER_CUT, PIECE})  # tests, or kinds of tests, that have this response
    why_only: str = ""  # reason why other tests lack the response, for the error message
    noun: str = ""  # word for the response in sentences, by default the label
    of_test: str = ""  # words that follow the name of a laboratory test, by default the noun
    before_maximum: bool = False  # whether its value is valid even if the stroke ended before the maximum force
    varies_with_mesh: bool = False  # whether its value decreases with the element size

    def value(self, test: ForceTravel) -> float | None:
        """Return the value in a test, in `unit`: as the solver reported it, else from the curve, else None."""
        try:
            number = test.numbers[self.name] if self.name in test.numbers else self.of(test)
            return None if number is None or not isfinite(number) else float(number)
        except Exception as error:  # `of` may be code of another package
            reason = f"{type(error).__name__}: {error}"
            raise UsageError(f"the response {self.name} cannot be calculated from a run: {reason}") from error


def secant(travel: Array, force: Array, shares: tuple[float, float] = _SECANT) -> float | None:
    """Return the slope (N/mm) of a straight line fitted by least squares to a part of a curve until the break.

    The part begins and ends where the force first reaches these `shares` of its maximum. None if it has < 3 points.
    """
    low, high = (int(np.argmax(force >= share * force.max())) for share in shares)
    u, f = travel[low : high + 1], force[low : high + 1]
    if len(u) < _FEWEST or np.ptp(u) == 0.0 or np.ptp(f) == 0.0:
        return None
    return float(np.polyfit(u - u[0], f, 1)[0])


def work_until(travel: ArrayLike, force: ArrayLike, end: float) -> float:
    """Return the work (N·mm = mJ) of a force from first contact, travel u = 0, to u = `end` (mm).

    W = ∫₀ᵉⁿᵈ F du by the trapezoidal rule; the force at both ends is interpolated.
    """
    u, f = np.asarray(travel, dtype=float), np.asarray(force, dtype=float)
    inner = u[(u > 0.0) & (u < end)]
    points = np.concatenate([[0.0], inner, [max(end, 0.0)]])
    return float(np.trapezoid(np.interp(points, u, f), points))


def _work(test: ForceTravel) -> float | None:
    if not len(test.travel):
        return None
    if test.kind == CUT:
        return work_until(test.travel, test.force, test.peak_travel)
    return float(np.trapezoid(test.force, test.travel))


# A measured stem is cut through when the force stays below this fraction of its maximum. Its first fracture is the
# first fall of the force by this fraction of the largest force so far.
_FALLEN = 0.1
_BEGUN = 0.2  # a fall at less than this fraction of the maximum force is a settling of the blade, not a fracture


def _measured_energy(test: ForceTravel) -> float | None:
    """Return the work (mJ) until a measured force finally falls below a tenth of its maximum; None if it does not.

    >>> _measured_energy(ForceTravel(np.arange(5.0), np.array([0.0, 10.0, 20.0, 0.0, 0.0]), 20.0, 2.0, 8.0))
    30.0
    """
    high = np.flatnonzero(test.force > _FALLEN * test.force.max(initial=0.0))
    if test.numbers or not len(high) or high[-1] == len(test.force) - 1:
        return None
    return work_until(test.travel, test.force, float(test.travel[high[-1] + 1]))


def _measured_fracture(test: ForceTravel) -> tuple[float | None, float | None]:
    """Return force (N) and travel (mm) of the first peak after which a measured force falls by a tenth; else None.

    >>> _measured_fracture(ForceTravel(np.arange(5.0), np.array([0.0, 10.0, 8.0, 30.0, 0.0]), 30.0, 3.0, 8.0))
    (10.0, 1.0)
    """
    largest = np.maximum.accumulate(test.force)
    fallen = (test.force <= (1.0 - _FALLEN) * largest) & (largest > _BEGUN * largest[-1:])
    if test.numbers or not fallen.any():
        return None, None
    peak = int(np.argmax(test.force[: np.argmax(fallen)]))
    return float(test.force[peak]), float(test.travel[peak])


WHOLE_CUT = ("cutting_energy", "first_fracture_force", "first_fracture_travel")
"""Responses of a test in which the stem is cut through completely."""
_WHOLE_CUT: Any = {"tests": frozenset({CUT}), "why_only": "only a cut all the way through the stem has it"}

# The built-in responses, in the order in which records of laboratory tests contain them.
TABLE: tuple[Response, ...] = (
    Response(
        *("slope", "Slope", "k", "N/mm"),
        of=lambda test: secant(test.travel, test.force),
        meaning="""Mean slope of the force–travel curve from 20 to 50 % of the maximum force, in tests other than
        cutting.""",
        tests=frozenset({PIECE}),
        why_only="the slope of a cutting curve includes the contact compliance, which depends on the mesh",
        before_maximum=True,
    ),
    Response(
        *("force", "Maximum force", "F", "N"),
        of=lambda test: test.peak_force,
        meaning="Mean maximum force.",
        noun="force",
        of_test="maximum force",
    ),
    Response(
        *("travel", "Travel at maximum force", "u", "mm"),
        of=lambda test: test.peak_travel,
        meaning="Mean travel from first contact to the maximum force.",
        noun="travel",
        varies_with_mesh=True,
    ),
    Response(
        *("work", "Work up to maximum force", "W", "mJ"),
        of=_work,
        meaning="""Mean work: in the cutting test, up to the maximum force; in the tests of the `tests` section, until
        the specimen breaks or the stroke ends.""",
        noun="work",
        varies_with_mesh=True,
    ),
    Response(
        *("cutting_energy", "Cutting energy", "Wc", "mJ"),
        of=_measured_energy,
        meaning="""Mean work of the blade until the stem is cut through (`loading.until: severed`); in measured curves,
        until the force stays below 10 % of its maximum.""",
        **_WHOLE_CUT,
    ),
    Response(
        *("first_fracture_force", "Force at first fracture", "Ff", "N"),
        of=lambda test: _measured_fracture(test)[0],
        meaning="""Mean of the largest force up to the first fracture, in whole cuts (`loading.until: severed`); in
        measured curves, up to the first drop by 10 %.""",
        **_WHOLE_CUT,
    ),
    Response(
        *("first_fracture_travel", "Travel at first fracture", "uf", "mm"),
        of=lambda test: _measured_fracture(test)[1],
        meaning="""Mean travel from first contact to the first fracture, in whole cuts (`loading.until: severed`); in
        measured curves, to the peak before the first drop by 10 %.""",
        **_WHOLE_CUT,
        varies_with_mesh=True,
    ),
)

RESPONSES: Registry[Response] = Registry(Response, "stemcal.responses", TABLE)
"""The built-in responses and those of other packages."""


def response_of(name: str, *tests: str) -> Response | None:
    """Return the response with this name if one of these tests (default: any test) has it; otherwise None."""
    response = RESPONSES.named(name)
    return response if response is not None and (not tests or response.tests.intersection(tests)) else None


def known_response(name: str) -> Response:
    """Return the response with this name; raise `KeyError` if there is none."""
    if (response := RESPONSES.named(name)) is None:
        raise KeyError(name)
    return response


def responses_in(*tests: str, measured: Iterable[str] = ()) -> tuple[Response, ...]:
    """Return the built-in responses of these tests (default: all), then those of other packages named in `measured`."""
    built_in = tuple(response for response in RESPONSES.built_in if not tests or response.tests.intersection(tests))
    named = dict.fromkeys(response_of(name, *tests) for name in measured)
    return (*built_in, *(response for response in named if response is not None and response not in built_in))


def packages_of(names: Iterable[str]) -> dict[str, str]:
    """Return package version and code hash of each response that is not built in; the keys are ``package of NAME``."""
    return {f"package of {name}": version for name in names if (version := RESPONSES.version_of(name))}
