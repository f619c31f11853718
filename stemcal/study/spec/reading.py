"""From a YAML file to a `Study`, or to every problem in it with its line and what to do.

The way of a spec: bytes → strict tree with places → each section by itself → rules across them → `Study`.
A section that is wrong does not hide what is wrong in another.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import TypeAdapter, ValidationError

from stemcal.errors import SpecError, SpecProblem
from stemcal.files.plain import open_plain
from stemcal.naming import Naming
from stemcal.study.model import MOST_FACTORS, EmbeddedSolver, Factor, Study, StudyForm
from stemcal.study.rules import broken_rules
from stemcal.study.rules.plausible import doubts
from stemcal.study.spec.draft import Draft, Finding
from stemcal.study.spec.messages import finding_of
from stemcal.study.spec.named import inner_options, naming_of, respelled, spelled
from stemcal.study.spec.partly import partly
from stemcal.study.spec.schema import RESULT_KINDS, SOLVER_KINDS, section_with
from stemcal.study.spec.strict_yaml import MAX_BYTES, Document, NodePath, Place, read_yaml
from stemcal.words import listed, nearest

__all__ = ["load_study", "read_study"]


def load_study(path: str | Path) -> Study:
    """Return the study in the YAML file `path`; raise `SpecError` with all that is wrong with it."""
    path = Path(path)
    return read_study(_content(path), path)


@dataclass(frozen=True)
class Reread:
    """Reads a spec again with further changes laid over it."""

    content: bytes
    path: Path
    changes: tuple[Mapping[str, object], ...] = ()

    def __call__(self, changes: Mapping[str, object]) -> Study:
        """Return the study with all changes so far and these."""
        return read_study(self.content, self.path, (*self.changes, changes))


def read_study(content: bytes, path: Path, changes: tuple[Mapping[str, object], ...] = ()) -> Study:
    """Return the study in `content`; `path` names it in messages, and tables are found beside it.

    `changes` are laid over it one after the other, by the name of a section or a factor (see `Study.with_`).
    """
    document = read_yaml(content)
    for change in changes:
        document.data = _changed(document.data, change)
    problems = [
        _problem(path, document, place, Finding(node, message, remedy))
        for place, node, message, remedy in document.problems
    ]
    if not document.complete:
        raise SpecError(problems)
    sections, findings = _sections(document.data, path.absolute().parent)
    _fit_all_responses(sections, document.data)
    naming = naming_of(sections.get("responses", ()), sections.get("conditions"))
    findings += broken_rules(_draft(document.data, sections, naming))
    findings = [_as_spelled(finding, document.data, naming) for finding in findings]
    problems += _without_echo(path, document, findings, {problem.line for problem in problems})
    if problems:
        raise SpecError(problems)
    study = _study(path, document, sections)
    study._reread = Reread(content, path, changes)
    return study


def _changed(data: Any, changes: Mapping[str, object]) -> Any:
    """Lay changes over the tree of a spec: mappings over mappings, by factor or by section."""
    if not isinstance(data, dict):
        return data
    changed = dict(data)
    for name, value in changes.items():
        factors = changed.get("factors")
        named = isinstance(factors, list) and any(isinstance(f, dict) and f.get("name") == name for f in factors)
        if named and isinstance(factors, list):
            changed["factors"] = [
                _laid_over(f, value) if isinstance(f, dict) and f.get("name") == name else f for f in factors
            ]
        else:
            changed[name] = _laid_over(changed.get(name), value)
    return changed


def _laid_over(below: object, above: object) -> object:
    return {**below, **above} if isinstance(below, dict) and isinstance(above, Mapping) else above


def _content(path: Path) -> bytes:
    try:
        with open_plain(path) as file:
            return file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        problem = SpecProblem(str(path), 1, 1, "", f"cannot be read: {reason}", "check the name of the spec")
        raise SpecError([problem]) from None


def _sections(data: Any, folder: Path) -> tuple[dict[str, Any], list[Finding]]:
    """Validate each section by itself; return what is good of each, and what is wrong."""
    if not isinstance(data, dict):
        message = "the file is empty" if data is None else "a study is a mapping: lines of key: value"
        return {}, [Finding((), message, "start from `stemcal init`")]
    findings = list(_unknown_sections(data))
    sections: dict[str, Any] = {}
    context: dict[str, Any] = {"spec": folder}
    for name, field in StudyForm.model_fields.items():
        if name in data:
            _VALIDATE.get(name, _validate)(name, data[name], context, sections, findings)
        elif field.is_required():
            findings.append(Finding((), f"{name!r} is missing", f"add a section {name}:"))
        else:
            sections[name] = field.get_default()
        if name == "conditions":  # what follows is written under the names declared by now
            context["naming"] = naming_of(sections.get("responses", ()), sections.get("conditions"))
    return sections, findings


def _fit_all_responses(sections: dict[str, Any], data: Any) -> None:
    """Let a study of several responses of its own fit all that are measured, unless the spec chooses."""
    targets, invert = sections.get("targets"), sections.get("invert")
    chosen = isinstance(data, dict) and isinstance(data.get("invert"), dict) and "responses" in data["invert"]
    if not sections.get("responses") or targets is None or invert is None or chosen:
        return
    measured = dict.fromkeys(name for target in targets.forces for name in target.further)
    if measured:
        sections["invert"] = invert.model_copy(update={"responses": ("force", *measured)})


def _unknown_sections(data: dict[str, Any]) -> Iterator[Finding]:
    known = tuple(StudyForm.model_fields)
    for key in data:
        if key not in known:
            near, section = nearest(key, known), section_with(key)
            remedy = f"remove it; the sections are {listed(known)}"
            if near or section:
                remedy = f"did you mean {near}?" if near else f"it belongs under {section}"
            yield Finding((key,), f"unknown key {key[:60]!r}", remedy, at_key=True)


def _validate(
    name: str, given: Any, context: dict[str, Any], sections: dict[str, Any], findings: list[Finding]
) -> None:
    if given is None:
        findings.append(Finding((name,), "is empty", "fill it in or remove it"))
        return
    try:
        sections[name] = _adapter(name).validate_python(given, context=context)
    except ValidationError as error:
        findings += _findings(error, (name,))
        if (rest := partly(_kind_of(name), given, context)) is not None:
            sections[name] = rest


def _validate_targets(
    name: str, given: Any, context: dict[str, Any], sections: dict[str, Any], findings: list[Finding]
) -> None:
    naming: Naming = context["naming"]
    if naming.is_cutting or given is None:
        _validate(name, given, context, sections, findings)
        return
    respelt, wrong = respelled(given, naming)
    findings += [Finding((name, *path), message, remedy) for path, message, remedy in wrong]
    if respelt is not None and not wrong:
        try:
            sections[name] = _adapter(name).validate_python(respelt, context=context)
        except ValidationError as error:
            findings += _findings(error, (name,))


def _validate_invert(
    name: str, given: Any, context: dict[str, Any], sections: dict[str, Any], findings: list[Finding]
) -> None:
    """What is fitted together is chosen by ``diameters``, or ``conditions`` where these are of the study's own."""
    inner, wrong = inner_options(given, context["naming"])
    findings += [Finding((name, *path), message, remedy) for path, message, remedy in wrong]
    _validate(name, inner, context, sections, findings)


