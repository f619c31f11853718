import time

import pytest

from stemcal.storage.encodings import decode
from stemcal.study.types.strict_yaml import MAX_BYTES, Document, Position, read_yaml, resolve


def read(text: str) -> Document:
    return read_yaml(text.encode("utf-8", "surrogatepass"))


def messages(document: Document) -> list[str]:
    return [finding.message for _, finding in document.problems]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *(("1e9", 1e9), ("20e6", 20e6), ("1e-3", 1e-3), ("1.5E+3", 1500.0), (".5", 0.5), ("5.", 5.0)),
        *(("-7", -7), ("010", 10), ("0x10", "0x10"), ("1_000", "1_000"), ("190:20:30", "190:20:30")),
        *(("no", "no"), ("yes", "yes"), ("on", "on"), ("true", True), ("false", False), ("~", None)),
        *(("null", None), ("", None), ("2026-01-02", "2026-01-02"), ("<<", "<<"), ("=", "=")),
        *(("nan", "nan"), ("٣", "٣")),
    ],
)
def test_plain_scalars_follow_yaml_1_2(text: str, value: object) -> None:
    found = read(f"key: {text}").data["key"]
    assert found == value
    assert type(found) is type(value)
    assert resolve(text) == value


@pytest.mark.parametrize("text", ["'1e9'", '"true"', "|\n  010", "!!str 5"])
def test_quoted_scalars_stay_texts(text: str) -> None:
    assert isinstance(read(f"key: {text}").data["key"], str | int)
    assert isinstance(read(f"key: {text.removeprefix('!!str ')!r}").data["key"], str)


@pytest.mark.parametrize("text", [".nan", ".NaN", ".inf", "-.Inf", "1e999", "-1e400", "9" * 5000])
def test_numbers_are_finite(text: str) -> None:
    document = read(f"a: 1\nkey: {text}")
    assert document.problems[0][1].message.endswith("is not a finite number")
    assert document.problems[0][0] == Position(2, 6)


def test_huge_integers_become_floats_without_raising() -> None:
    assert read("key: " + "9" * 300).data["key"] == pytest.approx(1e300)


def test_every_node_has_its_place() -> None:
    document = read("a: 1\nb:\n  - x: 5\n    y: [6, 7]\n  - 8\n")
    assert document.data == {"a": 1, "b": [{"x": 5, "y": [6, 7]}, 8]}
    assert document.place(("a",)) == Position(1, 4)
    assert document.place(("b",)) == Position(2, 1)
    assert document.place(("b", 0, "x")) == Position(3, 8)
    assert document.place(("b", 0, "y", 1)) == Position(4, 12)
    assert document.place(("b", 1)) == Position(5, 5)
    assert document.keys["b", 0, "y"] == Position(4, 5)


def test_a_missing_node_is_placed_at_what_would_hold_it() -> None:
    document = read("a:\n  b:\n    c: 1\n")
    assert document.place(("a", "b", "z")) == Position(2, 3)
    assert document.place(("nowhere",)) == Position(1, 1)


def test_duplicate_keys_name_both_lines_and_keep_the_first() -> None:
    document = read("low: 1\nhigh: 2\nlow: 3\nlow: {low: 4}\n")
    assert messages(document) == [
        "the key 'low' is already used in line 1",
        "the key 'low' is already used in line 1",
    ]
    assert [place.line for place, _ in document.problems] == [3, 4]
    assert document.data == {"low": 1, "high": 2}


def test_equal_keys_in_different_mappings_are_fine() -> None:
    assert read("- {a: 1}\n- {a: 2}\n").problems == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: &x 1", "&x is an anchor"),
        ("a: *x", "*x is an alias"),
        ("a: !!int 1", "tag:yaml.org,2002:int is a tag"),
        ("a: !x [1]", "!x is a tag"),
        ("a: !!python/object/apply:os.system ['true']", "tag:yaml.org,2002:python/object/apply:os is a tag"),
        ("*x : 1", "*x is an alias"),
        ("? [a, b]\n: 1", "a list or mapping cannot be a key"),
        ("{{a}}: 1", "a list or mapping cannot be a key"),
        ("a: 1\n---\nb: 2", "a second YAML document begins here"),
        ("a: b: c", "the file is not valid YAML: mapping values are not allowed here"),
        ("a: \0", "character U+0000 is not allowed"),
        ("a: \x07", "character U+0007 is not allowed"),
        ('a: "\\uD800"', "an unpaired surrogate is not a valid character"),
        ('a: "\\UFFFFFFFF"', "the file is not valid YAML at this position"),
        ("%YAML 1." + "9" * 5000 + "\n--- a", "the file is not valid YAML at this position"),
        ("%YAML 9.9\n--- a", "the file is not valid YAML: found incompatible YAML document (version 1.* is required)"),
        ("k" * 2000 + ": 1", "the file is not valid YAML: mapping values are not allowed here"),
        ("\ta: 1", "the file is not valid YAML: found character '\\t' that cannot start any token"),
    ],
)
def test_what_is_refused(text: str, message: str) -> None:
    document = read(text)
    assert document.problems[0][1].message == message
    assert document.problems[0][1].remedy


def test_an_alias_bomb_is_not_walked() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [" + ", ".join([f"*a{i - 1}"] * 9) + "]" for i in range(1, 30)]
    document = read("\n".join(lines))
    assert len(document.problems) == 100
    assert not document.complete


@pytest.mark.parametrize("text", ["[" * 100_000, "- " * 100_000, "a: [" * 100_000, "{a: " * 100_000, "? " * 100_000])
def test_100000_nested_brackets_are_refused(text: str) -> None:
    begin = time.process_time()
    document = read(text)
    assert time.process_time() - begin < 5
    assert document.problems and not document.complete


def test_size_is_limited() -> None:
    assert messages(read_yaml(b"#" * (MAX_BYTES + 1))) == ["the file is larger than 1 MiB"]
    assert read_yaml(b"#" * MAX_BYTES).problems == []


@pytest.mark.parametrize(
    "content",
    [
        "name: 菊花".encode(),
        "name: 菊花".encode("utf-8-sig"),
        "name: 菊花".encode("utf-16"),
        "name: 菊花".encode("utf-16-le"),
        "name: 菊花".encode("utf-16-be"),
        "name: 菊花".encode("gbk"),
    ],
)
def test_encodings_of_chinese_windows_are_read(content: bytes) -> None:
    assert read_yaml(content).data == {"name": "菊花"}


def test_bytes_of_no_encoding_are_refused() -> None:
    assert decode(b"name: \xff\xff\xff") is None
    assert messages(read_yaml(b"name: \xff\xff\xff")) == ["the file is not encoded in UTF-8, UTF-16 or GBK"]


def test_windows_line_ends_count_once() -> None:
    assert read("a: 1\r\nb: 2\r\n").place(("b",)) == Position(2, 4)
