import pickle
import re
import shutil
from pathlib import Path

import pytest
from pydantic import ValidationError

from stemcal.by_hand.options import SheetSolver
from stemcal.errors import SpecError, UsageError
from stemcal.solvers.options import EmbeddedSolver
from stemcal.study.model.shear_test import BladeSection
from stemcal.study.model.study import Study, StudyForm
from stemcal.study.reading import load_study, read_study
from stemcal.study.types.factor import PARAMETERS
from stemcal.study.types.field_types import Length

ROOT = Path(__file__).parents[3]
CASES = ROOT / "tests" / "cases"
AS_PUBLISHED = ROOT / "configs" / "wild-chrysanthemum-as-published.yaml"
MINIMAL = (CASES / "good" / "minimal.yaml").read_text(encoding="utf-8")
# the published study with the keys that tests replace
SHIPPED = (
    (ROOT / "configs" / "wild-chrysanthemum-as-published.yaml")
    .read_text(encoding="utf-8")
    .replace("  kind: embedded\n", "  kind: embedded\n  element_size: d/16\n  mass_scaling: 1e4\n  time_step: 40 us\n")
    + """
specimen: {outer_diameter: 8 mm, diameter_ratio: 0.41, length: 50 mm}
supports: {clearance: 20 mm}
loading: {speed: 100 mm/min, duration: 0.5 s}
"""
)
EXPECT = re.compile(r"# expect: (\d+): (.+)")


def study_of(text: str) -> Study:
    return read_study(text.encode(), CASES / "good" / "study.yaml")


def problems_of(text: str) -> list[str]:
    with pytest.raises(SpecError) as caught:
        study_of(text)
    return [str(problem).split("study.yaml:", 1)[1] for problem in caught.value.problems]


@pytest.mark.parametrize("path", sorted((CASES / "bad").glob("*.yaml")), ids=lambda path: path.stem)
def test_bad_spec_is_refused_with_line_and_remedy(path: Path) -> None:
    expected = [(int(line), text) for line, text in EXPECT.findall(path.read_text(encoding="utf-8"))]
    assert expected
    with pytest.raises(SpecError) as caught:
        load_study(path)
    found = caught.value.problems
    assert [problem.line for problem in found] == [line for line, _ in expected]
    for problem, (_, text) in zip(found, expected, strict=True):
        assert text in str(problem)
        assert problem.remedy
        assert str(problem).startswith(f"{path}:{problem.line}:{problem.column}: ")


@pytest.mark.parametrize(
    "path", [*sorted((CASES / "good").glob("*.yaml")), *sorted((ROOT / "configs").glob("*.yaml"))], ids=lambda p: p.stem
)
def test_good_spec_loads_pickles_and_dumps(path: Path) -> None:
    study = load_study(path)
    assert pickle.loads(pickle.dumps(study)) == study
    dump = study.model_dump(mode="json")
    assert set(dump) == set(StudyForm.model_fields)
    as_written = study.model_dump_json(by_alias=True)
    assert Study.model_validate_json(as_written).model_dump(mode="json") == dump


def test_everything_arrives_in_internal_units() -> None:
    study = load_study(CASES / "good" / "everything.yaml")
    assert study.title == "Stems <b>cut</b> & 中文"
    assert study.specimen.outer_diameter == pytest.approx(9.0, rel=1e-14)
    assert study.blade.edge_angle == pytest.approx(28.647889756541, rel=1e-12)
    assert study.blade.edge_radius == pytest.approx(0.02, rel=1e-14)
    assert study.supports.clearance == pytest.approx(15.0, rel=1e-14)
    assert study.loading.speed == 2000.0
    assert study.loading.duration == pytest.approx(0.005, rel=1e-14)
    assert study.contact.decay == pytest.approx(0.01, rel=1e-14)
    assert study.material.tangent_modulus == pytest.approx(0.5, rel=1e-14)
    assert isinstance(study.solver, EmbeddedSolver)
    assert study.solver.element_size.at(9.0) == pytest.approx(0.5, rel=1e-14)
    assert study.solver.filter_window == 0.0
    assert study.calibration_target.response == pytest.approx(213.8, rel=1e-14)
    assert study.calibration_target.sd == 12.0 and study.calibration_target.n == 6


