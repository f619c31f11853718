"""How a program's output becomes one number."""

import re
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, WithJsonSchema

from stemcal.naming import CUTTING, Naming
from stemcal.study.model.frozen import Frozen
from stemcal.study.types.field_types import Number, Whole, complain


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
    except re.error as error:
        raise complain(f"is no regular expression: {error}", "mend it") from None
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
    """A file of the run folder and how its series of numbers becomes one.

    ``max, min, first, last`` need the series alone; ``at`` (with `at`, linear between points), ``mean_over``
    (with `over: [from, to]`) and ``work`` (the integral) also need what it is plotted along.
    """

    file: RunFile
    reduction: Literal["max", "min", "first", "last", "at", "mean_over", "work"] = "last"
    """How a series of numbers becomes one: its largest, smallest, first or last, the value `at` a place, the mean
    `over` a stretch, or the integral (work) along what it is plotted against."""
    at: Number | None = None
    """For `reduction: at`: where, in the unit of what the series is plotted along; linear between points."""
    over: tuple[Number, Number] | None = None
    """For `reduction: mean_over`: from and to."""
    scale: Number = 1.0
    """The number is multiplied by it: 4 for a quarter model, 1e-3 from mN."""


class JsonResult(_Result):
    """A number or a list of numbers in a JSON file."""

    kind: Literal["json"]
    """A JSON file."""
    path: Text
    """Keys and indices joined by points: `history.force` or `rows.0.force`."""
    along: Text | None = None
    """The same, of what the series is plotted along."""


class CsvResult(_Result):
    """A column of a CSV file with a header."""

    kind: Literal["csv"]
    """A CSV file with a header."""
    column: Text
    """Name of the column."""
    along: Text | None = None
    """Name of the column it is plotted against."""


class RegexResult(_Result):
    """Numbers found in a text file, line by line."""

    kind: Literal["regex"]
    """A text file, searched line by line."""
    pattern: Pattern
    """Regular expression; the group called y, or the first, is the number, a group x what it is plotted along."""


class RcforcResult(_Result):
    """The force of a contact over time in LS-DYNA's ASCII ``rcforc``, turned so that its peak is positive."""

    kind: Literal["rcforc"]
    """LS-DYNA's ASCII rcforc."""
    file: RunFile = "rcforc"
    interface: Annotated[Whole, Field(ge=1)] = 1
    """Number of the contact."""
    component: Literal["x", "y", "z"] = "z"
    """Direction of the force."""


class CalculixResult(_Result):
    """What CalculiX has printed into its ``.dat`` for a set, over time: ``*NODE PRINT, NSET=TIP`` and ``RF``, say.

    `quantity` and `component` are called as there: ``forces`` and ``fz``, ``displacements`` and ``vx``, ``total
    force``.
    """

    kind: Literal["calculix"]
    """CalculiX's .dat."""
    set: Text
    """Name of the set that is printed."""
    quantity: Text = "forces"
    """What is printed, called as there."""
    component: Text
    """Its component, called as there."""
    node: Annotated[Whole, Field(ge=1)] | None = None
    """The one node of the set; forces are summed over the set without it."""


ResultReader = Annotated[
    JsonResult | CsvResult | RegexResult | RcforcResult | CalculixResult, Field(discriminator="kind")
]
