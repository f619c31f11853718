"""stemcal built, installed and run from outside its tree, with the lowest and the newest versions of what it needs.

Slow, and the packages come from an index: ``python -m pytest -m slow tests/test_installing.py``. A Python that this
machine lacks is passed over.
"""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

import stemcal
from stemcal.version import __version__

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = ("dask",)
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
SHIPPED = ("stemcal", "pyproject.toml", "README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md", "MANIFEST.in")
STUDIES = ("paper-replay", "smoke")

EXTRAS_AT_WORK = """
import subprocess, sys
from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        address = cluster.scheduler_address.replace("tcp", "dask")
        subprocess.run([sys.executable, "-m", "stemcal", "screen", sys.argv[1], "--executor", address], check=True)
"""


def needed() -> list[Requirement]:
    """Return what stemcal and its extras for users need."""
    extras = (line for extra in EXTRAS for line in PROJECT["optional-dependencies"][extra])
    return [Requirement(line) for line in (*PROJECT["dependencies"], *extras)]


def lowest(requirement: Requirement) -> str:
    """Return a requirement of just the lowest version that is allowed."""
    (bound,) = (specifier.version for specifier in requirement.specifier if specifier.operator == ">=")
    return f"{requirement.name}=={bound}"


def python_of(version: str) -> str | None:
    """Return an interpreter of a version: this one, one on PATH or one of pyenv's."""
    if version == "{}.{}".format(*sys.version_info):
        return sys.executable
    home = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    places = [shutil.which(f"python{version}"), *map(str, home.glob(f"versions/{version}.*/bin/python"))]
    for place in filter(None, places):
        said = subprocess.run([place, "--version"], capture_output=True, text=True)
        if said.stdout.startswith(f"Python {version}."):
            return place
    return None


def run(folder: Path, *line: object) -> str:
    """Run a program in a folder, away from the repository; return what it said."""
    apart = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    apart["STEMCAL_CACHE_DIR"] = str(folder / "cache")
    done = subprocess.run(
        [*map(str, line)],
        cwd=folder,
        env=apart,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=3600,  # of a machine with much else to do
    )
    assert done.returncode == 0, done.stdout[-3000:]
    return done.stdout


def environment(folder: Path, python: str, *packages: object) -> Path:
    """Return the interpreter of a new environment with packages, none of them built here."""
    run(folder, python, "-m", "venv", "venv")
    inside = folder / "venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    run(folder, inside, "-m", "pip", "install", "--quiet", "--only-binary", ":all:", *packages)
    return inside


@pytest.fixture(scope="session")
def largest_errors(tmp_path_factory: pytest.TempPathFactory) -> dict[str, float]:
    """Return what the studies give in this environment, the largest error of their validation in percent."""
    folder, found = tmp_path_factory.mktemp("here"), {}
    for name in STUDIES:
        study = stemcal.load_study(ROOT / "configs" / f"{name}.yaml")
        results = stemcal.calibrate(study, workers=1, out=folder / name)
        found[name] = results.validation.worst_percent
    assert found["paper-replay"] == pytest.approx(7.83, abs=0.005)  # as printed
    return found


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the sdist, and the wheel from it; return their folder."""
    folder = tmp_path_factory.mktemp("built")
    for name in SHIPPED:
        here, there = ROOT / name, folder / "tree" / name
        there.parent.mkdir(exist_ok=True)
        if here.is_dir():
            shutil.copytree(here, there, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(here, there)
    python = environment(folder, sys.executable, "build")
    run(folder, python, "-m", "build", "--outdir", folder / "dist", folder / "tree")
    return folder / "dist"


def test_every_bound_has_a_lowest_version() -> None:
    assert {lowest(requirement) for requirement in needed()} >= {"typer==0.19", "pydantic==2.12"}


def test_citation_agrees_with_the_project() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert (cited["title"], cited["license"]) == (PROJECT["name"], PROJECT["license"])
    assert [author["name"] for author in cited["authors"]] == [author["name"] for author in PROJECT["authors"]]
    assert cited["keywords"] == PROJECT["keywords"]
    preferred, (paper,) = cited["preferred-citation"], cited["references"]
    assert cited["version"] == preferred["version"] == __version__
    assert all(preferred[key] == cited[key] for key in ("type", "title", "authors", "date-released"))
    assert paper["type"] == "article" and "Wild Chrysanthemum" in paper["title"]
    assert f"## [{__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_sdist_and_wheel_are_whole(built: Path) -> None:
    (wheel,), (sdist,) = built.glob("*.whl"), built.glob("*.tar.gz")
    package = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "stemcal").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    inside = set(zipfile.ZipFile(wheel).namelist())
    assert {name for name in inside if name.startswith("stemcal/")} == package
    assert {name.rpartition("/")[2] for name in inside if ".dist-info/" in name} >= {"METADATA", "LICENSE"}
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert package | set(SHIPPED[1:]) <= names


@pytest.mark.slow
@pytest.mark.parametrize("version", PYTHONS)
@pytest.mark.parametrize("which", ["lowest", "newest"])
def test_studies_run_where_it_is_installed(
    built: Path, largest_errors: dict[str, float], tmp_path: Path, which: str, version: str
) -> None:
    if (python := python_of(version)) is None:
        pytest.skip(f"there is no Python {version} here")
    (wheel,) = built.glob("*.whl")
    pinned = [lowest(requirement) if which == "lowest" else str(requirement) for requirement in needed()]
    inside = environment(tmp_path, python, wheel, *pinned)
    command = inside.with_name("stemcal")
    for name, error in largest_errors.items():
        said = run(tmp_path, command, "run", ROOT / "configs" / f"{name}.yaml", "--out", name, "--workers", 1)
        assert "Warning" not in said, said
        found = json.loads((tmp_path / name / "validate.json").read_text(encoding="utf-8"))
        assert found["worst_percent"] == pytest.approx(error, abs=0.005)
    replay, smoke = (ROOT / "configs" / f"{name}.yaml" for name in STUDIES)
    run(tmp_path, command, "export", "tables", replay, "--format", "docx", "--out", "paper-replay")
    assert zipfile.is_zipfile(tmp_path / "paper-replay" / "tables" / "tables.docx")
    (tmp_path / "extras.py").write_text(EXTRAS_AT_WORK, encoding="utf-8")
    run(tmp_path, inside, "extras.py", replay, smoke)
