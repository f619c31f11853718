"""What others may have laid in the way: links in the place of outputs, compiled code, and a command that is stopped."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from fakes import ENVIRONMENT
from of_processes import SLOW_SPEC, heeding, posix
from tally import Fault, Missing, each

ROOT = Path(__file__).parents[2]
REPLAY = ROOT / "configs" / "paper-replay.yaml"
SMOKE = ROOT / "configs" / "smoke.yaml"

# where a link lies in the study folder, and the command that comes upon it
LINKS = (
    *(("log.jsonl", "screen"), (".lock", "screen"), (".lock.holder", "screen"), ("screen.json", "screen")),
    *(("screen.csv", "screen"), ("runs", "screen"), ("report.html", "report"), ("figures", "export figures")),
    *(
        ("figures/pareto.svg", "export figures"),
        ("figures/pareto.png", "export figures"),
        ("tables", "export tables --format csv"),
    ),
    *(("tables/tables.docx", "export tables --format docx"), ("tables/tables.md", "export tables --format md")),
    *(("mine.k", "export deck"), ("mine.yaml", "init")),
)


def a_link_lies_there(folder: Path, number: int, rng: random.Random) -> None:
    """What the link leads to, a file or a folder of the user, is the same as before, whatever the command says."""
    posix()
    place, verb = LINKS[number % len(LINKS)]
    study, mine = folder / "study", folder / "precious"
    is_folder = place in ("runs", "figures", "tables")
    if is_folder:
        mine.mkdir()
    elif rng.random() < 0.8:  # else the link leads to what is not there yet
        mine.write_bytes(b"precious")
    if verb != "screen":
        assert _command("screen", REPLAY, "--out", study).returncode == 0
    link = study / place
    link.parent.mkdir(parents=True, exist_ok=True)
    if link.is_dir() and not link.is_symlink():
        link.rmdir()
    link.unlink(missing_ok=True)
    link.symlink_to(mine)
    before = _content(mine)
    done = _command(*_arguments(verb, study, link))
    assert "Traceback" not in done.stderr and "internal error" not in done.stderr, done.stderr[-300:]
    assert _content(mine) == before, f"{verb} wrote through {place}"
    said = "link" in done.stderr or "exists already" in done.stderr
    assert done.returncode == 0 or said, f"{verb}, {place}: exit {done.returncode}: {done.stderr}"


def _arguments(verb: str, study: Path, link: Path) -> list[object]:
    name, *options = verb.split()
    match name:
        case "export" if options == ["deck"]:
            return ["export", "deck", SMOKE, link]
        case "export":
            return [name, options[0], REPLAY, "--out", study, *options[1:]]
        case "init":
            return ["init", link.with_suffix("")]
        case _:
            return [name, REPLAY, "--out", study, *options]


def _command(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "stemcal", *map(str, arguments)],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
        check=False,
        timeout=120,
    )


def _content(path: Path) -> object:
    if path.is_dir():
        return sorted(str(p.relative_to(path)) for p in path.rglob("*"))
    return path.read_bytes() if path.exists() else None


# ---- compiled code that is not ours

# Unpickled, it makes the canary; numba unpickles the index of a cached function when that is first called.
CANARY = """
import pathlib, pickle, sys
class Canary:
    def __reduce__(self):
        return pathlib.Path.touch, (pathlib.Path(sys.argv[2]),)
folder = pathlib.Path(sys.argv[1])
for path in folder.rglob("*.nb*"):
    path.write_bytes(pickle.dumps(Canary()))
"""
CALL = """
from stemcal.fem.kernels.compile import CACHE, entry
from small import double
print(CACHE, double(21))
"""
SMALL = "from stemcal.fem.kernels.compile import entry\n@entry\ndef double(x):\n    return 2 * x\n"
OPENINGS = ("others write the folder", "others write a file", "someone else's", "someone else's file", "a link")


def strange_cache(folder: Path, number: int, _rng: random.Random) -> None:
    """Code that somebody else could have put there is not executed; the same function is compiled elsewhere."""
    posix()
    opening, canary = OPENINGS[number % len(OPENINGS)], folder / "canary"
    (folder / "small.py").write_text(SMALL, encoding="utf-8")
    paths = os.pathsep.join([str(folder), str(ENVIRONMENT["PYTHONPATH"])])
    environment = {**ENVIRONMENT, "PYTHONPATH": paths, "STEMCAL_CACHE_DIR": str(folder / "cache")}
    first = _python(CALL, environment)
    cache = Path(first.stdout.split()[0])
    assert first.stdout.endswith(" 42\n") and list(cache.rglob("*.nbi")), first.stderr
    _python(CANARY, environment, str(cache), str(canary))
    _open(opening, cache)
    again = _python(CALL, environment)
    assert again.stdout.endswith(" 42\n"), again.stderr
    assert not canary.exists(), "code of somebody else was executed"
    used = Path(again.stdout.split()[0])
    assert used != cache, "the folder is used"
    assert not used.exists(), "the temporary folder is left behind"
    cache.chmod(0o700)


def _open(opening: str, cache: Path) -> None:
    files = sorted(cache.rglob("*.nbi"))
    if opening == "others write the folder":
        cache.chmod(0o777)
    elif opening == "others write a file":
        cache.chmod(0o755)
        files[0].chmod(0o666)
    elif opening == "a link":
        cache.rename(cache.with_name("elsewhere"))
        cache.symlink_to(cache.with_name("elsewhere"))
    elif os.geteuid() != 0:
        raise Missing("needs root, to give a folder away")
    else:
        os.chown(cache if opening == "someone else's" else files[0], 12345, 12345)


def _python(code: str, environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False, timeout=120)


# ---- a cache that cannot be written

PLACE = """
import time
def of_kernels():
    from stemcal.fem.kernels.compile import CACHE
    time.sleep(0.1)
    return str(CACHE)
