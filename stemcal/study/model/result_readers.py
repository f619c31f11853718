"""How a program's output becomes one number."""

import re
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, WithJsonSchema

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


class _Result(Frozen):
    """A file in the run folder, and how the series of numbers in it becomes one number."""

    file: RunFile
    reduction: Literal["max", "min", "first", "last"] = "last"
    """How a series of numbers becomes one: its largest, smallest, first or last."""
    scale: Number = 1.0
    """The number is multiplied by it: 4 for a quarter model, 1e-3 from mN."""


class JsonResult(_Result):
    """A number or a list of numbers in a JSON file."""

    kind: Literal["json"]
    """A JSON file."""
    path: Text
    """Keys and indices joined by points: `history.force` or `rows.0.force`."""
    along: Text | None = None
    """The same, of the travel of a curve (`targets.curves`)."""


class CsvResult(_Result):
    """A column of a CSV file with a header."""

    kind: Literal["csv"]
    """A CSV file with a header."""
    column: Text
    """Name of the column."""
    along: Text | None = None
    """Name of the column with the travel of a curve (`targets.curves`)."""


class RegexResult(_Result):
    """Numbers found in a text file, line by line."""

    kind: Literal["regex"]
    """A text file, searched line by line."""
    pattern: Pattern
    """Regular expression; the group called y, or the first, is the number, a group x the travel of a curve."""


ResultReader = Annotated[JsonResult | CsvResult | RegexResult, Field(discriminator="kind")]
