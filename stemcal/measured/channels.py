"""Which columns of a table are one specimen's displacement and force: named, by their headings, or not at all.

Several specimens may be side by side (力, 位移, 力, 位移, …) or share one displacement. What a heading does not
show is asked for, never guessed; a choice is reported.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from stemcal.errors import UsageError
from stemcal.measured.headings import FORCE, MILLIMETRES, NEWTONS, SECONDS, TIME, TRAVEL, millimetres_in, plain, shown
from stemcal.measured.tables import Form, TextTable, columns_of, given_columns, matching
from stemcal.note import Note, Remedy

NAME_THEM = "give both columns by name or number with --force-column and --displacement-column"
PRELOAD = 5.0  # N
_LABEL = 40  # characters of a label that are kept
_ONLY_DIAMETER = re.compile(r"\W*([dØ]|diameter)?\W*[\d.,]+[ _]?mm\W*", re.IGNORECASE)


@dataclass(frozen=True)
class CurveOptions:
    """How the files of a machine are to be taken; what is None is found out.

    Parameters
    ----------
    force_column, displacement_column, time_column : str, optional
        Name or number of a column; several, for specimens side by side, between commas.
    speed : float, optional
        Of the blade, mm/s: displacement is then time multiplied by it.
    preload : float
        Force in N below which the blade only settles; the curve begins where it is last reached before the rise.
    """

    form: Form = field(default_factory=Form)
    force_column: str | None = None
    displacement_column: str | None = None
    time_column: str | None = None
    force_unit: str | None = None
    displacement_unit: str | None = None
    time_unit: str | None = None
    speed: float | None = None
    preload: float = PRELOAD

    def check(self) -> None:
        """Raise `UsageError` if an option has no sense, or two contradict each other."""
        if self.time_column is not None and self.displacement_column is not None:
            raise UsageError("--time-column and --displacement-column cannot be combined; use one of these options")
        if self.time_column is not None and self.speed is None:
            raise UsageError("--time-column requires the blade speed, as in --speed '20 mm/min'")
        if self.displacement_column is not None and self.speed is not None:
            raise UsageError("--speed and --displacement-column cannot be combined; use one of these options")
        if not 0.0 <= self.preload < math.inf:
            raise UsageError(f"--preload {self.preload:g}: give a force of at least 0 N")


@dataclass(frozen=True)
class Channels:
    """The columns of one specimen: displacement or time, and force; its label, empty if it is the only one.

    `diameter` is that above the columns, mm.
    """

    across: int
    up: int
    timed: bool
    label: str = ""
    diameter: float | None = None


def channels_of(table: TextTable, how: CurveOptions) -> tuple[list[Channels], list[Note]]:
    """Return the channels of every specimen in a table, and notes on the choice.

    Raises
    ------
    UsageError
        If columns have no headings, or these do not show which columns form a pair.
    """
    if not table.headed and (how.force_column is None or (how.displacement_column is None and how.time_column is None)):
        raise UsageError(f"{table.source}: the columns have no headings ({columns_of(table)}); {NAME_THEM}")
    notes: list[Note] = []
    ups = _forces(table, how)
    acrosses, timed = _acrosses(table, how, notes)
    pairs = _paired(table, acrosses, ups, how, notes)
    if any(across == up for across, up in pairs):
        raise UsageError(f"{table.source}: the same column was given for force and displacement; {NAME_THEM}")
    over = _over(table, pairs)
    named = zip(pairs, _labels(over), over, strict=True)
    return [Channels(a, u, timed, label, millimetres_in(text)) for (a, u), label, text in named], notes


def _forces(table: TextTable, how: CurveOptions) -> list[int]:
    if how.force_column is not None:
        return given_columns(table, how.force_column, "force")
    found = matching(table, FORCE, NEWTONS)
    if not found:
        remedy = "name the column with --force-column, and its unit with --force-unit if the heading has none"
        raise UsageError(f"{table.source}: no force column found among {columns_of(table)}; {remedy}")
    return found


def _acrosses(table: TextTable, how: CurveOptions, notes: list[Note]) -> tuple[list[int], bool]:
    """Return the columns of displacement; those of time if there are none, and whether it is time."""
    if how.displacement_column is not None:
        return given_columns(table, how.displacement_column, "displacement"), False
    if how.time_column is not None:
        return given_columns(table, how.time_column, "time"), True
    found, times = matching(table, TRAVEL, MILLIMETRES), matching(table, TIME, SECONDS)
    if found:
        if how.speed is not None:
            notes.append(Note("speed_unused", "info", "The file contains a displacement, so --speed is ignored."))
        return found, False
    if times and how.speed is not None:
        return times, True
    where = f"{table.source}: no displacement column found among {columns_of(table)}"
    if times:
        raise UsageError(f"{where}; give the blade speed, as in --speed '20 mm/min', or the --displacement-column")
    raise UsageError(f"{where}; name the column with --displacement-column")


def _paired(
    table: TextTable, acrosses: Sequence[int], ups: Sequence[int], how: CurveOptions, notes: list[Note]
) -> list[tuple[int, int]]:
    """Return displacement (or time) and force of every specimen."""
    named = (how.displacement_column or how.time_column) is not None
    if how.force_column is not None and named:
        return _as_given(table, acrosses, ups)
    across_alike, up_alike = _are_alike(table, acrosses), _are_alike(table, ups)
    if len(acrosses) == len(ups) > 1:
        if across_alike and up_alike and _alternate(acrosses, ups):
            return list(zip(acrosses, ups, strict=True))
        raise _unclear(table)
    if len(ups) > 1 and up_alike:
        if len(acrosses) > 1:
            raise _unclear(table)
        text = f"{len(ups)} specimens share the displacement column {_name(table, acrosses[0])}."
        remedy = Remedy("If these are channels of one specimen, select one channel with --force-column.")
        notes.append(Note("shared_displacement", "caution", text, remedy))
        return [(acrosses[0], up) for up in ups]
    for what, columns in (("force", ups), ("displacement", acrosses)):
        if len(columns) > 1:
            others = ", ".join(_name(table, column) for column in columns[1:4])
            text = f"The {what} is read from {_name(table, columns[0])}, not from {others}."
            remedy = Remedy(f"Use --{what}-column to read another column.")
            notes.append(Note("column_chosen", "caution", text, remedy))
    return [(acrosses[0], ups[0])]


def _as_given(table: TextTable, acrosses: Sequence[int], ups: Sequence[int]) -> list[tuple[int, int]]:
    """Pair columns in the order in which they were given; one displacement may serve all forces."""
    if len(acrosses) == 1:
        acrosses = [acrosses[0]] * len(ups)
    if len(acrosses) != len(ups):
        raise UsageError(
            f"{table.source}: {len(ups)} force columns but {len(acrosses)} displacement columns were given; give the "
            "same number of each, or one displacement column for all"
        )
    return list(zip(acrosses, ups, strict=True))


def _unclear(table: TextTable) -> UsageError:
    return UsageError(
        f"{table.source}: the headings {columns_of(table)} may mean several specimens or several channels of one "
        f"specimen; {NAME_THEM}, for several specimens as in --force-column 2,4 --displacement-column 1,3"
    )


def _name(table: TextTable, column: int) -> str:
    return shown(table.columns[column])


def _are_alike(table: TextTable, columns: Sequence[int]) -> bool:
    """Return whether names differ in numbers or single letters at most, and units not at all."""
    parts = (re.split(r"[\W\d_]+", plain(table.columns[i])) for i in columns)
    roots = {tuple(part for part in each if len(part) > 1 or not part.isascii()) for each in parts}
    return len(roots) == 1 and len({table.units[i] for i in columns}) == 1


def _alternate(acrosses: Sequence[int], ups: Sequence[int]) -> bool:
    """Return whether displacement and force take turns from left to right, or all of one kind come before the other."""
    kinds = "".join("a" if column in set(acrosses) else "u" for column in sorted((*acrosses, *ups)))
    count = len(acrosses)
    return kinds in ("au" * count, "ua" * count, "a" * count + "u" * count, "u" * count + "a" * count)


def _over(table: TextTable, pairs: Sequence[tuple[int, int]]) -> list[str]:
    """Return the text above the columns of every specimen, or its heading where that holds a diameter."""
    shared = len({across for across, _ in pairs}) < len(pairs)
    found, end = [], -1
    for across, up in pairs:
        begin = up if shared else min(across, up)
        places = [i for i in range(end + 1, max(across, up) + 1) if i < len(table.labels) and table.labels[i]]
        nearest = [i for i in places if i <= begin][-1:] or places[:1]
        text = table.labels[nearest[0]] if nearest else ""
        if not text and len(pairs) > 1 and (diameter := millimetres_in(table.columns[up])):
            text = f"{diameter:g} mm"
        found.append("".join(letter for letter in text if letter.isprintable())[:_LABEL])
        end = max(across, up)
    return found


def _labels(over: Sequence[str]) -> list[str]:
    """Return a name for every specimen: the text above its columns if that is more than a diameter, else its number.

    >>> _labels(["A", "B"]), _labels(["d = 6.1 mm", "d = 6.2 mm"]), _labels(["A", "A"]), _labels(["6.1 mm"])
    (['A', 'B'], ['1', '2'], ['1', '2'], [''])
    """
    if len(over) == 1:
        return [""]
    if len(set(over)) == len(over) and all(over) and not all(map(_ONLY_DIAMETER.fullmatch, over)):
        return list(over)
    return [str(number) for number in range(1, len(over) + 1)]
