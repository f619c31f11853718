"""Keyword decks as an attacker or a broken program writes them, made from a good one."""

from __future__ import annotations

import json
import random
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from stemcal.solvers.deck import Deck, deck_text
from stemcal.study.reading import load_study

__all__ = ["COMMENTS", "GOOD", "NAMES", "SETTINGS", "attack", "hostile_decks", "running", "with_settings"]

_STUDY = load_study(Path(__file__).parents[2] / "configs" / "smoke.yaml").with_(
    solver={"element_size": "2 mm", "elements_through_wall": 2}
)
GOOD = deck_text(Deck.of(_STUDY, _STUDY.midlevels(), _STUDY.specimen.outer_diameter))
COMMENTS = "".join(line + "\n" for line in GOOD.splitlines() if line.startswith("$> "))
SETTINGS = json.loads(COMMENTS.replace("$> ", ""))
_TEXTS = ("rate_law", "symmetry", "element")

NAMES = (
    *("a\nsolver: {kind: lsdyna, command: [x]}\n.k", "a\x1b[31m.k", "a\u202eb.k", "a\u2028b.k", "'#: {x}.k", "-n.k"),
    *("a\r\nb.k", "a\x85b.k", "%YAML.k", "&a *b !c.k", "力.k", "\udcff.k", "a" * 200 + ".k"),
)


def running(canary: Path) -> str:
    """Return lines of YAML that name a program of a solver, if they are not data; the program makes the canary."""
    program = json.dumps([sys.executable, "-c", f"open({str(canary)!r}, 'w')", "{{deck}}"])
    return f"solver:\n  kind: lsdyna\n  command: {program}"


def attack(canary: Path) -> str:
    """Return a deck whose comments make a valid spec if they are copied: a quote opens in one and closes in another."""
    short = {name: value for name, value in SETTINGS.items() if name not in ("filter_window", "stop_after_peak")}
    hidden = {"internal_length": '1.6 mm\ntitle: "', "break_drop": f'"\n{running(canary)}'}
    return with_settings({**short, **hidden})


def with_settings(told: object, **dumped: object) -> str:
    """Return the good deck with other comments; a text stands in them as it is."""
    text = told if isinstance(told, str) else json.dumps(told, **dumped)  # type: ignore[arg-type]
    return GOOD.replace(COMMENTS, "".join(f"$> {line}\n" for line in text.split("\n")))


def hostile_decks(canary: Path) -> Iterator[tuple[str, bytes]]:
    """Yield what is wrong and the deck."""
    for name, text in (*_comments(canary), *_keywords(), *_cards(), *_shapes()):
        yield name, text.encode("utf-8", "surrogatepass")
    yield from _bytes()


def _comments(canary: Path) -> Iterator[tuple[str, str]]:
    lines = running(canary)
    for key in SETTINGS:
        yield f"lines of YAML as {key}", with_settings({**SETTINGS, key: lines})
        yield f"lines of YAML as the key {key}", with_settings({**SETTINGS, f"{key}: 1\n{lines}": 1})
        yield f"a list as {key}", with_settings({**SETTINGS, key: [1, {"kind": "lsdyna"}]})
        yield f"no {key}", with_settings({k: value for k, value in SETTINGS.items() if k != key})
    numbers = (
        "NaN",
        "Infinity",
        "-Infinity",
        "1e400",
        "1" + "0" * 400,
        "1" + "0" * 5000,
        "-1",
        "true",
        '"1"',
        '"7 mm"',
    )
    for key in ("edge_spread", "strain_rate_p", "mass_scaling", "time_step", "internal_length"):
        for number in numbers:
            yield f"{number[:20]} as {key}", with_settings(json.dumps({**SETTINGS, key: 0}).replace(
                f'"{key}": 0', f'"{key}": {number}'))  # fmt: skip
    for key in _TEXTS:
        for text in ("\x1b[2Jpaper", "\u202epaper", "", "paper\u2028x: 1", "no", "quarter #", "\udc80"):
            yield f"{text!r} as {key}", with_settings({**SETTINGS, key: text})
    yield "nested brackets", with_settings("[" * 100_000)
    yield "nested mappings", with_settings('{"a":' * 100_000)
    yield "nested in a value", with_settings('{"edge_spread": ' + "[" * 50_000 + "]" * 50_000 + "}")
    yield "a list", with_settings("[1, 2]")
    yield "a number", with_settings("1e3")
    yield "a text", with_settings('"embedded"')
    yield "null", with_settings("null")
    yield "cut in the middle", with_settings(json.dumps(SETTINGS)[:100])
    yield "a key twice", with_settings('{"rate_law": "paper", "rate_law": "x\\nsolver: {}"}')
    yield "only the printed law", with_settings({"rate_law": "paper"})
    yield "empty comments", with_settings("\n\n")


