"""Reading of a spec section by section: the valid values and the mistakes of each section."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeGuard, get_args, get_type_hints

from pydantic import BaseModel, TypeAdapter, ValidationError

from stemcal.formats import listed, nearest
from stemcal.study.model.laboratory_kind import TESTS, LaboratorySection, naming_with, with_tests
from stemcal.study.model.measured_targets import Targets, fitted_responses
from stemcal.study.model.study import FIELDS, StudyForm
from stemcal.study.reading.json_schema import keys_of, section_with
from stemcal.study.reading.messages import finding_of
from stemcal.study.reading.target_rows import TargetRows
from stemcal.study.types.factor import MOST_FACTORS, Factor
from stemcal.study.types.field_types import field_or_none, has_fields, without_fields
from stemcal.study.types.named import naming_of
from stemcal.study.types.solver_kind import usual_solver
from stemcal.study.types.stage_kind import STAGES
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.vocabulary import CUTTING, FIRST, NOWHERE, Vocabulary


def read_sections(data: Any, folder: Path) -> Sections:
    """Read each section of a spec's tree independently; file names in it are relative to the folder of the spec."""
    sections = Sections(folder, data if isinstance(data, dict) else {})
    if not isinstance(data, dict):
        message = "the file is empty" if data is None else "a spec must consist of lines of the form `key: value`"
        sections.findings.append(Finding((), message, "create a new spec with `stemcal init`"))
        return sections
    sections.read_further()
    for name, key in StudyForm.model_fields.items():
        if spelled(name) in data:
            _READ.get(name, Sections.read)(sections, name, data[spelled(name)])
        elif name == "targets" and "goal" in data:
            sections.set_goal_condition()
        elif key.is_required():
            sections.findings.append(Finding((), f"{name!r} is missing", f"add `{name}: …`"))
        else:
            sections.good[name] = key.get_default(call_default_factory=True)
        if name == "conditions":  # the following sections use the declared names
            sections.naming = naming_of(sections.good.get("responses", ()), sections.good.get("conditions"))
    sections.add_borrowed_material()
    sections.fit_all_responses()
    return sections


