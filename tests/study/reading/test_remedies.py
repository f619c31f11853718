"""Every remedy of the wrong specs, typed: the spec then has one problem fewer, or none.

A remedy is applied as a reader of the message would: to the value or key at the place of the problem. What the message
leaves to the reader (`…`, another name, a larger value) is filled in from `SAMPLES` or by the rule of the remedy.
"""

import copy
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from stemcal.study.reading.read import _draft, broken_rules, read_yaml
from stemcal.study.reading.sections import read_sections
from stemcal.study.types.strict_yaml import Finding

BAD = Path(__file__).parents[2] / "cases" / "bad"
SAMPLES = {
    "span": "56 mm", "thickness": "0.5 mm", "source": "a handbook", "exponent": 1.0, "value": "0.5 MPa", "name": "demo",
    "force": "10 N", "travel": "1 mm", "work": "30 mJ", "sd": "1 N", "moisture": "14 %",
    "targets": [{"diameter": "8 mm", "force": "159.2 N"}],
}  # fmt: skip
FACTOR = {"name": "stem_friction", "low": 0.1, "high": 0.3}
READER = {"file": "out.csv", "column": "x"}


def findings(data: Any) -> list[Finding]:
    """Return the problems of a tree of YAML."""
    read = read_sections(copy.deepcopy(data), BAD)
    return list(dict.fromkeys([*read.findings, *broken_rules(_draft(data, read))]))


class Typed:
    """A spec in which a remedy is typed at the place of a problem."""

    def __init__(self, data: Any, finding: Finding) -> None:
        self.data, self.finding = copy.deepcopy(data), finding
        *above, self.key = finding.path or (None,)
        self.parent = self.at(above)

    def at(self, path: Any) -> Any:
        node = self.data
        for step in path:
            node = node[step]
        return node

    @property
    def value(self) -> Any:
        return self.data if self.key is None else self.parent[self.key]

    def write(self, value: Any) -> None:
        self.parent[self.key] = value

    def merge(self, fragment: dict[str, Any], into: Any = None) -> None:
        node = self.value if into is None else into
        for key, value in fragment.items():
            if isinstance(value, dict) and isinstance(node.get(key), dict):
                self.merge(value, node[key])
            else:
                node[key] = value

    def remove(self, key: Any = None) -> None:
        del self.parent[self.key if key is None else key]

    def section(self, name: str) -> Any:
        return self.data.setdefault(name, {})


def plain(text: str) -> Any:
    return yaml.safe_load(text) if text else text


def rename(one: Typed, new: str) -> None:
    """Put another word in the place of the one that the message quotes: a key, a value, or a unit in a value."""
    found = re.search(r"'([^']*)'", one.finding.message)
    is_key = isinstance(one.parent, dict) and (
        one.finding.message.startswith(f"{one.key} ") or (found and found[1] == one.key)
    )
    if one.finding.at_key or is_key:
        one.parent[new] = one.parent.pop(one.key)
    elif found and isinstance(one.value, str) and found[1] in one.value:
        one.write(one.value.replace(found[1], new))
    else:
        one.write(new)


def sample(fragment: str) -> dict[str, Any]:
    """Return `key: …` with a sample for the dots."""
    key, _, rest = fragment.partition(":")
    if "file: …" in rest:
        return {key: READER}
    inner = re.match(r"\s*\{(.*)\}", rest)
    return {key: sample(inner[1]) if inner else SAMPLES[key.strip()] if "…" in rest else plain(rest)}


def within(one: Typed, limit: str, share: float) -> None:
    number, _, unit = limit.strip().partition(" ")
    one.write(f"{share * float(number):g} {unit}" if unit else share * float(number))


def unit(one: Typed, new: str) -> None:
    """Write a unit: that of a factor, or behind the number of a value."""
    wrong = re.match(r"(\S+) is a unit", one.finding.message)
    if isinstance(one.parent, dict) and one.key not in one.parent:
        one.write(new)
        return
    if isinstance(one.value, str) and wrong and one.value != wrong[1]:
        one.write(one.value.replace(wrong[1], new))
    elif isinstance(one.value, dict):
        one.value["unit"] = new
    else:
        one.write(new)


def swapped(one: Typed, low: str, high: str) -> None:
    node = one.parent if isinstance(one.parent, dict) and low in one.parent else one.value
    node[low], node[high] = node[high], node[low]


