"""Files in the forms that testing machines of many makers write: all hold the same curve of 1234.5 N at 0.3 mm."""

from pathlib import Path

import pytest

from stemcal.errors import UsageError
from stemcal.measured.headings import FORCE, NEWTONS
from stemcal.measured.shear_curves import CurveOptions, read_curves
from stemcal.measured.tables import read_table

CURVE = [(0.0, 0.0), (0.1, 1.2), (0.2, 4.8), (0.3, 12.5), (0.4, 60.0), (0.5, 1234.5), (0.6, 900.0), (0.7, 300.25)]
MICROMETRES = "\u00b5m"


def rows(form: str, swap: bool = False, per: float = 1.0) -> str:
    """Return the curve, a line each: t seconds, d mm, f N; `swap` exchanges comma and point."""
    text = "".join(form.format(t=t, d=d, f=f / per) for t, (d, f) in enumerate(CURVE))
    return text.translate(str.maketrans(".,", ",.")) if swap else text


MACHINES = {
    "quoted, with thousands set apart": (
        '"Specimen","A"\r\n"Width","5 mm"\r\n\r\n"Time","Extension","Load"\r\n"(s)","(mm)","(N)"\r\n'
        + rows('"{t:,.3f}","{d:,.5f}","{f:,.4f}"\r\n'), "utf-8",
    ),
    "German words joined, a line of units": (
        "Prüfprotokoll;\r\nKunde;Uni\r\nPrüfzeit;Standardweg;Standardkraft\r\ns;mm;N\r\n"
        + rows("{t:.2f};{d:.4f};{f:.3f}\r\n", swap=True), "cp1252",
    ),
    "decimal comma, point between thousands": (
        "Weg in mm;Kraft in N\r\n" + rows("{d:.4f};{f:,.3f}\r\n", swap=True), "utf-8-sig",
    ),
    "apostrophe between thousands": ("Weg [mm];Kraft [N]\n" + rows("{d};{f:,.2f}\n").replace(",", "'"), "utf-8"),
    "force before stroke": ("Date,2026/11/21\r\nTime,Force,Stroke\r\nsec,N,mm\r\n" + rows("{t},{f},{d}\r\n"), "utf-8"),
    "grams": ("Force (g)\tDistance (mm)\tTime (sec)\n" + rows("{f:.3f}\t{d}\t{t}\n", per=0.00980665), "utf-8"),
    "Chinese, kN, stress beside": (
        "万能试验机\n试样编号：3\n时间(s)\t应力(MPa)\t试验力(kN)\t位移(mm)\n"
        + rows("{t}\t{t}\t{f:.6f}\t{d}\n", per=1000.0), "gbk",
    ),
    "Chinese units, UTF-16": ("负荷值（牛）,变形量（毫米）\r\n" + rows("{f},{d}\r\n"), "utf-16"),
    "exponents": ("A|B|1|2\n\nCrosshead \tLoad \tTime \nmm\tN\ts\n" + rows("{d:.5E}\t{f:.5E}\t{t}\n"), "utf-8"),
    "time of day": ("Date Time,Force [N],Position [mm]\n" + rows("2026-11-21 10:00:{t:02d},{f},{d}\n"), "utf-8"),
    "two channels of force": ("Time s,Force kN,Force N,Extension mm\n" + rows("{t},0,{f},{d}\n"), "utf-8"),
    "Spanish": ("Tiempo (s);Desplazamiento (mm);Fuerza (N)\n" + rows("{t};{d};{f}\n", swap=True), "utf-8"),
    "French, decanewtons": ("Déplacement (mm);Force (daN)\n" + rows("{d};{f}\n", swap=True, per=10.0), "latin-1"),
    "units in capitals": (
        "MTS793|MPT|ENU|1|2\r\n\r\nAxial Displacement\tAxial Force\tTime\r\nMM\tKN\tSec\r\n"
        + rows("{d:.6f}\t{f:.7f}\t{t:.4f}\r\n", per=1000.0), "utf-8",
    ),
    "columns by spaces": ("  displacement   force\n" + rows("  {d:9.4f}  {f:12.4f}\n"), "utf-8"),
    "micrometres": (f"Position ({MICROMETRES}),Force(N)\n" + "".join(f"{1000 * d},{f}\n" for d, f in CURVE), "utf-8"),
    "results below": ("Displacement/mm,Force/N\n" + rows("{d},{f}\n") + "Max force,1234.5\nMean,800\n", "utf-8"),
}  # fmt: skip


@pytest.mark.parametrize("name", MACHINES)
def test_every_machine_gives_the_same_curve(tmp_path: Path, name: str) -> None:
    text, encoding = MACHINES[name]
    path = tmp_path / "7mm-1.csv"
    path.write_bytes(text.encode(encoding))
    how = CurveOptions(force_column="Force N") if name == "two channels of force" else CurveOptions()
    curve = read_curves(path, how)[0]
    assert curve.max_force == pytest.approx(1234.5, abs=0.01)
    assert curve.travel_at_max == pytest.approx(0.3)
    assert (curve.trimmed, len(curve.force)) == (2, 6)


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    path = tmp_path / "7mm-1.csv"
    path.write_text(
        "travel/mm,force/N\n" + rows("{d},{f}\n").replace("0.2,4.8", "0.2,4.8\n0.25,NaN\n0.26,") + "Max,1234.5\n"
    )
    (omitted,) = read_curves(path)[0].notes
    assert omitted.kind == "rows_left_out" and "3 rows" in omitted.text
    path.write_text("travel/mm,force/N\n" + rows("{d},{f}\n") + "Cycle 2\n" + rows("{d},{f}\n")[:24])
    (apart,) = read_curves(path)[0].notes
    assert apart.kind == "rows_apart" and "3 rows" in apart.text


def test_a_word_among_the_numbers_is_no_gap(tmp_path: Path) -> None:
    path = tmp_path / "7mm-1.csv"
    path.write_text("travel,force\n" + rows("{d},{f}\n").replace("60.0", "sixty"))
    with pytest.raises(UsageError, match=r"data row 5, force: 'sixty' is not a number"):
        read_curves(path)


def test_a_unit_that_is_known_goes_before(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("应力(MPa),位移(mm),力(kN),力(%)\n1,2,3,4\n4,5,6,7\n", encoding="utf-8")
    table = read_table(path)
    assert table.matching(FORCE) == [2, 3]  # 应力 is stress, though it holds the word for force
    assert table.matching(FORCE, NEWTONS) == [2]


def test_two_lines_of_words_are_no_line_of_units(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("Operator,Smith\nWeg,Kraft\n0.0,1.0\n0.1,2.0\n")
    table = read_table(path)
    assert (table.columns, table.preamble) == (("Weg", "Kraft"), ("Operator,Smith",))
