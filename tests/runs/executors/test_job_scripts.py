"""The scripts in the documentation that start a cluster by Slurm or PBS: what jobs they would submit."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from fakes import ENVIRONMENT

pytest.importorskip("dask_jobqueue", reason="needs dask-jobqueue: pip install dask-jobqueue")

PAGE = Path(__file__).parents[3] / "docs" / "howto" / "long-studies.md"
EXPECTED = {
    "SLURMCluster": ("#SBATCH -p normal", "#SBATCH --cpus-per-task=16", "#SBATCH --mem=15G", "#SBATCH -t 08:00:00"),
    "PBSCluster": ("#PBS -q normal", "#PBS -l select=1:ncpus=16:mem=16gb", "#PBS -l walltime=08:00:00"),
}
WORKER = ("distributed.cli.dask_worker", "--nthreads 16", "--memory-limit 14.90GiB", "--lifetime 460m")


@pytest.mark.parametrize("kind", ["SLURMCluster", pytest.param("PBSCluster", marks=pytest.mark.slow)])
def test_job_script(kind: str) -> None:
    """The page's script, and for PBS what the page says to change in it."""
    page = PAGE.read_text("utf-8")
    (code,) = (block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "SLURMCluster" in block)
    if kind == "PBSCluster":
        (added,) = re.findall(r"`PBSCluster` class and add the argument `(.*?)`", page)
        code = code.replace("SLURMCluster", kind).replace(f"{kind}(\n", f"{kind}(\n    {added},\n")
    until_jobs = code.replace('"port": 8786', '"port": 0').partition("cluster.adapt")[0]
    done = subprocess.run(
        [sys.executable, "-c", f"{until_jobs}\nprint(cluster.job_script())\ncluster.close()"],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for line in (*EXPECTED[kind], *WORKER):
        assert line in done.stdout, done.stdout
