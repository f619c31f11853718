"""Every command that README, pages and help show does what it says: given word for word in a new folder."""

import json
import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from shown import DOCS, ROOT, are_printed, commands, give, inline, outputs, pages, save_files

HOWTO = DOCS / "howto"
GIVEN = {"README.md", "tutorial.md", *(page.name for page in HOWTO.glob("*.md"))}


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a folder with what a clone of the repository has beside the code."""
    for folder in ("configs", "examples"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    return tmp_path


def first_study(clone: Path, name: str) -> None:
    """Put a small study into a clone under the name that a page gives it."""
    shutil.copy(clone / "configs" / "smoke.yaml", clone / name)


def test_no_page_shows_commands_that_nothing_here_gives() -> None:
    assert {page.name for page in pages() if commands(page)} <= GIVEN


def test_every_command_exists_with_its_options() -> None:
    """Also those within sentences, whose placeholders cannot be given."""
    from typer.main import get_command

    from stemcal.cli.app import app

    root = get_command(app)
    shown = [line for page in pages() for line in (*commands(page), *inline(page))]
    for line in (line for line in shown if line.startswith("stemcal ")):
        words = shlex.split(line, comments=True)[1:]
        if words[0] == "me":  # half a word, for the tabulator key
            continue
        command = root.commands[words.pop(0)]  # type: ignore[attr-defined]
        if hasattr(command, "commands") and words and words[0] in command.commands:
            command = command.commands[words.pop(0)]
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        assert {word for word in words if word.startswith("-")} <= known | {"--out"}, line


def test_read_files_of_any_testing_machine(clone: Path) -> None:
    printed = give(commands(HOWTO / "laboratory-files.md"), clone)
    assert printed and all("Maximum shear force by grade" in text for text in printed.values())


@pytest.mark.slow
def test_have_your_own_program_answer(clone: Path) -> None:
    """The page's three files are a whole study: F = τ·π/4·d²(1 − κ²)(1 + µ) meets the measured force."""
    page = HOWTO / "own-solver.md"
    save_files(page, clone)
    printed = give(commands(page), clone)
    assert "3 factors, 3 targets, solver command" in printed["stemcal check ring.yaml"]
    rows = json.loads((clone / "runs" / "ring" / "validate.json").read_text("utf-8"))["rows"]
    assert rows[1]["simulated"] == pytest.approx(159.2, rel=0.002)
    assert rows[0]["simulated"] / rows[1]["simulated"] == pytest.approx((7 / 8) ** 2)
    assert "18.37" in printed["stemcal run configs/paper-replay.yaml"]


@pytest.mark.slow
def test_take_the_parameters_to_another_mesh(clone: Path) -> None:
    """The page's tables are what its commands print."""
    page = HOWTO / "transfer.md"
    printed = give(commands(page), clone)
    are_printed(outputs(page), printed.values())
    planned = printed["stemcal check configs/wild-chrysanthemum-transfer.yaml"]
    assert "The refinement adds at most 12 runs in the other model" in " ".join(planned.split())
    written = json.loads((clone / "material" / "material.json").read_text("utf-8"))
    assert written["valid"] and written["files"] == ["material.k", "material.json"]


@pytest.mark.slow
def test_do_the_runs_by_hand(clone: Path) -> None:
    """The page's angles, written into each sheet, come to the parameters that it shows."""
    page = HOWTO / "by-hand.md"
    angles = dict(re.findall(r"\| (rsm \d+) \| ([\d.]+) ", page.read_text("utf-8")))
    assert len(angles) == 15
    *first, run = commands(page)
    printed = give(first, clone)
    assert "15 + 1 runs must be done by hand, 16 in total" in printed["stemcal check heap.yaml"]
    assert "Waiting for 15 results from the rsm stage" in give([run], clone, code=6)[run]
    for code in (6, 6, 0):
        write_angles(clone / "runs" / "heap" / "sheet.csv", angles)
        printed = give([run], clone, code=code)
    are_printed(outputs(page), printed.values())
    assert (clone / "runs" / "heap" / "report.html").is_file()


