"""`stemcal verify-transfer`: does a deck give the force in the user's program that it is to give?"""

from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.options import AsJson, Quiet

DeckOrFolder = Annotated[
    Path,
    typer.Argument(
        metavar="DECK-OR-FOLDER", help="A deck to run, or the folder of one and its finished run.", show_default=False
    ),
]
Within = Annotated[
    float | None,
    typer.Option("--within", metavar="PERCENT", min=0, help="End with 1 if it is farther off.", show_default=False),
]


def verify_transfer(path: DeckOrFolder, within: Within = None, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Tell within how many per cent a deck gives the force that it is to give.

    Decks of export material (check.k) and export deck keep that force. A deck is run by OpenRadioss, where one is
    named by OPENRADIOSS_PATH; of a folder with a deck, the finished run of LS-DYNA (rcforc) or OpenRadioss (…T01.csv)
    is read.

    Example: [bold]stemcal verify-transfer material/check.k[/bold]
    """
    from stemcal.cli.console import say, say_json, waiting, warn
    from stemcal.errors import RunsFailed, UsageError
    from stemcal.files.typed import from_json
    from stemcal.run_warnings import RunWarning
    from stemcal.solvers.check_deck import read_run, run_deck
    from stemcal.text.decks import checked_told
    from stemcal.text.runs import warning_text

    if not path.exists():
        raise UsageError(f"{path} does not exist")
    with waiting(f"{path.name} is run or read", quiet):
        found = read_run(path) if path.is_dir() else run_deck(path)
    answer, off = found.answer, found.off_percent
    if as_json:
        told = {"deck": str(found.deck), "program": found.program, "force_to_give": found.force_to_give}
        say_json({"schema_version": 1, "stage": "verify-transfer", **told, "off_percent": off, **vars(answer)})
    if answer.response is None or off is None:
        raise RunsFailed(f"the run failed ({answer.reason}): {answer.message}")
    first, *rest = checked_told(found.program, answer.response, found.force_to_give)
    if not as_json:
        say(first)
    for sentence in rest:
        warn(sentence)
    for warning in answer.details.get("warnings", []):
        warn(warning_text(from_json(RunWarning, warning)))
    if within is not None and abs(off) > within:
        raise typer.Exit(1)
