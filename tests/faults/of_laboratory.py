"""Files of a laboratory as they should not be: damaged, hostile, ambiguous."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from pathlib import Path

from tally import Fault, each

from stemcal.errors import UsageError
from stemcal.measured.channels import CurveOptions
from stemcal.measured.diameters import measure_diameters
from stemcal.measured.shear import ShearTests, find_files, measure_shear

CURVE = [(0.05 * i, round(300.0 * (i / 30) ** 2 if i <= 30 else 300.0 * (40 - i) / 10, 2)) for i in range(40)]
PEAK = 300.0
MOST_SECONDS = 20.0  # by the processor's clock


def text_of(separator: str = ";", decimal: str = ".", head: str = "Weg (mm);Kraft (N)") -> str:
    """Return the known curve as a machine writes it."""
    rows = [f"{d:.2f};{f:.2f}".replace(".", decimal).replace(";", separator) for d, f in CURVE]
    return "\n".join([head.replace(";", separator), *rows, ""])


def measured(folder: Path, how: CurveOptions = CurveOptions()) -> ShearTests | str:
    """Return what is found in a folder, or the message; soon, and nothing else."""
    began = time.process_time()
    try:
        return measure_shear(find_files(folder), how)
    except UsageError as error:
        assert 10 < len(str(error)) < 700, f"a message of {len(str(error))} characters"
        return str(error)
    finally:
        assert time.process_time() - began < MOST_SECONDS, "it took too long"


# ---- hostile cells and lines

CELLS = (
    *(
        "1" * 100_000,
        "1" * 40_000 + "x",
        "1e400",
        "-1e400",
        "1e999999999",
        "nan",
        "inf",
        "0x1F",
        "1_000",
        "١٢٣",
        "1e308",
    ),
    *('"' * 300_000, '"', "=1+1", "\x00", "\x1b[31m", "\u202e1", "1;" * 20_000, "(" * 20_000, "," * 20_000, "'"),
    *("-", "--", "1e", "1.2.3", "1,2,3", ".", "+", "\ufeff", "9" * 400, "1" + "0" * 60, "\u2028", "\t" * 20_000),
)


def hostile_cell(folder: Path, number: int, rng: random.Random) -> None:
    """One cell of heading, data or preamble is such: the curve as it is, or a short message; never a wrong maximum."""
    cell = CELLS[number % len(CELLS)]
    lines = ["Specimen;7mm-1", *text_of(separator=rng.choice([";", "\t"])).splitlines()]
    row = rng.randrange(len(lines))
    mark = "\t" if "\t" in lines[1] else ";"
    cells = lines[row].split(mark if mark in lines[row] else ";")
    cells[rng.randrange(len(cells))] = cell
    lines[row] = mark.join(cells)
    (folder / "7mm-1.csv").write_bytes("\n".join(lines).encode("utf-8", "surrogatepass"))
    found = measured(folder)
    if isinstance(found, ShearTests):
        force = found.specimens[0].curve.max_force
        left = sorted((f for _, f in CURVE), reverse=True)[:2]  # the row of the maximum may be the one that is hit
        assert force in (*left, 31.0, 123.0), f"{force} N"


def damaged_file(folder: Path, _number: int, rng: random.Random) -> None:
    """Bytes changed, taken, doubled: a curve of finite numbers, or a message."""
    encoding = rng.choice(["utf-8", "gbk", "utf-16", "cp1251", "cp949"])
    blob = bytearray(text_of(head="位移;力" if encoding == "gbk" else "Weg;Kraft").encode(encoding, "ignore"))
    for _ in range(rng.randint(1, 20)):
        place = rng.randrange(len(blob))
        match rng.randrange(3):
            case 0:
                blob[place] = rng.randrange(256)
            case 1:
                del blob[place : place + rng.randint(1, 30)]
            case _:
                blob[place:place] = blob[place : place + rng.randint(1, 30)]
    (folder / "7mm-1.csv").write_bytes(bytes(blob))
    found = measured(folder)
    if isinstance(found, ShearTests):
        assert all(0.0 < s.curve.max_force <= 1e7 for s in found.specimens)


# ---- columns that nothing tells apart


def untold_columns(folder: Path, number: int, rng: random.Random) -> None:
    """Without headings, or with others, in either order: asked for; named, they give the maximum."""
    swapped = number % 2 == 1
    head = rng.choice(["", "a;b\n", "X;Y\n", "1;2\n", "data;\n", "通道1;通道2\n"])
    rows = [(f, d) if swapped else (d, f) for d, f in CURVE]
    text = head + "".join(f"{a};{b}\n" for a, b in rows)
    (folder / "7mm-1.csv").write_bytes(text.encode("gbk"))
    said = measured(folder)
    assert isinstance(said, str) and "--force-column" in said, f"taken without a word: {said}"
    named = CurveOptions(force_column="1" if swapped else "2", displacement_column="2" if swapped else "1")
    found = measured(folder, named)
    assert isinstance(found, ShearTests) and found.specimens[0].curve.max_force == PEAK, str(found)


# ---- several specimens in one file

PAIRS = (
    ("位移;力", "gbk"),
    ("力(N);位移(mm)", "utf-16"),
    ("Weg [mm];Kraft [N]", "cp1252"),
    ("Load (N);Extension (mm)", "utf-8"),
    ("Перемещение, мм;Сила, Н", "cp1251"),
    ("변위(mm);하중(N)", "cp949"),
    ("Yer değiştirme (mm);Kuvvet (N)", "cp1254"),
)


def side_by_side(folder: Path, number: int, rng: random.Random) -> None:
    """Two to twelve of them, of different lengths: all are read, each with its own maximum."""
    head, encoding = PAIRS[number % len(PAIRS)]
    count, mark = rng.randint(2, 12), rng.choice([";", "\t"])
    force_first = head.startswith(("力", "Load"))
    scales = [rng.uniform(0.5, 3.0) for _ in range(count)]
    ends = [rng.randint(34, len(CURVE)) for _ in range(count)]
    lines = [mark.join([head.replace(";", mark)] * count)]
    for row in range(max(ends)):
        cells: list[str] = []
        for scale, end in zip(scales, ends, strict=True):
            d, f = CURVE[row]
            pair = [f"{d:.2f}", f"{scale * f:.2f}"] if row < end else ["", ""]
            cells += pair[::-1] if force_first else pair
        line = mark.join(cells)
        lines.append(line.rstrip(mark) if rng.random() < 0.5 else line)
    (folder / "8mm.txt").write_bytes("\r\n".join(lines).encode(encoding))
    found = measured(folder)
    assert isinstance(found, ShearTests), found
    peaks = [specimen.curve.max_force for specimen in found.specimens]
    assert len(peaks) == count, f"{len(peaks)} of {count} read"
    assert all(abs(p - PEAK * s) < 0.01 for p, s in zip(peaks, scales, strict=True)), str(peaks)


# ---- values of options

SenseLess = Callable[[Path], object]
OPTIONS: tuple[SenseLess, ...] = (
    lambda path: measure_diameters(path, step=1e-9),
    lambda path: measure_diameters(path, step=float("nan")),
    lambda path: measure_diameters(path, step=1e300),
    lambda path: measure_diameters(path, grades=[float("nan")]),
    lambda path: measure_diameters(path, grades=[7.0, 7.0]),
    lambda path: measure_diameters(path, grades=[float("inf")]),
    lambda path: measure_shear([path], CurveOptions(preload=float("nan"))),
    lambda path: measure_shear([path], CurveOptions(speed=1.0, displacement_column="1")),
    lambda path: measure_shear([path], CurveOptions(time_column="1")),
    lambda path: measure_shear([path], alpha=float("nan")),
)


def senseless_option(folder: Path, number: int, _rng: random.Random) -> None:
    """Refused, soon, in words that name it."""
    path = folder / "7mm.csv"
    path.write_text("stem;diameter\n1;7\n2;8\n3;9\n4;10\n", encoding="utf-8")
    began = time.process_time()
    try:
        OPTIONS[number % len(OPTIONS)](path)
    except UsageError as error:
        assert "--" in str(error), str(error)
    else:
        raise AssertionError("taken")
    assert time.process_time() - began < MOST_SECONDS, "it took too long"


FAULTS = (
    Fault(
        "hostile cells in laboratory files",
        "33 kinds, from 100,000 digits to `1e400` and control characters, in a random cell",
        "the maximum as it is, or a short message; no hang, no infinite force",
        each(hostile_cell),
        33,
        990,
    ),
    Fault(
        "damaged laboratory files",
        "bytes changed, taken or doubled, in five encodings",
        "a curve of finite numbers, or a message",
        each(damaged_file),
        50,
        2000,
    ),
    Fault(
        "columns that nothing tells apart",
        "no headings or ones that say nothing, force first or displacement first",
        "asked for, never assigned; named, they are read",
        each(untold_columns),
        12,
        200,
    ),
    Fault(
        "several specimens in one file",
        "2 to 12 side by side, of different lengths, in seven languages and encodings",
        "all are read, each with its own maximum",
        each(side_by_side),
        14,
        300,
    ),
    Fault(
        "options without sense",
        "`--step 1e-9`, `--grades nan`, `--preload nan` and seven more",
        "refused in words that name the option, no hang",
        each(senseless_option),
        10,
        30,
    ),
)