"""
COMMAND = """
import sys, time
import typer
import stemcal.fem.warm as warm
from place import of_kernels
from stemcal.cli.guard import exit_codes
from stemcal.executors.local import LocalExecutor
if __name__ == "__main__":
    warm._smallest_simulation = lambda *_: None
    warm._compiled_elsewhere = lambda *_: True
    try:
        with exit_codes():
            warm.warm()
            with LocalExecutor(2) as executor:
                found = {executor.submit(of_kernels).result() for _ in range(3)} | {str(warm.CACHE)}
            print(*found, flush=True)
            if sys.argv[1] == "fails":
                raise OSError(5, "as it must")
            time.sleep(60 if sys.argv[1] == "waits" else 0)
    except typer.Exit as ended:
        sys.exit(ended.exit_code)
"""
ENDINGS = (("ends", None, 0), ("fails", None, 1), ("waits", signal.SIGINT, 130), ("waits", signal.SIGTERM, 143))


def unwritable_cache(folder: Path, number: int, _rng: random.Random) -> None:
    """One temporary folder serves command and workers, is told of once, and is gone whatever ends the command."""
    posix()
    ending, sent, code = ENDINGS[number % len(ENDINGS)]
    for name, text in (("place.py", PLACE), ("command.py", COMMAND), ("occupied", "")):
        (folder / name).write_text(text, encoding="utf-8")
    paths = os.pathsep.join([str(folder), str(ENVIRONMENT["PYTHONPATH"])])
    cache = folder / "occupied" / "deeper" if number % 2 else folder / "occupied"
    environment = {**ENVIRONMENT, "PYTHONPATH": paths, "STEMCAL_CACHE_DIR": str(cache), "TMPDIR": str(folder)}
    child = subprocess.Popen(
        [sys.executable, str(folder / "command.py"), ending],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        preexec_fn=heeding,
    )
    assert child.stdout is not None
    said = child.stdout.readline().split()
    if sent is not None:
        child.send_signal(sent)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == code, f"exit {child.returncode}: {errors[-300:]}"
    assert len(said) == 1 and Path(said[0]).parent == folder, f"used {said}"
    assert errors.count("STEMCAL_CACHE_DIR") == 1 and "Traceback" not in errors, errors[-300:]
    assert not list(folder.glob("stemcal-kernels-*")), "left behind"


# ---- a command that is stopped


def stopped(folder: Path, _number: int, rng: random.Random) -> None:
    """Ctrl-Z and, later than the limit of a run, `fg`: no run has failed, and none was done twice."""
    posix()
    spec = folder / "slow.yaml"
    text = SLOW_SPEC.format(python=json.dumps(sys.executable)).replace("command\n", "command\n  time_limit: 3 s\n", 1)
    spec.write_text(text.replace("time.sleep(0.3)", "time.sleep(0.8)"), encoding="utf-8")
    command = [sys.executable, "-m", "stemcal", "screen", str(spec), "--out", str(folder / "out"), "--workers", "2"]
    child = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT, start_new_session=True
    )
    end = time.monotonic() + 30.0
    while not (folder / "out" / "runs").is_dir() and time.monotonic() < end:
        time.sleep(0.02)
    time.sleep(rng.uniform(0.0, 4.0))
    os.killpg(child.pid, signal.SIGSTOP)
    time.sleep(4.5)
    os.killpg(child.pid, signal.SIGCONT)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == 0, errors[-300:]
    records = [json.loads(path.read_text("utf-8")) for path in (folder / "out" / "runs").glob("*.json")]
    assert records and all(r["status"] == "ok" and "tries" not in r["provenance"] for r in records)


FAULTS = (
    Fault(
        "a link in the place of an output",
        "links laid at seventeen places that commands write, to a file or a folder of the user, or to nowhere",
        "what it leads to is untouched; refused with the place and the remedy, or the link is replaced",
        each(a_link_lies_there),
        5,
        34,
    ),
    Fault(
        "compiled code of somebody else",
        "pickles that make a canary file in a cache that others may write, own, or have laid a link to",
        "not executed; compiled anew into a temporary folder that is gone afterwards",
        each(strange_cache),
        2,
        20,
    ),
    Fault(
        "a cache that cannot be written",
        "a file in its place; the command, with two workers, ends, fails, or gets Ctrl-C or SIGTERM",
        "one temporary folder for all its processes, one warning, nothing left behind",
        each(unwritable_cache),
        3,
        12,
    ),
    Fault(
        "the command is stopped",
        "SIGSTOP for longer than the limit of a run, at a random moment of a screening; then SIGCONT",
        "no run has timed out, none is done twice",
        each(stopped),
        1,
        12,
    ),
)