@dataclass
class Sections:
    """The sections of a spec as far as they have been read.

    good: Sections by name; an invalid section has only its valid keys, which the rules can check.
    findings: Mistakes in the spec.
    tests: Laboratory tests by their index in the spec.
    naming: Declared and measured responses, and the condition.
    """

    folder: Path
    data: dict[str, Any]
    good: dict[str, Any] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    tests: dict[int, LaboratorySection] = field(default_factory=dict)
    naming: Vocabulary = CUTTING

    @property
    def context(self) -> dict[str, Any]:
        """Context for pydantic's validation of the sections; `measured` is None while the responses are unknown."""
        targets, measured = self.good.get("targets"), None
        if _complete(targets):
            measured = {self.naming.response.name, *(name for target in targets.means for name in target.further)}
        return {"spec": self.folder, "naming": self.naming, "measured": measured}

    def read(self, name: str, raw: Any) -> None:
        """Read a section; keep the valid keys of an invalid section."""
        reported: Collection[NodePath] = ()
        if raw is None:
            self.findings.append(Finding((spelled(name),), "the section is empty", "fill in or remove the section"))
            return
        if "tests" not in self.good and "responses" in getattr(_kind(name), "model_fields", ()):
            reported = [(spelled(name), "responses")]  # the responses are unknown while a test is invalid
        try:
            self.good[name] = _adapter(name).validate_python(raw, context=self.context)
        except ValidationError as error:
            self._find(error, (spelled(name),), reported)
            if (rest := _partly(_kind(name), raw, self.context)) is not None:  # the rules can check the valid keys
                self.good[name] = rest

    def read_further(self) -> None:
        """Read the sections of stages from other packages; any other key is unknown."""
        known, further = tuple(map(spelled, StudyForm.model_fields)), {}
        for key in self.data:
            if key in known:
                continue
            if (stage := STAGES.named(key)) is None or (kind := stage.section()) is None:
                near, section = nearest(key, known), section_with(key)
                remedy = f"remove the key; known sections are {listed(known)}"
                if near in self.data:
                    remedy = f"move its entries to the `{near}` section, and remove the key"
                elif near or section:
                    remedy = f"did you mean {near}?" if near else f"move the key to the `{section}` section"
                if (broken := STAGES.broken.get(key)) is not None:
                    remedy = f"the {key[:60]} stage cannot be loaded: {broken}"
                self.findings.append(Finding((key,), f"unknown key {key[:60]!r}", remedy, at_key=True))
                continue
            try:
                further[key] = kind.model_validate(self.data[key] or {}, context=self.context)
            except ValidationError as error:
                self._find(error, (key,))
        self.good["further"] = further

    def read_targets(self, name: str, raw: Any) -> None:
        """Read the rows of the targets with their curves; add their responses to the responses of the study."""
        tests, machine = self.data.get("tests"), self.good.get("machine")
        names = [test.get("name") for test in tests if isinstance(test, dict)] if isinstance(tests, list) else []
        if self.naming.is_cutting and isinstance(raw, list):
            keys = [key for row in raw if isinstance(row, dict) and "test" not in row for key in row]
            self.naming = self.naming.measuring(list(map(str, keys)))
        rows = TargetRows(self.naming, [test_name for test_name in names if isinstance(test_name, str)], self.folder)
        rows.read(raw)
        self.findings += rows.findings
        self.tests = {
            index: test.model_copy(update={"targets": tuple(rows.of_tests.get(test.name, ()))})
            for index, test in self.tests.items()
        }
        if "tests" in self.good:
            self.good["tests"] = tuple(self.tests.values())
        specimen, chosen = self.good.get("specimen"), self.chosen("diameters")
        calibrate_at = rows.calibrated_at(chosen, field_or_none(specimen, "outer_diameter"))
        if (targets := rows.targets(calibrate_at, field_or_none(machine, "stiffness"))) is not None:
            self.good[name] = targets
            self.add_test_responses(targets)

    def add_borrowed_material(self) -> None:
        """Add the material of another study (`material.from`) to the sections."""
        if field_or_none(self.good.get("material"), "from_") is not None:
            each = (stage.completed(self.good, self.data, self.folder) for stage in STAGES.built_in)
            borrowed = next(filter(None, each))
            self.findings += borrowed.findings
            self.good |= {**borrowed.sections, "materials": tuple(borrowed.others), "pending": borrowed.pending}

    def read_goal(self, name: str, raw: Any) -> None:
        """Read the goal; add the responses of the cutting test in the goal to the responses of the study."""
        keys = [key for value in raw.values() for key in value] if isinstance(raw, dict) else []
        self.naming = self.naming.measuring(list(map(str, keys))) if self.naming.is_cutting else self.naming
        self.read(name, raw)

    def set_goal_condition(self) -> None:
        """Set the condition of a study with a goal: the diameter of the specimen."""
        specimen, condition = self.good.get("specimen"), self.naming.condition
        at = NOWHERE if condition is None else field_or_none(specimen, "outer_diameter")
        if at is not None:
            self.good["targets"] = Targets(calibrate_at=at, means=())

    def read_tests(self, name: str, raw: Any) -> None:
        """Read the tests; remove unknown keys of each test, and keep the valid tests by their index in the list."""
        self.read(name, raw)
        for index, test in enumerate(raw) if isinstance(raw, list) else ():
            kind = TESTS.named(str(test.get("kind"))) if isinstance(test, dict) else None
            if kind is None:
                continue
            known = {key: test[key] for key in test if key in kind.options.model_fields}
            with suppress(ValidationError):
                self.tests[index] = kind.options.model_validate(known, context=self.context)

    def read_factors(self, name: str, raw: Any) -> None:
        """Read the factors one by one; keep the valid ones by their index in the list."""
        if isinstance(raw, list) and len(raw) > MOST_FACTORS:
            remedy = "keep the most important factors, and set the other parameters in the `material` section"
            message = f"the spec has {len(raw)} factors, but at most {MOST_FACTORS} are allowed"
            self.findings.append(Finding((name,), message, remedy))
            return
        if not isinstance(raw, list) or not raw:
            self.read(name, raw)
            return
        good, adapter = dict[int, Factor](), TypeAdapter(Factor)
        for index, entry in enumerate(raw):
            if isinstance(entry, dict):
                label = str(entry.get("name", "")).replace("_", " ")[:80] or "factor"
                entry = {"symbol": f"X{index + 1}", "label": label, **entry}
            try:
                good[index] = adapter.validate_python(entry, context=self.context)
            except ValidationError as error:
                self._find(error, (name, index))
        self.good[name] = good

    def add_test_responses(self, targets: Targets) -> None:
        """Add means of laboratory tests and scores of curves to the targets, and their names to the vocabulary."""
        tests = tuple(self.tests.values())
        if not self.naming.is_cutting or not (tests or targets.modes):
            return
        self.naming = naming_with(targets, tests)
        if _complete(targets):
            self.good["targets"] = with_tests(targets, tests)

    def fit_all_responses(self) -> None:
        """Set the fitted responses of all stages to all measured ones, unless a stage's section has `responses`."""
        targets = self.good.get("targets")
        if not _complete(targets) or self.chosen("responses") is not None:
            return
        measured = fitted_responses(targets, self.naming)
        for name in FIELDS.values() if len(measured) > 1 else ():
            if "responses" in getattr(type(self.good.get(name)), "model_fields", ()):
                self.good[name] = self.good[name].model_copy(update={"responses": measured})

    def _find(self, error: ValidationError, section: NodePath, reported: Collection[NodePath] = ()) -> None:
        """Add pydantic's errors in a section to the findings, except those at the paths `reported`."""
        for entry in error.errors(include_url=False):
            if entry["type"] == "too_short" and isinstance(entry["input"], list) and entry["input"]:
                continue  # pydantic counts only the valid entries of the list; the invalid ones are reported
            # a single `solver.result` is read as a mapping with the key `FIRST`, which the spec does not have
            path = (*section, *(step for step in entry["loc"] if step != FIRST))
            if path not in reported:
                self.findings.append(finding_of(entry, path, _with_kinds(path, self.data)))

    def chosen(self, key: str) -> Any:
        """Return the value of a key from the first section of a stage that has the key; None if there is none."""
        sections = (self.data.get(spelled(name)) for name in FIELDS.values())
        return next((section[key] for section in sections if isinstance(section, dict) and key in section), None)


