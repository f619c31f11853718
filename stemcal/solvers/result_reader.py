"""The keys of a result that a program leaves: the file, the numbers in it, and the one that is taken."""

import re
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, WithJsonSchema, model_validator

from stemcal.study.types.field_types import Frozen, Number, complain
from stemcal.vocabulary import CUTTING, Vocabulary


def _inside_run_folder(given: object) -> object:
    """Refuse names that leave the run folder, on any system."""
    if not isinstance(given, str):
        return given
    parts = given.replace("\\", "/").split("/")
    if not given.strip() or "\0" in given or ":" in given or given[0] in "/\\" or ".." in parts or len(given) > 255:
        raise complain(f"{given[:60]!r} is not a file in the run folder", "write a file name, such as out.csv")
    return given


def _pattern(given: object, info: ValidationInfo) -> object:
    if not isinstance(given, str):
        return given
    try:
        groups = re.compile(given).groups
    except (re.error, OverflowError, RecursionError) as error:
        raise complain(f"the pattern is not a valid regular expression: {error}", "correct the expression") from None
    if groups == 0:
        naming: Vocabulary = (info.context or {}).get("naming", CUTTING)
        remedy = f"write a pattern such as '{naming.response.name} = (\\S+)'"
        raise complain("the pattern has no capture group around the number", remedy)
    return given


RunFile = Annotated[
    str,
    StringConstraints(strict=True),
    BeforeValidator(_inside_run_folder),
    Field(description="Name of a file that the program writes to the run folder."),
]
Text = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=500)]
Pattern = Annotated[Text, BeforeValidator(_pattern), WithJsonSchema({"type": "string", "format": "regex"})]


class ResultReader(Frozen):
    """A file in the run folder, and how a series of numbers in it is reduced to one number.

    The numbers are selected by one of `column` (CSV file with a header), `path` (JSON file) and `pattern` (text file).
    """

    file: RunFile
    column: Text | None = None
    """Column that contains the numbers, in a CSV file with a header row."""
    path: Text | None = None
    """Path to the numbers in a JSON file: keys and indices separated by dots, such as `history.force` or
    `rows.0.force`."""
    pattern: Pattern | None = None
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
        given = [name for name in ("column", "path", "pattern") if getattr(self, name) is not None]
        if len(given) != 1:
            wrong = f"has {' and '.join(given)}" if given else "does not specify which numbers to read"
            remedy = "use exactly one of `column: …` (CSV), `path: …` (JSON) and `pattern: …` (text)"
            raise complain(f"the reader {wrong}", remedy)
        if self.pattern is not None and self.along is not None:
            remedy = "remove `along`, and use a group named x for the travel in the pattern: `(?P<x>…)`"
            raise complain("the reader has both `along` and `pattern`", remedy)
        return self
