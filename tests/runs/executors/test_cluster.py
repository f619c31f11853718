"""A real Dask scheduler and real workers on the loopback: the same tables as on one machine, whatever dies."""

import contextlib
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
import workflow
from fakes import ENVIRONMENT, FakeSolver, lines, make_study
from test_local import Prepared

import stemcal
from stemcal.errors import UsageError
from stemcal.processes.limits import RunTimedOut
from stemcal.runs.executors import ClusterLost, InlineExecutor, WorkerDied
from stemcal.runs.study_folder import StudyFolder
from stemcal.version import code_version

pytest.importorskip("distributed", reason="needs Dask: pip install 'stemcal[dask]'")

from stemcal.runs.executors.cluster import DaskExecutor

POSIX = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
HERE = str(Path(__file__).parent)
MANY = "rsm: {centre_points: 3}\n"


class Cluster:
    """A scheduler and workers, started by Dask's own commands as a user would."""

    def __init__(self, folder: Path, workers: int, scheme: str = "tcp") -> None:
        self.file = folder / "scheduler.json"
        self.log = (folder / "dask.log").open("wb")
        self.scheduler = self._dask("scheduler", "--scheduler-file", self.file, "--port", "0")
        eventually_true(lambda: self.file.exists() and self.file.stat().st_size > 0)
        self.address = json.loads(self.file.read_text(encoding="utf-8"))["address"].removeprefix(f"{scheme}://")
        self.workers = [self.start_worker() for _ in range(workers)]

    def start_worker(self) -> subprocess.Popen[bytes]:
        options = ("--nthreads", "1", "--nworkers", "1", "--local-directory", self.file.parent)
        return self._dask("worker", "--scheduler-file", self.file, *options)

    def _dask(self, *args: object) -> subprocess.Popen[bytes]:
        path = os.pathsep.join([HERE, str(ENVIRONMENT["PYTHONPATH"])])
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *map(str, args), "--host", "127.0.0.1", "--no-dashboard"],
            stdout=self.log,
            stderr=self.log,
            env={**ENVIRONMENT, "PYTHONPATH": path},
            start_new_session=True,
        )

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            kill_group(process)
        self.log.close()


def kill_group(process: subprocess.Popen[bytes]) -> None:
    """Kill a dask command with the worker process that its nanny keeps."""
    if os.name == "nt":
        process.kill()
    else:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def eventually_true(condition: object, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.05)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    found = Cluster(tmp_path_factory.mktemp("dask"), workers=2)
    yield found
    found.close()


@pytest.fixture
def executor(cluster: Cluster) -> Iterator[DaskExecutor]:
    with DaskExecutor(cluster.address, time_limit=1.5) as executor:
        eventually_true(lambda: executor.workers >= 2)
        yield executor


def tables(folder: StudyFolder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.path.iterdir()) if p.suffix in (".json", ".csv")}


def unbroken(tmp_path: Path) -> dict[str, bytes]:
    folder = StudyFolder(tmp_path / "here")
    workflow.calibrate(make_study(tmp_path, MANY), folder, InlineExecutor(), solver=FakeSolver())
    return tables(folder)


@pytest.mark.parametrize(("versions", "warned"), [({}, 1), ({"tcp://127.0.0.1:1": code_version()}, 0)])
def test_a_scheduler_without_workers_is_named(versions: dict[str, str], warned: int, caplog) -> None:
    unmade = DaskExecutor.__new__(DaskExecutor)
    unmade.address, unmade._client = "127.0.0.1:8786", SimpleNamespace(run=lambda _: versions)
    with caplog.at_level("WARNING"):
        unmade._check_versions()
    assert len(caplog.records) == warned and all("127.0.0.1:8786" in one.getMessage() for one in caplog.records)


def test_computes(executor: DaskExecutor) -> None:
    assert list(executor.map(pow, range(20), [2] * 20)) == [x * x for x in range(20)]
    assert executor.submit(os.getpid).result() != os.getpid()


def test_the_same_tables_as_here_byte_for_byte(executor: DaskExecutor, tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "there")
    workflow.calibrate(make_study(tmp_path, MANY), folder, executor, solver=FakeSolver())
    assert tables(folder) == unbroken(tmp_path)


