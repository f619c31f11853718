"""`stemcal explain`: what a term means and where it comes from."""

from typing import Annotated

import typer

from stemcal.cli.console import say, say_json
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


def explain(term: Term = None, as_json: AsJson = False) -> None:
    """Say what a term means, with its source; without a term list all that are known.

    Example: [bold]stemcal explain lack of fit[/bold]
    """
    from dataclasses import asdict

    from stemcal.text.glossary import GLOSSARY, look_up

    entries = look_up(" ".join(term)) if term else list(GLOSSARY)
    if as_json:
        say_json({"schema_version": 1, "stage": "explain", "terms": [asdict(entry) for entry in entries]})
    elif not term:
        say(", ".join(entry.term for entry in entries))
    else:
        from rich.padding import Padding

        for entry in entries:
            say(entry.term, Padding(f"{entry.meaning}\nSource: {entry.source}", (0, 0, 0, 2), expand=False))
