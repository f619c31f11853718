"""`stemcal init`: a commented spec to start from."""

from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.console import note, say_whole
from stemcal.errors import UsageError


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the study and of the file.")] = "my-study",
    crop: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="With published ranges: wheat, rice, rape, sugarcane, chickpea, maize."),
    ] = None,
) -> None:
    """Write NAME.yaml, a commented spec to start from. An existing file is left alone.

    Example: [bold]stemcal init maize-2026 --crop maize[/bold]
    """
    from stemcal.study.reading.template import template

    stem = Path(name).name.removesuffix(".yaml").removesuffix(".yml")
    path = Path(name).with_name(f"{stem}.yaml")
    write_new(path, template(stem, crop))
    say_whole(str(path))
    given = f'"{path}"' if " " in str(path) else path
    note("edit it, then")
    for verb in ("check", "plan", "run"):
        note(f"  stemcal {verb} {given}")


def write_new(path: Path, text: str) -> None:
    """Write a spec that is not there yet.

    Raises
    ------
    UsageError
        If there is a file of that name, or none can be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise UsageError(f"{path} exists already; choose another name or remove it first") from None
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; choose another folder") from None
