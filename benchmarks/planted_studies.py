"""Check verdicts and remedies on studies with a known fault.

python benchmarks/planted_studies.py [seeds] [first seed] [kind ...]

Each kind of fault is planted with several seeds (12 by default, from 1), from which the true parameters, the law and
the laboratory are drawn. In the law, a and b are coded by their ranges, and p, q, r, g, t and u are drawn for each
seed:

    force   (100 + p·a + q·b + r·b²)·(d/8)^(2 + g·b)      travel   (2 + t·a − u·b)·(d/8)

The script evaluates a study, applies its remedy as a user would (by changing the named key or correcting the doubtful
input), and evaluates the study again. Counted are the correct verdicts and reasons, the correct remedies, the correct
verdicts after the remedy, and the studies whose parameters are no further from the true values than before. A parameter
counts as no further if its distance increases by at most 0.05 half ranges or its 95 % interval covers the true value,
because a point that was selected from many can be near by chance. If only one force is fitted, which determines one
combination, the error of this force may increase by 1.4 %, two standard errors of the measured mean. The script takes
some ten minutes.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from stemcal.errors import StemcalError
from stemcal.notes import Note
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.fresh import make_all
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS

SEEDS = 12
ROOM, ROOM_PERCENT = 0.05, 1.4
MIDDLE, HALF = np.array([15.0, 0.03]), np.array([5.0, 0.02])
NAMES = ("yield_stress", "failure_strain")
MATERIAL = "density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,\n"
SPEC = f"""\
name: planted
factors:
  - {{name: yield_stress, unit: MPa, low: 10, high: 20}}
  - {{name: failure_strain, low: 0.01, high: 0.05}}
material: {{{MATERIAL}  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8}}
"""
NINE = """\
name: planted
factors:
  - {name: density, unit: kg/m3, low: 1000, high: 1200}
  - {name: elastic_modulus, unit: MPa, low: 800, high: 1200}
  - {name: poisson_ratio, low: 0.2, high: 0.4}
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
  - {name: tangent_modulus, unit: MPa, low: 0.4, high: 0.6}
  - {name: hardening_parameter, low: 0, high: 0.1}
  - {name: strain_rate_c, unit: 1/s, low: 80, high: 100}
  - {name: strain_rate_p, low: 4, high: 12}
  - {name: failure_strain, low: 0.01, high: 0.05}
"""
RSM = "rsm: {factors: [yield_stress, failure_strain], centre_points: 4}\n"
WIDE = "rsm: {factors: [yield_stress, failure_strain], design: latin-hypercube, runs: 20}\n"
PROGRAM = """\
solver: {kind: command, command: [none, "{{yield_stress}}", "{{failure_strain}}"],
  result: {file: out.json, path: force}MORE}
