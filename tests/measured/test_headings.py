"""Cells and headings of laboratories in many languages."""

from stemcal.measured.headings import folded, is_missing, quoted, units_in


def test_cells() -> None:
    assert [is_missing(cell) for cell in ("", "NaN", "---", "thick")] == [True, True, True, False]
    assert (quoted("thick"), quoted("1" * 50, 8)) == ("'thick'", "'11111111…'")


def test_headings() -> None:
    names = ("KUVVET（Ｎ）", "YER DEĞİŞTİRME", "ｋＮ")
    assert [folded(name) for name in names] == ["kuvvet(n)", "yer değiştirme", "kn"]
    assert units_in(["Force [kN], travel [mm]", "Load cell: 5 kN", "s"]) == ["kN", "mm", "kN", "s"]
