"""Compare all numbers in the stage files of two study folders, old and new, to a relative error of 1e-12.

    python benchmarks/compare_stage_files.py OLD NEW [OLD NEW ...]

Texts, hashes and versions are not compared. Numbers that only the new folder contains are counted. The exit code is 1
if an old number differs or is missing.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

STAGES = ("screen", "climb", "rsm", "invert", "refine", "validate")
TOLERANCE = 1e-12  # of the number
SHOWN = 20
NOT_COMPARED = {"schema_version", "naming", "inputs", "sha256", "notes"}

Leaf = float | bool | None


def leaves(content: Any, path: str = "") -> Iterator[tuple[str, Leaf]]:
    """Yield every number, flag and null of a tree with the path to it."""
    if isinstance(content, dict):
        for key, value in content.items():
            if key not in NOT_COMPARED:
                yield from leaves(value, f"{path}.{key}")
    elif isinstance(content, list):
        for index, value in enumerate(content):
            yield from leaves(value, f"{path}[{index}]")
    elif not isinstance(content, str):
        yield path.lstrip("."), content


def numbers_of(folder: Path) -> dict[str, Leaf]:
    """Return the leaves of all stage files of a study folder."""
    found: dict[str, Leaf] = {}
    for stage in STAGES:
        path = folder / f"{stage}.json"
        if path.exists():
            content = json.loads(path.read_text("utf-8"))
            found.update((f"{stage}: {place}", value) for place, value in leaves(content))
    return found


def same(old: Leaf, new: Leaf) -> bool:
    """Whether two leaves are equal, numbers within the tolerance."""
    if old is None or new is None or isinstance(old, bool) or isinstance(new, bool):
        return old is new
    return math.isclose(old, new, rel_tol=TOLERANCE, abs_tol=TOLERANCE) or (math.isnan(old) and math.isnan(new))


def differences(old: Mapping[str, Leaf], new: Mapping[str, Leaf]) -> list[str]:
    """Return a line for each old number that differs, or is gone."""
    lines = []
    for place, value in old.items():
        if place not in new:
            lines.append(f"{place}: only old, {value}")
        elif not same(value, new[place]):
            lines.append(f"{place}: {value} is now {new[place]}")
    return lines


def main(folders: list[str]) -> int:
    """Compare the folders two by two; print how many numbers agree and the first that do not."""
    if not folders or len(folders) % 2:
        print(__doc__)
        return 2
    worst = 0
    for old, new in zip(folders[::2], folders[1::2], strict=True):
        before, after = numbers_of(Path(old)), numbers_of(Path(new))
        lines = differences(before, after)
        added = len(after.keys() - before.keys())
        print(f"{new}: {len(before)} numbers, {len(lines)} differ; {added} more than before")
        print("".join(f"  {line}\n" for line in lines[:SHOWN]), end="")
        worst = max(worst, bool(lines) or not before)
    return worst


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
