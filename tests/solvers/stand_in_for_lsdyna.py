"""Not LS-DYNA: a stand-in for tests, which takes its command line and leaves its files.

It reads SIGY and the speed from the deck and writes an ``rcforc`` whose force rises to 10·SIGY and falls again,
on the side of the stem of contact 1, in LS-DYNA's columns. STAND_IN=error, silent, nan, rising or broken
makes it fail in that way, STAND_IN=fails tells of an element that does.
"""

import os
import sys
from pathlib import Path

NORMAL = " N o r m a l    t e r m i n a t i o n\n"
ERROR = " *** Error 40509 (SOL+509)\n     negative volume\n E r r o r   t e r m i n a t i o n\n"
FAILED = " solid element     1911 failed at time  3.0000E-01\n"
STEPS = 101


def sigy(deck: str) -> float:
    lines = [line for line in deck.splitlines() if not line.startswith("$")]
    at = next(i for i, line in enumerate(lines) if line.startswith(("*MAT_PLASTIC_KINEMATIC", "*MAT_003")))
    width = 20 if lines[at].rstrip().endswith("+") else 10
    card = lines[at + (2 if "_TITLE" in lines[at] else 1)]
    return float(card.split(",")[4] if "," in card else card[4 * width : 5 * width])


def row(side: str, contact: int, time: float, z: float) -> str:
    return f" {side:>6}{contact:12d} time{time:13.5E}  x  0.00000E+00  y  0.00000E+00  z{z:13.5E}  mass  1.00000E-06\n"


def main() -> int:
    mode = os.environ.get("STAND_IN", "")
    name = next(argument[2:] for argument in sys.argv[1:] if argument.startswith("i="))
    peak = 10.0 * sigy(Path(name).read_text(encoding="utf-8", errors="replace"))
    if mode == "error":
        print(ERROR)
        return 0
    with Path("rcforc").open("w", encoding="utf-8") as file:
        file.write(" stand-in, not LS-DYNA\n\n")
        for step in range(STEPS):
            share = step / (STEPS - 1)
            force = peak * (share if mode == "rising" else min(share, 1.0 - share) * 2.0)
            text = row("slave", 1, 0.5 * share, -force) + row("master", 1, 0.5 * share, force)
            text += row("slave", 2, 0.5 * share, 0.5 * force) + row("master", 2, 0.5 * share, -0.5 * force)
            file.write(text.replace("E", "X") if mode == "broken" else text)
        if mode == "nan":
            file.write(f" slave           1 time{0.51:13.5E}  x          NaN  y          NaN  z          NaN\n")
    if mode == "fails":
        print(FAILED)
    if mode != "silent":
        Path("messag").write_text((FAILED if mode == "fails" else "") + NORMAL, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
