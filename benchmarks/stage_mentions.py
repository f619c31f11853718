"""Count the lines that name a stage outside its folder.

    python benchmarks/stage_mentions.py

A line counts if it contains the name of the stage as a whole text or identifier, or the name of its result or options.
The folder of the stage, the list of stages in `study/types/stage_kind.py`, comments and docstrings do not count. The
script prints a line per stage: number of lines, number of files, and the five files with the most lines.
"""

from __future__ import annotations

import io
import re
import tokenize
from collections import Counter
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "stemcal"
NAMES = {
    "screen": r"screen|Screen(ing|Result|Options|Plots)?|screening\w*|stages\.screen",
    "climb": r"climb|Climb(Result|Options|Row)?|stages\.climb",
    "rsm": r"rsm|Surface(Result|Plots)|Rsm(Options)?|stages\.surface",
    "invert": r"invert|Invert(Result|Options)|Inversion(Plots)?|inversion\w*|stages\.invert",
    "refine": r"refine|Refine(Result|Options)|refinement|stages\.refine",
    "validate": r"validate|Validat(e|ion)(Result|Options|Plots)|stages\.validate",
}


def lines_of(path: Path, pattern: re.Pattern[str]) -> set[int]:
    """Return the numbers of the lines whose names, or whole texts, match; comments and docstrings do not."""
    found, before = set[int](), tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type == tokenize.NAME and pattern.fullmatch(token.string):
            found.add(token.start[0])
        is_docstring = before in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.NL)
        if token.type == tokenize.STRING and not is_docstring and pattern.fullmatch(token.string.strip("\"'")):
            found.add(token.start[0])
        if token.type != tokenize.COMMENT:
            before = token.type
    return found


def mentions(stage: str) -> Counter[str]:
    """Return the number of lines in each file that name a stage outside its folder."""
    pattern, own = re.compile(NAMES[stage]), PACKAGE / "stages" / stage
    found = Counter[str]()
    for path in sorted(PACKAGE.rglob("*.py")):
        inside = own in path.parents or path == own.with_suffix(".py") or path.name == "stage_kind.py"
        if not inside and (lines := lines_of(path, pattern)):
            found[path.relative_to(PACKAGE).as_posix()] = len(lines)
    return found


def main() -> None:
    """Print the mentions of every stage."""
    for stage in NAMES:
        found = mentions(stage)
        most = ", ".join(f"{name} {count}" for name, count in found.most_common(5))
        print(f"{stage:9} {found.total():4} lines in {len(found):3} files   {most}")


if __name__ == "__main__":
    main()
