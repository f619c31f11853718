"""Files as machines write them: every mix of encoding, separator, decimal mark and heading gives the same numbers."""

from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import pytest

from stemcal.errors import UsageError
from stemcal.measured import cells
from stemcal.measured.diameters import measure_diameters
from stemcal.measured.shear_curves import read_curves
from stemcal.measured.tables import Form, read_table

ROWS = [(0.0, 0.25), (0.5, 12.5), (1.0, -3.75), (1.5, 1200.0)]


def written(separator: str, decimal: str, head: list[str]) -> str:
    body = [separator.join(f"{value:.3f}".replace(".", decimal) for value in row) for row in ROWS]
    return "\n".join([*head, *body, ""])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "gbk"])
@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("  ", "."), (" ", ",")]
)
def test_every_form_gives_the_same_numbers(tmp_path: Path, encoding: str, separator: str, decimal: str) -> None:
    head = ["试验机报告", "Specimen 7mm-1", separator.join(["Weg[mm]", "Kraft[N]"])]
    path = tmp_path / "a.csv"
    path.write_bytes(written(separator, decimal, head).encode(encoding))
    table = read_table(path)
    assert (table.columns, table.units) == (("Weg[mm]", "Kraft[N]"), ("mm", "N"))
    assert list(zip(table.numbers(0), table.numbers(1), strict=True)) == ROWS
    assert table.preamble[0] == "试验机报告"


