"""Reading of the rows of `targets`: measured values in the names and units of the study, and mistakes in the rows."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from stemcal.errors import UsageError
from stemcal.formats import counted, did_you_mean
from stemcal.measured.curve_modes import FEWEST, MOST, Curve, from_preload, modes_of, without_noise
from stemcal.measured.shear_curves import CurveOptions, read_curves
from stemcal.measured.statistics import summarise
from stemcal.responses import responses_in
from stemcal.study.model.laboratory_kind import LaboratoryMeans
from stemcal.study.model.measured_targets import Count, Mean, Patterns, Target, Targets
from stemcal.study.reading.messages import finding_of
from stemcal.study.types import units
from stemcal.study.types.field_types import MOST as LARGEST
from stemcal.study.types.field_types import Quantity, complain, field_or_none, has_fields, without_fields
from stemcal.study.types.named import as_written, quantity
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.vocabulary import DIAMETER, FORCE, NOWHERE, Variable, Vocabulary

_MOST_NAMES, _MOST_ROWS = 10, 1000
_WHOLE = CurveOptions(preload=0.0)  # the preload is applied after smoothing, because noise exceeds it too early


def _curves_in(patterns: Sequence[str], folder: Path, path: NodePath) -> tuple[list[Curve], list[Finding]]:
    """Return the smoothed curves in all files that match the patterns in the folder of the spec, and the mistakes."""
    read: list[Curve] = []
    wrong: list[Finding] = []
    files: dict[Path, None] = {}
    for pattern in patterns:
        try:
            matches = sorted(path for path in folder.glob(pattern) if path.is_file())
        except (ValueError, NotImplementedError, OSError):
            matches = []
        inside = [file for file in matches if file.resolve().is_relative_to(folder.resolve())]
        if not inside:
            remedy = "list force–travel files from the spec folder"
            return read, [Finding(path, f"no file matches {pattern[:100]}", remedy)]
        files |= dict.fromkeys(inside)
    for file in files:
        try:
            read += [without_noise(curve.travel, curve.force) for curve in read_curves(file, _WHOLE)]
        except UsageError as error:
            remedy = "correct the file; its columns can have the headings `Travel (mm)` and `Force (N)`"
            wrong.append(Finding(path, str(error), remedy))
    if not wrong and len(read) < FEWEST:
        message = f"the scatter of the curves cannot be estimated from only {counted(len(read), 'specimen')}"
        remedy = f"measure at least {FEWEST} specimens, or write `force` and `sd` instead of `curves`"
        wrong.append(Finding(path, message, remedy))
    return read, wrong[:_MOST_NAMES]


@dataclass
class TargetRows:
    """The rows of `targets` as far as they are valid.

    naming: Responses and condition of the main test (cutting, or the test of a program).
    tests: Names of the laboratory tests in the spec.
    means, of_tests: Measured means of the main test, and of laboratory tests by name.
    curves: Measured curves by the index of their row.
    """

    naming: Vocabulary
    tests: Collection[str]
    folder: Path
    means: list[Target] = field(default_factory=list)
    of_tests: dict[str, list[LaboratoryMeans]] = field(default_factory=dict)
    curves: dict[int, list[Curve]] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    def read(self, raw: Any) -> None:
        """Read all rows."""
        at = "" if self.naming.condition is None else f"{self.naming.condition.name}: …, "
        example = f"{at}{self.naming.response.name}: …, sd: …, n: …"
        if not isinstance(raw, list) or not 0 < len(raw) <= _MOST_ROWS:
            remedy = f"write a row such as `- {{{example}}}` for each mean"
            self._find(("targets",), f"the targets are not a list of 1 to {_MOST_ROWS} rows", remedy)
            return
        for index, row in enumerate(raw):
            if isinstance(row, dict):
                self._read_row(index, row)
            else:
                self._find(("targets", index), "the row is not a mapping", f"write a row such as `{{{example}}}`")
        if not self.means and not self.findings:
            message = f"no row contains a measured {self.naming.response.noun}"
            self._find(("targets",), message, f"add a row such as `- {{{example}}}`")

    def _read_row(self, index: int, row: Mapping[str, Any]) -> None:
        test = row.get("test")
        if "test" in row and test not in self.tests:
            absent = "remove the `test` key, or add the test to the `tests` section"
            remedy = did_you_mean(str(test), self.tests) if self.tests else absent
            self._find(("targets", index, "test"), f"this study has no test named {str(test)[:60]!r}", remedy)
            return
        if test is None:
            self._read_main(index, self._with_curves(index, row))
        else:
            responses = responses_in(measured=map(str, row))  # rules refuse responses of other tests
            naming = Vocabulary(DIAMETER, tuple(map(Variable.of, responses)))
            entry = _Row(row, ("targets", index), naming, self.findings)
            if not entry.means and not entry.wrong:
                remedy = f"add a response, such as `{FORCE.name}: …`"
                self._find(("targets", index), "the row contains no measured response", remedy)
            if entry.condition is not None:
                means = LaboratoryMeans(diameter=entry.condition, means=entry.means, row=index)
                self.of_tests.setdefault(str(test), []).append(means)

    def _read_main(self, index: int, row: Mapping[str, Any]) -> None:
        """Read a row of the main test; of an invalid row, keep the valid values, which the rules can check."""
        naming = self.naming
        entry = _Row(row, ("targets", index), naming, self.findings)
        first = naming.response.name
        values: dict[str, Any] = {"row": index, "n": entry.n, "curves": entry.curves}
        if entry.condition is not None:
            values["condition"] = entry.condition
        if first in entry.means:
            values |= {"response": entry.means[first].value}
        elif first not in row and not row.get("curves"):
            self._find(("targets", index), f"{first!r} is missing", f"add {first}: …")
        values["further"] = {name: mean for name, mean in entry.means.items() if name != first}
        values["sd"] = field_or_none(entry.means.get(first), "sd")
        target = Target.model_construct(**values)
        if entry.scatter_is_wrong:
            without_fields(target, ["sd"])
        self.means.append(target)

    def _with_curves(self, index: int, row: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the row; if it has curves but no force, add force, standard deviation and `n` of the curves."""
        patterns = row.get("curves")
        patterns = [patterns] if isinstance(patterns, str) else patterns
        if not isinstance(patterns, list) or not patterns or not all(isinstance(name, str) for name in patterns):
            return row
        if self.naming.response != FORCE:
            return row
        read, wrong = _curves_in(patterns, self.folder, ("targets", index, "curves"))
        self.findings += wrong
        if wrong:
            return row
        self.curves[index] = read
        if "force" in row:
            return row
        forces = summarise([float(force.max()) for _, force in read])
        sd = dict(row["sd"]) if isinstance(row.get("sd"), dict) else {}
        if forces.sd is not None:
            sd["force"] = f"{forces.sd:.4g} N"
        return {**row, "force": f"{forces.mean:.5g} N", "n": forces.n, **({"sd": sd} if sd else {})}

    def _find(self, path: NodePath, message: str, remedy: str) -> None:
        self.findings.append(Finding(path, message, remedy))

    def targets(self, calibrate_at: float | None, stiffness: float | None) -> Targets | None:
        """Return the targets with the modes of their curves; None without a valid row or calibration condition."""
        if not self.means or calibrate_at is None:
            return None
        targets = Targets(calibrate_at=calibrate_at, means=tuple(self.means))
        if self.curves and all(has_fields(target, "condition", "response") for target in self.means):
            places = {target.row: place for place, target in enumerate(targets.means)}
            at = [row for row in self.curves if isclose(targets.means[places[row]].condition, targets.calibrate_at)]
            most, modes = MOST, {}  # other conditions have at most as many modes as the calibration condition
            for row in [*at, *(row for row in self.curves if row not in at)]:
                modes[places[row]] = modes_of(self.curves[row], stiffness, most)
                most = len(modes[places[row]].weights) if row in at else most
            travels = {places[row]: _travel_of(each, stiffness) for row, each in self.curves.items()}
            return targets.with_modes(modes, travels)
        return targets

    def calibrated_at(self, chosen: Any, outer_diameter: float | None) -> float | None:
        """Return the condition of the calibration: the first of the `chosen` ones, or the diameter of the specimen.

        If no row has this condition, return the condition of the first row.
        """
        measured = [target.condition for target in self.means if has_fields(target, "condition")]
        wanted = outer_diameter if self.naming.condition == DIAMETER else None
        if isinstance(chosen, list) and chosen and self.naming.condition is not None:
            try:
                wanted = _value(chosen[0], self.naming.condition, self.naming.condition == DIAMETER)
            except PydanticCustomError:
                return measured[0] if measured else None
        equal = (value for value in measured if wanted is not None and isclose(value, wanted, rel_tol=1e-9))
        return next(equal, measured[0] if measured else None)


