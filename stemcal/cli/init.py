"""`stemcal init`: a commented spec to start from."""

import json
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.console import note, say_whole
from stemcal.errors import UsageError

MORE = "# ---- Everything below"  # begins what only --full writes


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the study and of its file.")] = "my-study",
    full: Annotated[bool, typer.Option("--full", help="Include the keys that have a default.")] = False,
) -> None:
    """Write a commented spec to start from.

    The file is NAME.yaml; an existing file is not overwritten.

    Example: [bold]stemcal init my-stems[/bold]
    """
    stem = Path(name).name.removesuffix(".yaml").removesuffix(".yml")
    path = Path(name).with_name(f"{stem}.yaml")
    write_new(path, spec_text(stem, full))
    say_whole(str(path))
    given = f'"{path}"' if " " in str(path) else path
    note("edit it, then")
    for verb in ("check", "run"):
        note(f"  stemcal {verb} {given}")


def spec_text(name: str, full: bool = False) -> str:
    """Return the commented spec of a study called `name`; raise `UsageError` if no study can have that name."""
    from pydantic import TypeAdapter, ValidationError

    from stemcal.study.types.field_types import StudyName

    try:
        TypeAdapter(StudyName).validate_python(name)
    except ValidationError as error:
        problem = error.errors()[0].get("ctx", {})
        raise UsageError(f"{problem['message']}; {problem['remedy']}") from None
    text = files("stemcal.cli").joinpath("study.yaml").read_text(encoding="utf-8")
    text = text.replace("@NAME@", json.dumps(name, ensure_ascii=False), 1)
    return text if full else text[: text.index(MORE)]


def write_new(path: Path, text: str) -> None:
    """Write a file; raise `UsageError` if there is one of that name, or none can be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise UsageError(f"{path} already exists; choose another name or remove it first") from None
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; choose another folder") from None
