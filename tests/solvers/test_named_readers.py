"""Readers by name: files as LS-DYNA and CalculiX write them in, known numbers out."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from stemcal.solvers.programs.readers import read_number
from stemcal.solvers.programs.reductions import NoResult
from stemcal.study.model import CalculixResult, RcforcResult

# From CalculiX 2.20: forces at two times, displacements of three nodes, totals.
DAT = """
 forces (fx,fy,fz) for set TIP and time  0.5000000E+00

        21 -1.131419E-11  3.105209E-11 -1.403756E+01
        22  1.000000E+00  0.000000E+00 -1.000000E+00

 displacements (vx,vy,vz) for set ALL and time  0.5000000E+00

         1  0.000000E+00  0.000000E+00  0.000000E+00
        21 -1.000000E-02  0.000000E+00 -1.000000E+00

 forces (fx,fy,fz) for set TIP and time  0.1000000E+01

        21 -1.131419E-11  3.105209E-11 -2.807511E+01
        22  1.000000E+00  0.000000E+00 -2.000000E+00

 total force (fx,fy,fz) for set TIP and time  0.1000000E+01

        1.000000E+00  3.105209E-11 -3.007511E+01
"""
RCFORC = """ LS-DYNA, title

  slave           1 time  0.00000E+00  x  0.00000E+00  y  0.00000E+00  z  0.00000E+00  mass  1.0E-06
  master          1 time  0.00000E+00  x  0.00000E+00  y  0.00000E+00  z  0.00000E+00  mass  1.0E-06
  slave           1 time  1.00000E-01  x  3.00000E+00  y  0.00000E+00  z -8.00000E+00  mass  1.0E-06
  master          1 time  1.00000E-01  x -3.00000E+00  y  0.00000E+00  z  8.00000E+00  mass  1.0E-06
  slave           1 time  2.00000E-01  x  1.00000E+00  y  0.00000E+00  z -2.00000E+00  mass  1.0E-06
"""


def dat(folder: Path, **more: object) -> float:
    (folder / "job.dat").write_text(DAT, encoding="utf-8")
    given = {"kind": "calculix", "file": "job.dat", "set": "tip", "component": "fz", **more}
    return read_number(CalculixResult.model_validate(given), folder)


@pytest.mark.parametrize(
    ("more", "known"),
    [
        ({}, -2.807511e1 - 2.0),  # the last time, summed over the set
        ({"node": 21}, -2.807511e1),
        ({"node": 21, "scale": -1, "reduction": "first"}, 1.403756e1),
        ({"node": 21, "reduction": "at", "at": 0.75}, -(14.03756 + 28.07511) / 2),
        ({"reduction": "work"}, -0.5 * 0.5 * (15.03756 + 30.07511)),
        ({"component": "fx"}, 1.0),
        ({"quantity": "displacements", "set": "ALL", "component": "vz", "node": 21}, -1.0),
        ({"quantity": "total force"}, -30.07511),
    ],
)
def test_calculix(tmp_path: Path, more: dict[str, object], known: float) -> None:
    assert dat(tmp_path, **more) == pytest.approx(known, rel=1e-9)


@pytest.mark.parametrize(
    ("more", "reason", "said"),
    [
        ({"set": "ROOT"}, "no_result", "only displacements of ALL, forces of TIP, total force of TIP"),
        ({"component": "fw"}, "no_result", "only fx, fy, fz"),
        ({"node": 7}, "no_result", "have no node 7"),
        ({"quantity": "displacements", "set": "ALL", "component": "vz"}, "bad_result", "have 2 rows; name one"),
        ({"reduction": "at", "at": 2.0}, "no_result", "goes from 0.5 to 1"),
    ],
)
def test_calculix_refuses(tmp_path: Path, more: dict[str, object], reason: str, said: str) -> None:
    with pytest.raises(NoResult, match=said) as caught:
        dat(tmp_path, **more)
    assert caught.value.reason == reason


@pytest.mark.parametrize(
    ("row", "reason"), [("21  0. 0. NaN", "nan"), ("21  0. 0.", "bad_result"), ("21 a b c", "bad_result")]
)
def test_calculix_rows_that_are_none(tmp_path: Path, row: str, reason: str) -> None:
    text = f" forces (fx,fy,fz) for set TIP and time  0.1E+01\n\n {row} \n"
    (tmp_path / "job.dat").write_text(text, encoding="utf-8")
    result = CalculixResult(kind="calculix", file="job.dat", set="TIP", component="fz")
    with pytest.raises(NoResult) as caught:
        read_number(result, tmp_path)
    assert caught.value.reason == reason


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_calculix_itself_writes_what_is_read(tmp_path: Path) -> None:
    """A bar of 10 mm × 1 mm² pulled by 0.1 mm: F = E A u / L = 1000 · 1 · 0.1 / 10 = 10 N."""
    nodes = [(x, y, z) for x in (0, 10) for y, z in ((0, 0), (1, 0), (1, 1), (0, 1))]
    lines = "\n".join(f"{i}, {x}., {y}., {z}." for i, (x, y, z) in enumerate(nodes, start=1))
    (tmp_path / "bar.inp").write_text(
        f"*NODE, NSET=ALL\n{lines}\n*ELEMENT, TYPE=C3D8, ELSET=BAR\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
        "*NSET, NSET=END\n5, 6, 7, 8\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.\n*SOLID SECTION, ELSET=BAR, MATERIAL=M\n"
        "*BOUNDARY\n1, 1, 3\n2, 1, 1\n3, 1, 1\n4, 1, 1\n*STEP\n*STATIC\n*BOUNDARY\nEND, 1, 1, 0.1\n"
        "5, 2, 3\n*NODE PRINT, NSET=END, TOTALS=YES\nRF\n*NODE PRINT, NSET=END\nU\n*END STEP\n",
        encoding="utf-8",
    )
    subprocess.run(["ccx", "bar"], cwd=tmp_path, capture_output=True, check=True, timeout=60)

    def read(**more: object) -> float:
        given = {"kind": "calculix", "file": "bar.dat", "set": "END", **more}
        return read_number(CalculixResult.model_validate(given), tmp_path)

    assert read(component="fx") == pytest.approx(10.0, rel=1e-6)
    assert read(component="fx", quantity="total force") == pytest.approx(10.0, rel=1e-6)
    assert read(component="vx", quantity="displacements", node=7) == pytest.approx(0.1, rel=1e-6)


def test_rcforc(tmp_path: Path) -> None:
    (tmp_path / "rcforc").write_text(RCFORC, encoding="utf-8")

    def read(**more: object) -> float:
        return read_number(RcforcResult.model_validate({"kind": "rcforc", "reduction": "max", **more}), tmp_path)

    assert read() == 8.0  # turned so that the peak is positive
    assert read(component="x") == 3.0
    assert read(reduction="work") == pytest.approx(0.1 * (8.0 + 10.0) / 2, rel=1e-12)
    assert read(reduction="at", at=0.05) == pytest.approx(4.0, rel=1e-12)
    with pytest.raises(NoResult, match=r"has no contact 2, only \[1\]"):
        read(interface=2)
