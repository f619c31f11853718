"""What nobody expects in specs, cells, results and places: a clear message; nothing is believed or executed."""

import json
import math
import random
import re
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
import workflow
from fakes import ENVIRONMENT, FakeSolver, make_study
from trying import CONFIGS, POSIX, command, trials

from stemcal.drawing.table import Column, Table
from stemcal.errors import SimulationFailed, SpecError, UsageError
from stemcal.measured.shear import ShearTests, find_files, measure_shear
from stemcal.report.export import export_tables
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.solvers.readers import read_number
from stemcal.solvers.result_reader import ResultReader
from stemcal.study.reading import read_study

REPLAY, SMOKE = CONFIGS / "paper-replay.yaml", CONFIGS / "smoke.yaml"

# ---- units and magnitudes in specs

QUANTITY = re.compile(r"(?<![\w.])([0-9.]+(?:e[0-9]+)?) (mm|kg/m3|MPa|N|s|ms|deg|mm/min|1/s)(?![\w/])")
FOREIGN = {"mm": "MPa", "kg/m3": "mm", "MPa": "kg/m3", "N": "mm", "s": "N", "ms": "N", "deg": "mm", "mm/min": "N"}
FOREIGN |= {"1/s": "MPa"}
OF_STEMS = tuple(path for path in sorted(CONFIGS.glob("*.yaml")) if path.name != "calculix-cantilever.yaml")
# What times these powers of ten is still something that exists, such as a blade a thousand times faster.
PLAUSIBLE_TOO = {
    "speed": {3}, "duration": {-3, 3}, "gap": {-9, -6, -3, 3}, "tangent_modulus": {-9, -6, -3, 3},
    "strain_rate_c": {-3, 3}, "filter_window": {-3}, "time_limit": {-3},
}  # fmt: skip


def a_quantity_of(path: Path, rng: random.Random) -> tuple[str, re.Match[str], int]:
    """Return a spec without its comments, labels and sources, a quantity in it, and the line of that."""
    text = re.sub(r"(?m)\s+#.*$|^#.*$", "", path.read_text("utf-8"))
    text = re.sub(r"\b(label|source): (\"[^\"]*\"|[^,}\n]+)", r"\1: x", text)
    place = rng.choice(list(QUANTITY.finditer(text)))
    return text, place, text.count("\n", 0, place.start()) + 1


@trials(20, 1000)
def test_a_unit_of_another_kind_is_refused_with_its_line(_folder: Path, number: int, rng: random.Random) -> None:
    path = OF_STEMS[number % len(OF_STEMS)]
    text, place, line = a_quantity_of(path, rng)
    with pytest.raises(SpecError) as refused:
        read_study((text[: place.start(2)] + FOREIGN[place[2]] + text[place.end(2) :]).encode(), path)
    assert any(problem.line == line for problem in refused.value.problems), f"{path.name}:{line}: {place[0]}"


@trials(20, 1000)
def test_a_wrong_magnitude_is_doubted_or_refused(_folder: Path, number: int, rng: random.Random) -> None:
    """Times 1e±3, 1e±6 or 1e±9, unless that is plausible too."""
    path = OF_STEMS[number % len(OF_STEMS)]
    text, place, line = a_quantity_of(path, rng)
    key = re.findall(r"(\w+): *$", text[: place.start()])
    powers = {-9, -6, -3, 3, 6, 9} - PLAUSIBLE_TOO.get(key[0] if key else "", set())
    if not float(place[1]) or not powers:
        return
    value = f"{float(place[1]) * 10.0 ** rng.choice(sorted(powers)):.6g}"
    try:
        warnings = read_study((text[: place.start(1)] + value + text[place.end(1) :]).encode(), path).warnings
    except SpecError:
        return
    assert warnings, f"{path.name}:{line}: {place[0]} as {value} was taken without a word"


