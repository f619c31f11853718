"""Change the targets of tests in the text of a spec and nothing else: comments, order and layout stay."""

from collections.abc import Mapping, Sequence

import yaml


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