def positive(one: Typed) -> None:
    number, _, name = str(one.value).partition(" ")
    one.write(f"{abs(float(number)) or 1.0:g} {name}".strip() if name else abs(one.value) or 0.01)


RULES: list[tuple[str, Callable[..., object]]] = [
    (r"reduce `(height|clearance)`", lambda one, key: one.section("supports").update({key: "15 mm"})),
    (r"increase `height`", lambda one: one.section("supports").update(height="30 mm")),
    (r"add `clearance: 1 mm`", lambda one: one.parent.update(clearance="1 mm")),
    (r"write `kind: span`", lambda one: (one.write("span"), one.parent.pop("height", None))),
    (r"remove `height`", lambda one: one.parent.pop("height")),
    (r"write (\w+), \w+ or \w+$", lambda one, v: one.write(v)),
    (r"write `bevel: both`", lambda one: one.write("both")),
    (r'write "([^"]+)"', lambda one, text: one.write(text)),
    (r"write `until: (\w+)`", lambda one, v: one.section("loading").update(until=v)),
    (r"write `edge_over: nodes`", lambda one: one.write("nodes")),
    (r"write `factors: significant`", lambda one: one.write("significant")),
    (r"write `sd: (\{.*\})`", lambda one, text: one.write({k.strip(): plain(v) if "…" not in v else SAMPLES[k.strip()]
        for k, v in (part.split(":") for part in text[1:-1].split(","))})),
    (r"write `diameters: all` in the `invert`", lambda one: one.section("invert").update(diameters="all")),
    (r"write `rotatable`", lambda one: one.write("rotatable")),
    (r"write a (?:plain )?number, such as ([\d.]+)", lambda one, v: one.write(float(v))),
    (r"write ([\d.]+) without quotes", lambda one, v: one.write(float(v))),
    (r"write a number above ([\d.]+)", lambda one, v: one.write(float(v) + 0.5)),
    (r"write a number below ([\d.e]+)", lambda one, v: one.write(0.05 * min(float(v), 100.0))),
    (r"write ([\d.]+) or (?:more|less)", lambda one, v: one.write(plain(v))),
    (r"write a whole number", lambda one: one.write(20)),
    (r"write (?:a|the) (?:value|number|text)$",
     lambda one: one.write("text" if one.key in ("label", "symbol") else 0.02)),
    (r"write at least one entry", lambda one: one.write([dict(FACTOR)])),
    (r"write a number, or the factor|write a number, such as 0.5", lambda one: one.write(0.5)),
    (r"write a smaller and a larger value than ([\d.]+)", lambda one, v: one.write([0.9 * float(v), 1.1 * float(v)])),
    (r"write lines of the form", lambda one: one.write(dict(FACTOR)
        if one.finding.path[0] == "factors" else {"width": "10 mm"})),
    (r"write a row such as", lambda one: one.write(SAMPLES["targets"])),
    (r"write a longer value", lambda one: one.write("a handbook")),
    (r"write a value closer to (\S+)", lambda one, v: one.write(0.5 * (one.value + float(v)))),
    (r"write a larger value", lambda one: positive(one)),
    (r"write a smaller value", lambda one: within(one, re.search(r"below (.*)$", one.finding.message)[1], 0.5)),
    (r"write `time_step: (\S+ s)`", lambda one, v: one.section("solver").update(time_step=v)),
    (r"write `replicates: 4` under `solver`", lambda one: one.section("solver").update(replicates=4)),
    (r"write `transverse: \{\}` under `material`", lambda one: one.section("material").update(transverse={})),
    (r"add (a line `\S+ mm: …`.*),", lambda one, text: one.value.update(
        dict.fromkeys(re.findall(r"\S+ mm", text.replace("`", "")), next(iter(one.value.values()))))),
    (r"without quotes for a ratio", lambda one: one.write(float(one.value))),
    (r"write d/16", lambda one: one.write("d/16")),
    (r"write ([\d.]+(?: \w+)?)(?: \(or|$)", lambda one, v: one.write(plain(v))),
    (r"write (\w+) or \w+$", lambda one, v: one.write(v)),
    (r"did you mean ([\w.-]+)\?", rename),
    (r"add kind: (\w+)", lambda one, v: one.value.update(kind=v)),
    (r"add `command: (\[.*\])`", lambda one, v: one.value.update(command=plain(v))),
    (r"add `(\{name.*\})` to `factors`", lambda one, v: one.data["factors"].append(plain(v))),
    (r"add (?:a line )?`?(sd: …)", lambda one, v: one.value.update(sd="5 N")),
    (r"add sd: \{(\w+): …\}", lambda one, name: (one.value if isinstance(one.value, dict) else one.parent).setdefault(
        "sd", {}).update({name: SAMPLES[name]})),
    (r"add a response, such as `force: …`", lambda one: one.value.update(force="10 N", sd="1 N")),
    (r"add (?:a line )?`?(\w+: (?:…|\{file: …\}))", lambda one, text: one.merge(sample(text),
        one.parent if one.finding.path and not isinstance(one.value, dict) else None)
        if "standard deviation" not in one.finding.message else one.at(one.finding.path[:-2]).update(sample(text))),
    (r"move the key to the `(\w+)` section",
     lambda one, name: one.section(name).update({one.key: one.parent.pop(one.key)})),
    (r"move its entries to the `(\w+)` section",
     lambda one, name: one.section(name).extend(one.parent.pop(one.key) or [])),
    (r"remove this factor", lambda one: one.data["factors"].pop(one.finding.path[1])),
    (r"move the supports closer", lambda one: one.write("30 mm")),
    (r"move the parameter to the `material`", lambda one: one.section("material").update(
        {one.parent["name"]: one.data["factors"].pop(one.finding.path[1])["low"]})),
    (r"set the parameter (?:to a fixed value )?in the `material` section", lambda one: (
        one.section("material").update({re.search(r"`(\w+)` \(", one.finding.message)[1]:
            "1100 kg/m3" if "density" in one.finding.message else 8})
        if "requires `" in one.finding.message else one.section("material").update(
            {one.parent["name"]: one.data["factors"].pop(one.finding.path[1])["low"]}))),
    (r"remove `screen.design: none`", lambda one: one.data.pop("screen")),
    (r"list the factors, as in `factors: (\[.*\])`", lambda one, v: one.write(plain(v))),
    (r"set `stroke: d/2` instead of `duration`",
     lambda one: (one.value.pop("duration", None), one.value.update(stroke="d/2"))),
    (r"reduce `high`", lambda one: one.write(one.parent["low"] * 1.1)),
    (r"increase `low`", lambda one: one.write(one.parent["high"] * 0.9)),
    (r"remove `(?:duration|stroke)`", lambda one: one.remove()),
    (r"remove `edge_spread: 0 mm`", lambda one: one.remove()),
    (r"remove the parameter", lambda one: one.at(one.finding.path[:-2]).pop(one.finding.path[-2])
        if one.key == "name" else one.remove()),
    (r"fill in or remove the section|remove this section", lambda one: one.remove()),
    (r"remove (?:this|the) row", lambda one: one.at(one.finding.path[:-2]).pop(one.finding.path[-2])),
    (r"or remove this row", lambda one: one.at(one.finding.path[:-2]).pop(one.finding.path[-2])),
    (r"keep one row", lambda one: one.at(one.finding.path[:-2]).pop(one.finding.path[-2])),
    (r"add the (?:force|response) to `targets`, or remove", lambda one: one.remove() if isinstance(one.parent, list)
        else one.write("all")),
    (r"remove (?:this|the) (?:key|value)|remove one", lambda one: one.remove()
        if one.key != "adjust" else one.write(list(dict.fromkeys(one.value)))),
    (r"swap `low` and `high`", lambda one: swapped(one, "low", "high")),
    (r"swap the two values", lambda one: one.write(one.value[::-1])),
    (r"swap the two coefficients", lambda one: swapped(one, "static_friction", "dynamic_friction")),
    (r"use (?:less than|a radius below|about) ([\d.]+ ?\w*)", lambda one, v: within(one, v, 0.9)),
    (r"(?:use|choose from) (\S+?),? (?:or )?.*instead$", lambda one, v: one.parent.update({v: "10 N", "sd": {v: "1 N"}})
        or one.remove()),
    (r"choose from (\w+)", lambda one, v: one.write([v])),
    (r"choose a centre near ([\d.]+)", lambda one, v: one.write([float(v) - 2.5, float(v) + 2.5])),
    (r"choose another name|use a different (?:name|symbol)", lambda one: one.write(
        {"name": "another", "symbol": "Z9"}[one.key])),
    (r"use letters, digits and underscores|use up to 64 letters", lambda one: one.write("another")),
    (r"use (\S+?)(?:,| or|$)", lambda one, v: unit(one, v) if "unit" in one.finding.message else rename(one, v)),
    (r"remove the (?:character|characters)", lambda one: one.write(
        "".join(c for c in one.value if c.isprintable()).strip() or "source")),
    (r"keep two, and limit the others", lambda one: one.at(("goal",)).pop("maximise", None)),
    (r"enclose the value in quotes", lambda one: one.write(str(one.value))),
    (r"shorten the value to a length of at most (\d+)", lambda one, v: one.write(one.value[: int(v)])),
    (r"the usual range(?: for plants)? is ([\d.e-]+) to ([\d.e-]+)", lambda one, low, high: one.write(
        plain(low) if one.key == "low" else 0.4 if one.key == "high" else float(high) * 0.9)),
]  # fmt: skip
"""Forms of remedies, the first that fits is typed."""

