"""Commands that have no cache of kernels, or simulate without end."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from fakes import ENVIRONMENT
from trying import CONFIGS, POSIX, heeding, trials

PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}

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
ENDINGS = (("waits", signal.SIGTERM, 143), ("ends", None, 0), ("fails", None, 1), ("waits", signal.SIGINT, 130))


@POSIX
@trials(1, 12)
def test_a_cache_that_cannot_be_written(folder: Path, number: int, _rng: random.Random) -> None:
    """One temporary folder serves command and workers, is told of once, and is gone whatever ends the command."""
    ending, sent, code = ENDINGS[number % len(ENDINGS)]
    for name, text in (("place.py", PLACE), ("command.py", COMMAND), ("occupied", "")):
        (folder / name).write_text(text, encoding="utf-8")
    paths = os.pathsep.join([str(folder), str(ENVIRONMENT["PYTHONPATH"])])
    cache = folder / "occupied" / "deeper" if number % 2 else folder / "occupied"
    environment = {**ENVIRONMENT, "PYTHONPATH": paths, "STEMCAL_CACHE_DIR": str(cache), "TMPDIR": str(folder)}
    python = [sys.executable, str(folder / "command.py"), ending]
    child = subprocess.Popen(python, env=environment, preexec_fn=heeding, **PIPES)
    assert child.stdout is not None
    said = child.stdout.readline().split()
    if sent is not None:
        child.send_signal(sent)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == code, errors[-300:]
    assert len(said) == 1 and Path(said[0]).parent == folder, f"used {said}"
    assert errors.count("STEMCAL_CACHE_DIR") == 1 and "Traceback" not in errors, errors[-300:]
    assert not list(folder.glob("stemcal-kernels-*")), "left behind"


@POSIX
@trials(0, 12)
def test_a_simulation_without_end(folder: Path, number: int, rng: random.Random) -> None:
    """Steps of picoseconds; Ctrl-C and SIGTERM end it in seconds."""
    slowly = "time_step: 1e-15 s\n  time_step_safety: 0.001\n  mass_scaling: 1"
    text = (CONFIGS / "smoke.yaml").read_text("utf-8").replace("mass_scaling: 3e4", slowly, 1)
    (folder / "endless.yaml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "stemcal", "simulate", str(folder / "endless.yaml")]
    child = subprocess.Popen(command, env=ENVIRONMENT, preexec_fn=heeding, **PIPES)
    sent = (signal.SIGINT, signal.SIGTERM)[number % 2]
    time.sleep(rng.uniform(4.0, 12.0))
    assert child.poll() is None, child.communicate()
    child.send_signal(sent)
    began = time.monotonic()
    _, said = child.communicate(timeout=60.0)
    assert child.returncode == 128 + sent and "Traceback" not in said, said
    assert time.monotonic() - began < 10.0
