"""Compute the known solutions and write docs/verification.md, its cases and its figures.

    python benchmarks/verification_page.py [FOLDER]

The script takes some minutes and needs `pip install "stemcal[test]"`. The exit code is 1 if a case is outside its
tolerance.
"""

from __future__ import annotations

import sys
from pathlib import Path

from verification import ROOT
from verification.page import write


def main() -> int:
    topics = write(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs")
    missed = [(topic.title, case) for topic in topics for case in topic.cases if not case.holds]
    for title, case in missed:
        print(f"outside its tolerance: {title}, {case}", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
