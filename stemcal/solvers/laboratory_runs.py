"""Virtual laboratory tests, listed under `tests` in a spec, of the stem and the material of the shear test."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from stemcal import cutting
from stemcal.cutting.parts import Discretisation, Loading, ShearTest
from stemcal.cutting.result import CuttingResult
from stemcal.errors import SimulationFailed
from stemcal.fem.stepper import Inspect
from stemcal.laboratory import perform as laboratory
from stemcal.laboratory.build import LaboratoryTest
from stemcal.laboratory.perform import LaboratoryResult
from stemcal.notes import Note
from stemcal.responses import known_response, packages_of
from stemcal.study.model.laboratory_kind import TESTS, LaboratorySection, PieceSection
from stemcal.study.model.study import Study

# Number of points in the history of a test; smoothing window of force and strain rate, as a share of the duration.
_OUTPUTS, _SMOOTHED = 400, 0.01

# Largest error of the energy balance in a valid run, % of the largest work; in laboratory tests only until the break.
_WORST_DRIFT = 5.0
# Smallest contact energy in a valid run, % of the work of the tool. A negative value means that contact created energy.
_LEAST_CONTACT = -1.0
_HOURGLASS = 0.03

AnyTest = LaboratoryTest | ShearTest


def measured_at(study: Study, diameter: float) -> tuple[LaboratorySection, ...]:
    """Return the laboratory tests of a run: all measured tests if its diameter is fitted, else those measured at it."""
    fitted = [study.targets.calibrate_at, *(target.condition for target in study.joint_targets)]
    everywhere = any(abs(diameter - at) < 1e-6 for at in fitted)
    return tuple(test for test in study.tests if (test.targets if everywhere else test.means_at(diameter)))


def laboratory_test(section: PieceSection, sheared: ShearTest) -> LaboratoryTest:
    """Return the laboratory test that a section of the spec describes, on a piece of the stem of a shear test."""
    diameter, how = sheared.stem.outer_diameter, sheared.discretisation
    duration = section.stroke_at(diameter) / section.speed
    kind_of_test = TESTS.named(section.kind)  # loads plug-ins, since a worker process has not read the spec
    assert kind_of_test is not None, section.kind
    kind = kind_of_test.make(section, diameter)
    return LaboratoryTest(
        kind=kind,
        material=replace(sheared.material, rate_filter=_SMOOTHED * duration),
        outer=tuple(replace(law, rate_filter=_SMOOTHED * duration) for law in sheared.outer),
        stem=replace(sheared.stem, length=section.long(diameter)),
        loading=Loading(section.speed, duration, 0.0),
        contact=sheared.contact,
        discretisation=Discretisation(
            element_size=section.size().at(diameter),
            through_wall=kind.LAYERS,
            symmetry="quarter",
            edge_over="nodes",
            hourglass=_HOURGLASS,
            integration=replace(how.integration, outputs=_OUTPUTS, time_step=None, mass_scaling=1.0),
            filter_window=_SMOOTHED * duration,
            coarsening=kind.LONGER,
            coarsening_around=kind.WIDER,
            break_drop=how.break_drop,
            stop_after_peak=how.stop_after_peak,
        ),
    )


def identity(section: LaboratorySection, test: AnyTest) -> dict[str, Any]:
    """Return all data that determine the responses of a test, as JSON values."""
    kind = {"kind": section.kind, "revision": laboratory.REVISION, "measured": list(section.measured)}
    if package := TESTS.version_of(section.kind):
        kind["package"] = package
    cut = {} if isinstance(test, LaboratoryTest) else {"cutting": cutting.REVISION}
    return {**kind, **packages_of(section.measured), **cut, **determining(test)}


def determining(test: LaboratoryTest | ShearTest) -> dict[str, Any]:
    """Return the inputs of a test that determine its result: all inputs except the number of threads."""
    plain = asdict(test)
    del plain["discretisation"]["integration"]["threads"]
    if not test.outer:  # records of earlier versions, which had no layers, remain valid
        del plain["outer"], plain["stem"]["layers"]
        if test.material.transverse is None:
            del plain["material"]["transverse"]
    return plain


def perform_or_fail(test: AnyTest, inspect: Inspect | None = None) -> LaboratoryResult:
    """Perform a test by `laboratory.perform`; raise `SimulationFailed` if the result is not reliable."""
    result = laboratory.perform(test, inspect) if isinstance(test, LaboratoryTest) else laboratory.cut(test, inspect)
    if (failure := distrusted(result, test.discretisation.integration.safety)) is not None:
        raise failure
    return result


def distrusted(result: CuttingResult, safety: float) -> SimulationFailed | None:
    """Return a failure if the run created energy, with the remedy to halve the time step factor `safety`; else None."""
    drift, contact = result.energy_drift_percent, result.contact_energy_percent
    remedy = f"set `time_step_safety: {0.5 * safety:.2g}` under `solver`"
    if drift > _WORST_DRIFT:
        return SimulationFailed("energy_drift", f"the error in the energy balance is {drift:.1f} %; {remedy}")
    if contact >= _LEAST_CONTACT:
        return None
    return SimulationFailed("contact_energy", f"contact generated {-contact:.1f} % of the work of the tool; {remedy}")


def perform_all(tests: Sequence[tuple[LaboratorySection, AnyTest]]) -> tuple[dict[str, float], list[Note]]:
    """Perform tests; return their responses by name and their warnings. `SimulationFailed` if a response is missing."""
    responses: dict[str, float] = {}
    warnings: list[Note] = []
    for section, test in tests:
        try:
            result = perform_or_fail(test).with_responses(section.responses)
        except SimulationFailed as failure:
            raise SimulationFailed(failure.reason, f"{section.name}: {failure}") from failure
        for name in section.measured:
            if name not in result.responses:
                message = f"{section.name}: the {name} cannot be determined from the curve; increase the stroke"
                raise SimulationFailed("no_response", message)
            responses[section.called(name)] = result.responses[name]
        warnings += relevant_warnings(result, section.measured)
    return responses, list(dict.fromkeys(warnings))


def relevant_warnings(result: LaboratoryResult, measured: Sequence[str]) -> list[Note]:
    """Return the warnings that concern the measured responses; a slope does not depend on the later part of a curve."""
    needs_maximum = not all(known_response(name).before_maximum for name in measured)
    later = () if needs_maximum else ("maximum_not_passed", "buckles")
    return [warning for warning in result.warnings if warning.kind not in later]