@pytest.mark.parametrize("count", [100, 101, 1000])
def test_more_factors_than_can_be_screened(tmp_path: Path, count: int) -> None:
    factors = "\n".join(f"  - {{name: p{i}, low: 1, high: 2}}" for i in range(count))
    text = f"name: many\nfactors:\n{factors}\ntargets: [{{diameter: 8 mm, force: 9 N}}]\n"
    text += "solver: {kind: sheet, file: many.csv}\n"
    (tmp_path / "many.csv").write_text("run,p0,force\nscreen 1,1,2\n", encoding="utf-8")
    if count <= 100:
        assert len(read_study(text.encode(), tmp_path / "many.yaml").factors) == count
        return
    with pytest.raises(SpecError, match=f"the spec has {count} factors, but at most 100 are allowed") as refused:
        read_study(text.encode(), tmp_path / "many.yaml")
    assert len(refused.value.problems) == 1


# ---- control characters, links

CONTROLS = (
    "\0",
    "\x07",
    "\x1b[2J",
    "\x1b]0;owned\x07",
    "\x9b31m",
    "\u202e",
    "\u2028",
    "\x7f",
    "\r",
    *"\xad\u200b\u2060\u3164",
)
UNREADABLE = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2028\u2029\u2066-\u2069]")
LINKS = ("[a](https://x.y)", "https://x.y", "www.x.y", "<https://x.y>", "a@x.y", "mailto:a@x.y", "![i](https://x.y/i)")


class Saying(FakeSolver):
    """Fails in one run of the screening, with a message of control characters."""

    def solve(self, request: Request) -> Answer:
        """Answer, or say it."""
        if request.stage == "screen" and request.row == 3:
            return Answer("failed", reason="exit_code", message="a".join(CONTROLS))
        return super().solve(request)


@pytest.mark.parametrize("key", ["symbol", "label"])
def test_a_control_character_is_refused_in_a_spec(tmp_path: Path, key: str) -> None:
    make_study(tmp_path)
    whole = (tmp_path / "known.yaml").read_text("utf-8")
    for control in CONTROLS:
        text = whole.replace("{name: density,", f"{{name: density, {key}: {json.dumps(f'a{control}b')},")
        with pytest.raises(SpecError, match="control character"):
            read_study(text.encode(), tmp_path / "known.yaml")


@pytest.mark.parametrize(
    "label", ["\u200b", "\u2060\u200b", "\u3164", "\xad", "\u200d\u200c", "\ufe0f", "\u00a0\u200d", "\u0301"]
)
def test_an_invisible_label_is_refused(tmp_path: Path, label: str) -> None:
    make_study(tmp_path)
    whole = (tmp_path / "known.yaml").read_text("utf-8")
    text = whole.replace("{name: density,", f"{{name: density, label: {json.dumps(label)},")
    with pytest.raises(SpecError, match="visible"):
        read_study(text.encode(), tmp_path / "known.yaml")


def test_control_characters_are_spelled_out(tmp_path: Path) -> None:
    """In records, on the terminal, in Markdown, LaTeX and Word."""
    found, bad = StudyFolder(tmp_path / "out"), "a".join(CONTROLS)
    workflow.run_stage("screen", make_study(tmp_path), found, InlineExecutor(), solver=Saying())
    said = [str(record["message"]) for record in map(found.peek, found.keys()) if record]
    said.append(printed(bad))
    for kind in ("md", "tex", "docx"):
        (path,) = export_tables([table_of(bad)], kind, tmp_path)
        whole = zipfile.ZipFile(path).read("word/document.xml") if kind == "docx" else path.read_bytes()
        said.append(whole.decode("utf-8"))
    assert [text for text in said if UNREADABLE.search(text.replace("\r\n", "\n"))] == []


def table_of(text: str) -> Table:
    return Table((Column("", text), Column("x")), ((text, "1"), ("y", "2")), text, (text,))


def printed(text: str) -> str:
    """Return what the terminal gets of a text as warning, note, error, and cell of a table."""
    code = (
        "import json, sys; from stemcal.cli.console import *; text = json.loads(sys.argv[1]);"
        "from stemcal.drawing.table import *; from stemcal.report.terminal import table_drawn as drawn;"
        "table = Table((Column(text), Column('x')), ((text, '1'),), text, (text,));"
        "warn(text); note(text); fail(text); say(text, *drawn(table))"
    )
    python = [sys.executable, "-c", code, json.dumps(text)]
    done = subprocess.run(python, capture_output=True, env=ENVIRONMENT, check=True)
    return (done.stdout + done.stderr).decode("utf-8")