def test_a_crash_costs_one_run_and_no_worker(executor: DaskExecutor) -> None:
    deadly = [executor.submit(os._exit, code) for code in (3, 4)]
    for future, code in zip(deadly, (3, 4), strict=True):
        with pytest.raises(WorkerDied, match=f"exit code {code}"):
            future.result(timeout=30)
    assert executor.submit(pow, 2, 3).result() == 8
    assert executor.workers == 2


def test_exceptions_and_time_limits_come_back(executor: DaskExecutor) -> None:
    late, wrong = executor.submit(time.sleep, 60.0), executor.submit(divmod, 1, 0)
    with pytest.raises(ZeroDivisionError):
        wrong.result(timeout=30)
    begun = time.monotonic()
    with pytest.raises(RunTimedOut, match=r"1\.5 s"):
        late.result(timeout=30)
    assert time.monotonic() - begun < 8.0


def test_a_cold_worker_gets_ready_before_the_clock_starts(executor: DaskExecutor) -> None:
    """Compiling on a worker that has no kernels yet takes longer than many a limit, here of 1.5 s."""
    assert executor.submit(Prepared(2.0, 0.1)).result(timeout=60) == "done"


def test_cancelled_calls_are_not_run(executor: DaskExecutor, tmp_path: Path) -> None:
    blocking = [executor.submit(time.sleep, 0.5) for _ in range(2)]
    cancelled = executor.submit(Path.touch, tmp_path / "touched")
    assert cancelled.cancel()
    assert [future.result(timeout=30) for future in blocking] == [None, None]
    assert not (tmp_path / "touched").exists()


@POSIX
def test_a_lost_worker_costs_nothing_and_a_lost_scheduler_ends_the_study_but_fails_no_run(tmp_path: Path) -> None:
    """The runs of a killed worker go to the other one; in the end the tables are the same to the byte."""
    cluster, witness = Cluster(tmp_path, workers=2), tmp_path / "witness"
    folder, study = StudyFolder(tmp_path / "there"), make_study(tmp_path, MANY)
    workers = []

    def kill_both() -> None:
        eventually_true(lambda: len(lines(witness)) >= 8)
        kill_group(cluster.workers[0])
        eventually_true(lambda: len(lines(witness)) >= 16)
        workers.append(executor.workers)
        kill_group(cluster.scheduler)

    try:
        with pytest.raises(ClusterLost, match="the Dask scheduler"), DaskExecutor(cluster.address) as executor:
            eventually_true(lambda: executor.workers >= 2)
            killer = threading.Thread(target=kill_both)
            killer.start()
            workflow.calibrate(study, folder, executor, solver=FakeSolver(witness, seconds=0.1))
    finally:
        cluster.close()
    killer.join()
    kept = [folder.load(key) for key in folder.keys()]  # noqa: SIM118
    assert workers == [1] and len(kept) > 8
    assert all(record is not None and record["status"] == "ok" for record in kept)
    workflow.calibrate(study, folder, InlineExecutor(), solver=FakeSolver())
    assert tables(folder) == unbroken(tmp_path)


def test_nobody_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.runs.executors.cluster.CONNECT_S", 0.5)
    begun = time.monotonic()
    with pytest.raises(UsageError, match="no Dask scheduler responds"):
        DaskExecutor("127.0.0.1:9")
    assert time.monotonic() - begun < 10.0


