"""Mutated specs: whatever somebody feeds the loader, it answers with a study or a `SpecError`."""

import os
from pathlib import Path
from typing import Any

import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stemcal.errors import SpecError
from stemcal.study.model.study import Study
from stemcal.study.reading import read_study

CONFIGS = Path(__file__).parents[3] / "configs"
SPECS = [path.read_bytes() for path in sorted(CONFIGS.glob("*.yaml"))]
TREES = [yaml.safe_load(content) for content in SPECS]

EXAMPLES = int(os.environ.get("STEMCAL_FUZZ", "30"))  # of each kind; 20000 now and then by hand
fuzz = settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))

scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from(["8 mm", "8", "-1 mm", "0 N", "1e400 mm", "nan", "significant", "embedded", "table"]),
    st.sampled_from(["../x", "data", "\0", "<<", "*a", "&a", "!!int 3"]),
    st.sampled_from(["yield_stress", "density", "{{x}}", "%", "1", "10" * 200, "a" * 10_000]),
)
nodes = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
)
snippets = st.one_of(
    st.binary(max_size=8),
    st.sampled_from(b"\n|:|: |- |  |\t|{|}|[|]|&a |*a|!!x |'|\"|---\n|...\n|%YAML 1.1\n|#|? |\xff|\0|\r".split(b"|")),
    st.sampled_from(b"\xef\xbb\xbf|\xff\xfe|\xed\xa0\x80|\xe2\x80\xa8|1e999|0x1F|1_0|.inf".split(b"|")),
    st.sampled_from([b'"\\U00110000"', b"9" * 5000, b"|\n", b"[" * 40, b"a: " * 40]),
)


def load(content: bytes) -> Study | None:
    """Return the study, or None if it was refused with readable problems."""
    try:
        return read_study(content, CONFIGS / "mutated.yaml")
    except SpecError as error:
        assert error.problems
        for problem in error.problems:
            assert problem.line >= 1 and problem.column >= 1 and problem.message
            assert len(str(problem).encode("utf-8")) < 3000 and "\n" not in str(problem)
        lines = [problem.line for problem in error.problems]
        assert lines == sorted(lines)
        return None


@fuzz
@given(st.sampled_from(SPECS), st.lists(st.tuples(st.floats(0, 1), st.integers(0, 6), snippets), max_size=5))
def test_mutated_bytes(content: bytes, cuts: list[tuple[float, int, bytes]]) -> None:
    for where, width, snippet in cuts:
        at = int(where * len(content))
        content = content[:at] + snippet + content[at + width :]
    load(content)


@fuzz
@given(st.sampled_from(SPECS), st.lists(st.tuples(st.integers(0), st.integers(0), st.integers(0, 4)), max_size=6))
def test_mutated_lines(content: bytes, moves: list[tuple[int, int, int]]) -> None:
    lines = content.split(b"\n")
    for source, target, move in moves:
        line = lines[source % len(lines)]
        if move == 0 and len(lines) > 1:
            del lines[source % len(lines)]
        elif move == 1:
            lines.insert(target % len(lines), line)
        elif move == 2:
            lines[source % len(lines)] = b"  " + line
        elif move == 3:
            lines[source % len(lines)] = line.strip()
        else:
            lines[source % len(lines)] = line.partition(b":")[0] + b":"
    load(b"\n".join(lines))


def places(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the path of every node of a tree."""
    inner = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [path, *(found for key, node in inner for found in places(node, (*path, key)))]


def mutated(tree: Any, path: tuple[Any, ...], change: str, node: Any) -> Any:
    """Return a copy of `tree` with the node at `path` replaced, removed, renamed or joined by another."""
    if not path:
        return node
    copy = dict(tree) if isinstance(tree, dict) else list(tree)
    key = path[0]
    if len(path) > 1:
        copy[key] = mutated(copy[key], path[1:], change, node)
    elif change == "replace" or isinstance(copy, list):
        copy[key] = node
    elif change == "remove":
        del copy[key]
    elif change == "rename":
        copy[str(key)[:-1]] = copy.pop(key)
    else:
        copy[str(node)[:30]] = node
    return copy


@fuzz
@given(st.data())
def test_mutated_trees(data: st.DataObject) -> None:
    tree = data.draw(st.sampled_from(TREES))
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(places(tree)))
        change = data.draw(st.sampled_from(["replace", "remove", "rename", "add"]))
        tree = mutated(tree, path, change, data.draw(nodes))
    load(yaml.safe_dump(tree, allow_unicode=True).encode("utf-8", "surrogatepass"))