def test_factors_keep_their_unit_and_convert_levels() -> None:
    study = load_study(CASES / "good" / "everything.yaml")
    stress = study.factor("yield_stress")
    assert (stress.low, stress.high, stress.centre, stress.half_range) == (10_000, 20_000, 15_000, 5_000)
    assert stress.internal(17_960) == pytest.approx(17.96, rel=1e-14)
    assert study.factor("failure_strain").internal(3) == pytest.approx(0.03, rel=1e-14)
    assert study.factor("density").internal(1.1) == pytest.approx(1.1e-9, rel=1e-14)
    with pytest.raises(UsageError, match="no factor is named 'yeild_stress'; did you mean yield_stress"):
        study.factor("yeild_stress")


def test_parameters_join_levels_midlevels_and_fixed_values() -> None:
    values = load_study(CASES / "good" / "everything.yaml").parameters({"yield_stress": 12_000})
    assert set(values) == set(PARAMETERS)
    assert values["yield_stress"] == pytest.approx(12.0, rel=1e-14)
    assert values["elastic_modulus"] == pytest.approx(1000.0, rel=1e-14)
    assert values["failure_strain"] == pytest.approx(0.03, rel=1e-14)
    assert values["strain_rate_p"] == 8


def test_numbers_of_yaml_1_2() -> None:
    study = load_study(CASES / "good" / "numbers.yaml")
    assert (study.name, study.title) == ("010", "no")
    assert study.factor("elastic_modulus").internal(8e8) == pytest.approx(800.0, rel=1e-14)
    assert study.factor("strain_rate_p").low == 10
    assert study.material.poisson_ratio == 0.3


def test_defaults_fill_what_is_not_written() -> None:
    study = study_of(MINIMAL)
    assert study.title == "minimal"
    assert [factor.symbol for factor in study.factors] == ["X1", "X2"]
    assert study.factor("yield_stress").label == "yield stress"
    assert study.factor("failure_strain").unit == "1"
    assert study.loading.speed == pytest.approx(100 / 60, rel=1e-14)
    assert study.midlevels() == pytest.approx({"yield_stress": 15.0, "failure_strain": 0.03}, rel=1e-14)


def test_the_paper_study_is_the_paper() -> None:
    study = load_study(ROOT / "configs" / "wild-chrysanthemum-as-published.yaml")
    assert study.names == tuple(PARAMETERS)
    assert [factor.symbol for factor in study.factors] == [f"X{i}" for i in range(1, 10)]
    lows = [1000, 800, 0.2, 10, 0.4, 0, 80, 4, 0.01]
    highs = [1200, 1200, 0.4, 20, 0.6, 0.1, 100, 12, 0.05]
    assert [factor.low for factor in study.factors] == lows
    assert [factor.high for factor in study.factors] == highs
    assert [target.response for target in study.targets.means] == [120, 159.2, 213.8, 300, 378.2]
    assert study.calibration_target.response == 159.2
    assert (study.blade.width, study.blade.thickness) == (28, 2.3)
    replay = load_study(ROOT / "configs" / "paper-replay.yaml")
    assert study.rsm.coding == {}
    assert replay.rsm.coded("yield_stress") == (14.995, 2.975)
    assert replay.rsm.coded("strain_rate_c") == (90.0, 5.95)
    assert isinstance(study.solver, EmbeddedSolver) and study.solver.rate_law == "paper"


def test_the_replay_finds_its_sheet() -> None:
    study = load_study(ROOT / "configs" / "paper-replay.yaml")
    assert isinstance(study.solver, SheetSolver) and study.solver.file is not None
    assert study.solver.file.is_absolute()
    header = study.solver.file.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert header == ["run", *study.names, "diameter", "force"]