class _Row:
    """One row: its condition (None if missing or invalid) and valid means by response; mistakes go to `findings`."""

    def __init__(self, row: Mapping[str, Any], path: NodePath, naming: Vocabulary, findings: list[Finding]) -> None:
        self.row, self.path, self.findings, self.wrong = row, path, findings, False
        self.with_units = naming.is_cutting or "test" in row  # in other studies, a plain number has the declared unit
        present = [response for response in naming.responses if response.name in row]
        scatters = self._scatters(present, naming)
        self.scatter_is_wrong = self.wrong
        self.condition = self._condition(naming)
        self.n: int | None = self._checked("n", Count)
        with_curves = naming.response == FORCE and "test" not in row
        self.curves = self._checked("curves", Patterns) if with_curves else None
        self.means: dict[str, Mean] = {}
        for named in present:
            value = self._read((named.name,), row[named.name], named, above=0.0)
            at = ("sd", named.name) if isinstance(row.get("sd"), dict) else ("sd",)
            sd = self._read(at, scatters[named.name], named, at_least=0.0) if named.name in scatters else None
            if value is not None:
                mean = Mean.model_construct(value=value, sd=sd, n=self.n if "test" in row else None)
                if self.scatter_is_wrong:
                    without_fields(mean, ["sd"])
                self.means[named.name] = mean
        self._refuse_unknown(naming, with_curves)

    def _condition(self, naming: Vocabulary) -> float | None:
        named = naming.condition
        if named is None:
            return NOWHERE
        if named.name not in self.row:
            self._find((), f"{named.name!r} is missing", f"add {named.name}: …")
            return None
        bounds = {"above": 0.0} if self.with_units else {}
        return self._read((named.name,), self.row[named.name], named, **bounds)

    def _scatters(self, present: Sequence[Variable], naming: Vocabulary) -> Mapping[str, Any]:
        if "sd" not in self.row:
            return {}
        sd, names = self.row["sd"], [response.name for response in present]
        if isinstance(sd, dict):
            for name in sd:
                if name not in names:
                    known = any(name == response.name for response in naming.responses)
                    missing = f"{str(name)[:60]} has a standard deviation but no measured value"
                    self._find(("sd", name), missing, f"add {name}: …" if known else did_you_mean(str(name), names))
            return sd
        if len(names) > 1:
            shown = f"{sd:g}" if isinstance(sd, float) else str(sd)[:60]
            message = f"the standard deviation of {shown} could apply to {' or '.join(names)}"
            self._find(("sd",), message, f"write `sd: {{{names[0]}: {shown}, {names[1]}: …}}`")
            return {}
        if not names and not self.row.get("curves"):
            self._find(("sd",), "the row has a standard deviation but no response", "add the response")
        return dict.fromkeys(names, sd)

    def _read(self, key: tuple[str, ...], raw: Any, named: Variable, **bounds: float) -> float | None:
        try:
            return _value(raw, named, self.with_units, **bounds)
        except PydanticCustomError as error:
            context = error.context or {}
            self._find(key, str(context.get("message", "")), str(context.get("remedy", "")))
            return None

    def _checked(self, key: str, kind: Any) -> Any:
        if key not in self.row:
            return None
        try:
            return TypeAdapter(kind).validate_python(self.row[key])
        except ValidationError as error:
            path = (*self.path, key)
            self.findings.append(finding_of(error.errors(include_url=False)[0], path, path))
            self.wrong = True
            return None

    def _refuse_unknown(self, naming: Vocabulary, with_curves: bool) -> None:
        at = [] if naming.condition is None else [naming.condition.name]
        known = ["test"] * ("test" in self.row) + [*at, *(response.name for response in naming.responses), "sd", "n"]
        known += ["curves"] if with_curves else []
        for key in self.row:
            if key not in known:
                remedy = did_you_mean(str(key), known)
                if not self.with_units and naming.condition is None:
                    remedy += f", or declare the condition with `conditions: [{{name: {str(key)[:60]}, unit: …}}]`"
                    self.condition = None  # with an unknown condition, no rule compares the rows
                self._find((key,), f"unknown key {str(key)[:60]!r}", remedy, at_key=True)

    def _find(self, key: tuple[str, ...], message: str, remedy: str, at_key: bool = False) -> None:
        self.wrong = True
        self.findings.append(Finding((*self.path, *key), message, remedy, at_key))


