"""The embedded finite element solver, and the virtual tests that it runs for a study at given factor levels."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from math import hypot
from pathlib import Path
from typing import Any

from stemcal import cutting
from stemcal.cutting.build import mesh_size
from stemcal.cutting.end_state import LARGEST
from stemcal.cutting.parts import Blade, Discretisation, Loading, ShearTest, Stem, Supports, rate_filter
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import placed, shear
from stemcal.errors import SimulationFailed
from stemcal.fem.material import Material, Transverse
from stemcal.fem.model import Integration
from stemcal.fem.tools import Contact
from stemcal.fem.vtk_frames import FrameWriter
from stemcal.fem.warm import compile_once, is_compiled, warm
from stemcal.solvers import laboratory_runs
from stemcal.solvers.cost import seconds
from stemcal.solvers.film import Film
from stemcal.solvers.kept_curve import curve_scores, kept_curve, kept_rows
from stemcal.solvers.laboratory_runs import AnyTest
from stemcal.solvers.options import BREAK_DROP, EmbeddedSolver
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.solvers.replicates import MOST_SEED, seed_of
from stemcal.storage.typed import to_json
from stemcal.study.model.laboratory_kind import LaboratorySection, PieceSection
from stemcal.study.model.layers import LayerValues, layers_at
from stemcal.study.model.shear_test import DAMPING, GAP
from stemcal.study.model.study import Study
from stemcal.study.types.field_types import Length

# Columns of the history that are stored for the pictures of a run.
_PICTURED = frozenset({"travel", "kinetic", "internal", "hourglass", "eroded", "contact", "external"})
# Memory of a process without a mesh, bytes.
_PROCESS = 250.0e6


@dataclass(frozen=True)
class Embedded(Solver):
    """Answers requests by explicit finite element simulation; equal requests have bit-identical answers."""

    of_spec_alone = True

    study: Study
    random_offset: bool = True
    """Whether the mesh positions of replicates have a random offset, which depends on the levels of the run."""

    def prepare(self) -> None:
        """Compile the kernels, unless the cache contains them, so that the workers need not compile."""
        compile_once(self.study.is_layered)

    def get_ready(self) -> None:
        """Load the kernels into this process, or compile them if the cache does not contain them."""
        warm(self.study.is_layered)

    def preparing(self) -> bool:
        return not is_compiled(self.study.is_layered)

    def identity(self, request: Request) -> dict[str, Any]:
        """Return the inputs of the tests as plain values, and the revision of the code that simulates them."""
        tests = self._laboratory_tests(request)
        laboratory = [{"name": section.name, **laboratory_runs.identity(section, test)} for section, test in tests]
        return {
            "solver": "embedded",
            "revision": cutting.REVISION,
            "tests": [laboratory_runs.determining(self._test(request))],
            **({"laboratory": laboratory} if laboratory else {}),
            **({"curves": asdict(modes)} if (modes := self.study.targets.modes_at(request.condition)) else {}),
            **({"pictured": True} if request.pictured else {}),
        }

    def solve(self, request: Request) -> Answer:
        """Run the virtual shear test of a request, and the laboratory tests measured at its diameter."""
        try:
            test, modes = self._test(request), self.study.targets.modes_at(request.condition)
            film = Film() if request.pictured else None
            result = shear(test, inspect=film)
            responses, warnings = laboratory_runs.perform_all(self._laboratory_tests(request))
            scores = curve_scores(modes, result.history.travel, result.history.force_filtered, result.break_travel)
        except SimulationFailed as failure:
            return Answer("failed", reason=failure.reason, message=str(failure))
        result = replace(result, warnings=(*result.warnings, *warnings))
        scalars = {k: v for k, v in vars(result).items() if isinstance(v, bool | int | float)}
        curve = kept_curve(result.history.travel, result.history.force_filtered)
        details = {**scalars, "warnings": to_json(result.warnings), "curve": curve}
        if further := {**responses, **scores}:
            details |= {RESPONSES: further}
        if film is not None:
            details |= pictured(result, film)
        if (distrust := laboratory_runs.distrusted(result, _options(self.study).time_step_safety)) is not None:
            return Answer("failed", reason=distrust.reason, message=str(distrust), details=details)
        return Answer("ok", response=result.peak_force, details=details)

    def cost_estimate(self, request: Request) -> float:
        return sum(self.cost_by_test(request).values())

    def cost_by_test(self, request: Request) -> dict[str, float]:
        further = {section.name: seconds(test) for section, test in self._laboratory_tests(request)}
        return {"cutting": seconds(self._test(request)), **further}

    def memory_estimate(self, request: Request) -> float:
        further = (test for _, test in self._laboratory_tests(request) if isinstance(test, ShearTest))
        cuts = (self._test(request), *further)
        return _PROCESS + max(mesh_size(test.stem, test.discretisation).memory for test in cuts)

    def settings_that_matter(self, diameter: float) -> dict[str, str]:
        """Return the settings on which the force depends besides the factors: lengths, replicates, failure strain."""
        study, options = self.study, _options(self.study)
        lengths = {"element_size": options.element_size, **{key: length for (_, key), length in study.lengths.items()}}
        settings = {name: _written(length, length.at(diameter), diameter) for name, length in lengths.items()}
        for section, layer in zip(study.layers[:-1], layers_at(study, {}, diameter), strict=False):
            if (name := f"{section.name}_thickness") not in study.names:
                settings[name] = _written(section.thickness, layer.thickness, diameter)
        if options.elements_through_wall is not None:
            settings["elements_through_wall"] = f"{options.elements_through_wall}"
        if options.replicates is not None:
            settings["replicates"] = f"{options.replicates}"
        if study.material.failure_strain is None or "failure_strain" in study.names:
            return settings
        return {**settings, "failure_strain": f"{study.parameters({}, diameter)['failure_strain']:g}"}

    def _laboratory_tests(self, request: Request) -> list[tuple[LaboratorySection, AnyTest]]:
        """Return the laboratory tests of a run; in further cuts, the mesh is shifted as in the main shear test."""
        sections = laboratory_runs.measured_at(self.study, request.condition)
        tests = [test_of(self.study, section, request.levels, request.condition) for section in sections]
        placed_tests = [self._placed(test, request) if isinstance(test, ShearTest) else test for test in tests]
        return list(zip(sections, placed_tests, strict=True))

    def _test(self, request: Request) -> ShearTest:
        return self._placed(shear_test(self.study, request.levels, request.condition), request)

    def _placed(self, test: ShearTest, request: Request) -> ShearTest:
        """Return the test with its mesh shifted by 0 to ½ of an element; the shift differs between replicates."""
        if not request.replicate:
            return test
        offset = seed_of(Request("", 0, request.levels, request.condition)) / MOST_SEED if self.random_offset else 0.5
        count = max(self.study.solver.repeats, request.replicate)  # an old record may have a larger replicate number
        return placed(test, (request.replicate - 1 + offset) / (2 * count))


def meshed_as(study: Study, element_size: float) -> Study:
    """Return the study with another element size (mm); time step and elements through the wall change in proportion."""
    options, size = _options(study), Length(float(f"{element_size:g}"))
    diameter = study.targets.calibrate_at
    ratio = size.at(diameter) / options.element_size.at(diameter)
    changes = {
        "element_size": size,
        "time_step": None if (step := options.time_step) is None else step * ratio,
        "elements_through_wall": None if (n := options.elements_through_wall) is None else max(1, round(n / ratio)),
    }
    return study.model_copy(update={"solver": options.model_copy(update=changes)})


def simulate_levels(
    study: Study,
    levels: Mapping[str, float],
    diameter: float | None = None,
    frames: Path | None = None,
    section: LaboratorySection | None = None,
) -> CuttingResult:
    """Run one virtual shear test of a study, or the laboratory test of a section.

    levels     factor values in the units of the spec; factors without a value are at mid-level
    diameter   mm; by default that of the specimen
    frames     folder for about 50 frames in ParaView format

    The warnings of a laboratory test are those that concern the measured responses, or all if none was measured. Raises
    `SimulationFailed` if the result is not reliable.
    """
    warm(study.is_layered)
    diameter = study.stem_at(levels, study.specimen.outer_diameter if diameter is None else diameter)
    test = shear_test(study, levels, diameter) if section is None else test_of(study, section, levels, diameter)
    every = max(1, test.discretisation.integration.outputs // 50)
    writer = None if frames is None else FrameWriter(frames, every)
    if section is None:
        assert isinstance(test, ShearTest)
        result = shear(test, writer)
        if (distrust := laboratory_runs.distrusted(result, test.discretisation.integration.safety)) is not None:
            raise distrust
        return result
    result = laboratory_runs.perform_or_fail(test, writer).with_responses(section.responses)
    measured = section.measured or tuple(result.responses)
    return replace(result, warnings=tuple(laboratory_runs.relevant_warnings(result, measured)))


def test_of(study: Study, section: LaboratorySection, levels: Mapping[str, float], diameter: float) -> AnyTest:
    """Return the test of a section under `tests` in the spec: another cut, or a laboratory test of a piece of stem."""
    if isinstance(section, PieceSection):
        return laboratory_runs.laboratory_test(section, shear_test(study, levels, diameter))
    diameter = study.stem_at(levels, diameter)
    return _shear_test(study.at(levels).cut_as(section, diameter), levels, diameter)


def shear_test(study: Study, levels: Mapping[str, float], diameter: float) -> ShearTest:
    """Return the shear test of a study at given levels (in the units of the spec) and stem diameter (mm)."""
    return _shear_test(study.at(levels), levels, study.stem_at(levels, diameter))


def _shear_test(study: Study, levels: Mapping[str, float], diameter: float) -> ShearTest:
    blade, contact, layers = study.blade, study.contact, layers_at(study, levels, diameter)
    law, smoothing = _options(study).rate_law, rate_filter(diameter, study.loading.speed)
    *outer, inner = (_material(layer, law, smoothing) for layer in layers)
    thicknesses = tuple(layer.thickness for layer in layers[:-1])
    return ShearTest(
        material=inner,
        outer=tuple(outer),
        stem=Stem(diameter, study.specimen.ratio_at(diameter), study.specimen.length, thicknesses),
        blade=Blade(
            *(blade.thickness, blade.width, blade.edge_angle, blade.edge_radius, blade.bevel),
            edge_spread=blade.edge_spread.at(diameter),
        ),
        supports=Supports(**dict(study.supports)),
        loading=Loading(
            study.loading.speed, study.loading.duration_at(diameter), GAP, study.loading.until, blade.sliding_angle
        ),
        contact=Contact(contact.static_friction, contact.dynamic_friction, contact.decay, contact.penalty, DAMPING),
        discretisation=_discretisation(study, diameter),
    )


def _material(layer: LayerValues, law: str, smoothing: float) -> Material:
    return Material(
        **layer.along,
        transverse=None if layer.across is None else Transverse(**layer.across),
        rate_law="paper" if law == "paper" else "cowper_symonds",  # for `none`, C = 0 switches the law off
        rate_filter=smoothing,
        internal_length=layer.internal_length,
    )


def _written(length: object, mm: float, diameter: float) -> str:
    """Return a length as written in the spec, with its value (mm) at this diameter if it depends on the diameter."""
    if not isinstance(length, Length):
        return f"{mm:.3g} mm at {diameter:g} mm"
    return f"{length}" if length.divisor is None else f"{length} ({mm:.3g} mm)"


def _options(study: Study) -> EmbeddedSolver:
    solver = study.solver
    if not isinstance(solver, EmbeddedSolver):
        raise TypeError(f"the solver of the study is of kind `{solver.kind}`, not `embedded`")
    return solver


def _discretisation(study: Study, diameter: float) -> Discretisation:
    solver = _options(study).at_speed(study.loading.speed)
    over_nodes = solver.edge_over == "nodes"
    mirrored = study.blade.bevel == "both" and study.supports.kind == "span"
    return Discretisation(
        element_size=solver.element_size.at(diameter),
        through_wall=solver.elements_through_wall,
        symmetry="none" if study.blade.sliding_angle else "quarter" if mirrored and over_nodes else "half",
        edge_over=solver.edge_over,
        hourglass=solver.hourglass,
        integration=Integration(
            solver.mass_scaling, solver.time_step_safety, solver.outputs, solver.threads, solver.time_step, "mixed"
        ),
        filter_window=solver.filter_window,
        coarsening=solver.coarsening,
        even=_even(study, diameter, solver.element_size.at(diameter)),
        coarsening_around=solver.coarsening_around,
        break_drop=BREAK_DROP,
    )


def _even(study: Study, diameter: float, element_size: float) -> float:
    """Return `Discretisation.even`: in a whole cut, a stem that folds slides over the supports, which touch its nodes.

    The material up to this distance slides to the supports in half a diameter of travel. The maximum force is before.
    """
    supports = Supports(**dict(study.supports))
    slides = study.loading.until == "severed" and supports.kind == "span"
    return hypot(supports.rests_at, 0.5 * diameter) + element_size if slides else 0.0


def pictured(result: CuttingResult, film: Film) -> dict[str, Any]:
    """Return the data for pictures of a run: energies (mJ) over travel, the final shape, and frames of the cut."""
    keep = kept_rows(len(result.history.time))
    rows = {name: values for name, values in vars(result.history).items() if name in _PICTURED}
    energies = {name: [round(float(v), 6) for v in values[keep]] for name, values in rows.items()}
    if result.shape is None or len(result.shape.nodes) > LARGEST:
        return {"energies": energies}
    frames = film.packed(result)
    return {"energies": energies, "shape": result.shape.packed(), **({"film": frames} if frames else {})}
