"""A sheet that is filled in, as it stands: cells under the columns of the study, nothing judged yet."""

import csv
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from stemcal.by_hand import workbook
from stemcal.by_hand.sheet import ASKED, REMARK, REPLICATE, RUN, STUDY, WHEN, WHO, Field, entered_responses, fields_of
from stemcal.errors import UsageError
from stemcal.files.plain import MIB
from stemcal.measured.sheets import decoded, is_foreign, is_workbook, text_of_cell
from stemcal.study.model import Study
from stemcal.words import did_you_mean, listed

MAX_BYTES = 10 * MIB
_HEADING = re.compile(r"(.*?)\s*[(\[]([^()\[\]]*)[)\]]\s*")
_WIDE = {code: code - 0xFEE0 for code in range(0xFF01, 0xFF5F)} | {0x3000: 0x20}


@dataclass(frozen=True)
class Filled:
    """What stands on the sheet of one run: texts by response, and by factor, condition and replicate as `levels`.

    `units` are those of the columns. Without `levels` nothing tells that the run is the one that was asked for.
    """

    place: str
    run: str
    values: dict[str, str]
    levels: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    who: str = ""
    when: str = ""
    remark: str = ""
    study: str = ""
    decimal: str = "."
    extra: int = 0

    @property
    def is_empty(self) -> bool:
        """Whether nothing is said of the run yet."""
        return not any(self.values.values()) and not self.remark.casefold().startswith("failed") and not self.extra


def narrow(text: str) -> str:
    """Return a text with the wide letters, digits and signs of Chinese input as plain ones.

    >>> narrow("１２．５（Ｎ）")
    '12.5(N)'
    """
    return text.translate(_WIDE).strip()


def filled(content: bytes, source: str, study: Study) -> list[Filled]:
    """Return what a sheet holds, CSV or workbook, or what a program tells as JSON.

    Raises
    ------
    UsageError
        If it is none of these, or has not the columns of this study.
    """
    if len(content) > MAX_BYTES:
        raise UsageError(f"{source} has more than {MAX_BYTES // MIB} MiB; give the sheet alone")
    if is_workbook(content):
        return _of_workbook(content, source, study)
    if is_foreign(content):
        raise UsageError(f"{source} is a file of a spreadsheet program; open it there and save it as .xlsx or CSV")
    text = decoded(content, None, Path(source))[0]
    if "\0" in text:
        raise UsageError(f"{source} is not text; save the sheet as .xlsx or CSV")
    if text.lstrip()[:1] in ("{", "["):
        return told(_json(text, source), source, study)
    return _of_lines(_split(text, source), source, study)


# ---- a program's JSON


def _json(text: str, source: str) -> object:
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{source} is not JSON: {str(error)[:120]}; give what `stemcal ask --json` prints") from None


def told(given: object, source: str, study: Study) -> list[Filled]:
    """Return what a program tells: runs as `ask` gives them, with numbers under ``responses``, or why it ``failed``."""
    runs = given.get("runs") if isinstance(given, Mapping) else given
    of = text_of_cell(given.get(STUDY)) if isinstance(given, Mapping) else ""
    if not isinstance(runs, Sequence) or isinstance(runs, str):
        raise UsageError(f"{source}: no list of runs; give what `stemcal ask --json` prints, its responses filled in")
    return [_told(run, f"{source}: run {number}", study, of) for number, run in enumerate(runs, 1)]


def _told(run: object, place: str, study: Study, of: str) -> Filled:
    if not isinstance(run, Mapping) or not isinstance(run.get("run"), str):
        raise UsageError(f'{place} has no name; give each as {{"run": "screen 1", "responses": {{…}}}}')
    names = [response.name for response in entered_responses(study)]
    responses, levels = run.get("responses") or {}, run.get("levels") or {}
    if not isinstance(responses, Mapping) or not isinstance(levels, Mapping):
        raise UsageError(f"{place}: responses and levels are mappings from a name to a number")
    for name in responses:
        if name not in names:
            raise UsageError(f"{place}: no response {name!r:.60}; {did_you_mean(str(name), names)}")
    at = study.naming.condition
    places = {} if at is None or run.get("condition") is None else {at.name: text_of_cell(run["condition"])}
    values = {name: text_of_cell(responses.get(name)) for name in names}
    if run.get("failed"):
        values[names[0]] = f"failed: {text_of_cell(run['failed'])}"
    replicate = {} if run.get(REPLICATE) is None else {REPLICATE: text_of_cell(run[REPLICATE])}
    return Filled(
        place,
        run["run"],
        values,
        {str(name): text_of_cell(level) for name, level in levels.items()} | places | replicate,
        who=text_of_cell(run.get(WHO)),
        when=text_of_cell(run.get(WHEN)),
        remark=text_of_cell(run.get(REMARK)),
        study=of,
    )


