"""`stemcal schema`: the form of a spec, for editors."""

from pathlib import Path
from typing import Annotated

import typer

from stemcal.cli.console import note, say, say_json
from stemcal.errors import UsageError

Target = Annotated[
    Path | None, typer.Option("--out", "-o", metavar="FILE", help="Write it here.", show_default="stdout")
]


def schema(out: Target = None) -> None:
    """Print the JSON schema of a spec; editors complete and check specs with it.

    Put [bold]# yaml-language-server: $schema=stemcal.schema.json[/bold] at the top of a spec.

    Example: [bold]stemcal schema --out stemcal.schema.json[/bold]
    """
    from stemcal.files.durable import as_json, write_durably
    from stemcal.study.reading.json_schema import json_schema

    if out is None:
        say_json(json_schema())
        return
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_durably(out, as_json(json_schema()))
    except OSError as error:
        raise UsageError(f"{out}: {error.strerror}; choose another place") from None
    say(str(out))
    note(f"at the top of a spec beside it: # yaml-language-server: $schema={out.name}")