def _validate_solver(
    name: str, given: Any, context: dict[str, Any], sections: dict[str, Any], findings: list[Finding]
) -> None:
    """A program's ``result`` may be a mapping of readers by response."""
    result = given.get("result") if isinstance(given, dict) else None
    if (
        isinstance(result, dict)
        and result
        and "kind" not in result
        and all(isinstance(r, dict) for r in result.values())
    ):
        given = {**{key: value for key, value in given.items() if key != "result"}, "results": result}
    _validate(name, given, context, sections, findings)


def _validate_factors(
    name: str, given: Any, context: dict[str, Any], sections: dict[str, Any], findings: list[Finding]
) -> None:
    if isinstance(given, list) and len(given) > MOST_FACTORS:
        remedy = "screen those that may matter, and give the others under material"
        findings.append(Finding((name,), f"there are {len(given)} factors, at most {MOST_FACTORS} can be", remedy))
        return
    if not isinstance(given, list) or not given:
        _validate(name, given, context, sections, findings)
        return
    good: dict[int, Factor] = {}
    for index, entry in enumerate(given):
        try:
            good[index] = _factor_adapter().validate_python(_with_defaults(entry, index), context=context)
        except ValidationError as error:
            findings += _findings(error, (name, index))
    sections[name] = good


_VALIDATE = {
    "factors": _validate_factors,
    "targets": _validate_targets,
    "solver": _validate_solver,
    "invert": _validate_invert,
}


