"""`stemcal measure` as a laboratory uses it: files of many makers and languages, several specimens in one, mistakes."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import command

CURVE = [(0.0, 0.0), (0.1, 1.2), (0.2, 4.8), (0.3, 12.5), (0.4, 60.0), (0.5, 234.5), (0.6, 90.0), (0.7, 30.25)]
PEAK = 234.5


def lines(form: str, per: float = 1.0, scale: float = 1.0) -> str:
    """Return a line a point: t seconds, d mm, f N, g the same force times `scale`."""
    return "".join(form.format(t=0.01 * i, d=d, f=f / per, g=f * scale) for i, (d, f) in enumerate(CURVE))


def shear(folder: Path, *options: object) -> dict[str, Any]:
    """Return what `measure shear` finds; it must find something."""
    result = command("measure", "shear", folder, "--json", *options)
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)["result"]
    return found | {"notes": result.stderr}


def peaks(folder: Path, *options: object) -> dict[str, float]:
    """Return the maximum force of every specimen."""
    return {s["specimen"]: s["max_force"] for s in shear(folder, *options)["specimens"]}


def refused(folder: Path, *options: object, verb: str = "shear") -> str:
    """Return the message of a command that must end as a wrong use, soon by the processor's clock."""
    began = time.process_time()
    result = command("measure", verb, folder, *options)
    assert result.exit_code == 2, result.stdout + result.stderr
    assert "internal error" not in result.stderr and time.process_time() - began < 10.0
    return " ".join(result.stderr.split())


