"""Outputs are never written through a link."""

import os
from pathlib import Path

import pytest

from stemcal.errors import StemcalError
from stemcal.outputs import make_folder, open_output, refuse_link, write_output

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links need a right on Windows")


def test_files_are_written_anew_or_at_their_end(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_output(path, "long text, ü\r\n")
    write_output(path, b"b\n")
    with open_output(path, append=True) as file:
        file.write(b"c\n")
    assert path.read_bytes() == b"b\nc\n"
    assert path.stat().st_mode & 0o777 == 0o666 & ~_mask()


def _mask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


@pytest.mark.parametrize("target", ["file", "nothing", "folder"])
@pytest.mark.parametrize("append", [False, True])
def test_a_link_is_refused_and_what_it_leads_to_untouched(tmp_path: Path, target: str, append: bool) -> None:
    mine, link = tmp_path / "mine", tmp_path / "link"
    if target == "file":
        mine.write_bytes(b"precious")
    elif target == "folder":
        mine.mkdir()
    link.symlink_to(mine)
    with pytest.raises(StemcalError, match=r"link is a link, .*; remove it"):
        open_output(link, append)
    with pytest.raises(StemcalError, match="is a link"):
        make_folder(link)
    assert not mine.is_file() or mine.read_bytes() == b"precious"
    assert mine.exists() == (target != "nothing")


def test_a_link_that_comes_between_looking_and_opening(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mine, link = tmp_path / "mine", tmp_path / "link"
    mine.write_bytes(b"precious")
    link.symlink_to(mine)
    monkeypatch.setattr("stemcal.outputs.refuse_link", lambda _path: None)
    with pytest.raises(StemcalError, match="is a link"):
        write_output(link, b"x")
    assert mine.read_bytes() == b"precious"


def test_what_is_no_link_is_no_trouble(tmp_path: Path) -> None:
    refuse_link(tmp_path / "not there")
    assert make_folder(tmp_path / "a" / "b").is_dir()
    with pytest.raises(OSError):
        open_output(tmp_path / "c" / "d")
    write_output(Path(os.devnull), b"gone")