def write_angles(sheet: Path, angles: dict[str, str]) -> None:
    """Fill in a sheet; runs at the solution give 28.0 deg."""
    head, *rows = sheet.read_text("utf-8").splitlines()
    cells = [row.split(",") for row in rows]
    done = [",".join([*row[:4], angles.get(row[0], "28.0"), *row[5:]]) for row in cells]
    sheet.write_text("\n".join([head, *done, ""]), encoding="utf-8")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("lmp") is None, reason="LAMMPS (lmp) is not installed")
def test_example_of_a_bonded_stalk(clone: Path) -> None:
    printed = give(commands(ROOT / "examples" / "lammps" / "README.md"), clone)
    assert "873." in printed["stemcal run examples/lammps/stalk.yaml --workers 1"]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("liggghts") is None, reason="LIGGGHTS (liggghts) is not installed")
def test_calibrate_a_heap_of_grains(clone: Path) -> None:
    """The same seeds give the same heaps; another build of the program gives others, within their scatter."""
    printed = give(commands(HOWTO / "heap.md"), clone)
    assert "62 runs must be computed" in printed["stemcal check examples/liggghts/repose-heap.yaml"]
    folder = clone / "runs" / "repose-heap"
    pure = next(
        row for row in json.loads((folder / "rsm.json").read_text("utf-8"))["anova"] if row["source"] == "Pure error"
    )
    assert pure["df"] == 17 and 0.5 < (pure["sum_of_squares"] / pure["df"]) ** 0.5 < 3.0
    assert (folder / "tables" / "tables.md").is_file() and list((folder / "figures").glob("contour-*.png"))


@pytest.mark.slow
def test_ls_dyna_and_openradioss(clone: Path) -> None:
    printed = give(commands(HOWTO / "decks.md"), clone)
    assert "*MAT_NONLOCAL" in (clone / "run.k").read_text("utf-8")
    assert "33 runs must be computed" in printed["stemcal check configs/openradioss.yaml"]


@pytest.mark.slow
def test_readme(clone: Path) -> None:
    """The published study, one shear test, and a study of one's own from the template, all with the real mesh."""
    printed = give(commands(ROOT / "README.md"), clone)
    are_printed(outputs(ROOT / "README.md"), printed.values())
    assert (clone / "force-travel.png").is_file()


@pytest.mark.slow
def test_tutorial(clone: Path) -> None:
    printed = give(commands(DOCS / "tutorial.md"), clone)
    are_printed(outputs(DOCS / "tutorial.md"), printed.values())
    results = clone / "tutorial" / "results"
    expected = ["report.html", "tables/tables.md", "tables/tables.tex", "figures/fracture-8mm.svg"]
    assert all((results / name).is_file() for name in expected)
    assert (clone / "tutorial" / "laboratory" / "diameters.svg").is_file()


@pytest.mark.slow
def test_calibrate_your_own_stem(clone: Path) -> None:
    give(commands(HOWTO / "own-stem.md"), clone)
    assert (clone / "runs" / "my-stems" / "report.html").is_file()
    assert (clone / "before.svg").is_file()
    assert json.loads((clone / "stemcal.schema.json").read_text("utf-8"))["title"] == "stemcal study"


@pytest.mark.slow
def test_publish_and_long_studies(clone: Path) -> None:
    pytest.importorskip("docx")
    first_study(clone, "my-stems.yaml")
    first_study(clone, "study.yaml")
    give(["stemcal run study.yaml"], clone)
    give(commands(HOWTO / "publish.md"), clone)
    key = min((clone / "runs" / "smoke" / "runs").glob("*.json")).stem[:8]
    alone = [line for line in commands(HOWTO / "long-studies.md") if "dask" not in line]
    give(alone, clone, {"3f2a91c0": key, "--workers 32": "--workers 2"})
    tables = clone / "runs" / "smoke" / "tables"
    assert {path.suffix for path in tables.iterdir()} == {".csv", ".md", ".tex", ".docx"}