"""
BOTH, ALL = "invert: {responses: [force, travel]}\n", "invert: {diameters: all}\n"
ALL_BOTH = "invert: {diameters: all, responses: [force, travel]}\n"
_calls = count()


@dataclass(frozen=True)
class Law(Solver):
    """The forward model, in the solver's place.

    `rough` is the part by which answers are rough but repeatable, `noise` that by which they scatter. `wave` adds
    18·sin(3a + 0.5) to the force, `crossed` a product of a and b. `checks` are told of runs of a stage at a diameter.
    """

    of_spec_alone = True

    p: float
    q: float
    r: float = 3.0
    g: float = 0.0
    t: float = 0.05
    u: float = 0.3
    rough: float = 0.0
    noise: float = 0.0
    wave: float = 0.0
    crossed: float = 0.0
    held: float | None = None
    checks: dict[tuple[str, float], dict[str, float]] = field(default_factory=dict)

    def of(self, a: float, b: float, diameter: float) -> tuple[float, float]:
        """Return force and travel."""
        size = diameter / 8.0
        force = 100.0 + self.p * a + self.q * b + self.r * b * b + self.crossed * a * b
        force += self.wave * np.sin(3.0 * a + 0.5)
        return force * size ** (2.0 + self.g * b), (2.0 + self.t * a - self.u * b) * size

    def solve(self, request: Request) -> Answer:
        """Answer: rough responses are the same whenever they are asked for, noisy ones never."""
        a, b = coded({**dict(zip(NAMES, MIDDLE, strict=True)), **request.levels})
        force, travel = self.of(a, b if self.held is None else self.held, request.condition)
        if self.rough:
            seed = [round(1e6 * (value + 3.0)) for value in (a, b, request.condition)]
            force *= 1.0 + self.rough * np.random.default_rng(seed).standard_normal()
        if self.noise:
            force *= 1.0 + self.noise * np.random.default_rng(next(_calls)).standard_normal()
        told: dict[str, Any] = {"hourglass_ratio_percent": 1.0, "inertia_percent": 1.0, "stroke_was_enough": True}
        told |= {
            "travel": travel,
            "peak_travel": travel,
            "curve": {"travel": [0.0, travel, 2.0 * travel], "force": [0.0, force, 0.0]},
        }
        return Answer("ok", response=force, details=told | self.checks.get((request.stage, request.condition), {}))

    def identity(self, request: Request) -> dict[str, Any]:
        """Levels and diameter; of a program with chance in it the run too."""
        own = [request.stage, request.row, request.replicate] if self.noise else []
        return {"law": str(self), "levels": dict(request.levels), "diameter": request.condition, "run": own}

    def cost_estimate(self, _request: Request) -> float:
        """Return a second."""
        return 1.0


def coded(levels: dict[str, float]) -> tuple[float, float]:
    """Return a and b."""
    a, b = (np.array([levels[name] for name in NAMES]) - MIDDLE) / HALF
    return float(a), float(b)


@dataclass(frozen=True)
class Plant:
    """A law and a truth (coded); specimens scatter by `scatter`, and the travel is measured wrong by `travel_off`."""

    law: Law
    truth: tuple[float, float]
    random: np.random.Generator
    scatter: float = 0.02
    travel_off: float = 0.0

    def targets(self, diameters: Iterable[float] = (7.0, 8.0, 11.0), travel: bool = True) -> str:
        """Return what eight specimens of each diameter gave."""
        lines = []
        for diameter in diameters:
            true = np.array(self.law.of(*self.truth, diameter)) * (1.0, 1.0 + self.travel_off)
            measured = true * (1.0 + self.scatter * self.random.standard_normal((8, 2)))
            (force, way), (sd, way_sd) = measured.mean(axis=0), measured.std(axis=0, ddof=1)
            both = f", travel: {way:.6f} mm, sd: {{force: {sd:.5f} N, travel: {way_sd:.6f} mm}}"
            more = both if travel else f", sd: {sd:.5f} N"
            lines.append(f"    - {{diameter: {diameter:g} mm, force: {force:.5f} N, n: 8{more}}}")
        return "targets:\n" + "\n".join(lines) + "\n"

    def off(self, found: Results | None) -> float:
        """Return how far the parameters are from the truth, in half ranges; infinite where there are none."""
        if found is None or found.of(InvertResult) is None:
            return np.inf
        return float(np.linalg.norm(np.array(coded(found.parameters)) - self.truth))

    def no_further(self, before: Judged, after: Judged) -> bool:
        """Tell whether the parameters after are as near to the truth as before, or known to hold it."""
        inversion = None if after.results is None else after.results.of(InvertResult)
        if inversion is None or inversion.certainty is None:
            return False
        intervals = inversion.certainty.intervals
        ends = [coded({name: intervals[name][side] for name in NAMES}) for side in (0, 1)]
        held = all(low <= value <= high for value, low, high in zip(self.truth, *ends, strict=True))
        return held or self.off(after.results) <= self.off(before.results) + ROOM

    def force_off(self, found: Results | None) -> float:
        """Return how far off the true force at 8 mm is with the parameters, percent."""
        if found is None or found.of(InvertResult) is None:
            return np.inf
        true = self.law.of(*self.truth, 8.0)[0]
        return abs(100.0 * (self.law.of(*coded(found.parameters), 8.0)[0] / true - 1.0))


@dataclass(frozen=True)
class Judged:
    """What a study came to; `refused` is the error that ended it."""

    verdict: Verdict | None
    results: Results | None
    refused: str = ""

    def reason(self, kind: str) -> Note | None:
        """Return the reason of a kind, None where there is none."""
        reasons = () if self.verdict is None else self.verdict.reasons
        return next((reason for reason in reasons if reason.kind == kind), None)

    def advises(self, kind: str, words: str) -> bool:
        """Tell whether the remedy of a reason has these words, or this edit."""
        reason = self.reason(kind)
        remedy = None if reason is None else reason.remedy
        return remedy is not None and words in (f"{remedy.text} {remedy.edit}")

    @property
    def free(self) -> set[str]:
        """The factors that the fit leaves free."""
        found = None if self.results is None else self.results.of(InvertResult)
        return set() if found is None or found.certainty is None else set(found.certainty.not_identified)

    def is_(self, *words: str) -> bool:
        """Tell whether the verdict is one of these words."""
        return self.verdict is not None and self.verdict.verdict in words


@dataclass(frozen=True)
class Row:
    """What was right of one study: the verdict, its advice, the verdict after it, and the way it led."""

    verdict: bool
    advice: bool
    after: bool
    nearer: bool


def judged(law: Law, spec: str) -> Judged:
    """Take a study as far as it comes, with the law in the solver's place."""
    for kind in ("embedded", "command"):
        vars(SOLVERS.named(kind))["make"] = lambda _study: law
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "study.yaml"
        path.write_text(spec, encoding="utf-8")
        study, folder = load_study(path), StudyFolder(Path(place) / "out")
        refused = ""
        try:
            make_all(study, folder, InlineExecutor())
        except StemcalError as error:
            refused = str(error)
        with suppress(StemcalError):
            return Judged(verdict_of(study, folder), fresh_results(study, folder), refused)
        return Judged(None, None, refused)