def test_shipped_specs_raise_no_doubts(tmp_path: Path) -> None:
    """In a fresh clone, where the stem of the cutter study is not calibrated yet."""
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    doubts = {path.stem: load_study(path).warnings for path in sorted((tmp_path / "configs").glob("*.yaml"))}
    (uncalibrated,) = doubts.pop("chrysanthemum-cutter")
    assert "wild-chrysanthemum.yaml` first" in uncalibrated
    assert set(doubts.values()) == {()}


def test_without_lengths_the_force_belongs_to_the_mesh() -> None:
    said = study_of(f"{SHIPPED}material: {{internal_length: 0 mm}}\nblade: {{edge_spread: 0 mm}}\n").warnings
    assert len(said) == 2 and all("the force depends on the mesh" in warning for warning in said)


def test_lengths_are_millimetres_or_shares_of_the_diameter() -> None:
    assert Length(divisor=8.0).at(11.0) == 1.375 and Length(0.5).at(11.0) == 0.5
    blade = BladeSection.model_validate({"edge_spread": "d / 8"})
    assert blade.edge_spread == Length(divisor=8.0) and blade.model_dump()["edge_spread"] == "d/8"
    assert BladeSection(edge_spread="400 um").edge_spread == Length(0.4)  # type: ignore[arg-type]


@pytest.mark.parametrize("given", ["d/0", "d/-8", "d/1e9", "8/d", "d", "0.5", "-1 mm", "d/8 mm"])
def test_lengths_that_make_no_sense_are_refused(given: str) -> None:
    with pytest.raises(ValidationError):
        EmbeddedSolver.model_validate({"element_size": given})


@pytest.mark.parametrize("speed", ["300 mm/min", "5 mm/s", "300 mm/s", "20 m/s"])
def test_a_speed_of_no_testing_machine_is_questioned(speed: str) -> None:
    warnings = study_of(f"{MINIMAL}loading: {{speed: {speed}, duration: 0.5 s}}\n").warnings
    questioned = [warning for warning in warnings if "mm/min" in warning]
    assert len(questioned) == (speed == "300 mm/s")


@pytest.mark.parametrize(
    ("speed", "law", "doubted"),
    [(130, "paper", 0), (150, "paper", 1), (2000, "paper", 1), (2000, "cowper_symonds", 0)],
)
def test_a_speed_at_which_the_printed_rate_law_explodes_is_questioned(speed: int, law: str, doubted: int) -> None:
    """The smallest C is 80/s and the thinnest stem 7 mm: 4 V/d reaches C at 140 mm/s."""
    warnings = load_study(AS_PUBLISHED, loading={"speed": f"{speed} mm/s"}, solver={"rate_law": law}).warnings
    found = [one for one in warnings if "rate_law: cowper_symonds" in one]
    assert len(found) == doubted
    assert not doubted or re.search(rf"about {4 * speed / 7:.0f}/s, .* C = 80/s", found[0])


def test_elements_too_coarse_for_the_lengths_are_doubted() -> None:
    text = SHIPPED
    start, end = text.index("solver:\n"), text.index("\n\n", text.index("solver:\n"))
    deck = "solver: {kind: deck, program: lsdyna, command: [ls-dyna, 'i={{deck}}'], element_size: d/12"
    with_lengths = f"{text[:start]}{deck}, nonlocal_failure: true}}{text[end:]}"
    for coarse in (text.replace("element_size: d/16", "element_size: d/12"), with_lengths):
        said = study_of(coarse).warnings
        assert len(said) == 1
        size = "at a diameter of 7 mm; use at most 0.44 mm"
        assert f"the element size of d/12 exceeds 0.6 times `blade.edge_spread` (d/9.5) {size}" in said[0]
    assert not study_of(with_lengths.replace("d/12", "d/16")).warnings
    assert not study_of(with_lengths.replace(", nonlocal_failure: true", "")).warnings