def _value(
    raw: Any, named: Variable, with_units: bool, above: float | None = None, at_least: float = -LARGEST
) -> float:
    """Return a value in the unit of `named`. If `with_units`, `raw` must have a unit; otherwise numbers are allowed."""
    if with_units:
        bounds = {"above": above} if above is not None else {}
        kind = Quantity(units.parse_unit(named.unit).dimension, at_least=at_least, unit=named.unit, **bounds)
        return as_written(kind.checked(raw, from_yaml=named.unit != "1"), named.unit)
    value = quantity(raw, named)
    if not abs(value) <= LARGEST:
        raise complain(f"{value:g} is not between -{LARGEST:g} and {LARGEST:g}", "check the number and its unit")
    if above is not None and not value > above:
        remedy = "correct the value; a relative error requires a positive measured value"
        raise complain(f"{named.text(value)} must be above 0", remedy)
    if value < at_least:
        raise complain(f"the standard deviation of {named.text(value)} is negative", "write a value of 0 or more")
    return value


def _travel_of(curves: Sequence[Curve], stiffness: float | None) -> Mean:
    """Return the mean travel from the preload to the maximum force, corrected for the machine's stiffness (N/mm)."""
    compliance = 0.0 if stiffness is None else 1.0 / stiffness
    rising = [from_preload(travel - compliance * (force - force[0]), force) for travel, force in curves]
    travels = summarise([float(travel[int(np.argmax(force))]) for travel, force in rising])
    return Mean(value=travels.mean, sd=travels.sd, n=travels.n)
