"""Whether a file holds what is to be written, and what becomes of links."""

import errno
import os
from pathlib import Path

import pytest

from stemcal.errors import StemcalError
from stemcal.storage.atomic import make_folder, write_atomic
from stemcal.storage.plain import holds


def test_a_file_holds_just_this(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"12345")
    contents = (b"12345", b"1234", b"123456", b"")
    assert [holds(file, content) for content in contents] == [True, False, False, False]
    assert not holds(tmp_path, b"") and not holds(tmp_path / "none", b"")


def test_a_file_is_written_as_a_whole_with_the_users_rights(tmp_path: Path) -> None:
    path, mask = tmp_path / "a", os.umask(0)
    os.umask(mask)
    write_atomic(path, "long text, ü\r\n")
    assert path.read_bytes() == "long text, ü\r\n".encode()
    write_atomic(path, b"b\n")
    assert path.read_bytes() == b"b\n" and list(tmp_path.iterdir()) == [path]
    assert os.name == "nt" or path.stat().st_mode & 0o777 == 0o666 & ~mask
    with pytest.raises(StemcalError, match="the folder was deleted"):
        write_atomic(tmp_path / "none" / "a", b"")


@pytest.mark.skipif(os.name == "nt", reason="links need a right on Windows")
@pytest.mark.parametrize("target", ["file", "nothing", "folder"])
def test_what_a_link_leads_to_stays_as_it_is(tmp_path: Path, target: str) -> None:
    mine, link = tmp_path / "mine", tmp_path / "link"
    if target == "file":
        mine.write_bytes(b"precious")
    elif target == "folder":
        mine.mkdir()
    link.symlink_to(mine)
    with pytest.raises(StemcalError, match=r"is a symbolic link, .*; remove the link"):
        make_folder(link)
    write_atomic(link, b"new")
    assert link.read_bytes() == b"new" and not link.is_symlink()
    assert not mine.is_file() or mine.read_bytes() == b"precious"
    assert mine.exists() == (target != "nothing")


@pytest.mark.parametrize("links", [True, False])
def test_a_new_file_never_replaces_another(links: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On file systems without hard links too."""
    if not links:

        def refused(*_places: object) -> None:
            raise OSError(errno.EPERM, "Operation not permitted")

        monkeypatch.setattr("os.link", refused)
    path = tmp_path / "sheet.csv"
    assert write_atomic(path, b"first", new=True) and not write_atomic(path, b"second", new=True)
    assert path.read_bytes() == b"first" and list(tmp_path.iterdir()) == [path]
