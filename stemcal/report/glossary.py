"""The glossary: the terms of tables, reports and specs with their meanings and sources."""

import csv
import functools
from dataclasses import dataclass
from importlib.resources import files


@dataclass(frozen=True)
class Term:
    """An entry of the glossary: a term, its meaning, its source, its other names and its Chinese name."""

    term: str
    meaning: str
    source: str
    aliases: tuple[str, ...] = ()
    chinese: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return (self.term, *self.aliases, *filter(None, [self.chinese]))


@functools.cache
def glossary() -> tuple[Term, ...]:
    """Return the terms in `glossary.csv`, where aliases are separated by semicolons."""
    rows = csv.DictReader(files("stemcal.report").joinpath("glossary.csv").read_text(encoding="utf-8").splitlines())
    return tuple(
        Term(
            row["term"], row["meaning"], row["source"], tuple(filter(None, row["aliases"].split("; "))), row["chinese"]
        )
        for row in rows
    )
