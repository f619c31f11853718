"""The shipped verification page: complete, every case within its tolerance, and made by its script."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
CASES = "reference/verification-cases.md"
TOPICS = (
    *("Patch test", "Rigid rotation", "Hourglass modes", "Cyclic tension", "Yield stress versus strain rate"),
    *("Erosion at the failure strain", "Wave in a bar", "Cantilever", "Hollow cylinder in three-point bending"),
    *("Convergence under refinement", "Rebound and momentum", "Sliding block", "Taylor bar", "Spread edge"),
    *("Nonlocal failure", "Plate of known toughness", "Full model and quarter model"),
    *("Energy balance of the shear test", "Determinism"),
)


def rows(page: Path) -> list[list[str]]:
    """Return the table's rows: topic, case, computed, exact, difference, tolerance, source."""
    return cells(page.read_text("utf-8"))


def cells(text: str) -> list[list[str]]:
    """Return the cells of a table below its head."""
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def amount(cell: str) -> tuple[float, str]:
    """Return number and unit of a cell; of round-off, "< 1e-12", its bound."""
    found = re.fullmatch(r"(?:< )?([-+]?[\d.]+(?:e-?\d+)?)(?: (\S+))?", cell)
    assert found, cell
    return float(found[1]), found[2] or ""


def test_every_topic_is_there_with_rows_and_a_section() -> None:
    text = (DOCS / "verification.md").read_text("utf-8")
    assert re.findall(r"^## (.*)$", text, re.MULTILINE) == [*TOPICS, "Sources"]
    assert list(dict.fromkeys(row[0] for row in rows(DOCS / CASES))) == list(TOPICS)


def test_the_summary_before_counts_the_rows() -> None:
    summary = cells((DOCS / "verification.md").read_text("utf-8"))
    of_topic = [row[0] for row in rows(DOCS / CASES)]
    assert [row[0] for row in summary] == list(TOPICS)
    assert [int(row[1]) for row in summary] == [int(row[2]) for row in summary] == [of_topic.count(t) for t in TOPICS]


def test_every_case_lies_within_its_tolerance() -> None:
    """As printed: the difference too is that of the two numbers beside it, to their digits."""
    table = rows(DOCS / CASES)
    assert len(table) > 80
    for _, name, computed, exact, difference, tolerance, source in table:
        (off, unit), (allowed, same) = amount(difference), amount(tolerance)
        assert (abs(off) <= allowed, unit) == (True, same), name
        assert source, name
        one, other = amount(computed)[0], amount(exact)[0]
        share = unit == "%" and not computed.endswith("%")
        wanted = 100.0 * (one - other) / abs(other) if share else one - other
        if unit or other == 0.0:  # shares of round-off size have fewer digits than this needs
            digits = 1e-4 * max(abs(one), abs(other)) * (100.0 / abs(other) if share else 1.0)
            assert off == pytest.approx(wanted, rel=0.06, abs=max(digits, 1e-12)), name


def test_every_figure_is_there() -> None:
    text = (DOCS / "verification.md").read_text("utf-8")
    names = re.findall(r"!\[.+?\]\((images/verification-.*?\.png)\)", text)
    assert len(names) == len(set(names)) == 7
    assert {path.name for path in (DOCS / "images").glob("verification-*")} == {Path(name).name for name in names}
    for name in names:
        assert (DOCS / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_script_makes_the_page(tmp_path: Path) -> None:
    """Exit code 0, the same cases and limits, the same numbers to 0.1 %; round-off may differ by machine."""
    command = [sys.executable, str(ROOT / "benchmarks" / "verification_page.py"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    shipped, made = rows(DOCS / CASES), rows(tmp_path / CASES)
    assert [(row[:2], row[5:]) for row in made] == [(row[:2], row[5:]) for row in shipped]
    for old, new in zip(shipped, made, strict=True):
        slack = 1e-3 * abs(amount(old[3])[0]) + 0.05 * abs(amount(old[5])[0])
        assert amount(new[2])[0] == pytest.approx(amount(old[2])[0], rel=1e-3, abs=slack), old[1]
    figures = {path.name for path in (DOCS / "images").glob("verification-*")}
    assert {path.name for path in (tmp_path / "images").iterdir()} == figures