def drawn(seed: int, kind: str) -> tuple[np.random.Generator, tuple[float, float], Law]:
    """Return a truth within 0.6 of the middle, and a law in which both a and b raise the force."""
    random = np.random.default_rng([seed, *kind.encode()])
    a, b = random.uniform(-0.6, 0.6, 2).tolist()
    p, q, r = random.uniform(14.0, 24.0), random.uniform(6.0, 14.0), random.uniform(1.0, 4.0)
    return random, (a, b), Law(p, q, r, t=random.uniform(0.02, 0.08), u=random.uniform(0.2, 0.4))


def one_force(seed: int) -> Row:
    """One force knows a combination; a travel was measured, and is to be fitted too."""
    random, truth, law = drawn(seed, "one")
    plant = Plant(law, truth, random)
    targets = plant.targets()
    before, after = judged(law, SPEC + targets + RSM), judged(law, SPEC + targets + RSM + BOTH)
    return followed(plant, before, after, "responses")


def diameters_apart(seed: int) -> Row:
    """One force again; the other diameters were measured, and b changes how the force grows."""
    random, truth, law = drawn(seed, "apart")
    law = replace(law, g=random.uniform(0.5, 0.8))
    plant = Plant(law, truth, random, scatter=0.01)
    targets = plant.targets(travel=False)
    before, after = judged(law, SPEC + targets + RSM), judged(law, SPEC + targets + RSM + ALL)
    return followed(plant, before, after, "conditions")


def followed(plant: Plant, before: Judged, after: Judged, unfitted: str | None) -> Row:
    """Return what is right of a study that is to be identified, before and after what was not fitted is."""
    key = "diameters" if unfitted == "conditions" else unfitted
    return Row(
        before.is_("with_reservations") and before.reason("not_identified") is not None and before.free == set(NAMES),
        before.advises("not_identified", f"invert: {{{key}: all}}"),
        after.is_("calibrated", "with_reservations") and after.reason("not_identified") is None,
        plant.no_further(before, after),
    )


def from_the_literature(seed: int) -> Row:
    """Nothing else was measured: the factor that the advice names is held at its true value."""
    random, truth, law = drawn(seed, "literature")
    plant = Plant(law, truth, random, scatter=0.01)
    targets = plant.targets(travel=False)
    before = judged(law, SPEC + targets + RSM + ALL)
    reason = before.reason("not_identified")
    if not before.advises("not_identified", "give failure_strain a prior") or reason.remedy.edit is not None:
        return Row(reason is not None, False, False, False)
    known = f"failure_strain: {MIDDLE[1] + HALF[1] * truth[1]:.6g}, hardening_parameter"
    spec = SPEC.replace("  - {name: failure_strain, low: 0.01, high: 0.05}\n", "")
    one = "rsm: {factors: [yield_stress], centre_points: 4, alpha: 1}\n"
    after = judged(replace(law, held=truth[1]), spec.replace("hardening_parameter", known) + targets + one)
    off, results = np.inf, after.results
    if results is not None and results.of(InvertResult) is not None:
        off = abs(coded({NAMES[1]: 0.03, **results.parameters})[0] - truth[0])
    return Row(before.is_("with_reservations"), True, after.is_("calibrated"), off <= plant.off(before.results) + ROOM)