def test_another_version_is_refused(
    cluster: Cluster, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    request.addfinalizer(code_version.cache_clear)
    with DaskExecutor(cluster.address) as same:
        assert same.submit(pow, 2, 10).result(timeout=60) == 1024  # a worker has joined; versions are those of workers
    monkeypatch.setattr("stemcal.version.__version__", "0.1.0")
    code_version.cache_clear()
    with pytest.raises(UsageError, match=r"the study uses 0\.1\.0\+\w+; install the same version of stemcal"):
        DaskExecutor(cluster.address)


def test_code_that_differs_has_another_version_whatever_its_number(tmp_path: Path) -> None:
    copy = tmp_path / "stemcal"
    shutil.copytree(Path(stemcal.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    code = "from stemcal.version import code_version; print(code_version())"

    def told() -> str:
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    assert told() == code_version()
    model = copy / "cutting" / "parts.py"
    model.write_bytes(model.read_bytes().replace(b"\n", b"\r\n"))
    assert told() == code_version()
    model.write_bytes(model.read_bytes() + b"# changed\n")
    assert told() != code_version() and told().startswith(f"{stemcal.__version__}+")


@POSIX
def test_ctrl_c_ends_the_runs_on_the_workers(cluster: Cluster, tmp_path: Path) -> None:
    """Also a run that would go on for ever, and another command's runs go on."""
    with DaskExecutor(cluster.address) as other:
        going_on = other.submit(pause, str(tmp_path / "other"), 3.0)
        with pytest.raises(KeyboardInterrupt), DaskExecutor(cluster.address) as executor:
            executor.submit(pause, str(tmp_path / "mine"), 600.0)
            eventually_true(lambda: (tmp_path / "mine").exists() and (tmp_path / "other").exists())
            raise KeyboardInterrupt
        pid = int((tmp_path / "mine").read_text("utf-8"))
        eventually_true(lambda: not Path(f"/proc/{pid}").exists(), seconds=5.0)
        assert going_on.result(timeout=60) is None


def pause(witness: str, seconds: float) -> None:
    """Tell the number of this process and wait."""
    Path(witness).write_text(str(os.getpid()), encoding="utf-8")
    time.sleep(seconds)


@pytest.mark.slow
def test_an_encrypted_cluster_is_used_by_dasks_own_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("openssl") is None:
        pytest.skip("needs openssl")
    certificate = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=stemcal"]
    files = ["-keyout", str(tmp_path / "key.pem"), "-out", str(tmp_path / "cert.pem")]
    subprocess.run(["openssl", *certificate, *files], check=True, capture_output=True)
    settings = {"DASK_DISTRIBUTED__COMM__TLS__CA_FILE": str(tmp_path / "cert.pem")}
    settings |= {"DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True", "DASK_DISTRIBUTED__COMM__DEFAULT_SCHEME": "tls"}
    for role in ("SCHEDULER", "WORKER", "CLIENT"):
        settings[f"DASK_DISTRIBUTED__COMM__TLS__{role}__CERT"] = str(tmp_path / "cert.pem")
        settings[f"DASK_DISTRIBUTED__COMM__TLS__{role}__KEY"] = str(tmp_path / "key.pem")
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
        monkeypatch.setitem(ENVIRONMENT, name, value)
    code = (
        "import sys; from stemcal.runs.executors.cluster import DaskExecutor\n"
        "with DaskExecutor(sys.argv[1]) as executor: print(executor.submit(pow, 2, 10).result(timeout=60))"
    )
    encrypted = Cluster(tmp_path, workers=1, scheme="tls")
    try:
        done = subprocess.run(
            [sys.executable, "-c", code, encrypted.address], capture_output=True, text=True, timeout=120
        )
        assert done.stdout == "1024\n", done.stderr
    finally:
        encrypted.close()


CONNECTING = """\
import sys, time
from stemcal.errors import UsageError
from stemcal.runs.executors import cluster
cluster.CONNECT_S, began = 1.0, time.monotonic()
try:
    cluster.DaskExecutor(sys.argv[1])
except UsageError as error:
    print(error, "in time" if time.monotonic() - began < 5.0 else "late")
"""


@pytest.mark.parametrize("greeting", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"SSH-2.0-OpenSSH_9.6\r\n", bytes(16)])
def test_what_is_no_scheduler_is_refused_in_time(greeting: bytes) -> None:
    """A silent port, a web server, SSH and zeros: one message in time. In its own process, where Dask may wait on."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        kept: list[socket.socket] = []
        answer = lambda: kept.append(server.accept()[0]) or kept[0].sendall(greeting)  # noqa: E731
        threading.Thread(target=answer, daemon=True).start()
        command = [sys.executable, "-c", CONNECTING, f"127.0.0.1:{server.getsockname()[1]}"]
        said = subprocess.run(command, capture_output=True, text=True, timeout=60).stdout
    assert re.search(r"no Dask scheduler responds at this address; .*default port 8786\) in time", said)
