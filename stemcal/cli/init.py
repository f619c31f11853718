"""`stemcal init`: a commented spec to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

KITS = ("by-hand",)


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the study and of the file.")] = "my-study",
    crop: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="With published ranges: wheat, rice, rape, sugarcane, chickpea, maize."),
    ] = None,
    kit: Annotated[
        str | None, typer.Option(metavar="NAME", help="Another study to start from: by-hand, whose runs people do.")
    ] = None,
) -> None:
    """Write NAME.yaml, a commented spec to start from. An existing file is left alone.

    Example: [bold]stemcal init maize-2026 --crop maize[/bold]
    """
    from stemcal.cli.console import note, say_whole
    from stemcal.study.reading.template import template

    stem = Path(name).name.removesuffix(".yaml").removesuffix(".yml")
    path = Path(name).with_name(f"{stem}.yaml")
    write_new(path, template(stem, crop) if kit is None else _kit(kit, stem, crop))
    say_whole(str(path))
    given = f'"{path}"' if " " in str(path) else path
    note(f"edit it, then: stemcal check {given}; stemcal plan {given}; stemcal run {given}")


def _kit(kit: str, name: str, crop: str | None) -> str:
    """Return the spec of a kit, for a study of that name."""
    import json
    from importlib.resources import files

    from stemcal.errors import UsageError
    from stemcal.study.reading.template import study_name
    from stemcal.words import did_you_mean

    if kit not in KITS:
        raise UsageError(f"--kit {kit[:60]!r}: there is none; {did_you_mean(kit, KITS)}")
    if crop is not None:
        raise UsageError("--crop is for a study of stems; leave out --kit")
    text = files("stemcal.cli").joinpath(f"{kit}.yaml").read_text(encoding="utf-8")
    return text.replace("runs/@NAME@", f"runs/{name}").replace(
        "@NAME@", json.dumps(study_name(name), ensure_ascii=False)
    )


def write_new(path: Path, text: str) -> None:
    """Write a spec that is not there yet.

    Raises
    ------
    UsageError
        If there is a file of that name, or none can be written.
    """
    from stemcal.errors import UsageError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise UsageError(f"{path} exists already; choose another name or remove it first") from None
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; choose another folder") from None
