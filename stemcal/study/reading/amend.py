"""Change one key of a spec and nothing else in its text: comments, order and layout stay as their author left them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import yaml

from stemcal.errors import UsageError
from stemcal.files.durable import write_durably
from stemcal.files.plain import read_plain
from stemcal.study.model import Study
from stemcal.study.reading.read import read_study
from stemcal.study.types.strict_yaml import MAX_BYTES

Change = tuple[str, str, str]
"""Section, key, and the value as YAML writes it on one line."""


def rewrite(path: Path, wanted: Study, changes: Sequence[Change]) -> None:
    """Write the changes into a spec, once the text has been seen to make the study that is wanted.

    Raises
    ------
    UsageError
        If this text cannot be changed safely; the remedy says what to write by hand.
    """
    by_hand = "; ".join(f"{section}.{key}: {value}" for section, key, value in changes)
    refusal = UsageError(f"{path.name}: its text cannot be changed safely; write by hand {by_hand}")
    try:
        text = read_plain(path, MAX_BYTES).decode("utf-8-sig")
        for change in changes:
            text = amended(text, *change)
        made = read_study(text.encode("utf-8"), path)
    except (UnicodeDecodeError, yaml.YAMLError, ValueError):
        raise refusal from None
    if made.model_dump() != wanted.model_dump():
        raise refusal
    write_durably(path, text)


def amended(text: str, section: str, key: str, value: str) -> str:
    """Return the text with ``section.key`` set to `value`.

    >>> print(amended("rsm:\\n  # why\\n  alpha: face  # at the edge\\n", "rsm", "axial", "1"), end="")
    rsm:
      # why
      axial: 1
      alpha: face  # at the edge
    >>> amended("rsm: {alpha: face}\\n", "rsm", "alpha", "rotatable")
    'rsm: {alpha: rotatable}\\n'
    >>> amended("name: a\\n", "screen", "fold_over", "true")
    'name: a\\n\\nscreen:\\n  fold_over: true\\n'
    """
    line_end = "\r\n" if "\r\n" in text else "\n"
    part = _entries(yaml.compose(text, Loader=yaml.SafeLoader)).get(section)
    if part is None:
        return line_end.join([text.rstrip(), "", f"{section}:", f"  {key}: {value}", ""])
    if not isinstance(part[1], yaml.MappingNode):
        raise ValueError(f"{section} holds no keys")
    if key in (known := _entries(part[1])):
        old = known[key][1]
        return f"{text[: old.start_mark.index]}{value}{text[old.end_mark.index :]}"
    if part[1].flow_style:
        end = part[1].end_mark.index - 1
        return f"{text[:end].rstrip()}{', ' if known else ''}{key}: {value}{text[end:]}"
    first = next(iter(known.values()))[0].start_mark
    begin = first.index - first.column
    return f"{text[:begin]}{' ' * first.column}{key}: {value}{line_end}{text[begin:]}"


def with_test_targets(text: str, targets: Mapping[str, Sequence[str]]) -> str:
    """Return the text with other targets of tests: by a test's name its entries, each in YAML on one line.

    >>> spec = "tests:\\n  - name: pull  # glued\\n    targets:\\n      - {diameter: 7 mm}\\n      # more\\nname: a\\n"
    >>> print(with_test_targets(spec, {"pull": ["{diameter: 8 mm}", "{diameter: 9 mm}"]}), end="")
    tests:
      - name: pull  # glued
        targets:
          - {diameter: 8 mm}
          - {diameter: 9 mm}
          # more
    name: a
    >>> with_test_targets("tests: [{name: pull}]\\n", {"pull": ["{diameter: 8 mm}"]})
    'tests: [{name: pull, targets: [{diameter: 8 mm}]}]\\n'
    """
    line_end = "\r\n" if "\r\n" in text else "\n"
    tests = _entries(yaml.compose(text, Loader=yaml.SafeLoader))["tests"][1]
    for test in reversed(tests.value):  # from the last on, so that the places of the others stay
        keys = _entries(test)
        if (entries := targets.get(keys["name"][1].value)) is None:
            continue
        old = keys["targets"][1] if "targets" in keys else None
        begin, end = (_end(test.value[-1][1]),) * 2 if old is None else (old.start_mark.index, _end(old))
        if any(getattr(node, "flow_style", False) for node in (test, old)):
            new = f"{'' if old else ', targets: '}[{', '.join(entries)}]"
        else:
            column = test.start_mark.column + 2 if old is None else old.start_mark.column
            new = f"{line_end}{' ' * column}".join(f"- {entry}" for entry in entries)
            key = f"{line_end}{' ' * test.start_mark.column}targets:{line_end}{' ' * column}"
            new = new if old else key + new
        text = f"{text[:begin]}{new}{text[end:]}"
    return text


def _end(node: yaml.Node) -> int:
    """Return where a node ends: one in block style with its last part, before the comments and lines below."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)


def _entries(node: yaml.Node | None) -> Mapping[str, tuple[yaml.Node, yaml.Node]]:
    """Return the nodes of a mapping's keys and values by key."""
    if not isinstance(node, yaml.MappingNode):
        raise ValueError("no mapping")
    return {str(key.value): (key, value) for key, value in node.value}
