"""Each number of a spec arrives at its place in the virtual test, in mm, t, s, N and MPa; and the failures of a run."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stemcal import cutting
from stemcal.cutting.build import build
from stemcal.cutting.parts import Blade, Loading, Stem, Supports
from stemcal.errors import SimulationFailed
from stemcal.fem.material import Transverse
from stemcal.fem.model import Integration
from stemcal.laboratory import perform as laboratory
from stemcal.notes import Note
from stemcal.solvers import embedded, laboratory_runs
from stemcal.solvers.embedded import Embedded, shear_test, simulate_levels
from stemcal.solvers.kept_curve import curve_scores
from stemcal.solvers.laboratory_runs import distrusted, identity, measured_at, perform_all, relevant_warnings
from stemcal.solvers.protocol import Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
SPEC = """\
name: all-keys
factors: [{name: yield_stress, unit: MPa, low: 10, high: 20}]
material: {density: 1.2 g/cm3, elastic_modulus: 1.1 GPa, poisson_ratio: 0.31, tangent_modulus: 0.7 MPa,
  hardening_parameter: 0.06, RATEfailure_strain: 0.04, internal_length: d/4}
specimen: {outer_diameter: 9 mm, diameter_ratio: 0.5, length: 44 mm}
blade: {thickness: 2.1 mm, width: 2.5 cm, edge_angle: 40 deg, edge_radius: 0.15 mm, edge_spread: d/8, BEVEL}
supports: SUPPORTS
loading: {speed: 60 mm/min, duration: 0.6 s}
contact: {static_friction: 0.25, dynamic_friction: 0.2, decay: 0.3 s/mm, penalty: 0.3}
solver:
  {kind: embedded, rate_law: LAW, element_size: d/12, elements_through_wall: 5, edge_over: OVER, hourglass: 0.03,
  mass_scaling: 5000, time_step: 30 us, time_step_safety: 0.7, outputs: 300, filter_window: 20 ms, coarsening: 4,
  coarsening_around: 3, threads: 2}