OPEN = (
    "correct the value", "correct the prior", "reduce `tangent_modulus`", "copy the file", "write the path relative",
    "list at most", "write each entry on a separate line", "create a new spec",
    "use a different name for each factor", "as in `yield_stress`", "choose another name",
    "use thinner layers", "reduce the", "smaller than the diameter", "so that the present cutter is inside",
)  # fmt: skip
"""What only the reader can decide: which value is wrong, or a file."""


def typed(data: Any, finding: Finding) -> Any:
    """Return the spec with the remedy of a finding; None where only the reader can decide."""
    if any(text in finding.remedy for text in OPEN):
        return None
    one = Typed(data, finding)
    for form, apply in RULES:
        if (found := re.search(form, finding.remedy)) is not None:
            apply(one, *found.groups())
            return one.data
    raise AssertionError(f"no rule to type: {finding.remedy}")


def wrong_specs() -> list[Path]:
    """Return the wrong specs that are trees."""
    found = []
    for path in sorted(BAD.glob("*.yaml")):
        document = read_yaml(path.read_bytes())
        if document.complete and isinstance(document.data, dict) and findings(document.data):
            found.append(path)
    return found


def test_remedies_that_change_the_text_itself() -> None:
    """Of decimal commas in braces and of tabs, which YAML reads as something else."""
    for name, old, new in (
        ("decimal-comma-in-braces", "0,01", "0.01"),
        ("remedies-of-units", "152,5 N", "152.5 N"),
        ("remedies-of-units", "1,234 N", "1.234 N"),
        ("tab", "\t", "  "),
    ):
        text = (BAD / f"{name}.yaml").read_text(encoding="utf-8").split("name:", 1)[1]
        before, after = (read_yaml(f"name:{one}".encode()).problems for one in (text, text.replace(old, new)))
        (problem,) = (finding for _, finding in before if finding not in [other for _, other in after])
        assert new in problem.remedy or "spaces" in problem.remedy
        assert len(after) == len(before) - 1


