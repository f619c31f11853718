"""Every fault a study must survive, tried many times: PYTHONPATH=tests python tests/faults/survey.py [NAME ...]

Prints a table: the fault, how it is caused, what must come of it, how often it was tried and survived. Without a name
it tries all of them, as often as the page "What it survives" says (half an hour to an hour); with words of names,
those. `--seed N` tries other random moments, `--page` puts the rows into docs/survival.md. Exit code 1 if anything
was lost.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections.abc import Mapping
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
PAGE = HERE.parents[1] / "docs" / "survival.md"
BEGIN, END = "<!-- table: tests/faults/survey.py --page -->\n", "<!-- end of table -->\n"
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
    parser.add_argument("--page", action="store_true", help="put the table into docs/survival.md")
    given = parser.parse_args()
    rows, lost, all_of = {}, 0, 0
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
        rows[fault.name], lost, all_of = row(fault, tally), lost + len(tally.broken), all_of + tally.tried
        print(rows[fault.name], end="", flush=True)
    print(f"\n{all_of - lost} of {all_of} trials survived.")
    if given.page:
        put_into_page(rows)
    return bool(lost)


def put_into_page(rows: Mapping[str, str]) -> None:
    """Replace the rows of the page's table that were tried, and keep the others."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    table, _, after = rest.partition(END)
    known = {line.split(" | ")[0].removeprefix("| "): f"{line}\n" for line in table.splitlines()[2:]} | dict(rows)
    body = "".join(known.get(fault.name, "") for fault in FAULTS)
    PAGE.write_text(f"{before}{BEGIN}{HEAD}{body}{END}{after}", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    sys.exit(main())
