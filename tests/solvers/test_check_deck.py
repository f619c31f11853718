"""A deck with the force that it is to give, run by stand-ins that replay recorded runs or read when it has been run."""

from __future__ import annotations

import gzip
import json
import shutil
import sys
from pathlib import Path

import pytest
from test_openradioss import REQUEST, command, study_of

from stemcal.errors import UsageError
from stemcal.solvers.check_deck import read_run, run_deck
from stemcal.solvers.deck import Deck, deck_text

RECORDED = Path(__file__).with_name("openradioss")
LS_DYNA = Path(__file__).with_name("stand_in_for_lsdyna.py")
# what the recorded run gave, N
FORCE = 125.9459
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the stand-in's programs are scripts")


@pytest.fixture
def deck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A deck that is to give a fifth less than the recorded run did, and a program that replays this."""
    study = study_of(tmp_path)
    monkeypatch.setenv("OPENRADIOSS_PATH", str(tmp_path / "openradioss"))
    monkeypatch.setenv("RECORDED", "mat024")
    path = tmp_path / "material" / "check.k"
    path.parent.mkdir()
    written = Deck.of(study, REQUEST.levels, REQUEST.condition, force_to_give=FORCE / 1.25)
    path.write_text(deck_text(written), encoding="utf-8")
    return path


def finished(folder: Path) -> None:
    """Put the recorded run of OpenRadioss there under the deck's name."""
    for name in ("runT01.csv", "run_0001.out"):
        content = gzip.decompress((RECORDED / "mat024" / f"{name}.gz").read_bytes())
        (folder / name.replace("run", "check", 1)).write_bytes(content)


def test_a_deck_is_run_and_its_force_compared(deck: Path) -> None:
    found = run_deck(deck)
    assert found.answer.ok, found.answer.message
    assert (found.program, found.answer.response) == ("openradioss", pytest.approx(FORCE, abs=1e-4))
    assert found.off_percent == pytest.approx(25.0, abs=1e-3)


def test_files_of_openradioss_beside_a_deck_are_taken_with_it(deck: Path) -> None:
    """The stand-in asks for the names of our runs in them."""
    deck.with_name("check_0000.rad").write_text("#RADIOSS STARTER\n/BEGIN\ncheck\n/INCLUDE_LS-DYNA/\ncheck.k\n")
    deck.with_name("check_0001.rad").write_text("/RUN/check/1/\n0.5\n")
    found = run_deck(deck)
    assert found.answer.ok, found.answer.message


def test_a_finished_run_is_read(deck: Path) -> None:
    finished(deck.parent)
    found = read_run(deck.parent)
    assert (found.program, found.deck) == ("openradioss", deck)
    assert found.off_percent == pytest.approx(25.0, abs=1e-3)


def test_a_finished_run_of_ls_dyna_is_read(deck: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The stand-in's force rises to 180.7 N, less what the filter takes off its peak, of 100.757 N."""
    import runpy

    monkeypatch.chdir(deck.parent)
    monkeypatch.setattr(sys, "argv", ["ls-dyna", "i=check.k"])
    text = deck.read_text(encoding="utf-8")
    deck.write_text(text.replace("PIECEWISE_LINEAR_PLASTICITY", "PLASTIC_KINEMATIC"), encoding="utf-8")
    with pytest.raises(SystemExit):
        runpy.run_path(str(LS_DYNA), run_name="__main__")
    found = read_run(deck.parent)
    assert found.program == "lsdyna"
    assert found.answer.response == pytest.approx(180.7, rel=0.03)
    Path("messag").write_text("still running", encoding="utf-8")
    assert read_run(deck.parent).answer.reason == "no_termination"


def test_what_is_no_check_is_refused(deck: Path) -> None:
    folder = deck.parent
    with pytest.raises(UsageError, match=r"one finished run must lie there, found none"):
        read_run(folder)
    finished(folder)
    (folder / "rcforc").write_text("", encoding="utf-8")
    with pytest.raises(UsageError, match=r"found rcforc, checkT01\.csv"):
        read_run(folder)
    shutil.copyfile(deck, folder / "other.key")
    with pytest.raises(UsageError, match=r"found check\.k, other\.key"):
        read_run(folder)
    silent = folder / "silent.k"
    silent.write_text("*KEYWORD\n*END\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"silent\.k does not say which force"):
        run_deck(silent)


def test_the_command_says_within_how_many_per_cent(deck: Path) -> None:
    finished(deck.parent)
    done = command("verify-transfer", deck.parent)
    assert (done.exit_code, done.stdout) == (
        0,
        "OpenRadioss gives 125.9 N where this deck is to give 100.8 N: +25.0 %.\n",
    )
    assert "section transfer" in " ".join(done.stderr.split())
    told = json.loads(command("verify-transfer", deck, "--json").stdout)
    assert (told["program"], told["off_percent"]) == ("openradioss", pytest.approx(25.0, abs=1e-3))
    assert [command("verify-transfer", deck.parent, "--within", percent).exit_code for percent in (24, 26)] == [1, 0]
    (deck.parent / "check_0001.out").unlink()
    failed = command("verify-transfer", deck.parent)
    assert (failed.exit_code, "check_0001.out" in failed.stderr) == (3, True)
    assert command("verify-transfer", deck.parent / "no.k").exit_code == 2