def _keywords() -> Iterator[tuple[str, str]]:
    yield "a lone *", GOOD.replace("*NODE\n", "*\n*NODE\n")
    yield "only a *", "*"
    yield "a * and blanks", "*   \n*KEYWORD\n"
    yield "only *KEYWORD", "*KEYWORD\n"
    yield "only *END", "*END\n"
    yield "nothing but comments", "$ one\n$ two\n"
    yield "no line end", GOOD.rstrip("\n").removesuffix("*END")
    yield "stars", "*\n" * 200_000
    yield "many keywords", "*LOAD_BODY_Z\n" * 200_000
    yield "a long keyword", GOOD.replace("*END", f"*{'A' * 100_000}\n*END")
    for name in ("\x1b[31mRED", "\u202eTHGIR", "A\u2028B", "A\x85B", "A\x0bB", "A\0B", "ẞ", "A\nname: x", "#"):
        yield f"keyword {name!r}", GOOD.replace("*END", f"*LOAD_{name}\n         1\n*END")
    yield "headings of ESC", GOOD.replace("\nstem\n", "\n\x1b]0;title\x07stem\n")
    yield "old line ends", GOOD.replace("\n", "\r")


def _cards() -> Iterator[tuple[str, str]]:
    numbers = (
        "nan",
        "inf",
        "-1e400",
        "1_000",
        "١٢",
        "&E",
        "0x10",
        "1e30",
        "",
        "-1.0",
        "1e-300",
        "1.5.2",
        "--1",
        "1e",
        "+",
    )
    for keyword, old in {
        "*MAT_PIECEWISE_LINEAR_PLASTICITY": "    1000.0",
        "*CONTROL_TERMINATION": "       0.8",
        "*DEFINE_CURVE": "1.6666666666666667",
        "*DATABASE_RCFORC": "     0.004",
    }.items():
        place = GOOD.index(keyword)
        for number in numbers:
            changed = GOOD[place:].replace(old, f"{number:>{len(old)}}", 1)
            assert changed != GOOD[place:]
            yield f"{number!r} under {keyword}", GOOD[:place] + changed
    for field, values in {
        "tssfac": (5, -1, 1e-9), "dt2ms": (1, 1e20, -1e20, -1e-300), "qh": (7, -2), "ihq": (99, 1e9),
        "fs": (5, -1), "fd": (99, -1), "vdc": (-500, 1e9), "dc": (-4,), "sfs": (-1, 1e29, 1e-29), "pr": (0.7, -1),
        "sigy": (-1, 1e29), "etan": (2000, -1), "fail": (-1, 1e29, 1e-29), "c": (1e29, 1e-29), "ro": (1e29, 1e-29),
        "secid": (1.5, -3), "mid": (0.5, 1e12, 7), "pid": (2.5, 9), "elform": (1e9, -77), "dof": (0, 4, 1.5),
        "sf": (0, -1e29), "vad": (2,), "lcid": (0.5, 8), "dt": (1e-29, -1, 1e29), "endtim": (1e-29, 1e29),
    }.items():  # fmt: skip
        for value in values:
            yield f"{field} = {value:g}", _with_field(field, value)
    for keyword in sorted(set(re.findall(r"^\*(\w+)$", GOOD, re.MULTILINE)) - {"KEYWORD", "END"}):
        yield f"no cards under {keyword}", re.sub(rf"(?m)^\*{keyword}\n([^*].*\n)*", f"*{keyword}\n", GOOD)
        yield f"{keyword} twice", GOOD.replace(f"*{keyword}\n", f"*{keyword}\n         1\n*{keyword}\n", 1)


