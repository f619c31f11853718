from __future__ import annotations

import json
from pathlib import Path

from commanding import REPLAY, ROOT, SMOKE, command

from stemcal.numbers import significant
from stemcal.solvers.embedded import simulate
from stemcal.study.reading import load_study

PAPER = ROOT / "configs" / "wild-chrysanthemum.yaml"


def test_deck_is_written_with_the_values_as_they_are(tmp_path: Path) -> None:
    out = tmp_path / "run.k"
    done = command("export", "deck", PAPER, "--diameter", "7", "--set", "yield_stress=17.96", "--no-force", out)
    assert done.exit_code == 0, done.output
    text = out.read_text(encoding="utf-8")
    assert "         1   1.1e-09    1000.0       0.3     17.96       0.5      0.03       0.0\n" in text
    assert "outer diameter 7 mm" in text
    assert done.stderr.count("is written as no rate effect") == 1
    assert f"wrote {out}" in done.stderr.replace("\n", "")


def test_card_and_format_on_request_and_silence(tmp_path: Path) -> None:
    out, asked = tmp_path / "run.k", ("--material", "mat003", "--long", "--set", "yield_stress=14.204482103412")
    done = command("export", "deck", SMOKE, *asked, "--quiet", out)
    assert (done.exit_code, done.stdout, done.stderr) == (0, "", "")
    text = out.read_text(encoding="utf-8")
    assert "*MAT_PLASTIC_KINEMATIC+\n" in text
    assert "     14.204482103412" in text
    assert text.count("+\n") == 1


def test_force_of_the_deck_is_told_beside_the_study_s(tmp_path: Path) -> None:
    study = load_study(SMOKE)
    out, levels = tmp_path / "run.k", {**study.midlevels(), "yield_stress": 18.0}
    done = command("export", "deck", SMOKE, "--set", "yield_stress=18", "--json", out)
    told = json.loads(done.stdout)["result"]
    assert told["files"] == [str(out)]
    assert told["force_of_study"] == simulate(study, levels).peak_force
    assert told["force"] < 0.7 * told["force_of_study"]  # neither length has a card
    said = " ".join(done.stderr.split())
    assert f"This deck is to give {significant(told['force'])} N, the study" in said
    assert "Write one with --for lsdyna or --for openradioss" in said


def test_deck_for_openradioss_has_its_files_beside_it(tmp_path: Path) -> None:
    done = command(
        "export", "deck", SMOKE, "--for", "openradioss", "--no-force", "--json", "--quiet", tmp_path / "my.k"
    )
    told = json.loads(done.stdout)["result"]
    assert [Path(name).name for name in told["files"]] == ["my.k", "my_0000.rad", "my_0001.rad"]
    assert told["force"] is None
    assert "/INCLUDE_LS-DYNA/\nmy.k\n" in (tmp_path / "my_0000.rad").read_text(encoding="utf-8")
    assert (tmp_path / "my_0001.rad").read_text(encoding="utf-8").startswith("/RUN/my/1/\n")
    assert any("density" in sentence for sentence in told["otherwise"])


def test_same_deck_every_time(tmp_path: Path) -> None:
    for name in ("a.k", "b.k"):
        assert command("export", "deck", SMOKE, "--no-force", tmp_path / name).exit_code == 0
    assert (tmp_path / "a.k").read_bytes() == (tmp_path / "b.k").read_bytes()
    assert b"\r" not in (tmp_path / "a.k").read_bytes()


def test_refusals(tmp_path: Path) -> None:
    fixed = tmp_path / "fixed.yaml"
    fixed.write_text(
        SMOKE.read_text(encoding="utf-8").replace("element_size: d/10", "element_size: 0.8 mm"), encoding="utf-8"
    )
    for args, said in (
        ((REPLAY, tmp_path / "x.k"), "kind table"),
        ((SMOKE, tmp_path / "no" / "x.k"), "does not exist"),
        ((SMOKE, "--set", "yield_stres=3", tmp_path / "x.k"), "did you mean yield_stress?"),
        ((fixed, "--diameter", "1", tmp_path / "x.k"), "--diameter 1"),
    ):
        done = command("export", "deck", *args)
        assert done.exit_code == 2
        assert said in done.stderr.replace("\n", " ")
    assert not list(tmp_path.glob("*.k"))
