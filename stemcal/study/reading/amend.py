"""Change rows of `targets` in the text of a spec and nothing else: comments, order and layout stay."""

from collections.abc import Mapping, Sequence

import yaml


def with_rows(text: str, rows: Mapping[str, Sequence[str]]) -> str:
    """Return the text with other rows of some tests: by a test's name ("" for the main one) rows in YAML, or comments.

    >>> spec = "targets:\\n  - {test: pull, diameter: 7 mm}  # old\\n  # more\\n  - {diameter: 8 mm}\\nname: a\\n"
    >>> print(with_rows(spec, {"pull": ["{test: pull, diameter: 9 mm}"]}), end="")
    targets:
      - {test: pull, diameter: 9 mm}
      # more
      - {diameter: 8 mm}
    name: a
    >>> with_rows("targets: [{diameter: 7 mm}]\\n", {"": ["{diameter: 8 mm}"]})
    'targets:\\n  - {diameter: 8 mm}\\n'
    >>> with_rows("name: a\\n", {"": ["{diameter: 8 mm}"]})
    'name: a\\n\\ntargets:\\n  - {diameter: 8 mm}\\n'
    """
    line_end = "\r\n" if "\r\n" in text else "\n"
    new = [row if row.startswith("#") else f"- {row}" for of_test in rows.values() for row in of_test]
    section = _entries(yaml.compose(text, Loader=yaml.SafeLoader)).get("targets")
    if section is None:
        listed = "".join(f"  {row}{line_end}" for row in new)
        return f"{text.rstrip()}{line_end}{line_end}targets:{line_end}{listed}"
    key, node = section
    if not isinstance(node, yaml.SequenceNode) or node.flow_style or not node.value:
        old = node.value if isinstance(node, yaml.SequenceNode) else []
        kept = [text[row.start_mark.index : row.end_mark.index] for row in old if _test_of(row) not in rows]
        listed = "".join(f"{line_end}  {row}" for row in [*(f"- {row}" for row in kept), *new])
        return f"{text[: key.start_mark.index]}targets:{listed}{text[_end(node) :]}"
    indent, lines = " " * node.start_mark.column, text.splitlines(keepends=True)
    replaced = [row for row in node.value if _test_of(row) in rows]
    at = replaced[0].start_mark.line if replaced else text.count("\n", 0, _end(node)) + 1
    gone = {line for row in replaced for line in range(row.start_mark.line, text.count("\n", 0, _end(row)) + 1)}
    if at == len(lines) and not text.endswith("\n"):
        lines[-1] += line_end
    before = [line for number, line in enumerate(lines[:at]) if number not in gone]
    after = [line for number, line in enumerate(lines[at:], at) if number not in gone]
    return "".join([*before, *(f"{indent}{row}{line_end}" for row in new), *after])


def _test_of(row: yaml.Node) -> str:
    """Return the test that a row names; nothing for the main one."""
    test = _entries(row).get("test")
    return str(test[1].value) if test else ""


def _end(node: yaml.Node) -> int:
    """Return where a node ends: one in block style with its last part, before the comments and lines below."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)


def _entries(node: yaml.Node | None) -> Mapping[str, tuple[yaml.Node, yaml.Node]]:
    """Return the nodes of a mapping's keys and values by key; none of another node."""
    if not isinstance(node, yaml.MappingNode):
        return {}
    return {str(key.value): (key, value) for key, value in node.value}