targets: [{diameter: 8 mm, force: 150 N}]
"""


RATE = "strain_rate_c: 70 1/s, strain_rate_p: 5, "
SPAN = "{clearance: 18 mm, fillet_radius: 0.9 mm}"


def study_of(folder: Path, law: str = "paper", over: str = "nodes", bevel: str = "bevel: both", **more: str) -> Study:
    text = SPEC.replace("LAW", law).replace("OVER", over).replace("BEVEL", bevel)
    text = text.replace("RATE", more.get("rate", RATE)).replace("SUPPORTS", more.get("supports", SPAN))
    (folder / "all.yaml").write_text(text, encoding="utf-8")
    return load_study(folder / "all.yaml")


def test_every_number_has_its_place(tmp_path: Path) -> None:
    test = shear_test(study_of(tmp_path), {"yield_stress": 17.0}, 8.0)
    law = test.material
    assert (law.density, law.elastic_modulus, law.poisson_ratio) == (pytest.approx(1.2e-9), 1100.0, 0.31)
    assert (law.yield_stress, law.tangent_modulus, law.hardening_parameter) == (17.0, 0.7, 0.06)
    assert (law.strain_rate_c, law.strain_rate_p, law.failure_strain) == (70.0, 5.0, 0.04)
    assert (law.rate_law, law.transverse, law.internal_length) == ("paper", None, 2.0)
    assert law.rate_filter == pytest.approx(0.01 * 8.0 / 1.0)
    assert test.stem == Stem(8.0, 0.5, 44.0, ()) and test.outer == ()
    assert test.blade == Blade(2.1, 25.0, 40.0, 0.15, "both", 1.0)
    assert test.supports == Supports(18.0, 0.9, "span", 60.0)
    assert test.loading == Loading(1.0, 0.6, 0.001, "first_fracture", 0.0)
    contact = test.contact
    assert (contact.static_friction, contact.dynamic_friction, contact.decay) == (0.25, 0.2, 0.3)
    assert (contact.penalty, contact.damping) == (0.3, 0.5)
    how = test.discretisation
    assert how.integration == Integration(5000.0, 0.7, 300, 2, 30e-6, "mixed")
    assert (how.element_size, how.through_wall, how.symmetry) == (8.0 / 12.0, 5, "quarter")
    assert (how.edge_over, how.turn, how.shift, how.coarsening, how.coarsening_around) == ("nodes", 0.0, 0.0, 4.0, 3.0)
    assert (how.hourglass, how.filter_window, how.break_drop, how.stop_after_peak) == (0.03, 0.02, 0.5, True)


@pytest.mark.parametrize(
    ("over", "bevel", "symmetry"),
    [
        ("nodes", "bevel: both", "quarter"),
        ("nodes", "bevel: one", "half"),
        ("elements", "bevel: both", "half"),
        ("nodes", "sliding_angle: 10 deg", "none"),
    ],
)
def test_the_part_of_the_stem_that_is_modelled(tmp_path: Path, over: str, bevel: str, symmetry: str) -> None:
    study = study_of(tmp_path, over=over, bevel=bevel)
    test = shear_test(study, {"yield_stress": 17.0}, 8.0)
    assert (test.discretisation.symmetry, test.discretisation.edge_over) == (symmetry, over)
    assert test.loading.sliding_angle == (10.0 if "sliding" in bevel else 0.0)


@pytest.mark.parametrize(
    ("supports", "until", "even"),
    [(SPAN, "first_fracture", False), (SPAN, "severed", True), ("{kind: clamped, height: 20 mm}", "severed", False)],
)
def test_elements_over_the_supports_are_short_in_a_whole_cut(
    tmp_path: Path, supports: str, until: str, even: bool
) -> None:
    """They are as long as those under the edge up to √(9.9² + 4²) mm; `coarsening` is 4 at the ends, at 22 mm."""
    study = study_of(tmp_path, supports=supports)
    loading = study.loading.model_copy(update={"until": until})
    test = shear_test(study.model_copy(update={"loading": loading}), {"yield_stress": 17.0}, 8.0)
    x = np.unique(build(test).mesh.nodes[:, 0].round(9))
    lengths = np.diff(x[x >= 0.0])
    over = lengths[x[x >= 0.0][1:] <= np.hypot(9.9, 4.0) + 1e-9]
    ratio = over.max() / lengths[0]
    assert ratio < 1.1 if even else ratio > 2.0
    assert lengths[-1] / lengths[0] == pytest.approx(4.0, rel=0.1)


def test_next_to_a_clamp_half_of_the_stem_is_modelled(tmp_path: Path) -> None:
    study = study_of(tmp_path, supports="{kind: clamped, height: 20 mm}")
    test = shear_test(study, {"yield_stress": 17.0}, 8.0)
    assert test.discretisation.symmetry == "half" and (test.supports.kind, test.supports.height) == ("clamped", 20.0)


@pytest.mark.parametrize(("law", "c"), [("cowper_symonds", 70.0), ("none", 0.0)])
def test_no_rate_law_is_a_constant_of_zero(tmp_path: Path, law: str, c: float) -> None:
    study = study_of(tmp_path, law, rate="" if law == "none" else RATE)
    material = shear_test(study, {"yield_stress": 17.0}, 8.0).material
    assert (material.rate_law, material.strain_rate_c) == ("cowper_symonds", c)


def test_layers_are_counted_from_outside_and_fibres_are_across_the_radius() -> None:
    layered = load_study(CONFIGS / "hemp-two-layers.yaml")
    test = shear_test(layered, {"phloem_yield_stress": 20.0}, 9.3)
    (skin,) = test.outer
    assert test.stem == Stem(9.3, pytest.approx(4.2 / 9.3), layered.specimen.length, (0.5,))
    assert (skin.elastic_modulus, skin.yield_stress, skin.transverse) == (3607.5, 20.0, None)
    assert (test.material.elastic_modulus, test.material.yield_stress) == (1343.5, 16.0)
    assert skin.rate_filter == test.material.rate_filter == pytest.approx(0.01 * 9.3 / layered.loading.speed)
    fibres = load_study(CONFIGS / "grapevine.yaml")
    material = shear_test(fibres, fibres.midlevels(), 8.0).material
    assert isinstance(material.transverse, Transverse)


def test_settings_on_which_calibrated_values_depend(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    assert Embedded(study).settings_that_matter(8.0) == {
        "element_size": "d/12 (0.667 mm)",
        "edge_spread": "d/8 (1 mm)",
        "internal_length": "d/4 (2 mm)",
        "elements_through_wall": "5",
        "failure_strain": "0.04",
    }
    (tmp_path / "all.yaml").write_text(
        (tmp_path / "all.yaml").read_text("utf-8").replace("d/12, elements_through_wall: 5", "0.8 mm"), encoding="utf-8"
    )
    plain = Embedded(load_study(tmp_path / "all.yaml")).settings_that_matter(8.0)
    assert plain["element_size"] == "0.8 mm" and "elements_through_wall" not in plain
    layered = Embedded(load_study(CONFIGS / "hemp-two-layers.yaml")).settings_that_matter(9.3)
    assert (layered["phloem_thickness"], layered["failure_strain"]) == ("0.5 mm", "0.08")
    assert "xylem_thickness" not in layered
    written = {"d/16": "d/16 (0.5 mm)", "{at: 8 mm, value: 0.5 mm, exponent: 2}": "0.5 mm at 8 mm"}
    for rule, text in written.items():
        spec = (CONFIGS / "hemp-two-layers.yaml").read_text(encoding="utf-8")
        (tmp_path / "rule.yaml").write_text(spec.replace("thickness: 0.5 mm", f"thickness: {rule}"), encoding="utf-8")
        assert Embedded(load_study(tmp_path / "rule.yaml")).settings_that_matter(8.0)["phloem_thickness"] == text
    varied = load_study(CONFIGS / "smoke.yaml")
    assert "failure_strain" not in Embedded(varied).settings_that_matter(8.0)
    own = varied.material.model_copy(update={"failure_strain": None})  # as of layers with strains of their own
    layers = varied.model_copy(update={"material": own, "factors": varied.factors[:2]})
    assert "failure_strain" not in Embedded(layers).settings_that_matter(8.0)


def test_a_thickness_that_is_a_factor_is_no_setting(tmp_path: Path) -> None:
    text = (CONFIGS / "hemp-two-layers.yaml").read_text(encoding="utf-8")
    text = text.replace("thickness: 0.5 mm, ", "").replace(
        "\nmaterial:", "\n  - {name: phloem_thickness, unit: mm, low: 0.4, high: 0.6}\n\nmaterial:"
    )
    (tmp_path / "t.yaml").write_text(
        text.replace("[phloem_yield_stress]", "[phloem_yield_stress, phloem_thickness]"), encoding="utf-8"
    )
    assert "phloem_thickness" not in Embedded(load_study(tmp_path / "t.yaml")).settings_that_matter(9.3)


def test_only_the_embedded_solver_has_its_settings(tmp_path: Path) -> None:
    replay = load_study(CONFIGS / "paper-replay.yaml")
    with pytest.raises(TypeError, match="is of kind `sheet`, not `embedded`"):
        shear_test(replay, replay.midlevels(), 8.0)


# ---- replicates and identity


def test_the_mesh_of_a_replicate_is_in_its_part_of_half_an_element(tmp_path: Path) -> None:
    """Without chance in the middle of its part: of four replicates 1/16, 3/16, 5/16 and 7/16 of an element."""
    study = load_study(CONFIGS / "smoke.yaml", solver={"replicates": 4})
    fixed = Embedded(study, random_offset=False)
    requests = [Request("rsm", 0, study.midlevels(), 8.0, replicate=n) for n in (1, 2, 3, 4)]
    assert [fixed._test(run).discretisation.shift for run in requests] == pytest.approx(
        [0.0625, 0.1875, 0.3125, 0.4375]
    )
    beyond = Request("rsm", 0, study.midlevels(), 8.0, replicate=8)  # of a record with eight replicates
    assert fixed._test(beyond).discretisation.shift == pytest.approx(7.5 / 16.0)
    assert Embedded(study)._test(Request("rsm", 0, study.midlevels(), 8.0)).discretisation.shift == 0.0


def test_identity_is_the_test_and_the_revision(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    run = Request("rsm", 0, {"yield_stress": 17.0}, 8.0)
    found = Embedded(study).identity(run)
    assert set(found) == {"solver", "revision", "tests"}
    assert (found["solver"], found["revision"], len(found["tests"])) == ("embedded", cutting.REVISION, 1)
    (test,) = found["tests"]
    assert "threads" not in test["discretisation"]["integration"] and "outer" not in test
    assert "layers" not in test["stem"] and "transverse" not in test["material"]
    assert test["material"]["yield_stress"] == 17.0 and test["stem"]["outer_diameter"] == 8.0
    assert Embedded(study).identity(replace(run, pictured=True)) == {**found, "pictured": True}
    layered = load_study(CONFIGS / "hemp-two-layers.yaml")
    (test,) = Embedded(layered).identity(Request("rsm", 0, {"phloem_yield_stress": 20.0}, 9.3))["tests"]
    assert test["stem"]["layers"] == (0.5,) and test["outer"][0]["yield_stress"] == 20.0
    assert test["material"]["transverse"] is None


# ---- runs that fail

THREE = load_study(CONFIGS / "three-tests.yaml")


def result_of(drift: float = 1.0, contact: float = 2.0, **more: Any) -> Any:
    history = SimpleNamespace(travel=np.array([0.0, 1.0]), force_filtered=np.array([0.0, 90.0]))
    return SimpleNamespace(energy_drift_percent=drift, contact_energy_percent=contact, history=history, **more)


@pytest.mark.parametrize(
    ("drift", "contact", "safety", "found"),
    [
        (5.0, -1.0, 0.9, None),
        (5.04, 0.0, 0.9, ("energy_drift", "the error in the energy balance is 5.0 %", "0.45")),
        (0.0, -1.01, 0.7, ("contact_energy", "contact generated 1.0 % of the work of the tool", "0.35")),
        (9.0, -3.0, 0.9, ("energy_drift", "the error in the energy balance is 9.0 %", "0.45")),
    ],
)
def test_a_run_that_creates_energy_is_not_trusted(
    drift: float, contact: float, safety: float, found: tuple[str, str, str] | None
) -> None:
    failure = distrusted(result_of(drift, contact), safety)
    if found is None:
        assert failure is None
    else:
        message = f"{found[1]}; set `time_step_safety: {found[2]}` under `solver`"
        assert failure is not None and (failure.reason, str(failure)) == (found[0], message)


def test_a_simulation_that_fails_is_a_failed_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise SimulationFailed("inverted", "element 17 is inverted at 3 ms")

    monkeypatch.setattr(embedded, "shear", fail)
    answer = Embedded(study_of(tmp_path)).solve(Request("rsm", 0, {"yield_stress": 17.0}, 8.0))
    assert (answer.status, answer.reason, answer.message) == ("failed", "inverted", "element 17 is inverted at 3 ms")
    assert answer.response is None and answer.details == {}


class Performed:
    """In place of laboratory tests: a result with some responses and warnings for each."""

    def __init__(self, responses: dict[str, float], warnings: tuple[Note, ...] = (), drift: float = 0.0) -> None:
        self.responses, self.warnings = responses, warnings
        self.energy_drift_percent, self.contact_energy_percent = drift, 0.0

    def with_responses(self, _responses: Any) -> "Performed":
        return self


BUCKLES, SHORT, OTHER = (Note(kind, "warning", kind) for kind in ("buckles", "maximum_not_passed", "hourglass_energy"))


def test_laboratory_tests_have_their_responses_or_fail_with_their_name(monkeypatch: pytest.MonkeyPatch) -> None:
    bending, pull = THREE.tests
    tests = Embedded(THREE)._laboratory_tests(Request("rsm", 0, THREE.midlevels(), 8.0))
    results = {
        "bending": Performed({"slope": 3.0, "force": 5.0}, (SHORT, OTHER)),
        "pull": Performed({"force": 7.0, "work": 8.0}, (OTHER, BUCKLES)),
    }
    order: Iterator[str] = iter([])
    monkeypatch.setattr(laboratory, "perform", lambda _test, _inspect: results[next(order)])
    order = iter(["bending", "pull"])
    responses, warnings = perform_all(tests)
    assert responses == {"bending_slope": 3.0, "pull_force": 7.0, "pull_work": 8.0}
    assert warnings == [OTHER, BUCKLES]
    results["pull"] = Performed({"force": 7.0})
    order = iter(["bending", "pull"])
    with pytest.raises(SimulationFailed) as caught:
        perform_all(tests)
    message = "pull: the work cannot be determined from the curve; increase the stroke"
    assert (caught.value.reason, str(caught.value)) == ("no_response", message)
    results["pull"] = Performed({"force": 7.0, "work": 8.0}, drift=6.0)
    order = iter(["bending", "pull"])
    with pytest.raises(SimulationFailed, match=r"^pull: the error in the energy balance is 6\.0 %") as caught:
        perform_all(tests)
    assert caught.value.reason == "energy_drift"
    assert (bending.name, pull.name) == ("bending", "pull")


@pytest.mark.parametrize(
    ("measured", "kinds"),
    [
        (["slope"], ["hourglass_energy"]),
        (["force"], ["buckles", "maximum_not_passed", "hourglass_energy"]),
        (["slope", "work"], ["buckles", "maximum_not_passed", "hourglass_energy"]),
        ([], ["hourglass_energy"]),
    ],
)
def test_warnings_about_the_later_curve_concern_the_maximum(measured: list[str], kinds: list[str]) -> None:
    result: Any = Performed({}, (BUCKLES, SHORT, OTHER))
    assert [note.kind for note in relevant_warnings(result, measured)] == kinds


def test_tests_of_a_fitted_diameter_are_all_and_of_another_those_measured_there(tmp_path: Path) -> None:
    assert [test.name for test in measured_at(THREE, 8.0 + 0.9e-6)] == ["bending", "pull"]
    assert measured_at(THREE, 8.0 + 2e-6) == ()


def test_a_piece_has_the_settings_of_its_test() -> None:
    """Filters of a hundredth of its duration, 400 outputs, no time step, no scaled mass, three per cent hourglass."""
    sheared = shear_test(THREE, THREE.midlevels(), 8.0)
    bending = laboratory_runs.laboratory_test(THREE.tests[0], sheared)
    duration = bending.loading.duration
    assert duration == pytest.approx(THREE.tests[0].stroke_at(8.0) / THREE.tests[0].speed)
    assert (bending.loading.gap, bending.contact) == (0.0, sheared.contact)
    how = bending.discretisation
    assert how.filter_window == bending.material.rate_filter == pytest.approx(0.01 * duration)
    integration = sheared.discretisation.integration
    assert how.integration == replace(integration, outputs=400, time_step=None, mass_scaling=1.0)
    assert (how.hourglass, how.symmetry, how.edge_over, how.break_drop) == (0.03, "quarter", "nodes", 0.5)
    assert (how.coarsening, how.coarsening_around) == (bending.kind.LONGER, bending.kind.WIDER)
    known = identity(THREE.tests[0], bending)
    assert known["kind"] == {"span": 56.0, "nose_radius": 3.0, "support_radius": 3.0}
    assert (known["revision"], known["measured"]) == (laboratory.REVISION, ["slope"])
    assert "cutting" not in known and "package" not in known
    assert known["loading"] == asdict(bending.loading)
    assert identity(THREE.tests[0], sheared)["cutting"] == cutting.REVISION


def test_a_curve_that_cannot_be_scored_fails_the_run() -> None:
    assert curve_scores(None, np.array([0.0]), np.array([0.0])) == {}


def test_frames_are_every_fiftieth_of_the_outputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[Path, int]] = []
    monkeypatch.setattr(embedded, "FrameWriter", lambda folder, every: made.append((folder, every)))
    monkeypatch.setattr(embedded, "shear", lambda test, writer: test)
    monkeypatch.setattr(embedded, "warm", lambda layered: None)
    monkeypatch.setattr(laboratory_runs, "distrusted", lambda result, safety: None)
    for outputs, every in ((500, 10), (99, 1), (30, 1)):
        study = load_study(CONFIGS / "smoke.yaml", solver={"outputs": outputs})
        test: Any = simulate_levels(study, {"yield_stress": 17.0}, frames=tmp_path)
        assert made.pop() == (tmp_path, every)
        assert (test.stem.outer_diameter, test.material.yield_stress, test.material.elastic_modulus) == (
            8.0,
            17.0,
            1000.0,
        )
    simulate_levels(study, {}, 7.0)
    assert made == []


def test_one_simulation_that_created_energy_fails_as_in_a_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = Cut(contact_energy_percent=-1.1)
    monkeypatch.setattr(embedded, "shear", lambda test, writer: result)
    monkeypatch.setattr(embedded, "warm", lambda layered: None)
    with pytest.raises(SimulationFailed) as failed:
        simulate_levels(study_of(tmp_path), {"yield_stress": 17.0})
    assert failed.value.reason == "contact_energy" and "time_step_safety: 0.35" in str(failed.value)
    result = Cut(contact_energy_percent=-0.9)
    assert simulate_levels(study_of(tmp_path), {"yield_stress": 17.0}).peak_force == 90.0


CURVE = SimpleNamespace(travel=np.array([0.0, 1.0]), force_filtered=np.array([0.0, 90.0]))


@dataclass(frozen=True)
class Cut:
    """The part of the result of a cut that an answer is made of."""

    peak_force: float = 90.0
    stroke_was_enough: bool = True
    energy_drift_percent: float = 1.0
    contact_energy_percent: float = 2.0
    break_travel: float | None = 0.8
    warnings: tuple[Note, ...] = (OTHER,)
    history: Any = field(default_factory=lambda: CURVE)


def test_an_answer_has_the_numbers_of_the_cut_and_the_responses_of_all_tests(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = Cut()
    seen: list[Any] = []
    monkeypatch.setattr(embedded, "shear", lambda test, inspect: seen.append((test, inspect)) or result)
    solver, run = Embedded(study_of(tmp_path)), Request("rsm", 0, {"yield_stress": 17.0}, 8.0)
    answer = solver.solve(run)
    assert (answer.status, answer.response) == ("ok", 90.0)
    numbers = {"peak_force": 90.0, "stroke_was_enough": True, "break_travel": 0.8}
    energies = {"energy_drift_percent": 1.0, "contact_energy_percent": 2.0}
    warnings = [{"kind": "hourglass_energy", "severity": "warning", "text": "hourglass_energy", "remedy": None}]
    curve = {"travel": [0.0, 1.0], "force": [0.0, 90.0]}
    assert answer.details == {**numbers, **energies, "warnings": warnings, "curve": curve}
    assert seen[0] == (shear_test(solver.study, run.levels, 8.0), None)
    result = Cut(energy_drift_percent=6.0)
    failed = solver.solve(run)
    assert (failed.status, failed.reason, failed.response) == ("failed", "energy_drift", None)
    assert "`time_step_safety: 0.35`" in failed.message and failed.details["energy_drift_percent"] == 6.0
    monkeypatch.setattr(laboratory_runs, "perform_all", lambda tests: ({"pull_work": 8.0}, [SHORT]))
    result = Cut()
    more = Embedded(THREE).solve(Request("rsm", 0, THREE.midlevels(), 8.0))
    assert more.details["responses"] == {"pull_work": 8.0}
    assert [note["kind"] for note in more.details["warnings"]] == ["hourglass_energy", "maximum_not_passed"]


def test_kernels_are_prepared_for_the_layers_of_the_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    called: list[tuple[str, bool]] = []
    for name in ("warm", "compile_once", "is_compiled"):
        monkeypatch.setattr(embedded, name, lambda layered, name=name: called.append((name, layered)))
    for study in (study_of(tmp_path), load_study(CONFIGS / "hemp-two-layers.yaml")):
        solver = Embedded(study)
        solver.prepare()
        solver.get_ready()
        assert solver.preparing() is True
    names = ("compile_once", "warm", "is_compiled")
    assert called == [(name, layered) for layered in (False, True) for name in names]


def test_the_package_of_a_laboratory_test_is_in_its_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laboratory_runs.TESTS, "version_of", lambda kind: f"{kind} of springs 1.0")
    bending = laboratory_runs.laboratory_test(THREE.tests[0], shear_test(THREE, THREE.midlevels(), 8.0))
    assert identity(THREE.tests[0], bending)["package"] == "three-point-bending of springs 1.0"
