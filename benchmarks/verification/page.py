"""Run every topic and write it down as Markdown, with its figures as PNG."""

from __future__ import annotations

import platform
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

from stemcal import __version__
from stemcal.report.figures.style import save
from verification import contact, element, law, lengths, shear_test, structures
from verification.case import Topic

TOPICS = (
    element.patch,
    element.objectivity,
    element.hourglass,
    law.tension,
    law.rate,
    law.erosion,
    structures.wave,
    structures.beams,
    structures.cylinder,
    structures.convergence,
    contact.rebound,
    contact.sliding,
    contact.taylor,
    lengths.edge,
    lengths.failure,
    shear_test.symmetry,
    shear_test.energy,
    shear_test.determinism,
)
CASES = "reference/verification-cases.md"
NOTICE = "<!-- Made by benchmarks/verification_page.py; changes here are lost. -->"
PACKAGES = ("numpy", "numba", "scipy", "matplotlib")
SOURCES = (
    "G. R. Cowper, J. Appl. Mech. 33 (1966) 335.",
    "G. R. Cowper, P. S. Symonds, Brown University, Technical Report 28 (1957).",
    "J. K. Dienes, Acta Mechanica 32 (1979) 217.",
    "D. P. Flanagan, T. Belytschko, Int. J. Num. Meth. Eng. 17 (1981) 679.",
    "K. F. Graff, *Wave Motion in Elastic Solids*, Clarendon Press 1975.",
    "J. O. Hallquist, *DYNA3D User's Manual*, Lawrence Livermore National Laboratory.",
    "T. C. Huang, J. Appl. Mech. 28 (1961) 579.",
    "T. J. R. Hughes, *The Finite Element Method*, Prentice-Hall 1987.",
    "T. J. R. Hughes, J. Winget, Int. J. Num. Meth. Eng. 15 (1980) 1862.",
    "B. M. Irons, A. Razzaque, in *The Mathematical Foundations of the Finite Element Method*, Academic Press 1972.",
    "R. D. Krieg, S. W. Key, *Constitutive Equations in Viscoplasticity*, ASME AMD 20 (1976) 125.",
    "S. P. Timoshenko, Philosophical Magazine 41 (1921) 744.",
    "M. L. Wilkins, M. W. Guinan, J. Appl. Phys. 44 (1973) 1200.",
    "Y. Y. Zhu, S. Cescotto, Comput. Struct. 54 (1995) 1095.",
)


def write(docs: Path) -> list[Topic]:
    """Write ``verification.md``, ``reference/verification-cases.md`` and their figures; return the topics."""
    topics = []
    for make in TOPICS:
        begun = perf_counter()
        topics.append(topic := make())
        print(f"{topic.title}: {perf_counter() - begun:.1f} s", file=sys.stderr, flush=True)
    for name in ("images", "reference"):
        (docs / name).mkdir(parents=True, exist_ok=True)
    for drawing in (drawing for topic in topics for drawing in topic.drawings):
        save(drawing.figure, docs / "images" / f"verification-{drawing.name}.png")
    for name, parts in (("verification.md", _parts(topics)), (CASES, _cases(topics))):
        (docs / name).write_text("\n\n".join(parts) + "\n", encoding="utf-8", newline="\n")
    return topics


def _parts(topics: list[Topic]) -> Iterator[str]:
    count = sum(len(topic.cases) for topic in topics)
    inside = sum(case.holds for topic in topics for case in topic.cases)
    yield NOTICE
    yield "# Verification"
    yield (
        "For readers who want evidence that the solver is correct: each topic compares it with a known answer. "
        f"{inside} of {count} numbers are within their tolerance. "
        f"All of them are listed in [Verification cases]({CASES})."
    )
    yield _summary(topics)
    yield (
        "Largest difference: as a percentage of its tolerance. Units are mm, tonne, s, N, MPa, mJ. The same problems "
        "are tests in `tests/verification` and `tests/test_cutting.py`. The report of each study compares the model "
        "with measured forces."
    )
    for topic in topics:
        yield f"## {topic.title}"
        yield topic.text
        for drawing in topic.drawings:
            yield f"![{drawing.caption}](images/verification-{drawing.name}.png)"
            yield f"*{drawing.caption}*"
    yield "## Sources"
    yield "\n".join(f"* {source}" for source in SOURCES)


def _cases(topics: list[Topic]) -> Iterator[str]:
    yield NOTICE
    yield "# Verification cases"
    yield (
        "For readers of the page [Verification](../verification.md): every computed number with its exact value. A "
        "difference in % is relative to the exact value, unless the value itself is in %. For errors and drifts the "
        "ideal value is 0, and the tolerance is the allowed limit."
    )
    yield _provenance()
    yield _table(topics)


def _provenance() -> str:
    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return (
        f"Made by `python benchmarks/verification_page.py` with stemcal {__version__}, Python "
        f"{platform.python_version()}, {packages}. Values below 1e-6 are rounding errors of single "
        "precision; only their power of ten is shown."
    )


def _summary(topics: list[Topic]) -> str:
    """Return a row for each topic: how many numbers, how many within their tolerance, the one nearest to it."""
    rows = []
    for topic in topics:
        worst = max(topic.cases, key=lambda case: case.share)
        held = sum(case.holds for case in topic.cases)
        rows.append((topic.title, f"{len(topic.cases)}", f"{held}", f"{100 * worst.share:.0f} %", worst.name))
    head = ("Topic", "Numbers", "Within", "Largest difference", "Case")
    return _rows(head, ("---", "---:", "---:", "---:", "---"), rows)


def _table(topics: list[Topic]) -> str:
    head = ("Topic", "Case", "Computed", "Exact", "Difference", "Tolerance", "Source of the exact value")
    rows = [(topic.title, *case.cells()) for topic in topics for case in topic.cases]
    return _rows(head, ("---", "---", "---:", "---:", "---:", "---:", "---"), rows)


def _rows(head: tuple[str, ...], rules: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, rules, *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
