"""How a program's output becomes one number."""

import re
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, WithJsonSchema, model_validator

from stemcal.naming import CUTTING, Naming
from stemcal.study.model.frozen import Frozen
from stemcal.study.types.field_types import Number, complain


def _inside_run_folder(given: object) -> object:
    """Refuse names that leave the run folder, on any system."""
    if not isinstance(given, str):
        return given
    parts = given.replace("\\", "/").split("/")
    if not given.strip() or "\0" in given or ":" in given or given[0] in "/\\" or ".." in parts or len(given) > 255:
        raise complain(f"{given[:60]!r} is not a file in the run folder", "write its name, such as out.csv")
    return given


def _pattern(given: object, info: ValidationInfo) -> object:
    if not isinstance(given, str):
        return given
    try:
        groups = re.compile(given).groups
    except (re.error, OverflowError, RecursionError) as error:
        raise complain(f"is no regular expression: {error}", "correct it") from None
    if groups == 0:
        raise complain("has no group around the number", f"write it like '{_first(info)} = (\\S+)'")
    return given


def _first(info: ValidationInfo) -> str:
    """Return the name of the first response."""
    naming: Naming = (info.context or {}).get("naming", CUTTING)
    return naming.response.name


RunFile = Annotated[
    str,
    StringConstraints(strict=True),
    BeforeValidator(_inside_run_folder),
    Field(description="The file in the run folder that the program leaves."),
]
Text = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=500)]
Pattern = Annotated[Text, BeforeValidator(_pattern), WithJsonSchema({"type": "string", "format": "regex"})]


class ResultReader(Frozen):
    """A file in the run folder, and how the series of numbers in it becomes one number.

    One of `column` (of a CSV file with a header), `path` (in a JSON file) and `pattern` (in a text file) names the
    numbers.
    """

    file: RunFile
    column: Text | None = None
    """Name of a column of a CSV file with a header."""
    path: Text | None = None
    """Keys and indices in a JSON file, joined by points: `history.force` or `rows.0.force`."""
    pattern: Pattern | None = None
    """Regular expression, searched line by line; the group called y, or the first, is the number, a group x the travel
    of a curve."""
    along: Text | None = None
    """Column or path of the travel of a curve (`curves` of `targets`)."""
    reduction: Literal["max", "min", "first", "last"] = "last"
    """How a series of numbers becomes one: its largest, smallest, first or last."""
    scale: Number = 1.0
    """The number is multiplied by it: 4 for a quarter model, 1e-3 from mN."""

    @model_validator(mode="after")
    def _names_numbers_once(self) -> Self:
        given = [name for name in ("column", "path", "pattern") if getattr(self, name) is not None]
        if len(given) != 1:
            found = f"has {' and '.join(given)}" if given else "does not name the numbers"
            raise complain(found, "write one of column: … (CSV), path: … (JSON) and pattern: … (text)")
        if self.pattern is not None and self.along is not None:
            raise complain("has along and pattern", "call the group of the travel x in the pattern: (?P<x>…)")
        return self