# ---- a sheet

Lines = Sequence[tuple[int, Sequence[str]]]


def _of_workbook(content: bytes, source: str, study: Study) -> list[Filled]:
    """Return the one sheet of a workbook that has a heading."""
    sheets = [(title, lines) for title, lines in workbook.tables(content, source) if _head(lines) is not None]
    if len(sheets) > 1:
        titles = listed([title for title, _ in sheets])
        raise UsageError(f"{source}: several of its sheets have a heading `{RUN}` ({titles}); leave one of them in it")
    return _of_lines(sheets[0][1] if sheets else [], source, study)


def _split(text: str, source: str) -> Lines:
    """Return line number and cells, split at the mark that gives the heading most columns."""
    found: list[Lines] = []
    for separator in (",", ";", "\t"):
        reader = csv.reader(text.splitlines(keepends=True), delimiter=separator, strict=True)
        try:
            found.append([(reader.line_num, cells) for cells in reader])
        except csv.Error as error:
            raise UsageError(f"{source}:{reader.line_num}: no line of a table ({error}); mend it") from None
    return max(found, key=lambda lines: 0 if (head := _head(lines)) is None else len(lines[head][1]))


def _head(lines: Lines) -> int | None:
    """Return the index of the heading: the first line with a cell `run`."""
    return next((i for i, (_, cells) in enumerate(lines) if RUN in [narrow(c).casefold() for c in cells]), None)


def _of_lines(lines: Lines, source: str, study: Study) -> list[Filled]:
    head = _head(lines)
    if head is None:
        raise UsageError(f"{source}: no line has the heading `{RUN}`; fill in the sheet that stemcal has written")
    columns, units = _columns(lines[head][1], source, study)
    rows = [(number, cells) for number, cells in lines[head + 1 :] if any(cell.strip() for cell in cells)]
    factors = [column for column in columns if column.kind == "factor"]
    numbers = [cells[columns[c]] for _, cells in rows for c in factors if columns[c] < len(cells)]
    decimal = "," if any("," in n for n in numbers) and not any("." in n for n in numbers) else "."
    width = len(lines[head][1])
    return [
        Filled(
            place=f"{source}:{number}",
            run=_of(cells, columns, RUN),
            values={c.name: _at(cells, i) for c, i in columns.items() if c.kind == "response"},
            levels={c.name: _at(cells, i) for c, i in columns.items() if c.kind in ASKED},
            units=units,
            who=_of(cells, columns, WHO),
            when=_of(cells, columns, WHEN),
            remark=_of(cells, columns, REMARK),
            study=_of(cells, columns, STUDY),
            decimal=decimal,
            extra=max(0, len(cells) - width),
        )
        for number, cells in rows
    ]


def _columns(head: Sequence[str], source: str, study: Study) -> tuple[dict[Field, int], dict[str, str]]:
    """Return where each column of the study stands, and the unit that it is headed with."""
    fields, places, units = fields_of(study), {}, {}
    wanted = {title.casefold(): column for column in fields for title in _titles(column)}
    for i, cell in enumerate(head):
        title, unit = _parted(narrow(cell))
        column = wanted.get(title.casefold())
        if column is not None and column in places:
            raise UsageError(f"{source}: two columns are headed {column.heading!r}; delete one")
        if column is not None:
            places[column] = i
            units[column.name] = unit or column.unit
    missing = [column.heading for column in fields if column not in places and column.kind not in ("said", "study")]
    if missing:
        raise UsageError(f"{source}: no column is headed {listed(missing)}; head it as in the sheet of this study")
    return places, units


def _titles(column: Field) -> Iterator[str]:
    yield from filter(None, (column.name, column.label))


def _parted(heading: str) -> tuple[str, str]:
    """Return the title of a column and its unit.

    >>> _parted("force (N)"), _parted("force")
    (('force', 'N'), ('force', ''))
    """
    match = _HEADING.fullmatch(heading)
    return (match[1], match[2].strip()) if match else (heading, "")


def _of(cells: Sequence[str], columns: Mapping[Field, int], name: str) -> str:
    places = [i for column, i in columns.items() if column.name == name and column.kind in ("run", "said", "study")]
    return _at(cells, places[0]) if places else ""


def _at(cells: Sequence[str], place: int) -> str:
    return narrow(cells[place]) if place < len(cells) else ""