@pytest.mark.parametrize(
    ("changes", "warning"),
    [
        (
            {"0.41": "0.7"},
            "so the force depends on the mesh; write `elements_through_wall: 4`",
        ),
        ({"0.41": "0.7", "kind: embedded": "kind: embedded\n  elements_through_wall: 4"}, ""),
        ({"0.41": "0.7", "kind: embedded": "kind: embedded\n  elements_through_wall: 3"}, ""),
        ({"kind: embedded": "kind: embedded\n  elements_through_wall: 2"}, "write `elements_through_wall: 4`"),
        ({"speed: 100 mm/min": "speed: 1 m/s", "duration: 0.5 s": "duration: 1.2 ms"}, "rate_law: cowper_symonds"),
        ({"speed: 100 mm/min": "speed: 20 mm/s", "duration: 0.5 s": "duration: 50 ms"}, ""),
        ({"length: 50 mm": "length: 35 mm", "duration: 0.5 s": "until: severed"}, "use at least 36 mm"),
        ({"length: 50 mm": "length: 36 mm", "duration: 0.5 s": "until: severed"}, ""),
        ({"length: 50 mm": "length: 35 mm"}, ""),
    ],
)  # fmt: skip
def test_walls_that_the_force_would_feel_are_doubted(changes: dict[str, str], warning: str) -> None:
    text = SHIPPED
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    said = study_of(text).warnings
    assert len(said) == bool(warning) and all(warning in line for line in said)


@pytest.mark.parametrize(
    ("until", "test", "place", "remedy"),
    [
        ("severed", "supports: {clearance: 32 mm}", "specimen.length", "use at least 52 mm"),  # 32 + 2·(1 + 0.6·15)
        ("severed", "supports: {clearance: 30 mm}", "", ""),
        ("severed", "blade: {thickness: 0.5 mm}", "solver.element_size", "use at most 0.38 mm"),  # 0.75·0.5
        ("severed", "blade: {thickness: 1.25 mm}", "", ""),  # 15/16 mm is 0.75 times 1.25 mm
        ("severed", "supports: {kind: clamped, height: 20 mm}", "", ""),
        ("first_fracture", "supports: {clearance: 32 mm}, blade: {thickness: 0.5 mm}", "", ""),
    ],
)
def test_ends_and_blades_of_further_whole_cuts_are_doubted(until: str, test: str, place: str, remedy: str) -> None:
    """A stem of 15 mm, 50 mm long, on two blocks 8 mm apart; the mesh is d/16."""
    text = (CASES / "good" / "whole-cut.yaml").read_text(encoding="utf-8").replace("until: severed", f"until: {until}")
    text = text.replace(", cutting_energy: 6.3 J, sd: {force: 100 N, cutting_energy: 0.5 J}, n: 6", "")
    said = study_of(f"{text}tests:\n  - {{name: t, kind: cutting, {test}}}\n").warnings
    said = tuple(line for line in said if " machines (" not in line)
    assert len(said) == bool(place) and all(f" {place}: " in line and remedy in line for line in said)


def test_travel_and_work_depend_on_the_element_size() -> None:
    mean = "force: 159.2 N, travel: 0.6 mm, work: 45 mJ, sd: {force: 4 N, travel: 0.03 mm, work: 3 mJ}"
    text = SHIPPED.replace("force: 159.2 N", mean, 1)

    def fitting(names: str) -> tuple[str, ...]:
        return study_of(f"{text}invert: {{responses: {names}}}\n").warnings

    assert fitting("[force]") == ()
    (both,), (one,) = fitting("all"), fitting("[force, work]")
    assert "invert.responses: travel and work depend on the mesh" in both and "responses: work depends on" in one


