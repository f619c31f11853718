"""`stemcal explain`: what a term means and where it comes from; the schema of a spec."""

from typing import Annotated

import typer

from stemcal.cli.console import envelope, say, say_json
from stemcal.cli.options import AsJson


def _beginning(typed: str) -> list[str]:
    """Return the terms that begin as what was typed, for the shell to complete."""
    from stemcal.text.glossary import GLOSSARY

    names = {name for entry in GLOSSARY for name in (entry.term, *entry.aliases)}
    return sorted(name for name in names if name.lower().startswith(typed.lower()))


Term = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="TERM", help="A word of the tables or the report, or a key of a spec.", autocompletion=_beginning
    ),
]
Schema = Annotated[bool, typer.Option("--schema", help="Print the JSON schema of a spec, for editors.")]


def explain(term: Term = None, schema: Schema = False, as_json: AsJson = False) -> None:
    """Explain a term and name its source; without a term list all terms.

    With the schema in a file, [bold]# yaml-language-server: $schema=stemcal.schema.json[/bold] at the top of a spec
    lets an editor complete and check it.

    Example: [bold]stemcal explain lack of fit[/bold]

    Example: [bold]stemcal explain --schema > stemcal.schema.json[/bold]
    """
    from dataclasses import asdict

    from stemcal.text.glossary import GLOSSARY, look_up

    if schema:
        _say_schema()
        return
    entries = look_up(" ".join(term)) if term else list(GLOSSARY)
    if as_json:
        say_json({"terms": [asdict(entry) for entry in entries]})
    elif not term:
        say(", ".join(entry.term for entry in entries))
    else:
        from rich.padding import Padding

        for entry in entries:
            say(entry.term, Padding(f"{entry.meaning}\nSource: {entry.source}", (0, 0, 0, 2), expand=False))


def _say_schema() -> None:
    """Print the schema as it goes into a file; with --json it is the result of the envelope."""
    import json
    import sys

    from stemcal.study.reading.json_schema import json_schema

    if envelope.command:
        say_json(json_schema())
    else:
        sys.stdout.write(json.dumps(json_schema(), indent=2, ensure_ascii=True) + "\n")
