"""The published study, replayed once; `fakes` importable from every folder of tests, and by the workers they start."""

import functools
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock, Timeout

TESTS = Path(__file__).parent
ROOT = TESTS.parent
sys.path.insert(0, str(TESTS))

SIMULATING = {"cutting", "fem", "laboratory", "verification"}


def pytest_configure() -> None:
    """Raise Ctrl-C where the caller ignores it, as shells do for jobs in the background; children inherit that."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Where all tests are run by several workers, begin to compile the kernels while these collect."""
    config = session.config
    if config.args_source is config.ArgsSource.TESTPATHS and config.getoption("numprocesses", None):
        paths = os.pathsep.join([str(ROOT), str(TESTS)])
        begin = [sys.executable, "-c", "import conftest; conftest.compile_kernels()"]
        config.add_cleanup(subprocess.Popen(begin, env={**os.environ, "PYTHONPATH": paths}).terminate)


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, Any, Any]:
    """Let the first worker collect alone: it leaves compiled what each of the others would compile for itself."""
    if not hasattr(session.config, "workerinput") or sys.dont_write_bytecode:
        return (yield)
    lock = FileLock(session.config._tmp_path_factory.getbasetemp().parent / ".collecting")
    try:
        lock.acquire(blocking=False)
    except Timeout:
        with lock:  # the first has collected
            pass
    try:
        return (yield)
    finally:
        lock.release()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Have the kernels compiled before the first test that runs them."""
    if item.path.parent.name in SIMULATING:
        compile_kernels()


@functools.cache
def compile_kernels() -> None:
    """Compile the kernels, and the element in double precision, in one process while the others wait."""
    from exact import EXACT

    from stemcal.fem.kernels.compile import CACHE
    from stemcal.fem.kernels.element import add_internal_forces
    from stemcal.fem.material import Material
    from stemcal.fem.mesh import brick
    from stemcal.fem.model import Model
    from stemcal.fem.state import start
    from stemcal.fem.warm import warm

    warm()
    with FileLock(CACHE / ".exact"):
        one = start(Model(brick((1.0, 1.0, 1.0), (1, 1, 1)), Material(1.0, 1.0, 0.3), integration=EXACT))
        body = one.body
        add_internal_forces(body.scratch, body.runs, body.targets, body.seen, body.state, body.f, 1.0e-3, one.material)


@pytest.fixture(scope="session")
def replayed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any]:
    """The study of the printed tables and its folder, all stages done."""
    from workflow import calibrate

    from stemcal.runs.executors import InlineExecutor
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.study.reading import load_study

    study = load_study(ROOT / "configs" / "paper-replay.yaml")
    folder = StudyFolder(tmp_path_factory.mktemp("replay"))
    calibrate(study, folder, InlineExecutor())
    return study, folder


@pytest.fixture(scope="session")
def results(replayed: tuple[Any, Any]) -> Any:
    """What the replayed study came to."""
    from stemcal.stages.results import fresh_results

    return fresh_results(*replayed)


@pytest.fixture(scope="session")
def stages(results: Any) -> dict[str, Any]:
    """The same by the name of the stage."""
    return {result.name: result for result in results.done}


@pytest.fixture(scope="session")
def edited() -> Callable[[Any, Callable[[dict[str, Any]], None]], Any]:
    """Return a result as it comes back from an edited file."""

    def edit(result: Any, change: Callable[[dict[str, Any]], None]) -> Any:
        content = result.to_json()
        change(content)
        return type(result).from_json(content)

    return edit


@pytest.fixture
def blank_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw nothing where it is not asked what is drawn."""
    from fakes import leave_blank

    leave_blank(monkeypatch)