def write(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_bytes(text.encode(encoding))
    return path


def test_the_versions_of_the_results_are_those_that_programs_expect(tmp_path: Path) -> None:
    write(tmp_path / "8mm-1.csv", "travel (mm),force (N)\n" + lines("{d},{f}\n"))
    write(tmp_path / "stems.csv", "stem,diameter\n1,7.0\n2,8.0\n3,9.5\n")
    found = [
        shear(tmp_path / "8mm-1.csv"),
        json.loads(command("measure", "diameters", tmp_path / "stems.csv", "--json").stdout)["result"],
    ]
    assert [(one["stage"], one["schema_version"]) for one in found] == [("measure-shear", 2), ("measure-diameters", 3)]


# ---- several specimens in one file


def test_specimens_side_by_side_are_all_read(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "力(N),位移(mm),力(N),位移(mm)\n" + lines("{f},{d},{g},{d}\n", scale=2.0), "gbk")
    assert peaks(tmp_path) == {"8mm#1": PEAK, "8mm#2": 2 * PEAK}
    assert shear(tmp_path)["grades"][0]["n"] == 2


def test_diameters_over_pairs_of_columns(tmp_path: Path) -> None:
    """Merged cells in a spreadsheet: a text is above the first of its columns."""
    head = "8 mm A,,9 mm B,\nWeg [mm],Kraft [N],Weg [mm],Kraft [N]\n"
    write(tmp_path / "all.csv", head + lines("{d},{f},{d},{g}\n", scale=2.0))
    found = shear(tmp_path)
    assert [(s["specimen"], s["grade"]) for s in found["specimens"]] == [("all#1", 8.0), ("all#2", 9.0)]


@pytest.mark.parametrize("trimmed", [False, True])
def test_a_shorter_curve_beside_a_longer_one(tmp_path: Path, trimmed: bool) -> None:
    """Where the shorter one has ended its cells are empty, or the separators at the end of the line are left out."""
    rest = "{:.1f},{},,\n" if not trimmed else "{:.1f},{}\n"
    more = "".join(rest.format(0.7 + 0.1 * i, 300.0 + i) for i in range(1, 6))
    write(tmp_path / "8mm.csv", "位移,力,位移,力\n" + lines("{d},{f},{d},{g}\n", scale=3.0) + more)
    assert peaks(tmp_path) == {"8mm#1": 305.0, "8mm#2": 3 * PEAK}


def test_one_displacement_for_several_forces(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg,Kraft 1,Kraft 2\n" + lines("{d},{f},{g}\n", scale=2.0))
    found = shear(tmp_path)
    assert [s["max_force"] for s in found["specimens"]] == [PEAK, 2 * PEAK]
    assert "share one displacement column ('Weg'" in found["notes"] and "--force-column" in found["notes"]


def test_columns_that_may_be_specimens_or_channels(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg,Standardkraft,Traversenweg,Kraft DMS\n" + lines("{d},{f},{d},{g}\n", scale=2.0))
    assert "--force-column" in refused(tmp_path)
    assert peaks(tmp_path, "--force-column", "2", "--displacement-column", "1") == {"8mm": PEAK}
    both = peaks(tmp_path, "--force-column", "2,4", "--displacement-column", "1,3")
    assert both == {"8mm#1": PEAK, "8mm#2": 2 * PEAK}


def test_a_curve_of_a_whole_cut_has_its_responses(tmp_path: Path) -> None:
    """A triangle to 100 N at 1 mm, down to 80 N, a triangle to 300 N at 3 mm, down to 0 N at 4 mm: ∫F du = 530 mJ.

    The curve begins at the preload of 5 N, 0.05 mm after first contact, and ends at 30 N: less 0.125 and 1.5 mJ.
    """
    corners = np.array([[0.0, 0.0], [1.0, 100.0], [1.5, 80.0], [3.0, 300.0], [4.0, 0.0], [5.0, 0.0]])
    travel = np.arange(0.0, 5.001, 0.05)
    force = np.interp(travel, *corners.T)
    rows = "".join(f"{u:.2f},{f:.4f}\n" for u, f in zip(travel, force, strict=True))
    write(tmp_path / "8mm-1.csv", "Travel [mm],Force [N]\n" + rows)
    ended = travel <= 2.5
    rows = "".join(f"{u:.2f},{f:.4f}\n" for u, f in zip(travel[ended], force[ended], strict=True))
    write(tmp_path / "8mm-2.csv", "Travel [mm],Force [N]\n" + rows)
    whole, short = shear(tmp_path)["specimens"]
    assert whole["cutting_energy"] == pytest.approx(50.0 + 45.0 + 285.0 + 150.0 - 0.125 - 1.5)
    assert whole["first_fracture_force"] == pytest.approx(100.0) and whole["travel_at_max"] == pytest.approx(2.95)
    assert whole["first_fracture_travel"] == pytest.approx(0.95)
    assert short["cutting_energy"] is None and short["first_fracture_force"] == pytest.approx(100.0)
    shown = command("measure", "shear", tmp_path).stdout
    assert "energy, mJ" in shown and "528.4" in shown


def test_a_choice_among_channels_is_said(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg [mm],Kraft [N],Traversenweg [mm]\n" + lines("{d},{f},7\n"))
    found = shear(tmp_path)
    assert found["specimens"][0]["travel_at_max"] == pytest.approx(0.3)
    assert "displacement is read from column 'Weg [mm]', not from 'Traversenweg [mm]'" in found["notes"]


@pytest.mark.parametrize("name", ["应力", "Stress", "Spannung", "Crosshead speed", "Напряжение", "응력"])
def test_what_is_called_alike_is_no_force(tmp_path: Path, name: str) -> None:
    write(tmp_path / "8mm.csv", f"{name},位移,力\n" + lines("7,{d},{f}\n"))
    assert peaks(tmp_path) == {"8mm": PEAK}


# ---- columns without headings


@pytest.mark.parametrize("form", ["{d},{f}\n", "{f},{d}\n", "{t},{d},{f}\n"])
def test_columns_without_headings_are_never_assigned(tmp_path: Path, form: str) -> None:
    write(tmp_path / "8mm.csv", lines(form))
    said = refused(tmp_path)
    assert "no headings" in said and "--force-column" in said
    assert "0 to 234.5" in said and "0 to 0.7" in said  # what stands in each, to tell them apart


@pytest.mark.parametrize("form", ["{f},3\n", "s{f},{f},3\n"])
def test_diameters_without_headings_are_not_averaged_with_what_stands_beside(tmp_path: Path, form: str) -> None:
    path = write(tmp_path / "d.csv", "".join(form.format(f=f) for f in (7.1, 8.2, 8.9, 9.3)))
    assert "--diameter-column" in refused(path, verb="diameters")
    result = command("measure", "diameters", path, "--diameter-column", form.split(",").index("{f}") + 1, "--json")
    assert json.loads(result.stdout)["result"]["mean"] == pytest.approx(8.375)


def test_a_list_of_diameters_needs_no_heading(tmp_path: Path) -> None:
    path = write(tmp_path / "d.txt", "7.1\n8.2\n8.9\n")
    assert json.loads(command("measure", "diameters", path, "--json").stdout)["result"]["n"] == 3


# ---- workbooks


def book(path: Path, **sheets: list[list[object]]) -> Path:
    openpyxl = pytest.importorskip("openpyxl")
    found = openpyxl.Workbook()
    found.remove(found.active)
    for title, rows in sheets.items():
        sheet = found.create_sheet(title)
        for row in rows:
            sheet.append(row)
    found.save(path)
    return path


HEAD = ["时间(s)", "位移(mm)", "试验力(kN)"]


def rows_of(scale: float = 1.0) -> list[list[object]]:
    return [[0.01 * i, d, 0.001 * scale * f] for i, (d, f) in enumerate(CURVE)]


def test_a_workbook_of_one_sheet(tmp_path: Path) -> None:
    book(tmp_path / "7mm-1.xlsx", Sheet1=[["试样编号", "7mm-1"], ["直径: 7.02 mm"], [], HEAD, *rows_of()])
    found = shear(tmp_path)["specimens"][0]
    assert (found["specimen"], found["diameter"]) == ("7mm-1", 7.02)
    assert found["max_force"] == pytest.approx(PEAK)


def test_a_workbook_of_a_sheet_per_specimen(tmp_path: Path) -> None:
    summary = [["试样", "最大力(N)"], ["1", 234.5], ["2", 469.0]]
    book(tmp_path / "8mm.xlsx", 试样1=[HEAD, *rows_of()], 试样2=[HEAD, *rows_of(2.0)], 结果=summary, 空=[[]])
    assert peaks(tmp_path) == {"8mm#试样1": pytest.approx(PEAK), "8mm#试样2": pytest.approx(2 * PEAK)}
    assert "Sheet '结果' contains no curve" in shear(tmp_path)["notes"]
    assert peaks(tmp_path, "--sheet", "试样2") == {"8mm": pytest.approx(2 * PEAK)}
    assert "its sheets are '试样1', '试样2', '结果'" in refused(tmp_path, "--sheet", "third")


def test_text_cells_with_a_decimal_comma(tmp_path: Path) -> None:
    text = [[str(d).replace(".", ","), str(f).replace(".", ",")] for d, f in CURVE]
    book(tmp_path / "7mm.xlsx", a=[["Weg (mm)", "Kraft (N)"], *text])
    assert peaks(tmp_path) == {"7mm": PEAK}


def test_an_open_workbook_leaves_a_file_that_is_none(tmp_path: Path) -> None:
    book(tmp_path / "7mm.xlsx", a=[HEAD, *rows_of()])
    (tmp_path / "~$7mm.xlsx").write_bytes(b"\x05Smith")
    assert peaks(tmp_path) == {"7mm": pytest.approx(PEAK)}


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("7mm.xlsx", b"PK\x03\x04 cut off", "cannot be read as an Excel workbook"),
        ("7mm.csv", b"PK\x03\x04 cut off", "cannot be read as an Excel workbook"),
        ("7mm.xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "save the file as .xlsx or CSV"),
        ("7mm.xls", b"<html><table><tr><td>1</td></tr></table>", "save the file as .xlsx or CSV"),
    ],
)
def test_a_workbook_that_is_none_is_said(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    assert words in refused(tmp_path)


def test_an_old_name_for_text(tmp_path: Path) -> None:
    """Many Chinese machines call a table of tabs .xls."""
    write(tmp_path / "7mm.xls", "力(N)\t位移(mm)\n" + lines("{f}\t{d}\n"), "gbk")
    assert peaks(tmp_path) == {"7mm": PEAK}


# ---- machines and languages

LANGUAGES = {
    "Russian": ("Время, с;Перемещение, мм;Сила, Н", ("utf-8", "utf-16")),
    "Russian load": ("Время (сек);Ход траверсы (мм);Нагрузка (кН)", ("utf-8",)),
    "Ukrainian": ("Час, с;Переміщення, мм;Зусилля, Н", ("utf-8",)),
    "Korean": ("시간(초);변위(mm);하중(N)", ("utf-8", "utf-16")),
    "Korean force": ("시간;스트로크;시험력", ("utf-8",)),
    "Turkish": ("Süre (s);Yer değiştirme (mm);Kuvvet (N)", ("utf-8",)),
    "Turkish capitals": ("ZAMAN;UZAMA (mm);YÜK (N)", ("utf-8",)),
    "Turkish dotted": ("SÜRE;YER DEĞİŞTİRME (mm);KUVVET (N)", ("utf-8",)),
    "Turkish compounds": ("Süre (s);Kafa Deplasmanı (mm);KESME KUVVETİ (N)", ("utf-8",)),
    "Turkish load": ("Zaman;Kesme Uzaması;Basma Yükü (N)", ("utf-8",)),
    "Chinese": ("时间(s);位移(mm);试验力(N)", ("utf-8", "gbk", "utf-16")),
    "Chinese, no brackets": ("时间s;位移mm;力N", ("gbk",)),
    "Chinese, wide letters": ("时间（ｓ）;变形（ｍｍ）;负荷（Ｎ）", ("gbk",)),
    "Japanese": ("時間;変位(mm);試験力(N)", ("utf-8",)),
    "German": ("Prüfzeit;Traversenweg in mm;Prüfkraft in N", ("utf-8", "cp1252")),
    "English": ("Time;Extension (mm);Load (N)", ("utf-8",)),
}


@pytest.mark.parametrize(("name", "encoding"), [(n, e) for n, (_, codes) in LANGUAGES.items() for e in codes])
def test_headings_of_many_languages(tmp_path: Path, name: str, encoding: str) -> None:
    head = LANGUAGES[name][0]
    per = 1000.0 if "кН" in head else 1.0
    write(tmp_path / "8mm-1.txt", head + "\r\n" + lines("{t};{d};{f}\r\n", per=per), encoding)
    assert peaks(tmp_path) == {"8mm-1": pytest.approx(PEAK)}


def test_an_encoding_that_is_given(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", LANGUAGES["Russian"][0] + "\n" + lines("{t};{d};{f}\n"), "koi8-r")
    assert "--encoding" in refused(tmp_path)
    assert peaks(tmp_path, "--encoding", "koi8-r") == {"8mm": PEAK}


def test_quoted_decimal_commas_between_commas(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg,Kraft\n" + "".join(f'"{d:.3f}","{f:.3f}"\n'.replace(".", ",") for d, f in CURVE))
    assert peaks(tmp_path) == {"8mm": PEAK}
    assert peaks(tmp_path, "--decimal", "comma", "--separator", "comma") == {"8mm": PEAK}


# ---- files


def test_a_file_in_place_of_a_folder(tmp_path: Path) -> None:
    path = write(tmp_path / "8mm.csv", "Weg,Kraft\n" + lines("{d},{f}\n"))
    write(tmp_path / "9mm.csv", "Weg,Kraft\n" + lines("{d},{f}\n"))
    assert peaks(path) == {"8mm": PEAK}
    assert "does not exist" in refused(tmp_path / "none.csv")


def test_the_time_of_day_is_no_number(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg,Kraft\n" + lines("00:00:0{t},{f}\n"))
    assert "'Weg' contains '00:00:00.0' instead of numbers" in refused(tmp_path)


# ---- options that contradict each other or have no sense


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--decimal", "comma", "--separator", "comma"), "--decimal comma --separator comma"),
        (("--force-column", "1", "--displacement-column", "1"), "the same column"),
        (("--force-column", "1,2", "--displacement-column", "1,2,2"), "an equal number of each"),
        (("--force-column", "0", "--displacement-column", "1"), "no column '0'"),
        (("--force-column", "9" * 5000, "--displacement-column", "1"), "no column '9"),
        (("--preload", "nan"), "--preload"),
        (("--encoding", "punycode"), "--encoding"),
        (("--force-unit", "mm"), "unknown unit 'mm'"),
        (("--sheet", "1"), "--sheet"),
    ],
)
def test_options_without_sense(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    write(tmp_path / "8mm.csv", "Weg,Kraft\n" + lines("{d},{f}\n"))
    said = refused(tmp_path, *options)
    assert words in said
    assert len(said) < 400


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--step", "1e-9"), "--step 1e-09"),
        (("--step", "nan"), "--step"),
        (("--step", "0"), "--step"),
        (("--grades", "nan"), "--grades"),
        (("--grades", "-7"), "--grades"),
        (("--grades", "7,7.5"), "overlap"),
        (("--grades", "7,,8"), "--grades"),
        (("--grades", ",".join(str(i) for i in range(1, 500))), "--grades"),
    ],
)
def test_grades_without_sense(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    path = write(tmp_path / "d.csv", "stem,diameter\n1,7.1\n2,8\n3,9.5\n")
    said = refused(path, *options, verb="diameters")
    assert words in said
    assert len(said) < 400


# ---- hostile cells, lines and files


@pytest.mark.parametrize(
    "cell",
    ["1" * 100_000, "1" * 100_000 + "x", "1" * 5000, "1e400", "-1e400", "1e999999999", "9" * 400, "0x10", "1_000"],
    ids=lambda cell: f"{cell[:8]} {len(cell)}",
)
def test_a_cell_that_is_no_number_of_this_world(tmp_path: Path, cell: str) -> None:
    write(tmp_path / "8mm.csv", "Weg,Kraft\n" + lines("{d},{f}\n").replace("60.0", cell))
    said = refused(tmp_path)
    assert len(said) < 300
    path = write(tmp_path / "d.csv", f"stem,diameter\n1,7.1\n2,{cell}\n3,9.5\n4,8\n")
    assert len(refused(path, verb="diameters")) < 300


@pytest.mark.parametrize("line", ["0.45;1;2;3", '";77', ";;;;", "a;b;c;1"])
def test_a_line_that_cuts_the_table_in_two(tmp_path: Path, line: str) -> None:
    """Half a curve has another maximum: the line is named."""
    rows = lines("{d};{f}\n").splitlines()
    write(tmp_path / "8mm.csv", "\n".join(["Weg;Kraft", *rows[:4], line, *rows[4:], ""]))
    assert "line 6 and the adjacent lines differ" in refused(tmp_path)


def test_cycles_with_words_between_are_said(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg;Kraft\n" + lines("{d};{f}\n") + "Cycle 2\n" + "0.1;7\n0.2;8\n")
    assert "Numeric rows outside the curve table were skipped (2 rows)" in shear(tmp_path)["notes"]


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("0mm-1.csv", ""),
        ("99999mm.csv", ""),
        ("9" * 60 + "mm.csv", ""),
        ("a.csv", "Diameter: 0 mm\n"),
        ("a.csv", "Diameter: 99999 cm\n"),
        ("a.csv", f"Diameter: {'9' * 400} mm\n"),
    ],
)
def test_a_diameter_that_is_none(tmp_path: Path, name: str, head: str) -> None:
    write(tmp_path / name, f"{head}Weg,Kraft\n" + lines("{d},{f}\n"))
    assert "diameter" in refused(tmp_path)


@pytest.mark.parametrize("value", ["-7", "0", "1e5", "nan", "", "thick", "1e400"])
def test_an_index_with_a_diameter_that_is_none(tmp_path: Path, value: str) -> None:
    write(tmp_path / "a.csv", "Weg,Kraft\n" + lines("{d},{f}\n"))
    index = write(tmp_path / "index.csv", f"file,diameter\na.csv,{value}\nb.csv,7\n")
    assert "diameter" in refused(tmp_path, "--index", index)


def test_an_index_without_its_columns(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg,Kraft\n" + lines("{d},{f}\n"))
    index = write(tmp_path / "index.csv", "a,b\n8mm.csv,7\n")
    said = refused(tmp_path, "--index", index)
    assert "`file` and `diameter`" in said and "--file-column" not in said


def test_what_an_index_names_and_nobody_has(tmp_path: Path) -> None:
    write(tmp_path / "8mm.csv", "Weg,Kraft\n" + lines("{d},{f}\n"))
    index = write(tmp_path / "index.csv", "file,diameter\n8mm.csv,8.1\n9mm.csv,9\n")
    assert "files that do not exist: 9mm.csv" in shear(tmp_path, "--index", index)["notes"]


@pytest.mark.parametrize(
    "name", ["stem² 7mm.csv", "7mm ¹²³.csv", "7mm " + "1" * 200 + ".csv", "٧ 7mm.csv", "7mm 五.csv"]
)
def test_digits_of_other_scripts_in_names(tmp_path: Path, name: str) -> None:
    write(tmp_path / name, "Weg,Kraft\n" + lines("{d},{f}\n"))
    assert len(peaks(tmp_path)) == 1


def test_a_file_without_end(tmp_path: Path) -> None:
    if not Path("/dev/zero").exists():
        pytest.skip("needs /dev/zero")
    assert "not a file" in refused(Path("/dev/zero"), verb="diameters")


def test_files_that_differ_in_their_ending_are_two_specimens(tmp_path: Path) -> None:
    write(tmp_path / "8mm-1.csv", "Weg,Kraft\n" + lines("{d},{f}\n"))
    write(tmp_path / "8mm-1.txt", "Weg\tKraft\n" + lines("{d}\t{f}\n"))
    found = shear(tmp_path)
    assert [s["specimen"] for s in found["specimens"]] == ["8mm-1.csv", "8mm-1.txt"]
