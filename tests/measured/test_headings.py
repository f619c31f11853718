"""Cells and headings of laboratories in many languages."""

from pathlib import Path

import pytest

from stemcal.errors import UsageError
from stemcal.measured.cells import decoded_table, is_missing, quoted
from stemcal.measured.headings import _is_unit_row, folded, millimetres_in, units_in
from stemcal.measured.shear import measure_shear


def test_cells() -> None:
    assert [is_missing(cell) for cell in ("", "NaN", "---", "thick")] == [True, True, True, False]
    assert (quoted("thick"), quoted("1" * 50, 8)) == ("'thick'", "'11111111…'")


def test_headings() -> None:
    names = ("KUVVET（Ｎ）", "YER DEĞİŞTİRME", "ｋＮ")
    assert [folded(name) for name in names] == ["kuvvet(n)", "yer değiştirme", "kn"]
    assert units_in(["Force [kN], travel [mm]", "Load cell: 5 kN", "s"]) == ["kN", "mm", "kN", "s"]


def test_grades_in_the_names_of_files_and_folders(tmp_path: Path) -> None:
    paths = [tmp_path / path for path in ("shear/10mm-3.csv", "7.5 mm/a.txt", "a/b.csv")]
    for path in paths:
        path.parent.mkdir()
        path.write_text("travel (mm),force (N)\n" + "".join(f"{i},{10 * i}\n" for i in range(9)))
    assert [specimen.grade for specimen in measure_shear(paths[:2]).specimens] == [10.0, 7.5]
    with pytest.raises(UsageError, match="the diameter is unknown"):
        measure_shear(paths)


def test_rows_of_units_and_lengths() -> None:
    rows = (["d", "kN"], ["", "kN", "mm", "mm"], ["kN", "Weg"])
    assert [_is_unit_row(row) for row in rows] == [True, True, False]
    texts = ("12.1 mm", "A, d = 12,1mm", "8毫米-3", "1e99mm", "1e-9 mm", "10 mm/min")
    assert [millimetres_in(text) for text in texts] == [12.1, 12.1, 8.0, None, None, None]


def test_the_encoding_of_a_chinese_machine() -> None:
    assert decoded_table("力/N".encode("gbk"), None, Path("a.csv")) == ("力/N", "gb18030")
