"""`stemcal demo`: a whole small study, to see what comes out."""

from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.console import note
from stemcal.cli.options import OpenPage, Quiet, Workers
from stemcal.errors import UsageError
from stemcal.outputs import write_output

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Where spec and results go.")]


def demo(
    folder: Folder = Path("stemcal-demo"), workers: Workers = None, open_it: OpenPage = False, quiet: Quiet = False
) -> None:
    """Take a small study with a coarse mesh from spec to report; a minute, most of it the first compilation.

    Its forces mean little. The spec that it leaves is yours to change.

    Example: [bold]stemcal demo[/bold]
    """
    from importlib.resources import files

    from stemcal.cli.run import run

    text = files("stemcal.cli").joinpath("demo.yaml").read_text(encoding="utf-8")
    spec = folder / "demo.yaml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not spec.exists():
            write_output(spec, text)
    except OSError as error:
        raise UsageError(f"{folder}: {error.strerror}; choose another folder") from None
    run(spec, out=folder / "results", workers=workers, open_it=open_it, quiet=quiet)
    if not quiet:
        note(f"Open the report, then change {spec} and give: stemcal run {spec} --out {folder / 'results'}")
