"""Nothing that a program leaves behind takes long to be read."""

import contextlib
import gc
import os
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from stemcal.errors import SimulationFailed, UsageError
from stemcal.solvers.deck.lsdyna import failed_elements, tail
from stemcal.solvers.deck.lsdyna import force_in_rcforc as rcforc_force
from stemcal.solvers.deck.openradioss import (
    deleted_elements,
    force_in_histories,
    starter_errors,
    values_not_read,
)
from stemcal.solvers.readers import read_text
from stemcal.storage.plain import open_plain, read_plain

posix = pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals and files")
WRITTEN = {"ro": 1.1e-9, "e": 1000.0, "pr": 0.3, "sigy": 15.0, "etan": 0.5, "fail": 0.03, "c": 0.0, "p": 0.0}


# ---- files


@posix
@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "socket"])
def test_only_plain_files_are_read(tmp_path: Path, kind: str) -> None:
    place = tmp_path / "messag"
    if kind == "pipe":
        os.mkfifo(place)
    elif kind == "device":
        place.symlink_to("/dev/zero")
    elif kind == "folder":
        place.mkdir()
    else:
        socket.socket(socket.AF_UNIX).bind(str(place))
    with pytest.raises(OSError, match="is a folder" if kind == "folder" else "not a file"):
        open_plain(place)
    assert tail(place) == ""
    assert failed_elements(tmp_path, "element 7 failed at time 0.25") == [0.25]
    with pytest.raises(SimulationFailed):
        read_text(tmp_path, "messag")


def test_so_much_is_read_and_no_more(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"123456")
    assert read_plain(tmp_path / "a", 6) == b"123456"
    with pytest.raises(OSError, match=r"is larger than 4\.77e-06 MiB"):
        read_plain(tmp_path / "a", 5)


# ---- effort


READERS: dict[str, Callable[[str], object]] = {
    "values": lambda text: values_not_read(text, WRITTEN),
    "errors": starter_errors,
    "deleted": lambda text: deleted_elements(text, text),
    "table": lambda text: force_in_histories(text),
    "rcforc": lambda text: rcforc_force(text),
}
TEXTS: dict[str, Callable[[int], str]] = {
    "line ends": lambda n: "\n" * n,
    "blanks": lambda n: " " * n,
    "lines of blanks": lambda n: " \n" * n,
    "points": lambda n: f"   MATERIAL NUMBER = 1\n   A{'.' * n}",
    "points and blanks": lambda n: f"   MATERIAL NUMBER = 1\n   A{' .' * n}",
    "digits": lambda n: "1" * n,
    "digits of a value": lambda n: f"   MATERIAL NUMBER = 1\n   YIELD STRESS = {'1.' * n}",
    "brackets": lambda n: "a (" * n,
    "headings": lambda n: " forces (fx) for set" * n,
    "errors": lambda n: "ERROR ID : 1\n" * n,
    "an error and line ends": lambda n: f"ERROR ID : 1{chr(10) * n}",
    "deleted": lambda n: f"DELETE SOLID ELEMENT NUMBER{' ' * n}",
    "cycles": lambda n: " 1 1 1 A 1" * n,
    "time": lambda n: f" slave 1 time {'1' * n}",
    "keywords": lambda n: "*" * n,
}


def seconds_for(read: Callable[[str], object], text: str) -> float:
    gc.disable()  # a collection takes as long as what the other tests have left is large
    begun = time.process_time()
    with contextlib.suppress(SimulationFailed, UsageError):
        read(text)
    taken = time.process_time() - begun
    gc.enable()
    return taken


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS.keys())
@pytest.mark.parametrize("read", READERS.values(), ids=READERS.keys())
def test_reading_takes_linear_time(read: Callable[[str], object], text: Callable[[int], str]) -> None:
    """Of a text sixteen times as long no more than sixty times as long; a quadratic pattern takes 256 times."""
    short, long = (min(seconds_for(read, text(n)) for _ in range(2)) for n in (8_000, 128_000))
    assert long < 60.0 * max(short, 0.005)
