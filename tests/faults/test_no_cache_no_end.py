"""Commands that simulate without end."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from fakes import ENVIRONMENT
from trying import CONFIGS, POSIX, heeding, trials

PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}


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