_READ: dict[str, Callable[[Sections, str, Any], None]] = {
    "factors": Sections.read_factors,
    "goal": Sections.read_goal,
    "targets": Sections.read_targets,
    "tests": Sections.read_tests,
}


def _complete(targets: Targets | None) -> TypeGuard[Targets]:
    return targets is not None and all(has_fields(mean, "condition", "response") for mean in targets.means)


def spelled(name: str) -> str:
    """Return the key of a section in a spec; it differs from the field name if pydantic reserves the name."""
    return str(StudyForm.model_fields[name].validation_alias or name)


def _kind(section: str) -> Any:
    return type(usual_solver()) if section == "solver" else get_type_hints(StudyForm)[section]


@functools.cache
def _adapter(section: str) -> TypeAdapter[Any]:
    return TypeAdapter(get_type_hints(StudyForm, include_extras=True)[section])


def _with_kinds(path: NodePath, data: Any) -> NodePath:
    """Return the path of a key with the kind of its solver or test inserted, as in the JSON schema."""
    steps: list[str | int] = []
    for step in path:
        try:
            data = data[step]
        except (LookupError, TypeError):
            data = None
        kind = data.get("kind", usual_solver().kind if step == "solver" else None) if isinstance(data, dict) else None
        steps.append(step)
        if isinstance(kind, str) and not keys_of(tuple(steps)):  # in the schema, the keys are below the kind
            steps.append(kind)
    return tuple(steps)


def _partly(kind: Any, raw: Any, context: Mapping[str, Any]) -> Any:
    """Return a section with only its valid keys (access to others raises `Missing`); None if it cannot be created."""
    if not (isinstance(kind, type) and issubclass(kind, BaseModel) and isinstance(raw, dict)):
        return None
    if "kind" in (fields := kind.model_fields) and raw.get("kind", fields["kind"].default) not in get_args(
        fields["kind"].annotation
    ):
        return None  # a solver of another kind, which has other keys
    wrong = {step for error in _errors(kind, raw, context) for step in error["loc"][:1]}
    good = {key: value for key, value in raw.items() if key not in wrong}
    if _errors(kind, good, context):
        return None
    section = kind.model_validate(good, context=context)
    without_fields(section, (name for name, key in kind.model_fields.items() if wrong & {name, key.validation_alias}))
    return section


def _errors(kind: type[BaseModel], raw: Any, context: Mapping[str, Any]) -> list[Any]:
    try:
        kind.model_validate(raw, context=context)
    except ValidationError as error:
        return list(error.errors(include_url=False))
    return []
