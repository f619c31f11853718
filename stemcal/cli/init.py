"""`stemcal init`: a commented spec to start from."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.console import note, say_whole
from stemcal.errors import UsageError
from stemcal.files.plain import holds
from stemcal.kits import KITS
from stemcal.words import did_you_mean


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the study and of the file.")] = "my-study",
    crop: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="With published ranges: wheat, rice, rape, sugarcane, chickpea, maize."),
    ] = None,
    kit: Annotated[
        str | None,
        typer.Option(metavar="NAME", help=f"Another study to start from, with its files: {', '.join(KITS)}."),
    ] = None,
) -> None:
    """Write NAME.yaml, a commented spec to start from, and the files of a kit. An existing file is left alone.

    Example: [bold]stemcal init maize-2026 --crop maize[/bold]
    """
    from stemcal.study.reading.template import template

    stem = Path(name).name.removesuffix(".yaml").removesuffix(".yml")
    path = Path(name).with_name(f"{stem}.yaml")
    texts = {path: template(stem, crop)} if kit is None else _kit(kit, path, crop)
    # another kit of the folder may have the same files
    texts = {file: text for file, text in texts.items() if file == path or not holds(file, text.encode("utf-8"))}
    require_new(texts)
    for file, text in texts.items():
        write_new(file, text)
        say_whole(str(file))
    given = f'"{path}"' if " " in str(path) else path
    note("edit it, then")
    for verb in ("check", "plan", "run"):
        note(f"  stemcal {verb} {given}")


def _kit(kit: str, path: Path, crop: str | None) -> dict[Path, str]:
    """Return the spec of a kit, for a study of that name, and the files of the kit beside it."""
    import json

    from stemcal.kits import kit_text
    from stemcal.study.reading.template import study_name

    if kit not in KITS:
        raise UsageError(f"--kit {kit[:60]!r}: there is none; {did_you_mean(kit, KITS)}")
    if crop is not None:
        raise UsageError("--crop is for a study of stems; leave out --kit")
    name = json.dumps(study_name(path.stem), ensure_ascii=False)
    spec = kit_text(kit).replace("runs/@NAME@", f"runs/{path.stem}").replace("@NAME@", name)
    return {path: spec} | {path.parent / file: kit_text(file) for file in KITS[kit]}


def require_new(paths: Iterable[Path]) -> None:
    """Raise `UsageError` if one of these files is there already, before any is written."""
    for path in paths:
        if path.exists() or path.is_symlink():
            raise UsageError(f"{path} exists already; choose another name or remove it first")


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
