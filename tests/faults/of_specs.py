"""What people write into specs: mutations, tags, wrong units, wrong magnitudes."""

from __future__ import annotations

import random
import re
from pathlib import Path

from tally import Fault, Tally, each

from stemcal.errors import SpecError
from stemcal.study.reading import read_study

CONFIGS = Path(__file__).parents[2] / "configs"
SPECS = {path.name: path.read_bytes() for path in sorted(CONFIGS.glob("*.yaml"))}

# ---- specs

WORDS = (
    *(
        b"\0",
        b"\xff",
        b"\t",
        b"{",
        b"}",
        b"[",
        b"]",
        b"&a ",
        b"*a",
        b"!!python/object:os.system ",
        b"<<: ",
        b"%",
        b"---\n",
    ),
    *(
        b"1e999",
        b".inf",
        b"010",
        b"190:20:30",
        b"no",
        b"''",
        b"\xe2\x80\xa8",
        b"[" * 200,
        b"9" * 5000,
        b": ",
        b"\n",
        b"- ",
    ),
)


def mutated_spec(_folder: Path, number: int, rng: random.Random) -> None:
    """Words put in, bytes changed, lines swapped or doubled: a study, or problems with their lines."""
    content = list(SPECS.values())[number % len(SPECS)]
    for _ in range(rng.randint(1, 4)):
        content = _mutated(content, rng)
    try:
        read_study(content, CONFIGS / "mutated.yaml")
    except SpecError as refused:
        assert refused.problems
        assert all(problem.line >= 1 and problem.message for problem in refused.problems)
    except Exception as error:
        raise AssertionError(f"{type(error).__name__}: {error} for {content[:200]!r}") from error


def _mutated(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    match rng.randrange(4):
        case 0:
            return content[:at] + rng.choice(WORDS) + content[at:]
        case 1:
            return content[:at] + bytes([rng.randrange(256)]) + content[at + 1 :]
        case 2:
            return content[:at] + content[at + rng.randint(1, 20) :]
    lines = content.split(b"\n")
    lines.insert(rng.randrange(len(lines)), rng.choice(lines))
    return b"\n".join(lines)


# ---- units

QUANTITY = re.compile(r"(?<![\w.])([0-9.]+(?:e[0-9]+)?) (mm|kg/m3|MPa|N|s|ms|deg|mm/min|1/s)(?![\w/])")
FOREIGN = {"mm": "MPa", "kg/m3": "mm", "MPa": "kg/m3", "N": "mm", "s": "N", "ms": "N", "deg": "mm", "mm/min": "N"}
FOREIGN |= {"1/s": "MPa"}
FORCE_SPECS = tuple(name for name in SPECS if name != "calculix-cantilever.yaml")


def _places(name: str) -> tuple[str, list[re.Match[str]]]:
    """Return a spec without its comments and labels, and every quantity in it."""
    text = re.sub(r"(?m)\s+#.*$|^#.*$", "", SPECS[name].decode("utf-8"))
    text = re.sub(r"\blabel: [^,}\n]+", "label: x", text)
    return text, list(QUANTITY.finditer(text))


def wrong_dimension(_folder: Path, number: int, rng: random.Random) -> None:
    """A quantity of another kind: refused, with its line."""
    name = FORCE_SPECS[number % len(FORCE_SPECS)]
    text, places = _places(name)
    place = rng.choice(places)
    spoiled = text[: place.start(2)] + FOREIGN[place[2]] + text[place.end(2) :]
    line = text.count("\n", 0, place.start()) + 1
    try:
        read_study(spoiled.encode(), CONFIGS / name)
    except SpecError as refused:
        assert any(problem.line == line for problem in refused.problems), f"{name}:{line}: {refused}"
    else:
        raise AssertionError(f"{name}:{line}: {place[0]} in {FOREIGN[place[2]]} was taken")


# What times these powers of ten is still something that exists, such as a blade a thousand times faster.
PLAUSIBLE_TOO = {
    "speed": {3},
    "duration": {-3, 3},
    "gap": {-9, -6, -3, 3},
    "tangent_modulus": {-9, -6, -3, 3},
    "strain_rate_c": {-3, 3},
    "filter_window": {-3},
    "time_limit": {-3},
}


def _key(text: str, place: re.Match[str]) -> str:
    """Return the key before a quantity."""
    found = re.findall(r"(\w+): *$", text[: place.start()])
    return str(found[0]) if found else ""


def wrong_magnitude(_folder: Path, number: int, rng: random.Random) -> None:
    """A quantity times 1e±3, 1e±6 or 1e±9: doubted or refused, unless it is plausible too."""
    name = FORCE_SPECS[number % len(FORCE_SPECS)]
    text, places = _places(name)
    powers = [
        (place, power)
        for place in places
        for power in (-9, -6, -3, 3, 6, 9)
        if float(place[1]) and power not in PLAUSIBLE_TOO.get(_key(text, place), ())
    ]
    place, power = rng.choice(powers)
    value = f"{float(place[1]) * 10.0**power:.6g}"
    spoiled = text[: place.start(1)] + value + text[place.end(1) :]
    line = text.count("\n", 0, place.start()) + 1
    try:
        warnings = read_study(spoiled.encode(), CONFIGS / name).warnings
    except SpecError:
        return
    assert warnings, f"{name}:{line}: {place[0]} times 1e{power} was taken without a word"


def specs_as_python(_place: Path, times: int, _rng: random.Random) -> Tally:
    """Every tag of YAML that could make an object."""
    tags = ("python/object/apply:os.system", "python/name:os.system", "python/module:os", "binary", "timestamp", "set")
    tally = Tally()
    for tag in tags[:times]:
        tally.tried += 1
        text = SPECS["smoke.yaml"].replace(b"title: Coarse", f"title: !!{tag} Coarse".encode())
        try:
            read_study(text, CONFIGS / "tagged.yaml")
            tally.broken.append(f"!!{tag} was taken")
        except SpecError as refused:
            if "tag" not in str(refused):
                tally.broken.append(str(refused))
    return tally


FAULTS = (
    Fault(
        "mutated specs",
        "words put in, bytes changed or taken, lines doubled, in all shipped specs",
        "a study, or every problem with its line; no traceback",
        each(mutated_spec),
        200,
        10_000,
    ),
    Fault(
        "tags that make objects",
        "`!!python/object/apply:os.system` and five more",
        "refused",
        specs_as_python,
        6,
        6,
    ),
    Fault(
        "wrong units",
        "a random quantity of the shipped specs gets a unit of another kind",
        "refused, with its line",
        each(wrong_dimension),
        50,
        1000,
    ),
    Fault(
        "wrong magnitudes",
        "a random quantity of the shipped specs times 1e±3, 1e±6 or 1e±9",
        "doubted or refused, unless it is plausible still (a blade a thousand times faster)",
        each(wrong_magnitude),
        50,
        1000,
    ),
)
