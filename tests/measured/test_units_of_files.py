"""Unit rows, headings with numbers, and units that are unknown: 1234.5 N from every file, or a refusal."""

from pathlib import Path

import pytest

from stemcal.errors import UsageError
from stemcal.measured.diameters import measure_diameters
from stemcal.measured.shear_curves import CurveOptions, ShearCurve, read_curves
from stemcal.notes import Note

CURVE = [(0.0, 0.0), (0.1, 1.2), (0.2, 4.8), (0.3, 12.5), (0.4, 60.0), (0.5, 1234.5), (0.6, 900.0), (0.7, 300.25)]
BY_NAME = CurveOptions()
BY_NUMBER = CurveOptions(force_column="2", displacement_column="3")
"""As the message on columns without a known heading recommends."""


def table(head: str, per: float = 1.0, form: str = "{t}\t{f}\t{d}\t{t}", tail: str = "") -> str:
    """Return a file: time, force in units of `per` N, travel in mm and a further number below the lines of `head`."""
    body = (form.format(t=t, d=d, f=f"{f / per:.8g}") for t, (d, f) in enumerate(CURVE))
    return "\n".join([head, *body, tail])


def read(tmp_path: Path, text: str, how: CurveOptions = BY_NAME, encoding: str = "utf-8") -> ShearCurve:
    path = tmp_path / "7mm-1.txt"
    path.write_bytes(text.encode(encoding))
    return read_curves(path, how)[0]


