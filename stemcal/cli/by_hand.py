"""`stemcal enter`, `ask` and `tell`: runs that no command can start, and their results."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stemcal.cli.console import note, say, say_json, say_whole
from stemcal.cli.options import AsJson, Out, Quiet, Spec
from stemcal.cli.session import Session, opened
from stemcal.errors import UsageError
from stemcal.files.plain import read_plain

if TYPE_CHECKING:
    from stemcal.by_hand.entering import Correction, Entered

SOME_REFUSED = 2

Sheet = Annotated[
    Path, typer.Argument(metavar="FILE", help="The sheet, .csv or .xlsx, or JSON; - for what is typed or pasted.")
]
Replace = Annotated[
    bool, typer.Option("--replace", help="Results that differ take the place of those entered before; give a reason.")
]
Reason = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why; the record keeps it.", show_default=False)]
Who = Annotated[str, typer.Option("--who", metavar="NAME", help="Who enters rows without a name.", show_default="you")]
Sure = Annotated[bool, typer.Option("--yes", "-y", help="Take also values that are far from all others.")]


def ask(spec: Spec, out: Out = None, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Go on as far as the results allow, then tell which runs are awaited; write the sheet for them.

    For a study with [bold]solver: {kind: manual}[/bold]. Nothing is awaited at the end: the list is then empty.

    Example: [bold]stemcal ask my-study.yaml --json[/bold]
    """
    from stemcal.by_hand.awaited import gone_on, sheet_rows
    from stemcal.by_hand.face import asked_json, require_manual
    from stemcal.by_hand.handing_out import hand_out
    from stemcal.by_hand.sheet import sheet_text
    from stemcal.text.by_hand import nothing_awaited, waiting_for

    with opened(spec, out, 1, "local", quiet) as work:
        require_manual(work.study)
        waiting = gone_on(work.study, work.folder, work.watch)
        work.folder.remember_spec(work.study.source)
        rows = [] if waiting is None else sheet_rows(work.study, work.folder, waiting)
        if rows:
            sheet = hand_out(work.study.by_hand, work.folder, rows)
    if as_json:
        say_json(asked_json(work.study.by_hand, waiting, rows))
    elif waiting is None:
        say(nothing_awaited(str(spec)))
    else:
        say_whole(*sheet_text(work.study.by_hand, rows).removeprefix("\ufeff").splitlines())
        if not quiet:
            note(waiting_for(len(rows), waiting.stage, str(sheet), str(spec)))


def tell_command() -> Callable[..., None]:
    """Return the command that records results and does nothing else."""
    return _taking("tell", _TELL, goes_on=False)


def enter_command() -> Callable[..., None]:
    """Return the command that records results and goes on."""
    return _taking("enter", _ENTER, goes_on=True)


_TELL = """Record results and do nothing else: for programs, which ask and tell in turn.

FILE is what [bold]stemcal ask SPEC --json[/bold] prints with its responses filled in, or a sheet.

Example: [bold]stemcal tell my-study.yaml results.json[/bold]
"""
_ENTER = """Record the results of a sheet, whole or in part, in any order, and go on as far as they allow.

Each row is checked; those that are right are taken, the others are named with what is wrong. A run that could not
be done is entered as [bold]failed: why[/bold]; with --replace and a reason,
[bold]withdrawn[/bold] takes a result back.

Example: [bold]stemcal enter my-study.yaml runs/my-study/sheet.xlsx[/bold]
"""


def _taking(name: str, help_text: str, *, goes_on: bool) -> Callable[..., None]:
    """Return a command that records results, and goes on from there or not."""

    def command(
        spec: Spec,
        file: Sheet,
        out: Out = None,
        replace: Replace = False,
        reason: Reason = "",
        who: Who = "",
        sure: Sure = False,
        as_json: AsJson = False,
        quiet: Quiet = False,
    ) -> None:

        content, how = _content(file), _correction(replace, reason, who, sure)
        with opened(spec, out, None if goes_on else 1, "local", quiet) as work:
            _show(work, _entered(work, content, file, how), as_json)
            show = _gone_on(work, as_json) if goes_on else None
        if show is not None and not as_json:
            show(False, quiet)

    command.__name__, command.__doc__ = name, help_text
    return command


def _gone_on(work: Session, as_json: bool) -> Callable[..., None]:
    """Take the study to its end; return what shows it."""
    from stemcal.by_hand.handing_out import take_back
    from stemcal.cli.run import go_through

    show = go_through(work, tell=not as_json)
    take_back(work.folder)
    return show


def _content(file: Path) -> bytes:
    """Return what is to be entered; of an input without end so much that it is found too large."""
    from stemcal.by_hand.reading import MAX_BYTES

    if str(file) == "-":
        return sys.stdin.buffer.read(MAX_BYTES + 1)
    try:
        return read_plain(file, MAX_BYTES)
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}; name the sheet that is filled in") from None


def _correction(replace: bool, reason: str, who: str, sure: bool) -> Correction:
    from stemcal.by_hand.entering import Correction
    from stemcal.by_hand.face import user_name

    if replace and not reason.strip():
        raise UsageError('--replace needs a reason, which stays in the record: --reason "read from the wrong column"')
    return Correction(replace, reason.strip(), who or user_name(), sure)


def _entered(work: Session, content: bytes, file: Path, how: Correction) -> Entered:
    """Record what can be taken."""
    from stemcal.by_hand.face import enter_filled, require_manual
    from stemcal.by_hand.reading import filled

    require_manual(work.study)
    source = "standard input" if str(file) == "-" else file.name
    return enter_filled(work.study, work.folder, filled(content, source, work.study.by_hand), how)


def _show(work: Session, found: Entered, as_json: bool) -> None:
    """Tell what was taken; refused rows end the command, and what was taken stays."""
    from stemcal.by_hand.face import entered_json
    from stemcal.text.by_hand import entered, refused
    from stemcal.text.names import Names
    from stemcal.text.notes import sentence

    names = Names(work.study.naming)
    if as_json:
        say_json(entered_json(found, lambda one: sentence(one, names)))
    else:
        say(*entered(found, names))
    if found.refused:
        raise UsageError("\n".join(refused(found, names)))
