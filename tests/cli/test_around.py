"""The commands around a study: laboratory, tables, figures, first steps."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from commanding import REPLAY, ROOT, SMOKE, command, undrawn

from stemcal.cli.explain import look_up
from stemcal.cli.spec import _say_plan
from stemcal.errors import UsageError
from stemcal.overview.plan import plan
from stemcal.storage.rows import Rows
from stemcal.study.reading import load_study
from stemcal.study.reading.json_schema import meanings

DATA = ROOT / "configs" / "data"


@pytest.fixture(scope="module")
def done(finished: tuple[Path, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the replayed study, all stages done."""
    return undrawn(finished[0], tmp_path_factory.mktemp("replay") / "study")


def test_measure_diameters(tmp_path: Path) -> None:
    file = DATA / "measured-diameters.csv"
    result = command("measure", "diameters", file, "--grades", "7,8,9,10,11", "--out", tmp_path)
    assert result.exit_code == 0
    assert "50, 150 readings" in result.stdout
    assert "Shapiro–Wilk" in result.stdout
    assert "synthetic; do not publish" in result.stderr
    assert max(map(len, result.stdout.splitlines())) <= 80
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {f"measure-diameters.{kind}" for kind in ("csv", "json")} | {"diameters.svg", "diameters.png"}
    found = json.loads(command("measure", "diameters", file, "--json").stdout)["result"]
    assert found == json.loads((tmp_path / "measure-diameters.json").read_text("utf-8")) | {"grades": found["grades"],
            "share_percent": found["share_percent"]}  # fmt: skip


def test_measure_shear_prints_and_writes_targets(tmp_path: Path) -> None:
    spec = tmp_path / "mine.yaml"
    spec.write_text(SMOKE.read_text("utf-8"), "utf-8")
    result = command("measure", "shear", DATA / "measured-shear", "--spec", spec, "--out", tmp_path)
    assert result.exit_code == 0
    assert "- {diameter: 8 mm, force: 159.2 N, travel: 3.652 mm,\n     sd: {force: 7.236 N," in result.stdout
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert command("check", spec).exit_code == 0
    assert "force: 378.2 N" in spec.read_text("utf-8")
    assert (tmp_path / "targets.yaml").read_text("utf-8") in spec.read_text("utf-8")


def test_a_spec_that_would_be_wrong_is_left_alone(tmp_path: Path) -> None:
    spec = tmp_path / "mine.yaml"
    spec.write_text(SMOKE.read_text("utf-8").replace("low: 800", "low: 8000"), "utf-8")
    before = spec.read_bytes()
    result = command("measure", "shear", DATA / "measured-shear", "--spec", spec)
    assert result.exit_code == 2
    assert spec.read_bytes() == before


@pytest.mark.parametrize(
    "kind", ["csv", "docx", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("md", "tex"))]
)
def test_export(done: Path, kind: str) -> None:
    result = command("export", "tables", REPLAY, "--out", done, "--format", kind, "--json")
    assert result.exit_code == 0
    paths = [Path(path) for path in json.loads(result.stdout)["result"]["files"]]
    assert len(paths) == (11 if kind == "csv" else 1)
    assert all(path.stat().st_size > 50 for path in paths)


def test_export_figures_lists_draws_and_refuses(done: Path) -> None:
    listed = command("export", "figures", REPLAY, "list", "--out", done).stdout
    assert re.search(r"^pareto +Pareto chart of the effects", listed, re.M)
    drawn = json.loads(command("export", "figures", REPLAY, "contour", "--out", done, "--json").stdout)["result"][
        "files"
    ]
    assert len(drawn) == 2 * 3
    assert all(Path(path).is_file() for path in drawn)
    refused = command("export", "figures", REPLAY, "pie", "--out", done)
    assert refused.exit_code == 2
    assert "no figure is named 'pie'; the figures are pareto, observed-predicted" in refused.stderr


