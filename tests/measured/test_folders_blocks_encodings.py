"""Files with one name in several folders, several blocks in one file, encodings of Central and Eastern Europe."""

from pathlib import Path

import pytest

from stemcal.errors import UsageError
from stemcal.measured.shear import find_files, measure_shear, read_index


def rows(maximum: float, ends: float = 0.0) -> list[str]:
    """Return a curve that rises over 2 mm to a maximum and falls over 1 mm."""
    force = [maximum * min(i, 20) / 20 if i <= 20 else max(ends, maximum * (30 - i) / 10) for i in range(31)]
    return [f"{0.1 * i:.1f};{value:.2f}" for i, value in enumerate(force)]


def written(path: Path, *lines: str, heads: str = "Travel [mm];Force [N]", encoding: str = "utf-8") -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_bytes("\n".join((heads, *lines, "")).encode(encoding))
    return path


# ---- folders


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    for diameter, maximum in ((7, 100.0), (8, 150.0)):
        for number in (1, 2):
            written(tmp_path / f"{diameter}mm" / f"{number}.csv", *rows(maximum + number))
    return tmp_path


def test_files_with_one_name_are_called_with_their_folders(folders: Path) -> None:
    tests = measure_shear(find_files(folders))
    assert [s.name for s in tests.specimens] == ["7mm/1", "7mm/2", "8mm/1", "8mm/2"]
    assert [s.curve.max_force for s in tests.specimens] == pytest.approx([101.0, 102.0, 151.0, 152.0])
    left = measure_shear(find_files(folders), exclude=["8mm/1"])
    assert [s.name for s in left.specimens] == ["7mm/1", "7mm/2", "8mm/2"]


def test_names_are_as_short_as_they_can_be(folders: Path) -> None:
    written(folders / "8mm" / "3.csv", *rows(153.0))
    written(folders / "8mm" / "2.txt", *rows(154.0))
    names = [s.name for s in measure_shear(find_files(folders)).specimens]
    assert names == ["7mm/1", "7mm/2", "8mm/1", "8mm/2.csv", "2.txt", "3"]


@pytest.mark.parametrize("mark", ["/", "\\"])
def test_an_index_has_the_folders_of_its_files(folders: Path, mark: str) -> None:
    entries = {"7mm/1": 7.1, "8mm/1": 8.2, "7mm/2.csv": 7.3, "./8mm/2.csv": 8.4}
    text = "\n".join(f"{name.replace('/', mark)},{diameter}" for name, diameter in entries.items())
    (folders / "index.csv").write_text(f"file,diameter\n{text}\n")
    tests = measure_shear(find_files(folders), index=read_index(folders / "index.csv"))
    assert [s.diameter for s in tests.specimens] == [7.1, 7.3, 8.2, 8.4] and not tests.notes


def test_a_name_of_several_files_in_an_index_is_refused(folders: Path) -> None:
    with pytest.raises(UsageError, match=r"'1.csv' is the name of several files; write the folder"):
        measure_shear(find_files(folders), index={"1.csv": (7.1, None)})


# ---- blocks


@pytest.mark.parametrize("gap", [[], [""], ["", "", ""]])
def test_two_curves_below_each_other_are_refused(tmp_path: Path, gap: list[str]) -> None:
    """Before, the larger maximum was that of both."""
    path = written(tmp_path / "7mm-1.csv", *rows(100.0), *gap, *rows(150.0))
    with pytest.raises(UsageError, match=r"jumps from 3 to 0 mm at row 32 .* several curves"):
        measure_shear([path])


def test_a_return_stroke_is_part_of_its_curve(tmp_path: Path) -> None:
    back = ["0.0;0.1", "0.0;0.0", "0.0;0.1", "0.0;0.0", "0.0;0.0"]
    tests = measure_shear([written(tmp_path / "7mm-1.csv", *rows(100.0), *back)])
    assert tests.specimens[0].curve.max_force == pytest.approx(100.0)


@pytest.mark.parametrize("heads", ["Travel [mm];Force [N]", "No;Travel [mm];Force [N]"])
def test_a_further_block_with_its_own_headings_is_noted(tmp_path: Path, heads: str) -> None:
    first = ";" * heads.count("No;")
    other = [f"1;{row}" if first else row for row in rows(150.0)[:-4]]
    tests = measure_shear([written(tmp_path / "7mm-1.csv", *rows(100.0), "", "Second", heads, *other)])
    (note,) = (note for note in tests.all_notes() if note.kind == "rows_apart")
    assert tests.specimens[0].curve.max_force == pytest.approx(100.0) and "27 rows" in note.text


# ---- encodings


@pytest.mark.parametrize(
    ("heads", "encoding"),
    [
        ("Przemieszczenie [mm];Siła [N]", "cp1250"),
        ("Dráha [mm];Zatížení [N]", "cp1250"),
        ("Elmozdulás [mm];Erő [N]", "cp1250"),
        ("Перемещение [мм];Нагрузка [Н]", "cp1251"),
        ("Переміщення, мм;Зусилля, Н", "cp1251"),
        ("Traversenweg [mm];Prüfkraft [N]", "cp1252"),
        ("Déplacement [mm];Force [N]", "cp1252"),
        ("位移/mm;力/N", "gbk"),
        ("行程(mm);试验力(N)", "gb18030"),
    ],
)
def test_headings_are_read_in_the_encoding_of_the_machine(tmp_path: Path, heads: str, encoding: str) -> None:
    (specimen,) = measure_shear(
        [written(tmp_path / "7mm-1.csv", *rows(100.0), heads=heads, encoding=encoding)]
    ).specimens
    assert specimen.curve.max_force == pytest.approx(100.0) and len(specimen.curve.travel) == 30


# ---- missing values, offsets


@pytest.mark.parametrize("line", ["NaN;NaN", "--;--", "n/a;n/a"])
@pytest.mark.parametrize("at", [1, 4, 15, 20, 29])
def test_a_line_of_missing_values_does_not_end_the_curve(tmp_path: Path, line: str, at: int) -> None:
    lines = rows(150.0)
    path = written(tmp_path / "8mm-1.csv", *lines[:at], line, *lines[at:])
    (specimen,) = measure_shear([path]).specimens
    assert specimen.curve.max_force == 150.0 and specimen.curve.travel[-1] == pytest.approx(3.0, abs=0.11)
    assert "rows_left_out" in [note.kind for note in specimen.curve.notes]


@pytest.mark.parametrize(("offset", "noted"), [(0.0, False), (9.0, False), (40.0, True)])
def test_an_offset_of_the_load_cell_is_questioned(tmp_path: Path, offset: float, noted: bool) -> None:
    lines = [f"{row.split(';')[0]};{float(row.split(';')[1]) + offset:.2f}" for row in rows(150.0)]
    (specimen,) = measure_shear([written(tmp_path / "8mm-1.csv", *lines)]).specimens
    assert ("force_at_start" in [note.kind for note in specimen.curve.notes]) is noted


@pytest.mark.parametrize(
    ("heads", "encoding"),
    [
        ("変位(mm);試験力(N)", "shift_jis"),
        ("位移(mm);荷重(N)", "big5"),
        ("변위(mm);하중(N)", "euc_kr"),
        ("位移(mm);力(N)", "gbk"),
    ],
)
def test_eastern_encodings_are_detected_by_known_words(tmp_path: Path, heads: str, encoding: str) -> None:
    path = written(tmp_path / "8mm-1.csv", *rows(150.0), heads=heads, encoding=encoding)
    (specimen,) = measure_shear([path]).specimens
    assert specimen.curve.max_force == 150.0 and not specimen.curve.notes
