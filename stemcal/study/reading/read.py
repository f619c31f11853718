"""From a YAML file to a `Study`, or to all problems in it with their lines and remedies.

The steps are: bytes → tree with positions (`strict_yaml`) → each section independently (`sections`) → rules across the
sections (`study.rules`) → `Study`. Mistakes in one section do not hide mistakes in another.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml

from stemcal.errors import SpecError, SpecProblem
from stemcal.storage.plain import open_plain, unreadable
from stemcal.study.model.study import Study, StudyForm
from stemcal.study.reading.sections import Sections, read_sections
from stemcal.study.rules import Draft, factors, layers, target_rules
from stemcal.study.rules.plausible import doubts
from stemcal.study.types.field_types import Missing, field_or_none, without_fields
from stemcal.study.types.stage_kind import STAGES
from stemcal.study.types.strict_yaml import MAX_BYTES, Document, Finding, NodePath, Position, read_yaml


def load_study(path: str | Path, **changes: object) -> Study:
    """Return the study in the YAML file `path`; raise `SpecError` with all problems in it.

    `changes` modify the spec before it is checked. Each has the name of a section or a factor: a mapping is merged into
    it, any other value replaces it.
    """
    path = Path(path)
    try:
        with open_plain(path) as file:
            content = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        shown = f"{str(path)[:200]}{'…' if len(str(path)) > 200 else ''}"
        unread = SpecProblem(shown, 1, 1, "", f"the spec {unreadable(error)}", "check the path of the spec")
        raise SpecError([unread]) from None
    return read_study(content, path, changes)


def read_study(content: bytes, path: Path, changes: Mapping[str, object] | None = None) -> Study:
    """Return the study in `content`, with `changes`; messages show `path`, and files are relative to its folder."""
    document = read_yaml(content)
    document.data = _changed(document.data, changes or {})
    problems = [_problem(path, document, place, finding) for place, finding in document.problems]
    if not document.complete:
        raise SpecError(problems)
    read = read_sections(document.data, path.absolute().parent)
    findings = [*read.findings, *broken_rules(_draft(document.data, read))]
    problems += _without_echo(path, document, findings, {problem.line for problem in problems})
    if problems:
        raise SpecError(problems)
    values = {**read.good, "factors": tuple(read.good["factors"].values()), "source": path.absolute()}
    values["title"] = values["title"] or values["name"]
    study = Study.model_validate(values)
    doubtful = ((document.place(doubt.path, doubt.at_key), doubt) for doubt in doubts(study))
    warnings = tuple(str(_problem(path, document, *both)) for both in doubtful)
    return study.model_copy(update={"warnings": (*filter(None, [study.pending]), *warnings)})


def _changed(data: Any, changes: Mapping[str, object]) -> Any:
    """Return the tree of a spec with changes to factors or sections: mappings are merged, other values replaced."""
    for name, value in changes.items() if isinstance(data, dict) else ():
        factors = data["factors"] if isinstance(data.get("factors"), list) else []
        entries = (entry for entry in factors if isinstance(entry, dict) and entry.get("name") == name)
        node = next(entries, data.get(name))
        if isinstance(node, dict) and isinstance(value, Mapping):
            node.update(value)
        else:
            data[name] = value
    return data


def _draft(data: Any, sections: Sections) -> Draft:
    entries = data.get("factors") if isinstance(data, dict) else None
    entries = entries if isinstance(entries, list) else []
    names = tuple(str(entry.get("name", "")) for entry in entries if isinstance(entry, dict))
    good = {name: section for name, section in sections.good.items() if name != "factors"}
    study = Study.model_construct(**good)
    without_fields(study, StudyForm.model_fields.keys() - good)
    return Draft(study, sections.good.get("factors", {}), sections.tests, names, sections.naming)


def _without_echo(path: Path, document: Document, findings: list[Finding], spoiled: set[int]) -> Iterator[SpecProblem]:
    """Yield the findings as problems, without repetitions and without findings in lines that are invalid YAML."""
    seen = set()
    for finding in findings:
        problem = _problem(path, document, document.place(finding.path, finding.at_key), finding)
        if problem.line not in spoiled and problem not in seen:
            seen.add(problem)
            yield problem


def _problem(path: Path, document: Document, place: Position, finding: Finding) -> SpecProblem:
    shown = _shown(finding.path, document.data)
    return SpecProblem(str(path), place.line, place.column, shown, finding.message, finding.remedy)


def _shown(path: NodePath, data: Any) -> str:
    """Return the text of a path: list entries by their name if they have one, otherwise counted from 1."""
    words: list[str] = []
    for step in path:
        if isinstance(step, int):
            data = data[step] if isinstance(data, list) and step < len(data) else None
            name = data.get("name") if isinstance(data, dict) else None
            words.append(f".{name[:40]}" if isinstance(name, str) and name else f"[{step + 1}]")
        else:
            data = data.get(step) if isinstance(data, dict) else None
            words.append(f".{step[:60]}")
    return "".join(words).removeprefix(".").replace("\n", " ")


def broken_rules(draft: Draft) -> list[Finding]:
    """Return the mistakes that all rules find in `draft`: general rules, and those of its solver and its stages."""
    solver = field_or_none(draft.study, "solver")
    broken = [rule(draft) for rule in (*factors.RULES, *layers.RULES, *target_rules.RULES)]
    broken += [] if solver is None else [rule(draft, solver) for rule in draft.kind.rules]
    broken += [rule(draft) for stage in STAGES.with_(draft.study.further) for rule in stage.rules()]
    findings: list[Finding] = []
    for of_rule in broken:
        with suppress(Missing):  # the rule needs a field that is invalid (see `reading.sections`)
            for finding in of_rule:
                findings.append(finding)
    return findings


def with_rows(text: str, rows: Mapping[str, Sequence[str]]) -> str:
    """Return the text of a spec with other rows of `targets` for some tests; the rest of the text is unchanged.

    `rows` has the new rows (YAML or comments) by the name of the test, "" for the main test. Comments between the old
    rows are lost.
    """
    line_end = "\r\n" if "\r\n" in text else "\n"
    new = [row if row.startswith("#") else f"- {row}" for of_test in rows.values() for row in of_test]
    section = _entries(yaml.compose(text, Loader=yaml.SafeLoader)).get("targets")
    if section is None:
        listed = "".join(f"  {row}{line_end}" for row in new)
        return f"{text.rstrip()}{line_end}{line_end}targets:{line_end}{listed}"
    key, node = section
    is_block = isinstance(node, yaml.CollectionNode) and not node.flow_style
    indent = " " * node.start_mark.column if is_block else "  "
    rows_before = node.value if isinstance(node, yaml.SequenceNode) else []
    tests = [_entries(row).get("test") for row in rows_before]  # rows of the main test have no key `test`
    named = zip(rows_before, (str(test[1].value) if test else "" for test in tests), strict=True)
    kept = [text[row.start_mark.index : _end(row)] for row, test in named if test not in rows]
    listed = "".join(f"{line_end}{indent}{row}" for row in [*(f"- {row}" for row in kept), *new])
    return f"{text[: key.start_mark.index]}targets:{listed}{text[_end(node) :]}"


def _end(node: yaml.Node) -> int:
    """Return the index in the text at which a node ends; in block style, this is the end of its last entry."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)


def _entries(node: yaml.Node | None) -> Mapping[str, tuple[yaml.Node, yaml.Node]]:
    if not isinstance(node, yaml.MappingNode):
        return {}
    return {str(key.value): (key, value) for key, value in node.value}
