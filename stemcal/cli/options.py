"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.console import envelope


def _spec_meant(given: Path) -> Path:
    """Return the file of a spec whose ending was left out."""
    beside = [given.with_name(f"{given.name}{ending}") for ending in (".yaml", ".yml")]
    return next((path for path in beside if path.is_file()), given) if given.name and not given.exists() else given


Spec = Annotated[
    Path,
    typer.Argument(metavar="SPEC", help="Spec of the study, a YAML file.", show_default=False, callback=_spec_meant),
]

Out = Annotated[
    Path | None,
    typer.Option("--out", "-o", metavar="DIR", help="Study folder.", show_default="runs/<study name>"),
]

Workers = Annotated[
    int | None,
    typer.Option("--workers", "-j", metavar="N", min=1, help="Parallel simulations.", show_default="all cores"),
]

ExecutorName = Annotated[
    str,
    typer.Option(
        "--executor",
        metavar="local|dask://HOST:PORT",
        help="Run here or on a Dask cluster.",
    ),
]


def _name_envelope(ctx: typer.Context, value: bool) -> bool:
    if value:
        envelope.command = ctx.command_path.removeprefix(ctx.find_root().command_path).strip()
    return value


AsJson = Annotated[
    bool, typer.Option("--json", help="Print one JSON object and nothing else.", callback=_name_envelope)
]

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print no progress and no notes.")]