def _with_field(field: str, value: float) -> str:
    """Return the good deck with another number wherever a card has a field of that name."""
    lines = GOOD.splitlines()
    for index, line in enumerate(lines):
        found = re.search(rf"\b{field}$|\b{field} ", line) if line.startswith("$#") else None
        if found and index + 1 < len(lines):
            end = found.start() + len(field)
            lines[index + 1] = f"{lines[index + 1][: end - 10]:{end - 10}}{value:>10g}{lines[index + 1][end:]}"
    return "\n".join(lines) + "\n"


def _shapes() -> Iterator[tuple[str, str]]:
    begin, end = GOOD.index("*NODE\n"), GOOD.index("*ELEMENT_SOLID")
    head, *nodes = GOOD[begin:end].splitlines()
    nodes = [line for line in nodes if not line.startswith("$")]
    places = [(line[:8], [float(line[8 + 16 * i : 24 + 16 * i]) for i in range(3)]) for line in nodes]

    def moved(change: object) -> str:
        lines = (f"{number}" + "".join(f"{value:16.8g}" for value in change(*place)) for number, place in places)  # type: ignore[operator]
        return f"{GOOD[:begin]}{head}\n" + "\n".join(lines) + f"\n{GOOD[end:]}"

    rng = random.Random(1)
    yield "all nodes at one place", moved(lambda x, y, z: (1.0, 1.0, 1.0))
    yield "all nodes in a plane", moved(lambda x, y, z: (x, y, 0.0))
    yield "all nodes in a line", moved(lambda x, y, z: (x, 0.0, 0.0))
    for scale in (1e-25, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e25):
        yield f"nodes times {scale:g}", moved(lambda x, y, z, scale=scale: (scale * x, scale * y, scale * z))
    yield "nodes far away", moved(lambda x, y, z: (x + 1e12, y, z))
    yield "nodes anywhere", moved(lambda x, y, z: tuple(rng.uniform(-30.0, 30.0) for _ in range(3)))
    yield "upside down", moved(lambda x, y, z: (x, y, -z))
    yield "squeezed", moved(lambda x, y, z: (x, y, z * 1e-4))
    yield "no nodes", f"{GOOD[:begin]}{GOOD[end:]}"
    yield "every node number alike", re.sub(r"(?m)^ {7}\d(?= {6,}-?\d+\.\d+ )", "       1", GOOD)
    yield (
        "elements of one node",
        re.sub(r"(?m)^((?: {1,7}\d{1,7}){2})(?: {1,7}\d{1,7}){8}$", r"\1" + "       1" * 8, GOOD),
    )
    yield "cut within the elements", GOOD[: end + 2000]


def _bytes() -> Iterator[tuple[str, bytes]]:
    yield "empty", b""
    yield "blanks", b" \n\t\n"
    yield "only a byte order mark", b"\xef\xbb\xbf"
    yield "only a mark of UTF-16", b"\xff\xfe"
    for encoding in ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-7"):
        yield encoding, GOOD.encode(encoding)
    yield "UTF-16 of odd length", GOOD.encode("utf-16")[:-1]
    yield "zeros", bytes(10_000)
    yield "noise", random.Random(2).randbytes(10_000)
    yield "a zip file", b"PK\x03\x04" + random.Random(3).randbytes(1000)
    yield "no encoding", b"*KEYWORD\n\xff\xff\xff\n*END\n"
    yield "latin-1", GOOD.replace("\nstem\n", "\ntallo de maíz, Ø\n").encode("latin-1")