@pytest.mark.parametrize("size", ["0.0001 mm", "1e-300 mm", "1e-320 mm"])
def test_elements_too_small_for_any_mesh_are_refused(size: str) -> None:
    with pytest.raises(SpecError) as refused:
        study_of(SHIPPED.replace("element_size: d/16", f"element_size: {size}"))
    (problem,) = refused.value.problems
    assert "solver.element_size" in str(problem) and "too small" in str(problem)


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ("1100 kg/m3", "1100 g/cm3", "6:12: material.density: 1.1e+06 kg/m3 is outside"),
        ("1000 MPa", "1000 kPa", "7:20: material.elastic_modulus: 1 MPa is outside"),
        ("force: 159.2 N", "force: 159.2 N, sd: 0 N", "targets[1].sd: the mean has a standard deviation of 0"),
        ("low: 10, high: 20", "low: 1e4, high: 2e4", "3:53: factors.yield_stress.high: 20000 MPa is outside"),
        ("targets:", "loading: {speed: 1 mm/min}\ntargets:", ""),
        ("targets:", "loading: {duration: 1e6 s}\ntargets:", "13:21: loading.duration: 1e+06 s is outside"),
        ("targets:", "specimen: {outer_diameter: 9 mm}\ntargets:", "13:28: specimen.outer_diameter: the parameters"),
    ],
)
def test_implausible_magnitudes_are_doubted(old: str, new: str, warning: str) -> None:
    text = MINIMAL.replace(old, new, 1)
    warnings = study_of(text).warnings
    assert any(warning in line for line in warnings) if warning else not warnings


@pytest.mark.parametrize(
    ("given", "doubted"), [("2138 N", True), ("21.38 N", True), ("300 N", False), ("170 N", False)]
)
def test_a_force_far_from_its_neighbours_is_questioned(given: str, doubted: bool) -> None:
    """The published 213.8 N at 9 mm with a slip of the point; a force half as large again is scatter."""
    text = (ROOT / "configs" / "smoke.yaml").read_text(encoding="utf-8")
    warnings = study_of(text.replace("force: 213.8 N", f"force: {given}")).warnings
    assert len(warnings) == doubted
    assert not doubted or re.search(r"about 2[01]\d N expected from the other targets; check the", warnings[0])


@pytest.mark.parametrize(
    ("rows", "falls"),
    [
        ("{diameter: 8 mm, force: 159.2 N, n: 6}, {diameter: 10 mm, force: 152 N, n: 6}", "from 159.2 N .* to 152 N"),
        (
            "{diameter: 10 mm, force: 152 N}, {diameter: 8 mm, force: 159.2 N}, {diameter: 12 mm, force: 200 N}",
            "159.2 N",
        ),
        ("{diameter: 5 mm, force: 61 N}, {diameter: 7 mm, force: 120 N}, {diameter: 7.5 mm, force: 100 N}", "120 N"),
        ("{diameter: 8 mm, force: 159.2 N}, {diameter: 10 mm, force: 160 N}", ""),
        ("{diameter: 8 mm, force: 159.2 N}, {diameter: 8.3 mm, force: 155 N}", ""),
        ("{diameter: 8 mm, force: 159.2 N, sd: 50 N, n: 3}, {diameter: 10 mm, force: 152 N, sd: 40 N, n: 3}", ""),
    ],
)
def test_a_force_that_falls_with_the_diameter_is_questioned(rows: str, falls: str) -> None:
    """A row left over from the template; not where both diameters or both means are close by their scatter.

    Standard errors of 18 and 15 %: two of their ratio are 47 %, more than the 38 % to (10/8)^1.5.
    """
    head = (ROOT / "configs" / "smoke.yaml").read_text(encoding="utf-8").partition("targets:")[0]
    warnings = study_of(f"{head}targets: [{rows}]\nrsm: {{factors: [yield_stress, failure_strain]}}\n").warnings
    found = [one for one in warnings if "falls" in one]
    assert len(found) == bool(falls)
    assert not falls or re.search(falls, found[0])


def test_of_two_forces_that_contradict_each_other_both_are_questioned() -> None:
    """7 mm with four times the force of 8 mm; half of it is scatter."""
    text = (ROOT / "configs" / "smoke.yaml").read_text(encoding="utf-8")
    text = text.replace("  - {diameter: 9 mm, force: 213.8 N}\n", "")
    assert len(study_of(text.replace("force: 120 N", "force: 640 N")).warnings) == 2
    assert not study_of(text.replace("force: 120 N", "force: 80 N")).warnings


