"""`stemcal enter`: results of runs that no command can start."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stemcal.cli.console import say, say_json
from stemcal.cli.options import AsJson, Out, Quiet, Spec
from stemcal.cli.session import opened
from stemcal.errors import UsageError
from stemcal.files.plain import read_plain

if TYPE_CHECKING:
    from stemcal.by_hand.entering import Entered

Sheet = Annotated[Path, typer.Argument(metavar="SHEET", help="The sheet that is filled in, .csv or .xlsx.")]
_REPLACE = "Let results replace earlier ones, for this reason."
Replace = Annotated[str, typer.Option("--replace", metavar="WHY", help=_REPLACE, show_default=False)]
Who = Annotated[str, typer.Option("--who", metavar="NAME", help="Who enters rows without a name.", show_default="you")]
Sure = Annotated[bool, typer.Option("--yes", "-y", help="Accept values that are far from all others.")]


def enter(
    spec: Spec,
    sheet: Sheet,
    out: Out = None,
    replace: Replace = "",
    who: Who = "",
    sure: Sure = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Enter results of runs done by hand, then continue the study.

    Each row is checked; right rows are recorded, the others are listed with what is wrong. For a run that could not be
    done write [bold]failed: why[/bold]; with --replace, [bold]withdrawn[/bold] takes a result back.

    Example: [bold]stemcal enter my-study.yaml my-sheet.xlsx[/bold]
    """
    from stemcal.by_hand.entering import Correction, enter, user_name
    from stemcal.cli.run import go_through
    from stemcal.solvers.sheet.reading import filled

    content, how = _content(sheet), Correction(replace.strip(), who or user_name(), sure)
    with opened(spec, out, None, "local", quiet, entered=sheet) as work:
        found = enter(work.study, work.folder, filled(content, sheet.name, work.study.by_hand), how)
        if as_json:
            say_json(_entered_json(found))
        else:
            say(found.summary())
        found.require_all()
        show = go_through(work, tell=not as_json)
    if not as_json:
        show(False, quiet)


def _content(file: Path) -> bytes:
    from stemcal.solvers.sheet.reading import MAX_BYTES

    try:
        return read_plain(file, MAX_BYTES)
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}; name the sheet that is filled in") from None


def _entered_json(found: Entered) -> dict[str, object]:
    refused = [{"kind": one.kind, "place": one.place, "run": one.run, "text": str(one)} for one in found.refused]
    return {"schema_version": 1, "stage": "enter", **vars(found), "refused": refused}
