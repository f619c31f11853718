"""Print the largest force of a contact from LS-DYNA's ``rcforc``: ``python3 peak.py rcforc [CONTACT [x|y|z]]``.

Without a component the force is the resultant; of the two sides of a contact the first that stands there is read.
"""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

_ROW = re.compile(r"^\s*(\w+)\s+(\d+)\s+time\s+(\S+)\s+x\s+(\S+)\s+y\s+(\S+)\s+z\s+(\S+)", re.MULTILINE | re.IGNORECASE)


def forces(text: str, contact: int) -> list[tuple[float, tuple[float, float, float]]]:
    """Return time and force of one side of a contact."""
    rows = [found.groups() for found in _ROW.finditer(text) if int(found[2]) == contact]
    side = rows[0][0] if rows else ""
    return [(float(t), (float(x), float(y), float(z))) for name, _, t, x, y, z in rows if name == side]


def peak(text: str, contact: int = 1, component: str = "") -> tuple[float, float]:
    """Return the largest force and its time."""
    found = forces(text, contact)
    if not found:
        sys.exit(f"no contact {contact} in this file")
    sizes = [abs(f["xyz".index(component)]) if component else math.hypot(*f) for _, f in found]
    largest = max(range(len(found)), key=sizes.__getitem__)
    return sizes[largest], found[largest][0]


def main() -> None:
    """Read the file that is named."""
    text = Path(sys.argv[1]).read_text(encoding="ascii", errors="replace")
    contact, component = int(sys.argv[2]) if len(sys.argv) > 2 else 1, sys.argv[3] if len(sys.argv) > 3 else ""
    force, time = peak(text, contact, component)
    print(f"{force:.6g} at time {time:.6g}")


if __name__ == "__main__":
    main()