KN, KGF, GRAM, DAN, KIP = 1000.0, 9.80665, 0.00980665, 10.0, 4448.2216152605
LAYOUTS = {
    "a number in the heading, a line of units": ("Zeit\tKraft\tWeg\t1281068\ns\tkN\tmm\tmm", KN),
    "the same without a line of units": ("Zeit\tKraft [kN]\tWeg [mm]\t1281068", KN),
    "a number in front": ("20231105\tForce (kN)\tStroke (mm)\t1", KN),
    "several numbers": ("1\tForce (kN)\tTravel (mm)\t17.5", KN),
    "one unit that is none": ("Time\tLoad\tExtension\tTemp\nd\tkN\tmm\tmm", KN),
    "seconds in words": ("Time\tLoad\tExtension\tTemp\nSeconds\tkN\tmm\tzzz", KN),
    "cycles": ("Count\tForce\tPosition\tAngle\ncycles\tkN\tmm\tdeg", KN),
    "torque": ("Time\tForce\tPosition\tTorque\ns\tkN\tmm\tN·m", KN),
    "a dot between, volts": ("Time\tForce\tPosition\tSensor\ns\tkN\tmm\tmV/V", KN),
    "a sentence among the units": ("Time\tForce\tPosition\tNote\ns\tkN\tmm\tfree text", KN),
    "an empty unit": ("Time\tForce\tPosition\tNo\n\tkN\tmm\t", KN),
    "a one among the units": ("Zeit\tKraft\tWeg\tNr\ns\tkN\tmm\t1", KN),
    "fewer units than columns": ("Zeit\tKraft\tWeg\tNr\ns\tkN\tmm", KN),
    "symbols between names and units": ("Zeit\tKraft\tWeg\tKanal\nt\tF\tx\tk\ns\tkN\tmm\t-", KN),
    "symbols below the units": ("Zeit\tKraft\tWeg\tKanal\n[s]\t[kN]\t[mm]\t[-]\nt\tF\tx\tk", KN),
    "numbers of channels below the names": ("Time\tLoad\tStroke\tAux\nCh1\tCh2\tCh3\tCh4\ns\tkN\tmm\tV", KN),
    "rules around the units": ("Time\tLoad\tStroke\tAux\n----\t----\t----\t----\ns\tkN\tmm\tV\n===\t===\t===\t=", KN),
    "a blank line below the units": ("Time\tLoad\tStroke\tAux\ns\tkN\tmm\tV\n", KN),
    "a preamble as wide": ("Operator\tSmith\tDate\t5\nTime\tLoad\tStroke\tAux\ns\tkN\tmm\tV", KN),
    "brackets, one unit in the name": ("Time\tLoad (kN)\tStroke\tAux\n(s)\t\t(mm)\t(V)", KN),
    "the same unit twice": ("Time\tLoad (kN)\tStroke\tAux\ns\tkN\tmm\tV", KN),
    "kilogram-force": ("时间\t试验力\t位移\t编号\ns\tkgf\tmm\t个", KGF),
    "Chinese unit": ("时间\t试验力\t位移\t20231105\n秒\t公斤力\t毫米\t个", KGF),
    "grams": ("Time\tForce\tDistance\tBatch\nsec\tg\tmm\tbatch", GRAM),
    "decanewtons in capitals": ("Temps\tForce\tCourse\tNo 4\nS\tDAN\tMM\tx", DAN),
    "Newton in words": ("Time\tLoad\tDisp.\tx\nSecond(s)\tNewton(s)\tMillimeter(s)\tx", 1.0),
    "German load": ("Zeit\tLast [kN]\tDisp [mm]\tx", KN),
    "load_cell": ("time\tload_cell\tdisp\tx\ns\tkN\tmm\tx", KN),
    "one unit among words that are none": ("Time\tForce\tTravel\tX\nticks\tkN\tmm\tSchritte", KN),
    "a single known unit": ("Time\tForce\tStroke\tX\nticks\tkN\tSchritte mm\ta.u.", KN),
    "the word unit before each": ("Zeit\tKraft\tWeg\t17\nEinheit: s\tEinheit: kN\tEinheit: mm\tx", KN),
    "in before each": ("Zeit\tKraft\tWeg\t17\nin s\tin kN\tin mm\tin mm", KN),
    "angle brackets": ("Zeit\tKraft\tWeg\t17\n<s>\t<kN>\t<mm>\t<->", KN),
    "angle brackets in the names": ("Zeit <s>\tKraft <kN>\tWeg <mm>\t17", KN),
    "serial numbers below the units": ("Zeit\tKraft\tWeg\tNr\ns\tkN\tmm\tmm\n1281068\t1281069\t1281070\t55120", KN),
    "serial numbers behind a word": ("Zeit\tKraft\tWeg\tNr\ns\tkN\tmm\tmm\nS/N\t88123\t88124\t88125", KN),
    "serial numbers of two sensors": ("Zeit\tKraft\tWeg\tNr\ns\tkN\tmm\tmm\n\t5512\t5513\t", KN),
    "serial numbers above the units": ("Zeit\tKraft\tWeg\tNr\n1281068\t1281069\t1281070\t9999\ns\tkN\tmm\tmm", KN),
    "serial numbers of three digits": ("Time [s]\tForce [kN]\tTravel [mm]\tx\n101\t102\t103\t104", KN),
    "two lines of serial numbers": ("Zeit\tKraft [kN]\tWeg [mm]\tNr\n8881\t8882\t8883\t8884\n7771\t7772\t\t7774", KN),
    "kips after a space": ("Time s\tForce kips\tTravel mm\tx", KIP),
    "a unit in capitals after a space": ("TIME S\tFORCE KN\tTRAVEL MM\tx", KN),
    "a unit behind a colon": ("Time:s\tForce:kN\tTravel: mm\tx", KN),
    "the capacity of the load cell": ("Time\tLoad cell 500 lb\tPosition 2 cm\tx\ns\tkN\tmm\tx", KN),
    "Force/Fz": ("t/s\tForce/Fz\tDisp/mm\tx\ns\tkN\tmm\t°", KN),
}  # fmt: skip


@pytest.mark.parametrize("how", [BY_NAME, BY_NUMBER], ids=["by name", "by number"])
@pytest.mark.parametrize("name", LAYOUTS)
def test_the_unit_of_a_line_of_units_or_a_heading_counts(tmp_path: Path, name: str, how: CurveOptions) -> None:
    head, per = LAYOUTS[name]
    curve = read(tmp_path, table(head, per), how)
    assert curve.max_force == pytest.approx(1234.5, rel=1e-6)
    assert curve.travel_at_max == pytest.approx(0.3)
    assert "unit_assumed" not in {note.kind for note in curve.notes}