def ridge(seed: int) -> Row:
    """All diameters see one combination of a and b, and specimens scatter: no end of a range is to be widened."""
    random, truth, law = drawn(seed, "ridge")
    plant = Plant(law, truth, random, scatter=0.05)
    targets = plant.targets((7.0, 8.0, 9.0))
    before, after = judged(law, SPEC + targets + RSM + ALL), judged(law, SPEC + targets + RSM + ALL_BOTH)
    row = followed(plant, before, after, "responses")
    return replace(row, advice=row.advice and not widened(before))


def widened(study: Judged) -> bool:
    """Tell whether the verdict asks for a wider range."""
    reasons = () if study.verdict is None else study.verdict.reasons
    return any((reason.remedy.edit or "").startswith("factors:") for reason in reasons if reason.remedy)


def undeclared_noise(seed: int) -> Row:
    """A program with a scatter of 5 % that it does not declare is refused; it is declared, with replicates."""
    random, truth, law = drawn(seed, "noise")
    law = replace(law, noise=0.05)
    plant = Plant(law, truth, random)
    spec = SPEC + plant.targets((8.0,), travel=False) + RSM
    before = judged(law, spec + PROGRAM.replace("MORE", ""))
    after = judged(law, spec + PROGRAM.replace("MORE", ", replicates: 3"))
    return Row(
        "it is stochastic" in before.refused,
        "replicates: " in before.refused,
        after.is_("calibrated", "with_reservations") and after.reason("not_identified") is not None,
        plant.force_off(after.results) <= 5.0,  # that of the surface of so many runs
    )


def rough(seed: int) -> Row:
    """Answers that are rough by 8 % but repeatable show in the surface's misfit; a smooth solver mends it."""
    random, truth, law = drawn(seed, "rough")
    plant, uneven = Plant(law, truth, random), replace(law, rough=0.08)
    spec = SPEC + plant.targets() + RSM
    before, after = judged(uneven, spec), judged(law, spec)
    reason = before.reason("rough_response")
    return Row(
        reason is not None or before.is_("not_calibrated"),
        reason is None or before.advises("rough_response", "design: latin-hypercube"),
        after.is_("with_reservations") and after.reason("rough_response") is None,
        plant.force_off(after.results) <= plant.force_off(before.results) + ROOM_PERCENT,
    )


def physics(seed: int) -> Row:
    """The calibrated run alone has much hourglass energy; finer elements have less."""
    random, truth, law = drawn(seed, "physics")
    percent = random.uniform(25.0, 60.0)
    doubtful = replace(law, checks={("validate", 8.0): {"hourglass_ratio_percent": percent}})
    plant = Plant(law, truth, random)
    spec = SPEC + plant.targets() + RSM + BOTH + "solver: {kind: embedded, element_size: d/16MORE}\n"
    before = judged(doubtful, spec.replace("MORE", ""))
    after = judged(law, spec.replace("d/16MORE", "d/30, time_step: 21 us"))
    reason = before.reason("physics_of_solution")
    return Row(
        before.is_("not_calibrated") and reason is not None and f"{percent:.0f} %" in reason.text,
        before.advises("physics_of_solution", "smaller elements"),
        not after.is_("not_calibrated") and after.reason("physics_of_solution") is None,
        plant.off(after.results) <= plant.off(before.results) + ROOM,
    )


def wrong_sign(seed: int) -> Row:
    """The spec expects that b lowers the force; with the sign that the law has nothing is said."""
    random, truth, law = drawn(seed, "sign")
    plant = Plant(law, truth, random)
    spec = SPEC + plant.targets() + RSM + BOTH
    wrong, right = (judged(law, spec.replace("high: 0.05}", f'high: 0.05, expected_sign: "{sign}"}}')) for sign in "-+")
    reason = wrong.reason("sign_against_expectation")
    return Row(
        reason is not None and "of failure_strain has" in reason.text and wrong.is_("with_reservations"),
        wrong.advises("sign_against_expectation", "Check failure_strain in the model"),
        right.reason("sign_against_expectation") is None and not right.is_("not_calibrated"),
        plant.off(right.results) <= plant.off(wrong.results) + ROOM,
    )


