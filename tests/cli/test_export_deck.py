import json
from pathlib import Path

import pytest
from commanding import REPLAY, ROOT, SMOKE, command
from fakes import SpecSolver

from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS

PAPER = ROOT / "configs" / "wild-chrysanthemum-as-published.yaml"


def test_deck_is_written_with_the_values_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "run.k"
    asked = (
        "--for",
        "openradioss",
        "--diameter",
        "7",
        "--set",
        "yield_stress=17.96",
        "--quiet",
        "--json",
        "--out",
        tmp_path,
    )
    done = command("export", "deck", PAPER, path, *asked)
    assert done.exit_code == 0, done.output
    text = path.read_text(encoding="utf-8")
    assert f"{1000.0:>10}{0.3:>10}{17.96:>10}{0.5:>10}{0.03:>10}{0.0:>10}\n" in text
    assert "outer diameter 7 mm" in text
    result = json.loads(done.stdout)["result"]
    assert sum("is omitted because it changes" in sentence for sentence in result["otherwise"]) == 1
    assert str(path) in result["files"]


def test_deck_for_ls_dyna_has_the_digits_that_fit_and_quiet_says_nothing(tmp_path: Path) -> None:
    path = tmp_path / "run.k"
    asked = ("--for", "lsdyna", "--set", "yield_stress=14.204482103412", "--set", "failure_strain=0.03")
    done = command("export", "deck", SMOKE, path, *asked, "--out", tmp_path, "--quiet")
    assert (done.exit_code, done.stdout) == (0, "")
    text = path.read_text(encoding="utf-8")
    assert "*MAT_PLASTIC_KINEMATIC\n" in text and f"{14.2044821:>10}" in text


@pytest.mark.usefixtures("without_workers")
def test_calibrated_values_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: SpecSolver())
    spec, out = tmp_path / "spec.yaml", tmp_path / "out"
    spec.write_text(SMOKE.read_text("utf-8").replace("force: 159.2 N", "force: 104 N"), encoding="utf-8")
    asked = ("--for", "openradioss", "--quiet", "--json", "--out", out)
    before = command("export", "deck", spec, tmp_path / "run.k", *asked)
    assert "is not calibrated yet" in " ".join(before.stderr.split())
    assert json.loads(before.stdout)["result"]["levels"] == load_study(spec).midlevels()
    assert command("run", spec, "--out", out, "--quiet").exit_code == 0
    done = command("export", "deck", spec, tmp_path / "run.k", *asked)
    found = json.loads((out / "invert.json").read_text("utf-8"))["parameters"]
    assert json.loads(done.stdout)["result"]["levels"] == found and "not calibrated yet" not in done.stderr


def test_deck_for_openradioss_has_its_files_beside_it(tmp_path: Path) -> None:
    """A name that ends in .rad names the starter's file, and the program."""
    asked = ("--json", "--quiet", "--out", tmp_path)
    for name, options in (("my.k", ("--for", "openradioss")), ("my_0000.rad", ()), ("my.rad", ())):
        done = command("export", "deck", SMOKE, tmp_path / name, *options, *asked)
        told = json.loads(done.stdout)["result"]
        assert [Path(file).name for file in told["files"]] == ["my.k", "my_0000.rad", "my_0001.rad"]
        assert "/INCLUDE_LS-DYNA/\nmy.k\n" in (tmp_path / "my_0000.rad").read_text(encoding="utf-8")
        assert (tmp_path / "my_0001.rad").read_text(encoding="utf-8").startswith("/RUN/my/1/\n")
        assert any("density" in sentence for sentence in told["otherwise"])


def test_deck_of_a_study_of_its_program_is_the_one_that_runs(tmp_path: Path) -> None:
    """Without lengths, as the study was calibrated; another program is refused with the command that calibrates."""
    spec, asked = ROOT / "configs" / "openradioss.yaml", ("--quiet", "--json", "--out", tmp_path)
    done = command("export", "deck", spec, tmp_path / "a.k", *asked)
    assert [Path(name).name for name in json.loads(done.stdout)["result"]["files"]] == ["a.k"]
    radioss = command("export", "deck", spec, tmp_path / "a.rad", *asked)
    assert len(json.loads(radioss.stdout)["result"]["files"]) == 3
    assert "/NONLOCAL" not in (tmp_path / "a_0000.rad").read_text("utf-8")
    other = command("export", "deck", spec, tmp_path / "b.k", "--for", "lsdyna", *asked)
    assert other.exit_code == 2 and "do not apply to " in " ".join(other.stderr.split())
    assert "stemcal run SPEC" in " ".join(other.stderr.split())


def test_same_deck_every_time(tmp_path: Path) -> None:
    for name in ("a.k", "b.k"):
        asked = ("--for", "lsdyna", "--quiet", "--out", tmp_path)
        assert command("export", "deck", SMOKE, tmp_path / name, *asked).exit_code == 0
    assert (tmp_path / "a.k").read_bytes() == (tmp_path / "b.k").read_bytes()
    assert b"\r" not in (tmp_path / "a.k").read_bytes()


def test_refusals(tmp_path: Path) -> None:
    fixed, dyna = tmp_path / "fixed.yaml", ("--for", "lsdyna")
    fixed.write_text(
        SMOKE.read_text(encoding="utf-8").replace("element_size: d/10", "element_size: 0.8 mm"), encoding="utf-8"
    )
    for args, said in (
        ((REPLAY, tmp_path / "x.k", *dyna), "uses kind `sheet`"),
        ((SMOKE, tmp_path / "x.k"), "add `--for lsdyna` or `--for openradioss`"),
        ((SMOKE, tmp_path / "x.rad", *dyna), "LS-DYNA cannot read .rad files"),
        ((SMOKE, tmp_path / "no" / "x.k", *dyna), "does not exist"),
        ((SMOKE, tmp_path / "x.k", *dyna, "--set", "yield_stres=3"), "did you mean yield_stress?"),
        ((fixed, tmp_path / "x.k", *dyna, "--diameter", "1"), "--diameter 1"),
    ):
        done = command("export", "deck", *args, "--out", tmp_path)
        assert done.exit_code == 2
        assert said in " ".join(done.stderr.split()), done.stderr
    assert not list(tmp_path.glob("*.k"))