def test_units_on_a_line_of_their_own_and_no_header(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text(written("\t", ".", ["Crosshead\tLoad", "(mm)\t(kN)"]))
    table = read_table(path)
    assert (table.columns, table.units) == (("Crosshead", "Load"), ("mm", "kN"))
    path.write_text(written(",", ".", []))
    assert read_table(path).columns == ("column 1", "column 2")


def test_summary_below_the_data_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(written(",", ".", ["x,force"]) + "\nMaximum:,1200.0,N\n")
    assert len(read_table(path).rows) == len(ROWS)


def test_western_letters_are_not_taken_for_chinese(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(written(";", ",", ["Prüfung für Stängel", "Weg;Kraft"]).encode("cp1252"))
    table = read_table(path)
    assert (table.form.encoding, table.preamble) == ("cp1252", ("Prüfung für Stängel",))


def test_what_is_given_overrides_what_is_found(tmp_path: Path) -> None:
    """Without a word `1,5` twice could be two or four numbers a line."""
    path = tmp_path / "a.csv"
    path.write_text("1,5 2,5\n3,5 4,5\n")
    assert read_table(path, Form(separator="comma", decimal="point")).rows[0] == ("1", "5 2", "5")
    assert read_table(path, Form(decimal="comma")).numbers(1) == [2.5, 4.5]


@pytest.mark.parametrize(
    ("content", "form", "words"),
    [
        (b"no numbers here\n", Form(), "no numeric rows"),
        (b"", Form(), "no numeric rows"),
        (b"x,y\n1,2\n", Form(encoding="klingon"), "--encoding klingon: unknown"),
        (b"\xff\xff\n", Form(encoding="utf-8"), "not encoded in utf-8"),
        (b"x,y\n1,2\n", Form(separator="pipe"), "--separator pipe"),
        (b"PK\x03\x04....", Form(), "cannot be read as an Excel workbook"),
    ],
)
def test_what_cannot_be_read_is_said(tmp_path: Path, content: bytes, form: Form, words: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    with pytest.raises(UsageError, match=words):
        read_table(path, form)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"none\.csv: No such file"):
        read_table(tmp_path / "none.csv")


def test_a_cell_longer_than_a_reader_of_csv_takes_is_no_number(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('Travel (mm),Force (N)\n"' + "x" * 200_000 + '",1\n1,2\n2,3\n3,4\n', "utf-8")
    with pytest.raises(UsageError, match="data row 1, Travel"):
        read_table(path).numbers(0)


def test_a_text_of_too_many_rows_or_cells_is_refused_before_it_is_split(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("diameter\n" + "7.5\n" * cells.MOST_ROWS, "utf-8")
    with pytest.raises(UsageError, match="500,000 rows"):
        read_table(path)
    path.write_text("x;y\n" + (";".join(["1"] * 1000) + "\n") * (cells.MOST_CELLS // 1000), "utf-8")
    with pytest.raises(UsageError, match="2,000,000 cells"):
        read_table(path)


def workbook(path: Path, rows: str) -> Path:
    """Write a workbook whose only sheet has these rows, as XML."""
    import openpyxl

    openpyxl.Workbook().save(path)
    with ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    space = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    sheet = f'<worksheet xmlns="{space}"><sheetData>{rows}</sheetData></worksheet>'
    parts["xl/worksheets/sheet1.xml"] = sheet.encode()
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


def test_a_small_workbook_that_unpacks_to_many_cells_is_refused(tmp_path: Path) -> None:
    path = workbook(tmp_path / "a.xlsx", ("<row>" + "<c><v>1</v></c>" * 1000 + "</row>") * 5000)
    assert path.stat().st_size < 1_000_000
    with pytest.raises(UsageError, match="unpacks to 72 MiB"):
        read_table(path)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (("<row>" + "<c/>" * 1000 + "</row>") * 21, "20,000 cells"),
        # a million rows without a cell between the heading and one number
        ('<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="A1048576"><v>1</v></c></row>', "5,000 rows"),
    ],
)
def test_a_workbook_is_read_up_to_its_limits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: str, words: str
) -> None:
    monkeypatch.setattr(cells, "MOST_ROWS", 5_000)
    monkeypatch.setattr(cells, "MOST_CELLS", 20_000)
    with pytest.raises(UsageError, match=words):
        read_table(workbook(tmp_path / "a.xlsx", rows))


# ---- formulas without stored values, as a program writes them that does not compute


def with_formulas(path: Path, time: str = "=ROW()", force: str = "=A{i}*9.81", travel: str = "=A{i}/2") -> Path:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["Time (s)", "Force (N)", "Travel (mm)"])
    for i in range(2, 12):
        texts = [cell.format(i=i) for cell in (time, force, travel)]
        book.active.append([text if text.startswith("=") else float(text) for text in texts])
    book.save(path)
    return path


@pytest.mark.parametrize(
    ("cells_of", "formula"),
    [
        ({}, r"=ROW\(\)"),
        ({"time": "{i}"}, "=A2/2"),
        ({"time": "{i}", "travel": "{i}"}, r"=A2\*9.81"),
        ({"time": "{i}", "force": "1{i}"}, "=A2/2"),
    ],
    ids=["all", "two", "force", "travel"],
)
def test_formulas_without_values_are_named_with_the_remedy(
    tmp_path: Path, cells_of: dict[str, str], formula: str
) -> None:
    path = with_formulas(tmp_path / "7mm.xlsx", **cells_of)
    with pytest.raises(UsageError, match=f"'{formula}' is a formula without a stored value; open .* and save it"):
        read_curves(path)


def test_a_formula_without_value_among_numbers_is_no_empty_cell(tmp_path: Path) -> None:
    import openpyxl

    path = with_formulas(tmp_path / "7mm.xlsx", time="{i}", force="1{i}", travel="{i}")
    assert read_curves(path)[0].max_force == 111.0
    book = openpyxl.load_workbook(path)
    book.active["B11"], book.active["C11"] = "=2*B10", "=2*C10"
    book.save(path)
    with pytest.raises(UsageError, match=r"column 'Travel \(mm\)': '=2\*C10' is a formula"):
        read_curves(path)
    with pytest.raises(UsageError, match=r"stem .*: '=2\*C10' is a formula"):
        measure_diameters(path, column="Travel (mm)")


def test_a_formula_in_an_unused_column_or_with_an_empty_text_as_value_is_no_error(tmp_path: Path) -> None:
    path = with_formulas(tmp_path / "7mm.xlsx", force="1{i}", travel="{i}")
    assert read_curves(path)[0].max_force == 111.0
    rows = "".join(f'<row><c t="n"><v>{i}</v></c><c t="str"><f>""</f><v></v></c></row>' for i in range(5))
    assert read_table(workbook(tmp_path / "a.xlsx", rows)).numbers(0) == [0.0, 1.0, 2.0, 3.0, 4.0]