@pytest.mark.slow
def test_report_draws_page_and_figures_again(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And opens the page on request."""
    seen: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: not seen.append(address))
    assert command("report", REPLAY, "--out", done, "--open").exit_code == 0
    assert seen == [(done / "report.html").resolve().as_uri()]
    figures = done / "figures"
    assert {path.suffix for path in figures.iterdir()} == {".svg", ".png"}
    before = {path.name: path.read_bytes() for path in figures.glob("*.svg")}
    assert len(before) == 11
    (figures / "pareto.svg").unlink()
    assert command("report", REPLAY, "--out", done).exit_code == 0
    assert {path.name: path.read_bytes() for path in figures.glob("*.svg")} == before


def test_first_files_go_where_they_are_told(tmp_path: Path) -> None:
    """A folder that is not there is made; one that cannot be made is named, without talk of runs."""
    result = command("init", tmp_path / "new" / "my stems")
    assert result.exit_code == 0
    assert f'stemcal check "{tmp_path / "new" / "my stems.yaml"}"' in " ".join(result.stderr.split())
    (tmp_path / "file").write_text("")
    refused = command("init", tmp_path / "file" / "x")
    assert refused.exit_code == 2
    assert "choose another" in refused.stderr and "finished runs" not in refused.stderr


def test_explain() -> None:
    shown = command("explain", "lenth").stdout
    assert "R. V. Lenth, Technometrics" in shown and all(line.strip() for line in shown.strip().splitlines())
    assert "lack of fit" in " ".join(command("explain").stdout.split())
    wrong = command("explain", "lenht")
    assert wrong.exit_code == 2
    assert "did you mean Lenth's method?" in wrong.stderr
    assert "rsm.alpha" in command("explain", "alpha").stdout
    assert "low-pass filter" in command("explain", "solver.filter_window").stdout.lower()
    assert json.loads(command("explain", "PRESS", "--json").stdout)["result"]["terms"][0]["term"] == "PRESS"


def test_every_key_of_a_spec_is_explained_by_its_place_and_by_its_name() -> None:
    for place, meaning in meanings().items():
        path = place.partition(",")[0].replace("[]", "")
        assert len(meaning) > 10, place
        for asked in (place, path, path.rpartition(".")[2]):
            assert any(entry.meaning.startswith(meaning) for entry in look_up(asked)), asked


def test_of_a_section_the_keys_are_listed() -> None:
    (entry,) = look_up("machine")
    assert entry.meaning.endswith(" Keys: stiffness.")
    assert [entry.meaning.count("Keys:") for entry in look_up("solver.time_limit")] == [0, 0, 0, 0]


def test_doctor_solves_its_known_answer() -> None:
    result = command("doctor", "--json")
    found: dict[str, Any] = json.loads(result.stdout)["result"]
    rows = {row["what"]: row for row in found["found"]}
    assert (result.exit_code, found["ok"]) == (0, True)
    assert "exact value 0.03685" in rows["self-test: solver"]["found"]
    assert command("doctor").stdout.count("self-test") == 1


def test_doctor_says_what_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = SimpleNamespace(row=lambda _name: [0.04])
    monkeypatch.setattr("stemcal.fem.stepper.simulate", lambda *_: wrong)
    result = command("doctor")
    assert result.exit_code == 1
    assert "WRONG  self-test: solver" in result.stdout


def test_explain_takes_words_without_quotes() -> None:
    assert command("explain", "lack", "of", "fit").stdout == command("explain", "lack of fit").stdout
    assert command("explain", "strain", "rate").exit_code == 0


def test_check_shows_a_finished_stage_without_memory(capsys: pytest.CaptureFixture[str]) -> None:
    """A stage with nothing to compute needs none, while another has its estimate."""
    found = plan(load_study(SMOKE), None)
    first, *rest = found.stages
    _say_plan(replace(found, stages=Rows([replace(first, to_run=0, memory=None), *rest])))
    rows = {words[0]: words[-2:] for line in capsys.readouterr().out.splitlines() if (words := line.split())}
    assert rows["screen"][-1] == "–" and rows["rsm"][-1] == "GB"


def test_at_most_three_terms_are_suggested() -> None:
    with pytest.raises(UsageError) as caught:
        look_up("imulation")
    assert str(caught.value).endswith("did you mean run, validation, interaction?")  # calibration is the fourth
