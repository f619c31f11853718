"""A study of its own words: no sentence, key, column or label of its stages speaks of cutting a stem."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import workflow

from stemcal.errors import SpecError, TargetUnreachable
from stemcal.overview.plan import plan
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.ledger import ledger
from stemcal.stages.results import fresh_results
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.stages.verdict.words import lines, verdict_json
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.vocabulary import Vocabulary, Wording

KEY = re.compile(r"invert(: {|\.|:\\n +)diameters")  # invert.diameters, whatever the condition
STEM_WORDS = re.compile(r"\b(forces?|diameters?|stems?|blades?|cut|cutting|stroke|travel|N|mm|mJ)\b|N²")
FACTORS = """\
name: heap
factors:
  - {name: static, label: Static friction, low: 0.2, high: 0.8}
  - {name: rolling, label: Rolling friction, low: 0.02, high: 0.12}
  - {name: restitution, label: Restitution, low: 0.2, high: 0.6}
solver: {kind: command, command: [heap, "{{static}} {{rolling}} {{restitution}}"], result: RESULT}
rsm: {factors: [static, rolling]}
"""
ANGLE = "  - {name: angle, label: Angle of repose, symbol: θ, unit: deg}\n"
DENSITY = "  - {name: density, label: Bulk density, symbol: ρ, unit: kg/m3}\n"
MOISTURE = 'conditions: [{name: moisture, label: Moisture content, symbol: w, unit: "%"}]\n'
ONE = "targets: [{angle: 32.6 deg, sd: 0.8 deg, n: 5}]\n"
THREE = """\
targets:
  - {moisture: 12, angle: 32.6, sd: 0.8, n: 5}
  - {moisture: 16, angle: 34.9, sd: 0.8, n: 5}
  - {moisture: 20, angle: 37.8, sd: 0.8, n: 5}
"""
READER = "{file: out.json, path: angle}"


def spec_of(condition: str = "", targets: str = ONE, extra: str = "", further: str = "") -> str:
    """Return a spec of a heap of grains."""
    both = f"{{angle: {READER}, density: {READER}}}"
    factors = FACTORS.replace("RESULT", both if further else READER)
    return f"{factors}responses:\n{ANGLE}{further}{condition}{targets}{extra}"


def written(folder: Path, text: str) -> Study:
    """Write a spec and read it."""
    path = folder / "heap.yaml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


@dataclass(frozen=True)
class Heap(Solver):
    """A made-up heap; `low` scales what it gives in the validation."""

    words: Vocabulary
    low: float = 1.0

    @property
    def naming(self) -> Vocabulary:
        return self.words

    def identity(self, request: Request) -> dict[str, Any]:
        """Levels and condition; the validation by itself where it differs."""
        return {"levels": dict(request.levels), "at": request.condition, "low": self._scale(request)}

    def solve(self, request: Request) -> Answer:
        """Answer an angle, and a density beside it."""
        static, rolling = request.levels["static"], request.levels["rolling"]
        moist = 0.6 * (request.condition - 12.0) if self.naming.condition is not None else 0.0
        wavy = 0.3 * (7919.0 * static * rolling % 1.0)
        angle = 12.0 + 28.0 * static + 90.0 * rolling - 60.0 * static * rolling + moist + wavy
        density = 800.0 * (1.0 - 0.12 * static - 0.9 * rolling)
        return Answer("ok", response=self._scale(request) * angle, details={RESPONSES: {"density": density}})

    def _scale(self, request: Request) -> float:
        return self.low if request.stage == "validate" else 1.0


def calibrated(
    folder: Path, study: Study, monkeypatch: pytest.MonkeyPatch, low: float = 1.0
) -> tuple[StudyFolder, Verdict]:
    """Take a study through its stages."""
    monkeypatch.setattr(SOLVERS.named("command"), "make", lambda s: Heap(s.naming, low))
    place = StudyFolder(folder / "out")
    workflow.calibrate(study, place, InlineExecutor())
    return place, verdict_of(study, place)


def texts(folder: StudyFolder) -> Mapping[str, str]:
    """Return all that the stages have left, by file name, without what names a function or a solver's identity."""
    files = [*folder.path.glob("*.json"), *folder.path.glob("*.csv"), *folder.runs.glob("*.json")]
    return {path.name: path.read_text(encoding="utf-8") for path in files}


