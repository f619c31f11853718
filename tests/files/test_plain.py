"""Only plain files are read, and no more of them than was asked for."""

import os
from pathlib import Path

import pytest

from stemcal.files.plain import holds, open_plain, read_plain
from stemcal.report.drawing import _last_line


def test_so_much_is_read_and_no_more(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"12345")
    assert read_plain(file, 5) == b"12345"
    with pytest.raises(OSError, match="larger than"):
        read_plain(file, 4)


def test_a_file_holds_just_this(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"12345")
    contents = (b"12345", b"1234", b"123456", b"")
    assert [holds(file, content) for content in contents] == [True, False, False, False]
    assert not holds(tmp_path, b"") and not holds(tmp_path / "none", b"")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_what_has_no_end_is_no_file(tmp_path: Path) -> None:
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to("/dev/zero")
    for place in (pipe, link):
        with pytest.raises(OSError, match="not a plain file"):
            open_plain(place)
        assert not holds(place, b"") and _last_line(place) == ""
