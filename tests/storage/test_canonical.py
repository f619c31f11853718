"""Contents as JSON, their seals, and the reasons for which files cannot be read or written."""

import errno

from stemcal.storage.atomic import what_happened
from stemcal.storage.canonical import as_json, canonical
from stemcal.storage.encodings import csv_text, decode, in_a_line, unprintable, visible
from stemcal.storage.plain import NotPlain, unreadable
from stemcal.storage.sealed import sealed


def test_keys_are_sorted_and_a_seal_comes_first() -> None:
    assert as_json({"b": 0.1, "a": float("nan")}) == '{\n  "b": 0.1,\n  "a": null\n}\n'
    assert canonical({"b": 1.0, "a": [1, None]}) == '{"a":[1,null],"b":1.0}'
    assert sealed({"a": 1}).splitlines()[1].startswith('  "sha256": "015abd7')


def test_reasons() -> None:
    assert unreadable(NotPlain(errno.EISDIR, "is a folder")) == "is a folder"
    assert unreadable(OSError(errno.EACCES, "Permission denied")) == "cannot be read: Permission denied"
    remedy = "make the folder writable or choose another folder with `--out`"
    assert what_happened(OSError(errno.EROFS, "Read-only file system")) == f"Read-only file system; {remedy}"


def test_texts() -> None:
    contents = ("力/N".encode("gbk"), "力/N".encode("utf-16-le"), b"\xff\xff\xff")
    assert [decode(content) for content in contents] == ["力/N", "力/N", None]
    assert in_a_line("a\n b\tc") == "a b c"
    assert visible("\x1b[31mred\0") == r"\x1b[31mred\x00"
    assert (unprintable("x\x1b"), unprintable("切割 °")) == (r"\x1b", None)
    assert csv_text([["-2+3+cmd|' /C calc'!A0", "-4.75 **", -1.5, None]]) == "'-2+3+cmd|' /C calc'!A0,-4.75 **,-1.5,\n"