CASES = {
    "no condition": spec_of(),
    "moisture": spec_of(MOISTURE, THREE),
    "joint": spec_of(MOISTURE, THREE, "invert: {diameters: all}\n"),
    "refined": spec_of(MOISTURE, THREE, "climb: {}\nrefine: {tolerance_percent: 0.01, budget: 3}\n"),
    "joint, refined": spec_of(MOISTURE, THREE, "invert: {diameters: [12, 16]}\nrefine: {budget: 4}\n"),
    "missed": spec_of(MOISTURE, THREE),
    "two responses": spec_of(
        targets="targets: [{angle: 32.6, n: 5, density: 702, sd: {angle: 0.8, density: 12}}]\n", further=DENSITY
    ),
}


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=pytest.mark.slow if case in ("joint", "refined") else ()) for case in CASES]
)
def test_no_file_or_sentence_speaks_of_stems(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = written(tmp_path, CASES[case])
    place, verdict = calibrated(tmp_path, study, monkeypatch, low=0.57 if case == "missed" else 1.0)
    assert verdict.has("target_missed") == (case == "missed")
    told = texts(place)
    assert {"screen.json", "rsm.json", "invert.json", "validate.json", "validate.csv"} <= set(told)
    results = fresh_results(study, place)
    said = [text for result in results.done for text in (*(label for label, _ in result.runs()), repr(result))]
    said.append(json.dumps(verdict_json(verdict, Wording(study.naming))))
    planned = [str(note) for note in plan(study, place).notes]
    said += [repr(study), *planned, *(entry.message for entry in ledger(study, place))]
    for name, text in {**told, "what is said": "\n".join(said)}.items():
        text = KEY.sub("", text)
        assert not (found := STEM_WORDS.search(text)), f"{name}: {text[found.start() - 80 : found.end() + 80]}"


def test_a_single_target_is_good_nowhere_in_particular(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = written(tmp_path, spec_of())
    _, verdict = calibrated(tmp_path, study, monkeypatch)
    assert [reason.kind for reason in verdict.reasons] == ["unchecked", "not_identified"]
    assert verdict.use is not None and 0.0 < verdict.use.largest_percent < 1.0
    within = f"at most {verdict.use.largest_percent:.1f} % (limit: 10 %)."
    assert lines(verdict, Wording(study.naming))[3] == f"The error of the simulation is {within}"


def test_what_cannot_be_reached_is_told_in_the_unit_of_the_response(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = written(tmp_path, spec_of(targets="targets: [{angle: 70 deg}]\n"))
    with pytest.raises(TargetUnreachable, match=r"target 70° is above all values of .* to [\d.]+°\)"):
        calibrated(tmp_path, study, monkeypatch)
    verdict = verdict_of(study, StudyFolder(tmp_path / "out"))
    first = lines(verdict, Wording(study.naming))[0]
    assert re.search(r"angle of repose of 70° is out of reach: the factor ranges allow only [\d.]+ to [\d.]+°\.", first)


def test_power_laws_are_for_forces_over_diameters(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither F = a·d^b nor a slope per mm has a sense for an angle over moisture."""
    study = written(tmp_path, CASES["joint"])
    place, _ = calibrated(tmp_path, study, monkeypatch)
    results = fresh_results(study, place)
    found, joint = results.of(ValidateResult), results.of(InvertResult) and results.of(InvertResult).joint
    assert found is not None and joint is not None and joint.formula is None
    assert found.measured_exponent is found.error_slope_percent_per_unit is found.formula is None
    assert {note.kind for note in found.notes} <= {"fitted"}


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            spec_of(MOISTURE, THREE, "invert: {diameters: [13]}\n"),
            "invert.diameters[1]: no angle of repose is given for",
        ),
        (spec_of(extra="invert: {diameters: all}\n"), "the study has no conditions"),
        (spec_of(MOISTURE.replace("moisture", "n"), THREE.replace("moisture", "n")), "already a key of `targets`"),
    ],
)
def test_wrong_conditions(text: str, complaint: str, tmp_path: Path) -> None:
    with pytest.raises(SpecError) as error:
        written(tmp_path, text)
    assert complaint in str(error.value)