@pytest.mark.parametrize(
    "name",
    ["a/b", "a\\b", "../x", "..", ".", "C:", "x" * 65, "con", "NUL.txt", "a\nb", "a\0b", " a", "a.", "", "\u2028"],
)
def test_names_no_folder_can_have_are_refused(name: str) -> None:
    escaped = "".join(f"\\u{ord(letter):04x}" for letter in name)
    assert len(problems_of(MINIMAL.replace("name: minimal", f'name: "{escaped}"'))) == 1


@pytest.mark.parametrize("name", ["菊花 2026", "a-b_c", "x" * 64, "v1.2", "console"])
def test_names_of_folders_are_taken(name: str) -> None:
    assert study_of(MINIMAL.replace("name: minimal", f"name: {name}")).name == name


def test_tables_reached_through_a_link_outside_are_refused(tmp_path: Path) -> None:
    outside = tmp_path / "secret.csv"
    outside.write_text("f,force\n1,2\n", encoding="utf-8")
    folder = tmp_path / "study"
    folder.mkdir()
    try:
        (folder / "link.csv").symlink_to(outside)
    except OSError:
        pytest.skip("no symbolic links here")
    text = MINIMAL + "solver: {kind: sheet, file: link.csv}\n"
    with pytest.raises(SpecError, match="is outside the spec folder"):
        read_study(text.encode(), folder / "study.yaml")


@pytest.mark.parametrize("given", ['"a\\0.csv"', "a" * 5000 + ".csv", "data/../../x.csv", "''", "5", "[a]"])
def test_strange_table_names_are_refused(given: str) -> None:
    assert len(problems_of(MINIMAL + f"solver: {{kind: sheet, file: {given}}}\n")) == 1


def test_problems_of_every_section_come_at_once_in_the_order_of_lines() -> None:
    text = MINIMAL.replace("1100 kg/m3", "1100 kg").replace("high: 20", "high: 5").replace("159.2 N", "159.2")
    found = problems_of(text + "blade: {bevell: one}\nrsm: {factors: [x, y]}\n")
    assert [line.split(":")[0] for line in found] == ["3", "6", "14", "15", "16", "16"]


def test_a_missing_file_is_a_spec_error(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="cannot be read: No such file"):
        load_study(tmp_path / "absent.yaml")
    with pytest.raises(SpecError, match="the spec is a folder"):
        load_study(tmp_path)
    for name in ("a\0b.yaml", 5000 * "a", 2500 * "a/"):
        with pytest.raises(SpecError, match="cannot be read") as told:
            load_study(name)
        assert len(str(told.value)) < 400


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "gbk"])
def test_specs_in_other_encodings_load(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(MINIMAL.replace("name: minimal", "name: 菊花"), encoding=encoding)
    assert load_study(path).name == "菊花"


def test_studies_cannot_be_changed() -> None:
    study = study_of(MINIMAL)
    with pytest.raises(ValueError, match="frozen"):
        study.specimen.length = 3.0  # type: ignore[misc]


def test_a_blade_thinner_than_elements_is_questioned() -> None:
    """A whole cut of 15 mm has elements of 15/16 mm: 0.75 of a blade of 1.25 mm, so that 1.2 mm is questioned."""
    text = (CASES / "good" / "whole-cut.yaml").read_text(encoding="utf-8")
    for thickness, questioned in ((1.2, True), (1.3, False)):
        warned = study_of(f"{text}blade: {{thickness: {thickness} mm}}\n").warnings
        assert any("the blade thickness" in one for one in warned) is questioned
    varied = text.replace("factors:\n", "factors:\n  - {name: thickness, unit: mm, low: 1.2, high: 4}\n", 1)
    assert any("the blade thickness (1.2 mm)" in one for one in study_of(varied).warnings)


def test_a_solid_stem_has_no_wall() -> None:
    """Two elements across a radius: too coarse for the lengths, which is another question."""
    warnings = study_of(SHIPPED.replace("0.41", "0", 1).replace("element_size: d/16", "element_size: d/4")).warnings
    assert warnings and not any("elements_through_wall" in one for one in warnings)
