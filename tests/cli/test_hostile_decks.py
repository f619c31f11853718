"""Decks of strangers: whatever one holds, it is data; what cannot be read is refused with place and remedy."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest
from commanding import command
from hostile_decks import COMMENTS, GOOD, NAMES, attack, hostile_decks

from stemcal.study.reading import load_study

COMMANDS = tuple("\x1b\u202e\u2028\x85\x9b\0")


def assert_harmless(deck: Path, spec: Path) -> bool:
    """Import a deck; return whether it became a study, which then names no program."""
    done = command("import-deck", deck, spec)
    assert done.exit_code in (0, 2), done.output
    assert "internal error" not in done.output
    assert not any(letter in done.output for letter in COMMANDS)
    if done.exit_code:
        assert not spec.exists()
        assert ";" in done.stderr, f"no remedy: {done.stderr}"
        return False
    text = spec.read_text(encoding="utf-8")
    assert not any(letter in text for letter in COMMANDS)
    study = load_study(spec)
    assert study.solver.kind == "embedded"
    assert study.name == spec.stem
    return True


def test_deck_of_a_stranger_runs_no_program(tmp_path: Path) -> None:
    """Texts in the comments were once copied into the spec, and the program they named was run by `screen`."""
    canary, deck, spec = (tmp_path / name for name in ("canary", "run.k", "study.yaml"))
    deck.write_text(attack(canary), encoding="utf-8")
    done = command("import-deck", deck, spec)
    if spec.exists():
        command("screen", spec, "--out", tmp_path / "out")
    assert not canary.exists()
    assert done.exit_code == 2
    assert "'break_drop'" in done.stderr and "remove them or mend them" in " ".join(done.stderr.split())


@pytest.mark.parametrize("every", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_hostile_decks_do_no_harm(tmp_path: Path, every: int) -> None:
    canary, deck, spec = (tmp_path / name for name in ("canary", "run.k", "study.yaml"))
    taken, broken = set(), []
    tried = dict(list(hostile_decks(canary))[::every])
    for name, content in tried.items():
        deck.write_bytes(content)
        spec.unlink(missing_ok=True)
        try:
            if assert_harmless(deck, spec):
                taken.add(name)
        except AssertionError as error:
            broken.append(f"{name}: {str(error)[:300]}")
    assert not broken, f"{len(broken)} of {len(tried)}\n" + "\n".join(broken)
    assert len(tried) >= 76
    assert not canary.exists()
    assert not [name for name in taken if re.search("YAML|list|NaN|nan|Inf|inf|10{9}|e400|nested", name)]
    assert {"utf-16", "old line ends", "no symmetry"} & set(tried) <= taken


@pytest.mark.parametrize("name", NAMES, ids=ascii)
@pytest.mark.skipif(sys.platform == "win32", reason="such names cannot be")
def test_name_of_the_deck_is_data(tmp_path: Path, name: str) -> None:
    deck = tmp_path / name
    deck.write_text(GOOD, encoding="utf-8")
    assert assert_harmless(deck, tmp_path / "study.yaml")
    beside = command("import-deck", deck) if not name.startswith("-") else None
    assert beside is None or beside.exit_code in (0, 2)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes in folders")
def test_deck_is_a_plain_file(tmp_path: Path) -> None:
    pipe = tmp_path / "run.k"
    os.mkfifo(pipe)
    for deck in (pipe, Path("/dev/zero"), tmp_path, tmp_path / "none.k"):
        assert not assert_harmless(deck, tmp_path / "study.yaml")


def test_a_deck_without_comments_says_that_it_has_no_lengths(tmp_path: Path) -> None:
    (deck := tmp_path / "run.k").write_text(GOOD.replace(COMMENTS, ""), encoding="utf-8")
    done = command("import-deck", deck, tmp_path / "study.yaml")
    assert "edge spread and internal length: a deck has none" in " ".join(done.stderr.split())
