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
    """Write ``verification.md`` and ``images/verification-*.png`` into a folder; returns what was computed."""
    topics = []
    for make in TOPICS:
        begun = perf_counter()
        topics.append(topic := make())
        print(f"{topic.title}: {perf_counter() - begun:.1f} s", file=sys.stderr, flush=True)
    (docs / "images").mkdir(parents=True, exist_ok=True)
    for drawing in (drawing for topic in topics for drawing in topic.drawings):
        save(drawing.figure, docs / "images" / f"verification-{drawing.name}.png")
    (docs / "verification.md").write_text("\n\n".join(_parts(topics)) + "\n", encoding="utf-8", newline="\n")
    return topics


def _parts(topics: list[Topic]) -> Iterator[str]:
    count = sum(len(topic.cases) for topic in topics)
    inside = sum(case.holds for topic in topics for case in topic.cases)
    yield "<!-- Made by benchmarks/verification_page.py; changes here are lost. -->"
    yield "# Verification"
    yield (
        "Does the solver compute what its equations say? Each topic is a problem with known answers, run by the solver "
        f"that cuts stems: {inside} of {count} numbers lie within their tolerance."
    )
    yield _summary(topics)
    yield (
        "Nearest to its tolerance: the largest difference of the topic as a share of the tolerance of its number. "
        "Units are mm, tonne, s, N, MPa, mJ. "
        "The same problems are run as tests, in `tests/verification` and "
        "`tests/test_cutting.py`. How well the model agrees with measured cutting forces is another question, which "
        "the report of each study answers."
    )
    yield _provenance()
    yield "## All cases"
    yield (
        "A difference in % is a share of the exact value, unless the value itself is in %. Where 0 is the ideal rather "
        "than the exact answer, as for errors and drifts, the tolerance is the bound that is asked for."
    )
    yield _table(topics)
    for topic in topics:
        yield f"## {topic.title}"
        yield topic.text
        for drawing in topic.drawings:
            yield f"![{drawing.caption}](images/verification-{drawing.name}.png)"
            yield f"*{drawing.caption}*"
    yield "## Sources"
    yield "\n".join(f"* {source}" for source in SOURCES)


def _provenance() -> str:
    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return (
        f"Made by `python benchmarks/verification_page.py` with stemcal {__version__}, Python "
        f"{platform.python_version()}, {packages}. All numbers and figures are from that run; another run gives the "
        "same page. Numbers below 1e-10 are round-off, and only the power of ten above them is shown."
    )


def _summary(topics: list[Topic]) -> str:
    """Return a row for each topic: how many numbers, how many within their tolerance, the one nearest to it."""
    rows = []
    for topic in topics:
        worst = max(topic.cases, key=lambda case: case.share)
        held = sum(case.holds for case in topic.cases)
        rows.append((topic.title, f"{len(topic.cases)}", f"{held}", f"{100 * worst.share:.0f} %", worst.name))
    head = ("Topic", "Numbers", "Within", "Nearest", "Which")
    return _rows(head, ("---", "---:", "---:", "---:", "---"), rows)


def _table(topics: list[Topic]) -> str:
    head = ("Topic", "Case", "Computed", "Exact", "Difference", "Tolerance", "Source of the exact value")
    rows = [(topic.title, *case.cells()) for topic in topics for case in topic.cases]
    return _rows(head, ("---", "---", "---:", "---:", "---:", "---:", "---"), rows)


def _rows(head: tuple[str, ...], rules: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, rules, *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
