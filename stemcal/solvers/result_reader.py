"""The keys of `result` in a spec: the result file of a program, the series of numbers in it, and their reduction."""

import re
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, WithJsonSchema, model_validator

from stemcal.study.types.field_types import Frozen, Number, complain
from stemcal.vocabulary import CUTTING, Vocabulary


def _inside_run_folder(value: object) -> object:
    """Refuse a path that leads out of the run folder on any operating system."""
    if not isinstance(value, str):
        return value
    parts = value.replace("\\", "/").split("/")
    if not value.strip() or "\0" in value or ":" in value or value[0] in "/\\" or ".." in parts or len(value) > 255:
        raise complain(f"{value[:60]!r} is not a file in the run folder", "write a file name, such as out.csv")
    return value


def _pattern(value: object, info: ValidationInfo) -> object:
    if not isinstance(value, str):
        return value
    try:
        groups = re.compile(value).groups
    except (re.error, OverflowError, RecursionError) as error:
        raise complain(f"the pattern is not a valid regular expression: {error}", "correct the expression") from None
    if groups == 0:
        naming: Vocabulary = (info.context or {}).get("naming", CUTTING)
        remedy = f"write a pattern such as '{naming.response.name} = (\\S+)'"
        raise complain("the pattern has no capture group around the number", remedy)
    return value


_RunFile = Annotated[
    str,
    StringConstraints(strict=True),
    BeforeValidator(_inside_run_folder),
    Field(description="Name of a file that the program writes to the run folder."),
]
Text = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=500)]
_Pattern = Annotated[Text, BeforeValidator(_pattern), WithJsonSchema({"type": "string", "format": "regex"})]


class ResultReader(Frozen):
    """A file in the run folder, and how a series of numbers in it is reduced to one number.

    The numbers are selected by one of `column` (CSV file with a header), `path` (JSON file) and `pattern` (text file).
    """

    file: _RunFile
    column: Text | None = None
    """Column that contains the numbers, in a CSV file with a header row."""
    path: Text | None = None
    """Path to the numbers in a JSON file: keys and indices separated by dots, such as `history.force` or
    `rows.0.force`."""
    pattern: _Pattern | None = None
    """Regular expression that is applied to each line. The group `y` contains the number; if there is no group `y`, the
    first group contains the number. An optional group `x` contains the travel of a curve."""
    along: Text | None = None
    """Column or path of the blade travel, for `curves` under `targets`."""
    reduction: Literal["max", "min", "first", "last"] = "last"
    """Number that is selected from a series: the largest, smallest, first or last number."""
    ends_with: Text | None = None
    """Text that the program writes at its end, such as `NORMAL TERMINATION`. It must be in one of the last 10 lines of
    the result file or of the printed output; otherwise the run fails. Without this key, the result of a program that
    stopped early is accepted if its exit code is 0."""
    scale: Number = 1.0
    """Factor by which the number is multiplied, such as 4 for a quarter model or 1e-3 for mN."""

    @model_validator(mode="after")
    def _names_numbers_once(self) -> Self:
        keys = [name for name in ("column", "path", "pattern") if getattr(self, name) is not None]
        if len(keys) != 1:
            wrong = f"has {' and '.join(keys)}" if keys else "does not specify which numbers to read"
            remedy = "use exactly one of `column: …` (CSV), `path: …` (JSON) and `pattern: …` (text)"
            raise complain(f"the reader {wrong}", remedy)
        if self.pattern is not None and self.along is not None:
            remedy = "remove `along`, and use a group named x for the travel in the pattern: `(?P<x>…)`"
            raise complain("the reader has both `along` and `pattern`", remedy)
        return self