@pytest.mark.parametrize("head", ["s\tkN\tmm\tmm", "[s]\t[kN]\t[mm]\t[mm]", "Time\tkN\tmm\t17", "d\tkN\tmm\td"])
def test_a_heading_that_is_a_unit_gives_the_unit(tmp_path: Path, head: str) -> None:
    with pytest.raises(UsageError, match="--force-column"):
        read(tmp_path, table(head, KN))
    assert read(tmp_path, table(head, KN), BY_NUMBER).max_force == pytest.approx(1234.5, rel=1e-6)


UNKNOWN = {
    "volts": "Time\tForce\tPosition\tx\ns\tV\tmm\tx",
    "an unknown word in brackets": "Time\tForce (raw)\tPosition (mm)\tx",
    "an unknown unit after a stroke": "Time/s\tForce/dyn\tPosition/mm\tx",
    "meganewtons": "Time\tForce\tPosition\tx\ns\tMN\tmm\tx",
    "name and line of units disagree": "Time\tForce (N)\tPosition\tx\ns\tkN\tmm\tx",
    "a unit only further above": "Load cell; 5 kN\nTime\tForce\tPosition\tx",
    "the capacity of the load cell": "Time\tLoad cell 5 kN\tPosition\tx",
    "a legend above": "Force [kN], travel [mm]\n\nTime\tForce\tPosition\tx",
}


@pytest.mark.parametrize("how", [BY_NAME, BY_NUMBER], ids=["by name", "by number"])
@pytest.mark.parametrize("name", UNKNOWN)
def test_a_unit_that_stays_unknown_is_refused_and_can_be_given(tmp_path: Path, name: str, how: CurveOptions) -> None:
    text = table(UNKNOWN[name], KN)
    with pytest.raises(UsageError, match="--force-unit"):
        read(tmp_path, text, how)
    named = CurveOptions(force_column=how.force_column, displacement_column=how.displacement_column, force_unit="kN")
    assert read(tmp_path, text, named).max_force == pytest.approx(1234.5, rel=1e-6)


def test_headings_that_are_too_wide_do_not_hide_their_units(tmp_path: Path) -> None:
    """Columns by spaces, headings of several words: the columns are named by number, the unit is still not N."""
    text = table("Time s  Max Force kN  Travel mm  x", KN, form="{t}  {f}  {d}  {t}")
    with pytest.raises(UsageError, match="--force-unit"):
        read(tmp_path, text, BY_NUMBER)


def kinds(notes: tuple[Note, ...]) -> list[str]:
    return [note.kind for note in notes]


def test_an_assumed_unit_is_reported(tmp_path: Path) -> None:
    text = table("Time\tForce\tTravel\tx")
    assert kinds(read(tmp_path, text).notes) == ["unit_assumed", "unit_assumed"]
    given = CurveOptions(force_unit="N", displacement_unit="mm")
    assert kinds(read(tmp_path, text, given).notes) == []


def test_a_first_row_of_words_and_numbers_is_data(tmp_path: Path) -> None:
    """A label in the first column is no heading."""
    curve = read(tmp_path, table("Specimen\tForce (N)\tTravel (mm)\tx", form="A{t}\t{f}\t{d}\t{t}"))
    assert (len(curve.force), curve.trimmed) == (6, 2)


def test_a_first_row_of_large_whole_numbers_is_data(tmp_path: Path) -> None:
    """Ten times as large as the rows below are serial numbers only, not the largest stem of a table."""
    path = tmp_path / "stems.csv"
    path.write_text("a (um),b (um)\n9800,9600\n8100,8300\n7000,7100\n1200,1300\n", encoding="utf-8")
    stems = measure_diameters(path, column="1,2", label="none")
    assert [stem.diameter for stem in stems.stems] == pytest.approx([9.7, 8.2, 7.05, 1.25])


def test_the_height_of_a_measurement_is_not_its_unit(tmp_path: Path) -> None:
    path = tmp_path / "stems.csv"
    path.write_text("stem,Diameter at 10 cm\n1,7.1\n2,8.2\n3,9.3\n", encoding="utf-8")
    with pytest.raises(UsageError, match="unknown unit '10 cm'; write the unit in its heading"):
        measure_diameters(path)
    path.write_text("stem,Diameter at 10 cm (mm)\n1,7.1\n2,8.2\n3,9.3\n", encoding="utf-8")
    assert measure_diameters(path).summary.mean == pytest.approx(8.2)
