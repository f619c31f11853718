"""Work goes on when a reader has gone or progress cannot be written; data that a full disk refuses is an error."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from commanding import REPLAY, ROOT

posix = pytest.mark.skipif(sys.platform == "win32", reason="shells differ")
STEMCAL = f"'{sys.executable}' -m stemcal"
SCREEN = f"{STEMCAL} screen '{REPLAY}' --out out"


def first_of(*cases: str) -> list[Any]:
    """Try the first case in every run of the tests, the others among the slow ones."""
    return [cases[0], *(pytest.param(case, marks=pytest.mark.slow) for case in cases[1:])]


def shell(folder: Path, line: str) -> subprocess.CompletedProcess[str]:
    """Run a line of the shell; a pipe ends with the code of stemcal."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "STEMCAL_CACHE_DIR": str(folder / "cache")}
    line = f"set -o pipefail; {line}"
    return subprocess.run(
        ["bash", "-c", line], cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )


@posix
@pytest.mark.parametrize("reader", first_of("2>&1 | true", "2>&1 | head -1", "| head -c 1", "2>&1 >/dev/null | true"))
def test_work_goes_on_when_the_reader_has_gone(tmp_path: Path, reader: str) -> None:
    done = shell(tmp_path, f"{SCREEN} {reader}")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "screen.json").is_file()
    assert "Traceback" not in done.stderr and "Exception" not in done.stderr


@posix
@pytest.mark.parametrize("where", first_of("2>&-", ">&-", ">&- 2>&- <&-"))
def test_study_is_finished_with_closed_outputs(tmp_path: Path, where: str) -> None:
    done = shell(tmp_path, f"{SCREEN} {where}")
    assert done.returncode == 0 and (tmp_path / "out" / "screen.json").is_file()
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device")
@pytest.mark.parametrize("asked", first_of("screen", "status --json"))
def test_a_full_disk_behind_an_output_is_an_error(replayed: Path, asked: str) -> None:
    """Files are written all the same, and Python adds nothing."""
    (replayed / "screen.csv").unlink()
    done = shell(replayed, f"{STEMCAL} {asked} '{REPLAY}' --out . >/dev/full")
    assert done.returncode == 1 and "No space left" in done.stderr
    assert (replayed / "screen.csv").is_file() == (asked == "screen")
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device")
def test_progress_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    """Nor do a class of the user that prints, a warning or an error: the exit code remains that of the work."""
    (tmp_path / "ring.py").write_text(
        "import sys\nprint('loaded', flush=True)\n\n\nclass Ring:\n    def solve(self, levels, condition):\n"
        "        print('run', flush=True)\n        print('run', file=sys.stderr, flush=True)\n"
        "        return {'force': levels['yield_stress'] * 10.0}\n"
    )
    (tmp_path / "ring.yaml").write_text(
        "name: ring\nfactors:\n  - {name: yield_stress, unit: MPa, low: 10, high: 20}\n"
        "  - {name: failure_strain, low: 0.01, high: 0.02}\n"
        "targets:\n  - {diameter: 8 mm, force: 150 N, sd: 5 N, n: 10}\nscreen: {design: none}\n"
        "rsm: {factors: [yield_stress, failure_strain]}\nsolver: {kind: python, file: ring.py, class: Ring}\n"
    )
    done = shell(tmp_path, f"{STEMCAL} rsm ring.yaml --out out 2>/dev/full")
    assert done.returncode == 0 and (tmp_path / "out" / "rsm.json").is_file(), done.stdout
    wrong = shell(tmp_path, f"{STEMCAL} rsm no-such.yaml 2>/dev/full")
    assert wrong.returncode == 2


@posix
@pytest.mark.parametrize("variable", ["MPLBACKEND=nonsense", "SOURCE_DATE_EPOCH=x", "SOURCE_DATE_EPOCH=99999999999999"])
def test_variables_that_libraries_would_refuse_stop_nothing(replayed: Path, variable: str) -> None:
    (replayed / "report.html").unlink(missing_ok=True)
    done = shell(replayed, f"{variable} {STEMCAL} report '{REPLAY}' --out .")
    assert done.returncode == 0 and (replayed / "report.html").is_file(), done.stderr
