"""What others write into cells, names and messages: nothing executes it, no terminal obeys it, no file breaks on it."""

from __future__ import annotations

import csv
import io
import json
import random
import re
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

from fakes import ENVIRONMENT, FakeSolver, make_study
from tally import Fault, each

from stemcal import workflow
from stemcal.errors import SpecError
from stemcal.executors.inline import InlineExecutor
from stemcal.files.rows import Column, Table
from stemcal.folder.study_folder import StudyFolder
from stemcal.names import Names
from stemcal.overview.status import ledger
from stemcal.report.export.formats import export_tables
from stemcal.report.tables.of_designs import runs_table
from stemcal.report.tables.printed import PaperTable
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.reading import read_study

TRIGGERS = ("=", "+", "-", "@", "＝", "＋", "－", "＠", "−", "\t=", "\r=", " =", "\n+")
BODIES = ("cmd|' /C calc'!A0", "2+3+cmd|'/C calc'!A0", 'HYPERLINK("http://x.y","z")', "SUM(1+1)*cmd|'a'!A", "1;=1+1")
CONTROLS = ("\0", "\x07", "\x1b[2J", "\x1b]0;owned\x07", "\x9b31m", "\u202e", "\u2028", "\x7f", "\r")
LINKS = (
    "[a](https://x.y)",
    "https://x.y",
    "www.x.y",
    "<https://x.y>",
    "a@x.y",
    "mailto:a@x.y",
    "![i](https://x.y/i.png)",
)


def formula(folder: Path, number: int, rng: random.Random) -> None:
    """A formula in a cell or heading of each kind of CSV file begins with an apostrophe, in either separator."""
    cell = TRIGGERS[number % len(TRIGGERS)] + rng.choice(BODIES)
    folder.mkdir(parents=True, exist_ok=True)
    match number // len(TRIGGERS) % 3:
        case 0:
            text = Table((Column(cell), Column("x")), ((cell, 1.5), ("y", -2.5))).csv()
        case 1:
            table = PaperTable(
                5, "a", cell, Table((Column("", cell), Column("x")), ((cell, "−1.5 **"), ("y", "-2.5"))), cell
            )
            text = export_tables([table], "csv", folder)[0].read_text("utf-8-sig")
            assert "-1.5 **" in text
        case _:
            text = _runs_with(folder, message=cell)
    assert "-2.5" in text or "force" in text
    for separator in ",;\t":
        for found in (c for row in csv.reader(io.StringIO(text), delimiter=separator) for c in row):
            bare = found.lstrip(' "')
            harmless = (
                re.fullmatch(r"[-−]?[\d.]+( \*\*)?", bare.strip()) or not bare[:1] or bare[0] not in "=+-@＝＋－＠−\t\r"
            )
            assert harmless or separator != ",", f"{found!r} in {text!r}"
            assert harmless or re.fullmatch(r"[-−][\d.,]+.*", bare), f"{found!r} of {text!r} split at {separator!r}"


def _runs_with(folder: Path, message: str) -> str:
    """Return the table of runs, one of which failed with a message."""
    study, found = make_study(folder, "rsm: {factors: [yield_stress, failure_strain]}\n"), StudyFolder(folder / "out")
    _screened(study, found, message)
    runs = runs_table(ledger(study, found, _Saying(message)), Names(), study.names)
    return runs.headed(study.naming.headings).csv()


class _Saying(FakeSolver):
    """Fails in one run of the screening, with a message."""

    def __init__(self, message: str) -> None:
        super().__init__()
        object.__setattr__(self, "message", message)

    def solve(self, request: Request) -> Answer:
        """Answer, or say the message."""
        if request.stage == "screen" and request.row == 3:
            return Answer("failed", reason="exit_code", message=getattr(self, "message"))  # noqa: B009
        return super().solve(request)


def _screened(study: object, found: StudyFolder, message: str) -> None:
    workflow.run_stage("screen", study, found, InlineExecutor(), solver=_Saying(message))  # type: ignore[arg-type]


