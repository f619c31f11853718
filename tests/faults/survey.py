"""Every fault a study must survive, tried many times: PYTHONPATH=tests python tests/faults/survey.py [NAME ...]

Prints a table: the fault, how it is caused, what must come of it, how often it was tried and survived. Without a name
it tries all of them (half an hour to an hour); with words of names, those. `--seed N` tries other random moments.
Exit code 1 if anything was lost.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "solvers")]

import of_changes  # noqa: E402
import of_cluster  # noqa: E402
import of_damage  # noqa: E402
import of_demand  # noqa: E402
import of_disks  # noqa: E402
import of_exports  # noqa: E402
import of_laboratory  # noqa: E402
import of_names  # noqa: E402
import of_odds  # noqa: E402
import of_processes  # noqa: E402
import of_runs  # noqa: E402
import of_seals  # noqa: E402
import of_specs  # noqa: E402
import of_trust  # noqa: E402
from tally import Fault, Missing, Tally  # noqa: E402

KINDS = (
    of_processes,
    of_disks,
    of_damage,
    of_runs,
    of_seals,
    of_specs,
    of_names,
    of_changes,
    of_exports,
    of_laboratory,
    of_odds,
    of_trust,
    of_cluster,
    of_demand,
)
FAULTS: tuple[Fault, ...] = tuple(fault for kind in KINDS for fault in kind.FAULTS)
HEAD = "| Fault | How it is caused | What must come of it | Tried | Survived | |\n|---|---|---|---:|---:|---|\n"


def tried(fault: Fault, times: int, seed: int) -> Tally:
    """Try one fault in a temporary folder."""
    with tempfile.TemporaryDirectory() as place:
        return fault.trials(Path(place) / "place", times, random.Random(f"{fault.name} {seed}"))


def row(fault: Fault, tally: Tally) -> str:
    """Return the table's row; what was lost is told in it."""
    lost = [] if not tally.broken else [f"{len(tally.broken)} lost, the first: {' '.join(tally.broken[0].split())}"]
    remark = "; ".join(filter(None, [tally.remark, *lost])).replace("|", "\\|")
    figures = f"{tally.tried} | {tally.survived} | {remark}"
    return f"| {fault.name} | {fault.cause} | {fault.must} | {figures} |\n"


def main() -> int:
    """Try what the command line names and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="words of the faults' names; all by default")
    parser.add_argument("--quick", action="store_true", help="as often as the tests try it")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    lost, all_of = 0, 0
    print(HEAD, end="", flush=True)
    for fault in FAULTS:
        if given.names and not any(name in fault.name for name in given.names):
            continue
        begun = time.monotonic()
        try:
            tally = tried(fault, fault.quick if given.quick else fault.long, given.seed)
        except Missing as missing:
            tally = Tally(remark=f"not tried: {missing}")
        print(
            f"{fault.name}: {time.monotonic() - begun:.0f} s", *tally.broken[:10], sep="\n", file=sys.stderr, flush=True
        )
        lost, all_of = lost + len(tally.broken), all_of + tally.tried
        print(row(fault, tally), end="", flush=True)
    print(f"\n{all_of - lost} of {all_of} trials survived.")
    return bool(lost)


if __name__ == "__main__":
    sys.exit(main())