@pytest.mark.slow
def test_more_than_one_machine(clone: Path) -> None:
    """Scheduler and worker as the page starts them, both on this machine."""
    pytest.importorskip("distributed")
    shown = commands(HOWTO / "long-studies.md")
    first_study(clone, "study.yaml")
    port = free_port()
    place = f"127.0.0.1:{port}"
    here = {
        "scheduler-host:8786": place,
        "127.0.0.1:8786": place,
        "port 8786": f"port {port}",
        "nthreads 16": "nthreads 2",
    }
    with started([line for line in shown if line.startswith("dask ")], clone, here):
        give([line for line in shown if line.startswith("stemcal ") and "dask" in line], clone, here)
    assert (clone / "runs" / "smoke" / "report.html").is_file()


# a small study with a goal, under the name of the shipped one
CUTTER = """\
name: cutter
responses: [{name: force, unit: N}]
factors: [{name: a, low: -1, high: 1}, {name: b, low: -1, high: 1}]
goal: {minimise: [force]}
solver: {kind: python, file: blade.py, class: Blade}
screen: {design: none}
rsm: {factors: [a, b]}
"""
BLADE = """\
class Blade:
    def solve(self, levels, condition):
        return {"force": 150 + 30 * (levels["a"] - 0.3) ** 2 + 15 * (levels["b"] + 0.2) ** 2}
"""


@pytest.mark.slow
def test_examples_of_the_help(clone: Path) -> None:
    """What `stemcal COMMAND --help` gives as an example, one after the other in one folder."""
    shutil.copy(clone / "configs" / "data" / "measured-diameters.csv", clone / "stems.csv")
    first_study(clone, "my-study.yaml")
    smoke = (clone / "configs" / "smoke.yaml").read_text("utf-8")
    (clone / "my-stems.yaml").write_text(smoke.replace("name: smoke", "name: my-stems"), encoding="utf-8")
    give(["stemcal run configs/smoke.yaml", "stemcal run my-stems.yaml"], clone)
    (clone / "configs" / "chrysanthemum-cutter.yaml").write_text(CUTTER, encoding="utf-8")
    (clone / "configs" / "blade.py").write_text(BLADE, encoding="utf-8")
    give(["stemcal run configs/chrysanthemum-cutter.yaml"], clone)
    # tests/by_hand enters sheets, tests/overview reads folders of tests, the study of init is there already
    apart = ("stemcal enter ", "stemcal init ", "stemcal measure tests ")
    shown = [line for line in help_examples() if not line.startswith(apart)]
    assert len(shown) > 19
    # no run of this study has failed: all that have, in place of one by its key
    give(shown, clone, {"retry configs/smoke.yaml 3f2a91c0": "retry configs/smoke.yaml"})


def help_examples() -> list[str]:
    """Return the example of every command."""
    from typer.main import get_command

    from stemcal.cli.app import app

    todo = [get_command(app)]
    found = []
    while todo:
        command = todo.pop(0)
        todo += getattr(command, "commands", {}).values()
        found += re.findall(r"Example: \[bold\](.*?)\[/bold\]", command.help or "")
    return found


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


@contextmanager
def started(lines: list[str], folder: Path, replaced: dict[str, str]) -> Iterator[None]:
    """Keep programs that serve running while the block does."""
    serving = []
    for line in lines:
        for old, new in replaced.items():
            line = line.replace(old, new)
        _, *words = shlex.split(line)
        serving.append(subprocess.Popen([sys.executable, "-m", "dask", *words], cwd=folder, stderr=subprocess.DEVNULL))
        time.sleep(3.0)
    try:
        yield
    finally:
        for program in reversed(serving):
            program.terminate()
            program.wait(timeout=60)
