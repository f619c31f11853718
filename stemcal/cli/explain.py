"""`stemcal explain`: a glossary of the terms in tables, reports and specs with their sources; the schema of a spec."""

import functools
import json
from dataclasses import asdict
from typing import Annotated

import typer

from stemcal.cli.console import say, say_json, say_text
from stemcal.cli.session import AsJson
from stemcal.errors import UsageError
from stemcal.formats import near, series
from stemcal.report.glossary import Term, glossary


def look_up(term: str) -> list[Term]:
    """Return the entries for a term or a spec key; if there are none, the glossary entries whose names contain `term`.

    Raises `UsageError`, which suggests similar terms, if there is no entry.

    >>> [entry.term for entry in look_up("program")]
    ['solver.program, kind: deck']
    """
    wanted = _plain(term)
    keys = _keys_of_a_spec()
    exact = [entry for entry in (*glossary(), *keys) if wanted in map(_plain, entry.names)]
    matches = exact or [
        entry for entry in glossary() if wanted and any(wanted in _plain(name) for name in (entry.term, entry.chinese))
    ]
    if matches:
        return matches
    for entries in (glossary(), keys):
        names = {_plain(name): entry.term for entry in entries for name in entry.names}
        if meant := [names[name] for name in near(wanted, names, most=3)]:
            raise UsageError(f"{term!r} is not in the glossary; did you mean {', '.join(dict.fromkeys(meant))}?")
    raise UsageError(f"{term!r} is not in the glossary; `stemcal explain` lists all terms")


@functools.cache
def _keys_of_a_spec() -> tuple[Term, ...]:
    """Return an entry for each key of a spec, which can be looked up by its path or by the last part of the path."""
    from stemcal.study.reading.json_schema import meanings

    paths = [place.partition(",")[0].replace("[]", "").rpartition(".") for place in meanings()]
    entries = []
    for (place, meaning), (above, _, name) in zip(meanings().items(), paths, strict=True):
        path = f"{above}.{name}".removeprefix(".")
        keys = dict.fromkeys(key for section, _, key in paths if section == path)
        listed = f"{meaning} Keys: {series(keys)}." if keys else meaning
        entries.append(Term(place, listed, "spec key", (path, name)))
    return tuple(entries)


@functools.cache
def _plain(text: str) -> str:
    """Normalise case, dashes, underscores, superscripts and possessives, which people type differently."""
    table = str.maketrans({"–": "-", "_": " ", "²": "2", "’": "'"})
    return text.strip().lower().translate(table).replace("'s", "").replace("'", "").replace("-", " ")


_Wanted = Annotated[list[str] | None, typer.Argument(metavar="TERM", help="Glossary term or spec key.")]
_Schema = Annotated[bool, typer.Option("--schema", help="Print the JSON schema of the spec for use in an editor.")]


def explain(term: _Wanted = None, schema: _Schema = False, as_json: AsJson = False) -> None:
    """Explain a glossary term or a key of the spec.

    If no term is given, all terms are listed. Terms can be given in English or Chinese. To enable completion of spec
    keys in an editor, save the schema as `stemcal.schema.json` and begin each spec with the line
    `# yaml-language-server: $schema=stemcal.schema.json`.

    Example: [bold]stemcal explain lack of fit[/bold]

    Example: [bold]stemcal explain --schema > stemcal.schema.json[/bold]
    """
    if schema:
        from stemcal.study.reading.json_schema import json_schema

        if as_json:
            say_json(json_schema())
        else:
            say_text(json.dumps(json_schema(), indent=2, ensure_ascii=True))
        return
    entries = look_up(" ".join(term)) if term else list(glossary())
    if as_json:
        say_json({"terms": [asdict(entry) for entry in entries]})
    elif not term:
        say(", ".join(entry.term for entry in entries))
    else:
        from rich.padding import Padding

        for entry in entries:
            say(
                " · ".join(filter(None, (entry.term, entry.chinese))),
                Padding(f"{entry.meaning}\nSource: {entry.source}", (0, 0, 0, 2), expand=False),
            )