@pytest.mark.parametrize("path", wrong_specs(), ids=lambda path: path.stem)
def test_each_remedy_typed_leaves_one_problem_fewer(path: Path) -> None:
    data = read_yaml(path.read_bytes()).data
    before = findings(data)
    assert before
    for finding in before:
        if (after := typed(data, finding)) is not None:
            left = findings(after)
            assert finding not in left
            more = [one for one in left if one not in before]
            # a row that can be read at last may have other problems
            assert len(left) < len(before) or {one.path[:2] for one in more} == {finding.path[:2]}, (finding, more)


def test_only_rows_that_could_not_be_read_show_more() -> None:
    """A row of an unknown test, and one without the value of its scatter."""
    more = []
    for path in wrong_specs():
        data = read_yaml(path.read_bytes()).data
        before = findings(data)
        for finding in before:
            after = typed(data, finding)
            if after is not None and len(findings(after)) >= len(before):
                more.append((path.stem, finding.path))
    rows = [("laboratory-tests", ("targets", 4, "test")), ("one-test-wrong", ("targets", 3, "sd", "travel"))]
    assert more == rows


def test_few_remedies_are_left_to_the_reader() -> None:
    """Of all remedies of the wrong specs; the script types the others."""
    every = [finding for path in wrong_specs() for finding in findings(read_yaml(path.read_bytes()).data)]
    left = [finding.remedy for finding in every if any(text in finding.remedy for text in OPEN)]
    assert len(every) > 130 and len(left) < 0.15 * len(every)