def conflict(seed: int) -> Row:
    """Force and travel rise in nearly one direction, and the travel is measured 15 to 25 % wrong."""
    random, truth, law = drawn(seed, "conflict")
    law = replace(law, t=0.02 * law.p, u=-0.02 * law.q)
    wrong = random.uniform(0.15, 0.25) * random.choice([-1.0, 1.0])
    plant = Plant(law, truth, random, scatter=0.02, travel_off=wrong)
    targets = plant.targets((8.0,))
    before, after = judged(law, SPEC + targets + RSM + BOTH), judged(law, SPEC + targets + RSM)
    reason = before.reason("conflict")
    return Row(
        before.is_("not_calibrated") and reason is not None,
        before.advises("conflict", "`invert.responses`") and not widened(before),
        after.reason("conflict") is None and after.is_("with_reservations"),
        plant.force_off(after.results) <= plant.force_off(before.results) + ROOM_PERCENT,
    )


def wave(seed: int) -> Row:
    """A force in a wave, which the quadratic misses: refining corrects it. More than it can reach is out of reach."""
    random, _, law = drawn(seed, "wave")
    law = replace(law, p=0.0, q=6.0, r=0.0, wave=18.0)
    plant = Plant(law, (random.uniform(-0.3, 0.2), random.uniform(-0.4, 0.4)), random, 0.005)
    targets = plant.targets((8.0,), travel=False)
    before, after = judged(law, SPEC + targets + WIDE), judged(law, SPEC + targets + WIDE + "refine: {}\n")
    beyond = Plant(replace(law, wave=60.0), (0.35, 0.6), random, 0.005)
    out = judged(law, SPEC + beyond.targets((8.0,), travel=False) + WIDE)
    return Row(
        before.reason("rough_response") is not None,
        out.reason("out_of_reach") is not None and out.is_("not_calibrated"),
        after.reason("target_missed") is None and not after.is_("not_calibrated"),
        plant.force_off(after.results) <= 2.0,
    )


def aliased(seed: int) -> Row:
    """Nine factors, an interaction of two: a fold-over finds them, one force leaves both free, travel fixes them."""
    random, truth, law = drawn(seed, "aliased")
    law = replace(law, q=random.uniform(9.0, 14.0), r=0.0, crossed=random.uniform(4.0, 7.0))
    plant = Plant(law, truth, random)
    spec = NINE + "screen: {fold_over: true}\n" + plant.targets()
    return followed(plant, judged(law, spec), judged(law, spec + BOTH), "responses")


KINDS: dict[str, Callable[[int], Row]] = {
    "2 one force": one_force,
    "2 diameters apart": diameters_apart,
    "2 from the literature": from_the_literature,
    "3 ridge": ridge,
    "4 undeclared noise": undeclared_noise,
    "4 rough": rough,
    "5 physics of the solution": physics,
    "5 wrong sign": wrong_sign,
    "6 conflict": conflict,
    "7 wave": wave,
    "11 aliased interaction": aliased,
}


def main() -> None:
    """Print one row per kind: how many of the seeds are right, and those that are not."""
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    seeds, first = numbers + [SEEDS, 1][len(numbers) :]
    wanted = [word for word in sys.argv[1:] if not word.isdigit()]
    print("kind                         verdict  advice   after    no further   wrong seeds")
    for kind, study in KINDS.items():
        if wanted and not any(word in kind for word in wanted):
            continue
        rows = [study(seed) for seed in range(first, first + seeds)]
        each = dict(enumerate(([row.verdict, row.advice, row.after, row.nearer] for row in rows), first))
        right = [f"{sum(column)}/{seeds}" for column in zip(*each.values(), strict=True)]
        wrong = [f"{seed}:{''.join(str(int(ok)) for ok in row)}" for seed, row in each.items() if not all(row)]
        print(f"{kind:<28} {right[0]:<8} {right[1]:<8} {right[2]:<8} {right[3]:<11}  {' '.join(wrong)}", flush=True)


if __name__ == "__main__":
    main()