@pytest.mark.parametrize("ending", ["\n| x | y |", "", "\r\n"])
def test_links_and_line_ends_in_markdown_are_text(tmp_path: Path, ending: str) -> None:
    for link in LINKS:
        text = export_tables([table_of(link + ending)], "md", tmp_path)[0].read_text("utf-8")
        assert len([line for line in text.splitlines() if line.startswith("|")]) == 4
        assert not re.search(r"(?<!\\)[\[\]<>`@]|(?<!\\)://|(?i:www)\.|mailto:", text), text


# ---- files of a laboratory

CURVE = [(0.05 * i, round(300.0 * (i / 30) ** 2 if i <= 30 else 300.0 * (40 - i) / 10, 2)) for i in range(40)]


def written(head: str = "Weg (mm);Kraft (N)") -> str:
    """Return the known curve as a machine writes it."""
    return "\n".join([head, *(f"{travel:.2f};{force:.2f}" for travel, force in CURVE), ""])


def measured(folder: Path, content: bytes) -> ShearTests | None:
    """Return what is found in a file, None where it is refused; soon, in few words."""
    (folder / "7mm-1.csv").write_bytes(content)
    began = time.process_time()
    try:
        return measure_shear(find_files(folder))
    except UsageError as error:
        assert 10 < len(str(error)) < 700
        return None
    finally:
        assert time.process_time() - began < 20.0


@trials(20, 2000)
def test_a_damaged_laboratory_file(folder: Path, _number: int, rng: random.Random) -> None:
    """Bytes changed, taken, doubled: a curve of finite numbers, or a message."""
    encoding = rng.choice(["utf-8", "gbk", "utf-16", "cp1251", "cp949"])
    content = bytearray(written("位移;力" if encoding == "gbk" else "Weg;Kraft").encode(encoding, "ignore"))
    for _ in range(rng.randint(1, 20)):
        place = rng.randrange(len(content))
        match rng.randrange(3):
            case 0:
                content[place] = rng.randrange(256)
            case 1:
                del content[place : place + rng.randint(1, 30)]
            case _:
                content[place:place] = content[place : place + rng.randint(1, 30)]
    found = measured(folder, bytes(content))
    assert found is None or all(0.0 < specimen.curve.max_force < math.inf for specimen in found.specimens)


# ---- results of programs

RESULTS: tuple[tuple[ResultReader, bytes], ...] = (
    (
        ResultReader(file="out", path="F", along="x", reduction="max"),
        json.dumps({"F": [0.5 * i for i in range(40)], "x": list(range(40))}).encode(),
    ),
    (
        ResultReader(file="out", column="F", along="t", reduction="max"),
        b"t,F\n" + b"".join(b"%d,%d.25\n" % (i, 2 * i) for i in range(40)),
    ),
    (
        ResultReader(file="out", pattern=r"^force\s+(\S+)\s*;$"),
        b"".join(b"step %d\nforce  %d.5D+00 ;\n" % (i, i) for i in range(40)),
    ),
)
WORDS = (b"nan", b"-inf", b"1e999", b"********", b"\0", b"\xff\xfe", b"9" * 400, b'"', b"{", b",,,,", b"\r", b"null")


@trials(100, 10_000)
def test_a_broken_result_is_no_number_unless_it_still_holds_one(folder: Path, number: int, rng: random.Random) -> None:
    """Cut short, overwritten, binary, blank."""
    reader, content = RESULTS[number % 3]
    at, how = rng.randrange(len(content)), rng.randrange(5)
    word = rng.choice(WORDS) if how < 3 else bytes([rng.randrange(256)])
    spoiled = content[:at] + word + content[at + len(word) :]
    content = {0: content[:at], 4: rng.choice([rng.randbytes(2000), b" \n" * rng.randrange(100)])}.get(how, spoiled)
    (folder / "out").write_bytes(content)
    try:
        force = read_number(reader, folder)
    except SimulationFailed as failure:
        assert failure.reason in {"no_result", "bad_result", "nan"} and len(str(failure)) < 500
    else:
        assert math.isfinite(force) and how != 4
        assert how or reader.path is None, "half a JSON file gave a number"


# ---- links in the place of outputs