def _with_defaults(entry: Any, index: int) -> Any:
    if not isinstance(entry, dict):
        return entry
    label = str(entry.get("name", "")).replace("_", " ")[:80] or "factor"
    return {"symbol": f"X{index + 1}", "label": label, **entry}


@functools.cache
def _adapter(section: str) -> TypeAdapter[Any]:
    return TypeAdapter(get_type_hints(StudyForm, include_extras=True)[section])


def _kind_of(section: str) -> Any:
    """Return the type of a section; of a solver that of the embedded one, the only one that rules look into."""
    return EmbeddedSolver if section == "solver" else get_type_hints(StudyForm)[section]


@functools.cache
def _factor_adapter() -> TypeAdapter[Factor]:
    return TypeAdapter(Factor)


def _findings(error: ValidationError, section: NodePath) -> list[Finding]:
    found = []
    for entry in error.errors(include_url=False):
        if entry["type"] == "too_short" and entry["input"]:
            continue  # its wrong entries are reported; pydantic does not count them
        shown = (*section, *entry["loc"])
        is_tagged = section == ("solver",) and len(shown) > 1 and shown[1] in SOLVER_KINDS
        path = ("solver", *_without_kind(shown[2:])) if is_tagged else shown
        found.append(finding_of(entry, path, shown))
    return found


def _without_kind(path: NodePath) -> NodePath:
    """Return a path below a solver without the kind of its result, which pydantic puts in and YAML has not."""
    if path[:1] == ("results",) and len(path) > 2 and path[2] in RESULT_KINDS:
        return (*path[:2], *path[3:])
    return (path[0], *path[2:]) if len(path) > 1 and path[0] == "result" and path[1] in RESULT_KINDS else path


def _draft(data: Any, sections: dict[str, Any], naming: Naming) -> Draft:
    entries = data.get("factors") if isinstance(data, dict) else None
    entries = entries if isinstance(entries, list) else []
    names = tuple(str(entry.get("name", "")) for entry in entries if isinstance(entry, dict))
    known = {key: value for key, value in sections.items() if key in Draft.__dataclass_fields__}
    return Draft(**{**known, "names": names, "naming": naming})


def _as_spelled(finding: Finding, data: Any, naming: Naming) -> Finding:
    """Return a finding with the path that the spec writes, under its own names."""
    as_list = isinstance(data, dict) and isinstance(data.get("targets"), list)
    path = spelled(finding.path, naming, as_list)
    invert = data.get("invert") if isinstance(data, dict) else None
    if path[:2] == ("invert", "diameters") and isinstance(invert, dict) and "diameters" not in invert:
        path = ("invert", "conditions", *path[2:])
    return finding._replace(path=("solver", "result", *path[2:]) if path[:2] == ("solver", "results") else path)


def _without_echo(path: Path, document: Document, findings: list[Finding], spoiled: set[int]) -> Iterator[SpecProblem]:
    """Yield the findings as problems, but none that only follows from a line unreadable as YAML."""
    seen = set()
    for finding in findings:
        problem = _problem(path, document, _place(document, finding), finding)
        if problem.line not in spoiled and problem not in seen:
            seen.add(problem)
            yield problem


def _place(document: Document, finding: Finding) -> Place:
    if finding.at_key and finding.path in document.keys:
        return document.keys[finding.path]
    return document.place(finding.path)


def _problem(path: Path, document: Document, place: Place, finding: Finding) -> SpecProblem:
    shown = _shown(finding.path, document.data)
    return SpecProblem(str(path), place.line, place.column, shown, finding.message, finding.remedy)


def _shown(path: NodePath, data: Any) -> str:
    """Return `path` as people write it: factors by name, other list entries counted from 1."""
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


def _study(path: Path, document: Document, sections: dict[str, Any]) -> Study:
    values = {**sections, "factors": tuple(sections["factors"].values()), "source": path.absolute()}
    values["title"] = values["title"] or values["name"]
    study = Study.model_validate(values)
    warnings = tuple(str(_problem(path, document, _place(document, doubt), doubt)) for doubt in doubts(study))
    return study.model_copy(update={"warnings": warnings})