def control(folder: Path, number: int, _rng: random.Random) -> None:
    """A control character: refused in a spec, spelled out in a message on the terminal, in records and Word files."""
    folder.mkdir(parents=True, exist_ok=True)
    bad = f"a{CONTROLS[number % len(CONTROLS)]}b"
    match number // len(CONTROLS) % 5:
        case 0 | 1 as place:
            study = make_study(folder)
            key, old = (("symbol", "X1"), ("label", "density of it"))[place]
            text = (
                (folder / "known.yaml")
                .read_text("utf-8")
                .replace("{name: density,", f"{{name: density, {key}: {json.dumps(bad)},")
            )
            try:
                read_study(text.encode(), folder / "known.yaml")
                raise AssertionError(f"{key} {bad!r} was taken, {old}")
            except SpecError as refused:
                assert "control character" in str(refused), str(refused)
            assert study.names
        case 2:
            study, found = make_study(folder), StudyFolder(folder / "out")
            _screened(study, found, bad)
            kept = next(r for r in map(found.peek, found.keys()) if r and r["status"] == "failed")
            assert _is_readable(kept["message"]), kept["message"]
        case 3:
            said = _printed(bad)
            assert _is_readable(said), repr(said)
        case _:
            table = PaperTable(5, "a", bad, Table((Column("", bad), Column("x")), ((bad, "1"), ("y", "2"))), bad)
            for kind in ("md", "tex", "docx"):
                path = export_tables([table], kind, folder)[0]
                whole = zipfile.ZipFile(path).read("word/document.xml") if kind == "docx" else path.read_bytes()
                assert _is_readable(whole.decode("utf-8")), kind


def _is_readable(text: str) -> bool:
    return not re.search(
        "[\0-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2028\u2029\u2066-\u2069]", text.replace("\r\n", "\n")
    )


def _printed(text: str) -> str:
    """Return what the terminal gets of a text as warning, note, error, and cell of a table."""
    code = (
        "import json, sys; from stemcal.cli.console import *; text = json.loads(sys.argv[1]);"
        "from stemcal.files.rows import *; from stemcal.report.terminal import drawn;"
        "table = Table((Column(text), Column('x')), ((text, '1'),), text, (text,));"
        "warn(text); note(text); fail(text); say(text, *drawn(table))"
    )
    command = [sys.executable, "-c", code, json.dumps(text)]
    done = subprocess.run(command, capture_output=True, env=ENVIRONMENT, check=True)
    return (done.stdout + done.stderr).decode("utf-8")


def link(folder: Path, number: int, _rng: random.Random) -> None:
    """A link or a line end in a cell of a Markdown table is text, and the table keeps its rows."""
    folder.mkdir(parents=True, exist_ok=True)
    text = LINKS[number % len(LINKS)] + ("\n| x | y |", "", "\r\n")[number // len(LINKS) % 3]
    table = PaperTable(5, "a", text, Table((Column("", text), Column("x")), ((text, "1"), ("y", "2"))), text)
    found = export_tables([replace(table)], "md", folder)[0].read_text("utf-8")
    assert len([line for line in found.splitlines() if line.startswith("|")]) == 4, found
    assert not re.search(r"(?<!\\)[\[\]<>`@]|(?<!\\)://|(?i:www)\.|mailto:", found), found


FAULTS = (
    Fault(
        "formulas in cells",
        "thirteen ways to begin one, five bodies, in cells, headings and messages of three kinds of CSV files",
        "a text with an apostrophe, in spreadsheets of either separator; numbers stay numbers",
        each(formula),
        28,
        390,
    ),
    Fault(
        "control characters",
        "NUL, escape sequences, changes of direction in symbols, labels, messages, tables",
        "refused in a spec, spelled out on terminal, in records, Markdown, LaTeX and Word",
        each(control),
        30,
        90,
    ),
    Fault(
        "links and line ends in Markdown",
        "seven kinds of links, with line ends, in cells, headings, captions and notes",
        "text; the table keeps its rows",
        each(link),
        21,
        42,
    ),
)