# where a link lies in the study folder, and the command that comes upon it
PLACES = (
    *(("log.jsonl", "screen"), (".lock", "screen"), (".lock.holder", "screen"), ("screen.json", "screen")),
    *(("screen.csv", "screen"), ("runs", "screen"), ("report.html", "report"), ("figures", "export figures")),
    *(("figures/pareto.svg", "export figures"), ("figures/pareto.png", "export figures")),
    *(("tables", "export tables --format csv"), ("tables/tables.docx", "export tables --format docx")),
    *(("tables/tables.md", "export tables --format md"), ("mine.k", "export deck"), ("mine.yaml", "init")),
)


@POSIX
@trials(0, 2 * len(PLACES))
def test_a_link_in_the_place_of_an_output(folder: Path, number: int, rng: random.Random) -> None:
    """What it leads to, a file or a folder of the user, is the same as before, whatever the command says."""
    place, verb = PLACES[number % len(PLACES)]
    study, mine = folder / "study", folder / "precious"
    link, name = study / place, verb.split()[0]
    if place in ("runs", "figures", "tables"):
        mine.mkdir()
    elif rng.random() < 0.8:  # else the link leads to what is not there yet
        mine.write_bytes(b"precious")
    if verb != "screen":
        assert command("screen", REPLAY, "--out", study).exit_code == 0
    link.parent.mkdir(parents=True, exist_ok=True)
    link.unlink(missing_ok=True)
    link.symlink_to(mine)
    before = content_of(mine)
    arguments: list[object] = {"export deck": [SMOKE, link], "init": [link.with_suffix("")]}.get(verb, [])
    done = command(*verb.split(), *(arguments or [REPLAY, "--out", study]))
    assert "internal error" not in done.stderr
    assert content_of(mine) == before, f"{verb} wrote through {place}"
    said = "link" in done.stderr or "already exists" in done.stderr
    assert done.exit_code == 0 or said, f"{name}, {place}: exit {done.exit_code}: {done.stderr}"


def content_of(path: Path) -> Any:
    if path.is_dir():
        return sorted(str(inside.relative_to(path)) for inside in path.rglob("*"))
    return path.read_bytes() if path.exists() else None


# ---- studies that no machine can hold

SLOWLY = "time_step: 1e-15 s\n  time_step_safety: 0.001\n  mass_scaling: 1"
MONSTERS = (
    *(("element_size: d/10", f"element_size: {size}") for size in ("0.03 mm", "0.0001 mm", "1e-300 mm", "d/900")),
    *(("length: 30 mm", "length: 1000000 m"), ("length: 30 mm", "length: 1e20 m")),
    ("element_size: d/10\n  mass_scaling: 3e4", f"element_size: d/40\n  {SLOWLY}"),
    ("duration: 0.8 s", "duration: 3e7 s"),
)
COMMANDS = ("check", "run", "screen", "rsm", "validate", "simulate", "export deck")


@trials(3, 56)
def test_a_study_that_no_machine_can_hold(folder: Path, number: int, _rng: random.Random) -> None:
    """With 2 GB: `check` warns, what computes refuses, and all of them at once."""
    verb, spec = COMMANDS[number % len(COMMANDS)], folder / "monster.yaml"
    old, new = MONSTERS[(number + number // len(COMMANDS)) % len(MONSTERS)]
    assert old in SMOKE.read_text("utf-8")
    spec.write_text(SMOKE.read_text("utf-8").replace(old, new, 1), encoding="utf-8")
    deck: list[object] = [folder / "monster.k", "--for", "lsdyna"]
    options = {"check": [], "simulate": [], "export deck": deck}.get(verb, ["--out", folder / "out"])
    began = time.monotonic()
    with mock.patch("stemcal.runs.executors.machine_memory", lambda: 2.0e9):
        result = command(*verb.split(), spec, *options)
    said = " ".join(result.stderr.split())
    assert time.monotonic() - began < 30.0 and "internal error" not in said, said
    if "is too small" in said:  # refused with the spec
        assert result.exit_code == 2 and "solver.element_size" in said
    elif verb == "export deck":
        assert result.exit_code == 0 or "at most 2e+06 are written" in said, said
    else:
        assert "One run needs about" in said or "than 48 h" in said, said
        assert result.exit_code == (0 if verb == "check" else 2)
        assert not list(folder.glob("out/runs/*.json"))
