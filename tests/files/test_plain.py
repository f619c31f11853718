"""Whether a file holds what is to be written; what is read of files: solvers/test_time_limited_program."""

from pathlib import Path

from stemcal.files.plain import holds


def test_a_file_holds_just_this(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"12345")
    contents = (b"12345", b"1234", b"123456", b"")
    assert [holds(file, content) for content in contents] == [True, False, False, False]
    assert not holds(tmp_path, b"") and not holds(tmp_path / "none", b"")
