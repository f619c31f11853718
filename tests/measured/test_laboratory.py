"""Diameters and shear tests: the shipped synthetic examples, and files that go wrong."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from stemcal.errors import UsageError
from stemcal.measured.diameters import _proposed_grades, geometry_section, measure_diameters
from stemcal.measured.shear import find_files, measure_shear, read_index, row_of, section_of, target_rows
from stemcal.measured.shear_curves import CurveOptions, contact_begins, read_curves
from stemcal.measured.statistics import summarise
from stemcal.study.model.layers import layers_at
from stemcal.study.reading.read import read_study

DATA = Path(__file__).parents[2] / "configs" / "data"
MEANS = {7.0: 120.0, 8.0: 159.2, 9.0: 213.8, 10.0: 300.0, 11.0: 378.2}


def curve_file(path: Path, force: list[float], head: str = "travel (mm),force (N)") -> Path:
    path.write_text("\n".join([head, *(f"{0.1 * i:.1f},{f}" for i, f in enumerate(force)), ""]))
    return path


def test_the_examples_are_what_their_script_makes(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("make_measured", DATA / "make_measured.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main(tmp_path)
    made = {p.relative_to(tmp_path): p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    shipped = {name: (DATA / name).read_bytes() for name in made}
    assert len(made) == 31
    assert made == shipped


def test_examples_say_that_they_are_synthetic_and_have_the_published_means() -> None:
    tests = measure_shear(find_files(DATA / "measured-shear"))
    assert tests.synthetic
    assert {g.diameter: g.summary.mean for g in tests.grades} == pytest.approx(MEANS)
    assert [g.summary.n for g in tests.grades] == [6] * 5
    assert "SYNTHETIC" in target_rows(tests)[0]
    assert measure_diameters(DATA / "measured-diameters.csv").synthetic


def test_diameters_of_the_example() -> None:
    found = measure_diameters(DATA / "measured-diameters.csv", grades=[7, 8, 9, 10, 11])
    assert (found.summary.n, found.readings) == (50, 150)
    assert found.summary.mean == pytest.approx(8.90, abs=0.02)
    assert [grade.low for grade in found.grades] == [6.5, 7.5, 8.5, 9.5, 10.5]
    assert sum(grade.share_percent for grade in found.grades) > 90
    assert found.normality.p == pytest.approx(0.3972, abs=1e-4)


def test_repeats_are_averaged_per_stem_in_columns_or_rows(tmp_path: Path) -> None:
    wide, long = tmp_path / "wide.csv", tmp_path / "long.csv"
    wide.write_text("stem,d1 (cm),d2 (cm)\nA,0.70,0.72\nB,0.80,\nC,0.95,0.93\n")
    long.write_text("stem;diameter\nA;7,0\nA;7,2\nB;8,0\nC;9,5\nC;9,3\n")
    for path in (wide, long):
        assert [stem.diameter for stem in measure_diameters(path).stems] == pytest.approx((7.1, 8.0, 9.4))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stem,diameter\n1,8.1\n2,thick\n3,8.0\n4,7\n5,9\n", "stem 2: 'thick' is not a number|at least three"),
        ("stem,diameter\n1,8.1\n2,-8\n3,8.0\n", "stem 2: -8 mm is not a plausible diameter"),
        ("stem,diameter\n1,8\n2,8\n3,8\n", "three stems of different diameters"),
        ("stem,diameter (furlong)\n1,8\n2,9\n3,8\n", "unknown unit 'furlong'"),
    ],
)
def test_wrong_diameters_are_named(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "d.csv"
    path.write_text(text)
    with pytest.raises(UsageError, match=words):
        measure_diameters(path)


def test_grades_are_the_fewest_that_hold_95_percent() -> None:
    values = [7.0] * 10 + [8.0] * 40 + [9.0] * 40 + [10.0] * 9 + [3.0]
    assert _proposed_grades(values) == [7.0, 8.0, 9.0, 10.0]
    assert _proposed_grades(values, step=2.0) == [8.0, 10.0]


def test_preload_is_trimmed_and_travel_counted_from_there(tmp_path: Path) -> None:
    curve = read_curves(curve_file(tmp_path / "8mm-1.csv", [0.5, 6.0, 1.0, 4.0, 30.0, 80.0, 50.0, 1.0]))[0]
    assert (curve.trimmed, curve.max_force) == (3, 80.0)
    assert curve.travel_at_max == pytest.approx(0.2)
    assert curve.travel[0] == 0.0
    assert contact_begins(np.array([20.0, 60.0, 30.0]), 5.0) == 0


def test_units_signs_and_columns(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = "\n".join(f"{i},{-0.01 * i},{0.02 * i},7" for i in range(8))
    path.write_text(f"t (s),load (kN),position (cm),x\n{rows}\n")
    curve = read_curves(path)[0]
    assert (curve.max_force, curve.travel_at_max) == pytest.approx((70.0, 1.4))
    assert [note.kind for note in curve.notes] == ["pressing_is_positive", "largest_at_end"]
    assert read_curves(path, CurveOptions(force_unit="N", preload=0.01))[0].max_force == pytest.approx(0.07)
    assert read_curves(path, CurveOptions(force_column="4", preload=1.0))[0].max_force == 7.0
    with pytest.raises(UsageError, match="no column 'weight' for force; its columns are 't"):
        read_curves(path, CurveOptions(force_column="weight"))


def test_a_specimen_counts_until_it_is_excluded(tmp_path: Path) -> None:
    peaks = {"a": 100.0, "b": 102.0, "c": 98.0, "d": 101.0, "e": 99.0, "bad": 180.0}
    for name, peak in peaks.items():
        curve_file(tmp_path / f"8mm-{name}.csv", [0.0, 10.0, peak / 2, peak, 20.0])
    files = find_files(tmp_path)
    kept = measure_shear(files)
    assert kept.grades[0].summary.mean == pytest.approx(680 / 6)
    (note,) = kept.all_notes()
    assert note.kind == "outlier" and "8mm-bad" in note.text
    without = measure_shear(files, exclude=["8mm-bad"])
    assert (without.grades[0].summary.n, without.grades[0].summary.mean) == (5, 100.0)
    (note,) = without.all_notes()
    assert note.kind == "excluded" and "8mm-bad" in note.text
    with pytest.raises(UsageError, match="no such specimen"):
        measure_shear(files, exclude=["9mm-x"])


def test_where_the_diameter_comes_from(tmp_path: Path) -> None:
    force = [0.0, 10.0, 50.0, 90.0, 20.0]
    plain = curve_file(tmp_path / "s1.csv", force)
    stated = curve_file(tmp_path / "s2.csv", force, "Stem diameter: 7,6 mm\ntravel (mm),force (N)")
    (tmp_path / "9 mm").mkdir()
    in_folder = curve_file(tmp_path / "9 mm" / "s3.csv", force)
    with pytest.raises(UsageError, match="the diameter is unknown"):
        measure_shear([plain])
    index = tmp_path / "index.csv"
    index.write_text("file,diameter\ns1.csv,8.2\n")
    assert index not in find_files(tmp_path)
    found = measure_shear([plain, stated, in_folder], index=read_index(index))
    assert [(s.diameter, s.grade) for s in found.specimens] == [(8.2, 8.0), (7.6, 8.0), (9.0, 9.0)]


def test_travel_and_work_to_the_maximum(tmp_path: Path) -> None:
    """0, 10, 50, 90 N at 0, 0.1, 0.2, 0.3 mm from the last point below the preload: ∫F du = 0.5 + 3 + 7 = 10.5 mJ."""
    from stemcal.study.reading import read_study
    from stemcal.study.reading.read import with_rows

    for name, most in (("a", 90.0), ("b", 110.0)):
        curve_file(tmp_path / f"8mm-{name}.csv", [0.0, 10.0, 50.0, most, 20.0])
    tests = measure_shear(find_files(tmp_path))
    assert [s.curve.work_to_max for s in tests.specimens] == pytest.approx([10.5, 11.5])
    (grade,) = tests.grades
    assert (grade.travel.mean, grade.travel.sd) == pytest.approx((0.3, 0.0), abs=1e-12)
    assert (grade.work.mean, grade.work.sd) == pytest.approx((11.0, 0.5**0.5))
    rows = target_rows(tests, work=True)
    section = section_of(rows)
    assert "travel: 0.3 mm, work: 11 mJ," in section and "work: 0.7071 mJ}" in section
    assert max(map(len, section.splitlines())) <= 72
    spec = DATA.parent / "smoke.yaml"
    (target,) = read_study(with_rows(spec.read_text("utf-8"), {"": rows}).encode(), spec).targets.means
    assert (*target.mean_of("work"), target.n) == (11.0, 0.7071, 2)


@pytest.mark.parametrize(
    ("means", "row"),
    [
        ({"force": [9.0, 11.0]}, "force: 10 N, sd: 1.41 N, n: 2"),
        ({"force": [10.0]}, "force: 10 N, n: 2"),
        ({"force": [10.0], "work": [5.0]}, "force: 10 N, work: 5 N, n: 2"),
        ({"force": [10.0], "work": [4.0, 6.0]}, "force: 10 N, work: 5 N, sd: {work: 1.41 N}, n: 2"),
    ],
)
def test_a_row_has_the_standard_deviations_that_are_known(means: dict[str, list[float]], row: str) -> None:
    summaries = {name: (summarise(values), "N") for name, values in means.items()}
    assert row_of(8.0, summaries, 2, lambda value: f"{value:.3g}") == f"{{diameter: 8 mm, {row}}}"


def test_files_are_sorted_by_number() -> None:
    names = [path.stem for path in find_files(DATA / "measured-shear")]
    assert (names[0], names[6], names[-1]) == ("7mm-1", "8mm-1", "11mm-6")


def test_rows_of_the_cut_are_replaced_alone() -> None:
    from stemcal.study.reading import read_study
    from stemcal.study.reading.read import with_rows

    spec = DATA.parent / "wild-chrysanthemum-as-published.yaml"
    text = spec.read_text("utf-8")
    rows = target_rows(measure_shear(find_files(DATA / "measured-shear")))
    changed = with_rows(text, {"": rows})
    study = read_study(changed.encode(), spec)
    assert study.calibration_target.response == 159.2
    assert [target.n for target in study.targets.means] == [6] * 5
    assert all(target.sd for target in study.targets.means)
    outside = [line for line in text.splitlines() if line not in changed.splitlines()]
    assert all("diameter:" in line for line in outside)


@pytest.mark.parametrize("head", ["12.1 mm,,13.2 mm,", "d = 12.1 mm,,d = 13.2 mm,", "A (d=12.1mm),,B (d=13.2mm),"])
@pytest.mark.parametrize("name", ["a.csv", "9mm-1.csv"])
def test_diameters_stand_over_the_columns_whatever_the_file_is_called(tmp_path: Path, name: str, head: str) -> None:
    force = [0.0, 0.0, 2.0, 40.0, 80.0, 120.0, 160.0, 90.0, 20.0]
    lines = [head, "travel (mm),force (N),travel (mm),force (N)"]
    lines += [f"{0.1 * i:.1f},{f},{0.1 * i:.1f},{1.2 * f}" for i, f in enumerate(force)]
    (tmp_path / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = measure_shear([tmp_path / name], CurveOptions())
    assert [(s.diameter, s.grade, s.curve.max_force) for s in found.specimens] == [
        (12.1, 12.0, pytest.approx(160.0)),
        (13.2, 13.0, pytest.approx(192.0)),
    ]


@pytest.mark.parametrize(
    ("heads", "how"),
    [
        ([",6.1 mm,6.1 mm,5.9 mm", "travel (mm),force (N),force (N),force (N)"], CurveOptions()),
        ([",d = 6.1 mm,d = 6.1 mm,d = 5.9 mm", "travel (mm),force (N),force (N),force (N)"], CurveOptions()),
        (["travel (mm),force 6.1 mm (N),force 6.1 mm (N),force 5.9 mm (N)"], CurveOptions()),
        (["travel (mm),6.1 mm,6.1 mm,5.9 mm"], CurveOptions(force_column="2,3,4", force_unit="N")),
    ],
)
def test_diameters_over_forces_that_share_a_displacement(tmp_path: Path, heads: list[str], how: CurveOptions) -> None:
    """Two stems of one diameter keep it, and are told apart by their numbers."""
    lines = [*heads, *(f"{0.1 * i:.1f},{f},{1.1 * f:.1f},{0.9 * f:.1f}" for i, f in enumerate([0, 2, 40, 80, 160, 20]))]
    (tmp_path / "9mm.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = measure_shear([tmp_path / "9mm.csv"], how).specimens
    assert [(s.name, s.diameter, s.grade) for s in found] == [
        ("9mm#1", 6.1, 6.0), ("9mm#2", 6.1, 6.0), ("9mm#3", 5.9, 6.0)
    ]  # fmt: skip


def test_a_diameter_over_the_only_specimen(tmp_path: Path) -> None:
    lines = ["d = 6.1 mm,", "travel (mm),force (N)", *(f"{0.1 * i:.1f},{f}" for i, f in enumerate([0, 2, 40, 80, 20]))]
    (tmp_path / "9mm.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (one,) = measure_shear([tmp_path / "9mm.csv"]).specimens
    assert (one.name, one.diameter, one.curve.max_force) == ("9mm", 6.1, 80.0)


VARIETIES = [("A", 1, 6.1), ("A", 2, 7.4), ("A", 3, 8.2), ("B", 1, 9.0), ("B", 2, 10.3), ("B", 3, 11.5)]


def varieties(tmp_path: Path, head: str = "variety,plant,diameter") -> Path:
    path = tmp_path / "stems.csv"
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in VARIETIES), ""]))
    return path


def test_plants_of_two_varieties_with_the_same_number(tmp_path: Path) -> None:
    """Three stems of two readings by the plant alone, which is noted; six with the columns that the note names."""
    path = varieties(tmp_path)
    merged = measure_diameters(path)
    assert [stem.diameter for stem in merged.stems] == pytest.approx([7.55, 8.85, 9.85])
    (note,) = merged.notes
    assert (note.kind, note.severity) == ("labels_repeated", "warning") and note.remedy is not None
    advised = re.search(r"--label-column (\S+)`", note.remedy.text)
    assert advised is not None and advised[1] == "variety,plant"
    for label in (advised[1], "1,2", "none"):
        stems = measure_diameters(path, label=label)
        assert [stem.diameter for stem in stems.stems] == [row[2] for row in VARIETIES]
        assert (stems.summary.sd, stems.notes) == (pytest.approx(1.9583, abs=1e-4), ())


def test_a_heading_with_a_space_is_advised_by_number(tmp_path: Path) -> None:
    (note,) = measure_diameters(varieties(tmp_path, "variety name,plant,diameter")).notes
    assert note.remedy is not None and "`--label-column 1,2`" in note.remedy.text


def test_adjacent_plants_of_two_varieties_are_a_question_but_remarks_are_none(tmp_path: Path) -> None:
    """Rows sorted by the number of the plant; a remark on some rows does not name a plant."""
    rows = sorted(VARIETIES, key=lambda row: row[1])
    path = tmp_path / "stems.csv"
    path.write_text("\n".join(["variety,plant,diameter", *(",".join(map(str, row)) for row in rows), ""]))
    (note,) = measure_diameters(path).notes
    assert note.kind == "labels_repeated" and note.remedy is not None
    assert "`--label-column variety,plant`" in note.remedy.text
    assert len(measure_diameters(path, label="variety,plant").stems) == 6
    path.write_text("plant,diameter,remark\n1,6.0,\n1,6.2,bent\n2,7.0,\n2,7.2,\n3,8.0,\n3,8.2,\n")
    assert measure_diameters(path).notes == ()


def test_the_number_of_a_reading_is_no_diameter(tmp_path: Path) -> None:
    """A column of readings is one of diameters only if no other column is called so."""
    path = tmp_path / "stems.csv"
    path.write_text("plant,reading,diameter\n1,1,6.0\n1,2,6.2\n2,1,7.0\n2,2,7.2\n3,1,8.0\n3,2,8.2\n")
    found = measure_diameters(path)
    assert [stem.diameter for stem in found.stems] == pytest.approx([6.1, 7.1, 8.1]) and found.readings == 6
    path.write_text("plant,reading 1,reading 2\n1,6.0,6.2\n2,7.0,7.2\n3,8.0,8.2\n")
    assert [stem.diameter for stem in measure_diameters(path).stems] == pytest.approx([6.1, 7.1, 8.1])


def test_adjacent_readings_of_a_stem_are_no_question(tmp_path: Path) -> None:
    path = tmp_path / "stems.csv"
    path.write_text("plant,diameter\n1,6.0\n1,6.2\n2,7.0\n2,7.2\n3,8.0\n3,8.2\n")
    found = measure_diameters(path)
    assert [stem.diameter for stem in found.stems] == pytest.approx([6.1, 7.1, 8.1]) and found.notes == ()


SECTIONED = """\
stem;outer diameter (mm);inner diameter (mm);skin thickness / mm
a;6.9;2.7;0.40
a;7.1;2.9;0.42
b;7.2;2.6;
c;8.1;3.3;0.50
d;7.9;3.1;0.52
e;10.2;0;0.71
"""


def test_bore_and_skin_are_means_of_each_grade_and_a_spec_reads_them(tmp_path: Path) -> None:
    """7 mm: stems a (7.0; 2.8, .41) and b (7.2; 2.6); 8 mm: c, d; 10 mm: e, a solid stem. Of 9 mm there are none."""
    path = tmp_path / "sections.csv"
    path.write_text(SECTIONED, encoding="utf-8")
    found = measure_diameters(path)
    assert [stem.diameter for stem in found.stems] == pytest.approx((7.0, 7.2, 8.1, 7.9, 10.2))
    assert found.bore == pytest.approx({"7 mm": 2.7, "8 mm": 3.2, "10 mm": 0.0})
    assert found.skin == pytest.approx({"7 mm": 0.41, "8 mm": 0.51, "10 mm": 0.71})
    spec = "name: a\nfactors:\n  - {name: yield_stress, unit: MPa, low: 10, high: 20}\nmaterial: {density: 1100 kg/m3, "
    spec += "elastic_modulus: 1 GPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa, hardening_parameter: 0, "
    spec += "failure_strain: 0.03}\nsolver: {kind: embedded, rate_law: none}\n"
    spec += "targets: [{diameter: 8 mm, force: 100 N}, {diameter: 9 mm, force: 130 N}]\n"
    study = read_study((spec + geometry_section(found)).encode(), tmp_path / "study.yaml")
    assert study.specimen.ratio_at(8.0) == pytest.approx(3.2 / 8.0)
    assert study.specimen.ratio_at(9.0) == pytest.approx(1.6 / 9.0)
    outer, _ = layers_at(study, {}, 9.0)
    assert outer.thickness == pytest.approx(0.61)


def test_a_diameter_alone_has_no_section_and_a_bore_is_smaller(tmp_path: Path) -> None:
    path = tmp_path / "sections.csv"
    path.write_text("d,bore\n7 mm,\n".replace(" mm", "") + "7.1,\n8.2,\n", encoding="utf-8")
    assert geometry_section(measure_diameters(path, column="d")) == ""
    path.write_text("stem,diameter,bore\n1,7,2\n2,8,8.1\n3,9,3\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"stem 2: 'bore' is 8.1 mm, but the diameter 8 mm"):
        measure_diameters(path)
