"""Not OpenRadioss: a stand-in for tests, which replays what OpenRadioss has left in a recorded run.

Called as ``starter``, ``engine`` or ``th_to_csv``; RECORDED names the folder it replays, beside this file. STAND_IN
makes it fail: ``deaf`` echoes another yield stress, ``mute`` none of the material, ``hang`` never ends, ``killed`` dies
of a signal, ``stops`` ends the engine without a word, ``unwritten`` leaves no engine input, ``empty`` no histories.
"""

import gzip
import os
import signal
import sys
import time
from pathlib import Path

HERE = Path(__file__).with_name("openradioss")
FOLDER = os.environ.get("RECORDED", "first")
MODE = os.environ.get("STAND_IN", "")


def recorded(name: str, otherwise: str = "first") -> str:
    for folder in (FOLDER, otherwise):
        for path in (HERE / folder / name, HERE / folder / f"{name}.gz"):
            if path.is_file():
                content = path.read_bytes()
                return (gzip.decompress(content) if path.suffix == ".gz" else content).decode()
    return ""


def leave(name: str, text: str) -> None:
    if text:
        Path(name).write_text(text, encoding="utf-8", newline="\n")


def starter() -> int:
    if "-version" in sys.argv:
        print("OpenRadioss Starter \n\nDate of build : Aug  1 2026\n\nCommitID : bd4557ba7\n")
        return 0
    given = sys.argv[1 + sys.argv.index("-i")]
    assert given == "run.k" or "/BEGIN\nrun\n/INCLUDE_LS-DYNA/\nrun.k\n" in Path(given).read_text(encoding="utf-8")
    assert Path("run.k").read_text(encoding="utf-8").startswith("*KEYWORD")
    code = int(recorded("rc_starter", "none") or 0)
    print(recorded("starter.log", "none"))
    listing = recorded("run_0000.out", "none" if code else "first")
    if MODE == "deaf":
        listing = listing.replace("18.07000000000", "60.00000000000")
    if MODE == "mute":
        listing = listing[listing.index("TERMINATION WITH WARNING") :]
    leave("run_0000.out", listing)
    if code == 0:
        leave("run_0000_0001.rst", "binary")
        leave("run_0001.rad", "" if MODE == "unwritten" else recorded("run_0001.rad"))
    return code


def engine() -> int:
    assert "/RUN/run/1/" in Path("run_0001.rad").read_text(encoding="utf-8")
    assert "-i run_0001.rad" in " ".join(sys.argv)
    if MODE == "hang":
        time.sleep(60)
    if MODE == "killed":
        os.kill(os.getpid(), signal.SIGSEGV)
    if MODE == "stops":
        return 0
    print(recorded("engine.log", "none"))
    leave("run_0001.out", recorded("run_0001.out"))
    code = int(recorded("rc_engine", "none") or 0)
    if code == 0 and MODE != "empty":
        leave("runT01", "binary")
        leave("run_0001_0001.rst", "binary")
    return code


def th_to_csv() -> int:
    if not Path("runT01").is_file():
        return 136
    leave("runT01.csv", recorded("runT01.csv"))
    return 0


if __name__ == "__main__":
    sys.exit({"starter": starter, "engine": engine, "th_to_csv": th_to_csv}[sys.argv.pop(1)]())
