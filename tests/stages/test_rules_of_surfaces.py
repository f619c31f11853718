"""Each rule of the verdict on runs and surface: at its threshold, just beyond it, and the whole sentence.

The force is F = 100 + 20a + 8b + 3b² at 8 mm; a design within the ranges of both factors reaches 78.79 to 122.08 N.
"""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from known_results import FORCES, Known, evidence, known, spec_of

from stemcal.notes import Note, Remedy
from stemcal.runs.record import Outcome
from stemcal.stages.rsm import verdict_rules as rules
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.rsm.verdict_rules import _beyond, _unit_ratio
from stemcal.stages.screen.result import ScreenResult
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study

FAILED = Outcome(response=None, status="failed", reason="inverted")
RETRY = "Fix the causes of the failures (see `stemcal status SPEC --failed`), then run `stemcal run SPEC --retry`."


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return known(tmp_path_factory.mktemp("known"), spec_of())


def aimed(study: Study, force: float) -> Study:
    """Return the study with this force measured at 8 mm."""
    means = tuple(t.model_copy(update={"response": force}) if t.condition == 8.0 else t for t in study.targets.means)
    return study.model_copy(update={"targets": study.targets.model_copy(update={"means": means})})


def with_failed(surface: RsmResult, *runs: int) -> RsmResult:
    """Return a surface some of whose runs (from 1) failed."""
    changed = [replace(run, outcome=FAILED) if run.run in runs else run for run in surface.design.runs]
    return replace(surface, design=replace(surface.design, runs=Rows(changed)))


def only(found: Any) -> Note:
    (note,) = found
    return note


# ---- scatter that was not declared


def recorded(*responses: float | None, stage: str = "screen", **more: Any) -> list[dict[str, Any]]:
    """Return records of runs with equal inputs but for what each run draws."""
    return [
        {"request": {"stage": stage}, "response": response, "identity": {"x": 1, "seed": n, "replicate": n, **more}}
        for n, response in enumerate(responses)
    ]


@pytest.mark.parametrize(
    ("records", "ends"),
    [
        (recorded(100.0, 100.0001), None),  # 1e-6 of the larger one
        (recorded(100.0, 100.00011), "100 and 100"),
        (recorded(90.0, None, 100.0, 95.0), "90 and 100"),
        (recorded(-90.0, -100.0), "-100 and -90"),
        (recorded(90.0) + recorded(100.0, y=2), None),
        (recorded(90.0, 100.0, stage="refine"), "90 and 100"),
        ([], None),
    ],
)
def test_equal_inputs_with_different_responses(done: Known, records: list[dict[str, Any]], ends: str | None) -> None:
    study: Any = done.study
    found = list(rules.undeclared_scatter(SimpleNamespace(study=study, of=lambda _: None, records=records)))  # type: ignore[arg-type]
    assert [(note.kind, note.severity) for note in found] == [("undeclared_scatter", "error")] * bool(ends)
    assert [note.text for note in found] == [
        f"The program is stochastic (runs at the same levels returned {ends}), but the spec has no `replicates`."
    ] * bool(ends)
    assert all(note.remedy == study.solver.chance_remedy() for note in found)


def test_scatter_is_expected_with_replicates_and_of_no_matter_with_a_surface(done: Known) -> None:
    records, solver = recorded(90.0, 100.0), done.study.solver.model_copy(update={"replicates": 3})
    twice = done.study.model_copy(update={"solver": solver})
    for study, of in ((twice, lambda _: None), (done.study, lambda _: "a surface")):
        assert not list(rules.undeclared_scatter(SimpleNamespace(study=study, of=of, records=records)))  # type: ignore[arg-type]


# ---- reversed sign, confused units


@pytest.mark.parametrize(
    ("forces", "reported"),
    [
        ((-80.0, -100.0, -120.25), 3),
        ((-80.0, -100.0), 0),
        ((-80.0, None, -100.0), 0),
        ((-80.0, -100.0, 0.0), 0),
        ((-80.0, None, -100.0, -120.25), 3),
    ],
)
def test_three_negative_forces_and_no_other(done: Known, forces: tuple[float | None, ...], reported: int) -> None:
    surface = done.of(RsmResult)
    outcomes = [FAILED if force is None else Outcome(response=force) for force in forces]
    runs = [replace(run, outcome=outcome) for run, outcome in zip(surface.design.runs, outcomes, strict=False)]
    one = replace(surface, design=replace(surface.design, runs=Rows(runs)))
    found = list(rules.reversed_sign(evidence(done.study, [one])))
    assert len(found) == bool(reported)
    for note in found:
        assert (note.kind, note.severity) == ("reversed_sign", "error")
        assert note.text == (
            f"The sign of the simulated maximum force is reversed: all {reported} runs returned negative values "
            "(−120.2 N to −80 N), but the measured values are positive."
        )
        assert note.remedy == done.study.solver.sign_remedy("force")


@pytest.mark.parametrize(
    ("value", "found"),
    [
        (60_000.0, 1000.0),  # 60 is a quarter below 80
        (59_900.0, None),
        (156_250.0, 1000.0),  # 156.25 is a quarter above 125
        (156_300.0, None),
        (0.06, 0.001),
        (0.15625, 0.001),
        (0.0599, None),
        (588.5, 9.80665),
        (6.2, 1.0 / 9.80665),
        (6200.0, 1000.0 / 9.80665),
        (0.6, 9.80665 / 1000.0),
        (375.0, None),  # three times 125
        (26.7, None),  # a third of 80
    ],
)
def test_the_ratio_of_two_units(value: float, found: float | None) -> None:
    result = _unit_ratio(value, 80.0, 125.0)
    assert (result and result[0]) == (found and pytest.approx(found))
    assert _unit_ratio(value, 0.0, 125.0) is None


def test_a_force_in_the_wrong_unit(done: Known) -> None:
    surface = done.of(RsmResult)
    note = only(rules.probable_unit(evidence(aimed(done.study, 0.11), [surface])))
    assert (note.kind, note.severity) == ("probable_unit", "error")
    assert note.text == (
        "Two units were probably confused (kN and N, or mm and m). The measured maximum force is 0.11 N, about 0.001 "
        "times the simulated values (78.8 to 122 N)."
    )
    assert note.remedy is not None and note.remedy.text.startswith("Check the units of the target and of the simulated")
    assert not list(rules.probable_unit(evidence(done.study, [surface])))
    assert not list(rules.probable_unit(evidence(done.study, [])))


@pytest.mark.parametrize(("second", "count"), [(0.0840, 1), (84.0, 0), (0.84, 0), (824.0, 0)])
def test_all_fitted_means_must_have_the_ratio(tmp_path: Path, second: float, count: int) -> None:
    """7 mm of 84 N beside 8 mm of 0.11 N; 824 N is 9.81 times too large."""
    joint = known(tmp_path, spec_of({7.0: 84.0, 8.0: 110.0}, "invert: {diameters: all}\n"), until="rsm")
    means = [
        target.model_copy(update={"response": {7.0: second, 8.0: 0.11}[target.condition]})
        for target in joint.study.targets.means
    ]
    targets = joint.study.targets.model_copy(update={"means": tuple(means)})
    changed = joint.study.model_copy(update={"targets": targets})
    assert len(list(rules.probable_unit(evidence(changed, joint.results.done)))) == count


# ---- failed runs


def test_a_tenth_of_the_runs_may_fail(done: Known) -> None:
    """The design has 9 runs, repeated once."""
    surface = done.of(RsmResult)
    assert len(surface.design.runs) == 9
    assert not list(rules.failed_runs(evidence(done.study, [surface])))
    many = replace(surface.design, runs=Rows([*surface.design.runs] * 2))
    twice = replace(surface, design=many)
    one_of_18 = [replace(run, outcome=FAILED) if i == 0 else run for i, run in enumerate(many.runs)]
    assert not list(
        rules.failed_runs(evidence(done.study, [replace(twice, design=replace(many, runs=Rows(one_of_18)))]))
    )
    two_of_18 = [replace(run, outcome=FAILED) if i in (0, 2) else run for i, run in enumerate(many.runs)]
    assert list(rules.failed_runs(evidence(done.study, [replace(twice, design=replace(many, runs=Rows(two_of_18)))])))


def test_failed_runs_with_their_levels(done: Known) -> None:
    """Two opposite corners at coded ±1, which is 1/√2 of the range."""
    surface = done.of(RsmResult)
    levels = {run.run: run.levels for run in surface.design.runs}
    corner, opposite = 1, next(n for n, at in levels.items() if all(at[k] != levels[1][k] for k in at) and n < 5)
    note = only(rules.failed_runs(evidence(done.study, [with_failed(surface, corner, opposite)])))
    a, b = (f"{value:.4g}" for value in (15.0 - 5.0 / 2**0.5, 15.0 + 5.0 / 2**0.5))
    c, d = (f"{value:.4g}" for value in (0.03 - 0.02 / 2**0.5, 0.03 + 0.02 / 2**0.5))
    assert (note.kind, note.severity) == ("failed_runs", "warning")
    assert note.text == (
        f"2 of 9 response surface runs failed. They are at yield_stress {a} to {b} MPa and failure_strain {c} to {d}."
    )
    assert note.remedy == Remedy(
        f"{RETRY} Use more runs: `rsm: {{design: latin-hypercube, runs: 24}}`.",
        "rsm: {design: latin-hypercube, runs: 24, extra_runs: 0}",
    )


def test_failures_that_leave_no_error_are_reported_however_few(done: Known) -> None:
    """Of 9 runs 3 failed: 6 are left for 6 coefficients."""
    a_third = with_failed(done.of(RsmResult), 2, 5, 7)
    note = only(rules.failed_runs(evidence(done.study, [a_third])))
    assert note.text.startswith("3 of 9 response surface runs failed. ")
    assert note.text.endswith(" The error of the response surface cannot be estimated from the remaining runs.")
    assert not list(rules.few_runs(evidence(done.study, [a_third])))


def test_as_many_coefficients_as_runs(done: Known) -> None:
    surface = done.of(RsmResult)
    six = [run for run in surface.design.runs if run.run in (1, 2, 3, 5, 7, 9)]
    small = replace(surface, design=replace(surface.design, runs=Rows(six)))
    note = only(rules.few_runs(evidence(done.study, [small])))
    assert (note.kind, note.severity) == ("few_runs", "warning")
    assert note.text == (
        "The response surface has as many coefficients as runs (6), so the error of the surface cannot be estimated. "
        "The intervals are therefore wide."
    )
    assert note.remedy is not None and note.remedy.edit == "rsm: {design: latin-hypercube, runs: 24, extra_runs: 0}"
    assert not list(rules.few_runs(evidence(done.study, [surface])))
    assert not list(rules.few_runs(evidence(done.study, [])))


def at(**levels: float) -> dict[str, float]:
    return {"yield_stress": 15.0, "failure_strain": 0.03} | levels


@pytest.mark.parametrize(
    ("bad", "good", "where", "edit"),
    [
        (
            [at(yield_stress=18.0), at(yield_stress=20.0)],
            [at(yield_stress=12.0), at(yield_stress=17.0)],
            "All runs with yield_stress of at least 18 MPa failed, and no run up to 17 MPa.",
            "factors: [{name: yield_stress, high: 17.5}]",
        ),
        (
            [at(failure_strain=0.012), at(failure_strain=0.01)],
            [at(failure_strain=0.02), at(failure_strain=0.04)],
            "All runs with failure_strain of at most 0.012 failed, and no run from 0.02.",
            "factors: [{name: failure_strain, low: 0.016}]",
        ),
        (
            [at(yield_stress=18.0), at(yield_stress=20.0)],
            [at(yield_stress=18.0), at()],
            None,
            None,
        ),  # both
        ([at(yield_stress=20.0)], [at(yield_stress=12.0)], None, None),  # a single failure
        ([at(yield_stress=20.0)] * 2, [], None, None),  # all runs
        ([at(yield_stress=14.0), at(yield_stress=20.0)], [at(yield_stress=12.0)], None, None),  # below the middle
        ([{"failure_strain": 0.03}] * 2, [at()], None, None),  # a factor that is not in all of them
    ],
)
def test_a_level_beyond_which_all_runs_failed(
    done: Known, bad: list[dict[str, float]], good: list[dict[str, float]], where: str | None, edit: str | None
) -> None:
    found = _beyond(done.study, {"inverted"}, bad, good)
    assert (found and found[0], found and found[1].edit) == (where, edit)
    if found is not None and edit is not None and edit.startswith("factors: [{name: yield"):
        assert found[1].text == "Set `high` of yield_stress to 17.5 MPa."


@pytest.mark.parametrize("why", ["contact_energy", "energy_drift"])
def test_steps_that_are_too_long_come_before_any_level(done: Known, why: str) -> None:
    found = _beyond(done.study, {why, "timeout"}, [at(yield_stress=20.0)], [at()])
    assert found is not None and found[0] == "The time steps are too long for these levels."
    assert found[1].edit is not None and "time_step" in found[1].edit


def records(*runs: tuple[float | None, float, str]) -> list[dict[str, Any]]:
    """Return records of condition, yield stress and reason, which is empty for a good run."""
    return [
        {
            "status": "failed" if why else "ok",
            "reason": why,
            "request": {"stage": "screen", "levels": at(yield_stress=stress), "condition": condition},
        }
        for condition, stress, why in runs
    ]


@pytest.mark.parametrize(
    ("runs", "text", "remedy"),
    [
        (
            [(8.0, 12.0, ""), (8.0, 20.0, "timeout"), (7.0, 14.0, "inverted"), (7.0, 12.0, "inverted")],
            "3 of 4 runs failed (inverted), including all runs at a diameter of 7 mm.",
            RETRY,
        ),
        ([(8.0, 12.0, ""), (8.0, 14.0, "timeout")], "1 of 2 runs failed (timeout).", RETRY),
        (
            [(8.0, 12.0, ""), (8.0, 19.0, "timeout"), (8.0, 20.0, "timeout")],
            "2 of 3 runs failed (timeout). "
            "All runs with yield_stress of at least 19 MPa failed, and no run up to 12 MPa.",
            "Set `high` of yield_stress to 15.5 MPa.",
        ),
        ([(8.0, 14.0, "timeout")], "1 of 1 run failed (timeout), including all runs at a diameter of 8 mm.", RETRY),
        ([(8.0, 14.0, "")], None, None),
    ],
)
def test_failures_before_there_is_a_surface(
    done: Known, runs: list[tuple[float, float, str]], text: str | None, remedy: str | None
) -> None:
    seen: Any = SimpleNamespace(
        study=done.study, of=lambda _: None, records=records(*runs), names=evidence(done.study, []).names
    )
    found = list(rules.failed_runs(seen))
    assert [note.text for note in found] == ([] if text is None else [text])
    assert all((note.kind, note.severity) == ("failed_runs", "error") for note in found)
    assert all(note.remedy is not None and note.remedy.text == remedy for note in found)


# ---- reach, signs, smoothness


@pytest.mark.parametrize(
    ("force", "edge"), [(78.7, "yield_stress"), (78.8, None), (122.0, None), (122.2, "yield_stress")]
)
def test_out_of_reach(done: Known, force: float, edge: str | None) -> None:
    seen = evidence(aimed(done.study, force), [done.of(RsmResult)])
    found = list(rules.out_of_reach(seen))
    assert [note.text for note in found] == [
        f"The measured maximum force of {force:g} N is out of reach: the factor ranges allow only 78.79 to 122.1 N."
    ] * bool(edge)
    assert all((note.kind, note.severity) == ("out_of_reach", "error") for note in found)
    assert all(note.remedy is not None and str(edge) in note.remedy.text for note in found)
    calibrated = evidence(aimed(done.study, force), done.results.done)
    assert not list(rules.out_of_reach(calibrated))


def screening(done: Known, *forces: float | None) -> ScreenResult:
    """Return the screening with these forces in its runs."""
    screen = done.of(ScreenResult)
    outcomes = [FAILED if force is None else Outcome(response=force) for force in forces]
    runs = [replace(run, outcome=out) for run, out in zip(screen.design.runs, outcomes, strict=True)]
    return replace(screen, design=replace(screen.design, runs=Rows(runs)))


def narrowed(surface: RsmResult, name: str) -> RsmResult:
    """Return a surface of F = 100 + c·x in one factor, within ±1."""
    terms = {"1": 100.0, name: 2.0, f"{name}^2": 0.0}
    (row, *_) = surface.coefficients
    places = zip(surface.design.runs, (-1.0, 1.0, 0.0, -0.5, 0.5), strict=False)
    outcomes = [(run, x, Outcome(response=100.0 + 2.0 * x)) for run, x in places]
    runs = [replace(run, coded={name: x}, outcome=outcome) for run, x, outcome in outcomes]
    coding = {name: replace(surface.coding[name], half_step=5.0)}
    factors = [replace(surface.factor(name), half_step=5.0)]
    coefficients = Rows([replace(row, term=term, value=value) for term, value in terms.items()])
    return replace(
        surface, names=(name,), factors=Rows(factors), coding=coding, radius=1.0, coefficients=coefficients,
        design=replace(surface.design, runs=Rows(runs)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("target", "forces", "beyond"),
    [
        (130.0, (133.0, 137.0, 90.0, None), "2 recorded runs gave 133 to 137 N"),
        (130.0, (133.0, 130.0, 90.0, 90.0), "2 recorded runs gave 130 to 133 N"),
        (130.0, (129.0, 128.0, 90.0, 90.0), None),
        (70.0, (133.0, 137.0, 65.0, 60.0), "2 recorded runs gave 60 to 65 N"),
        (70.0, (133.0, 137.0, 65.0, 90.0), "1 recorded run gave 65 to 65 N"),
        (70.0, (133.0, 137.0, 71.0, 90.0), None),
    ],
)
def test_screening_runs_that_reach_what_the_surface_does_not(
    done: Known, target: float, forces: tuple[float | None, ...], beyond: str | None
) -> None:
    """The surface over the yield stress alone has 98 to 102 N and 100 N at its centre."""
    surface, screen = narrowed(done.of(RsmResult), "yield_stress"), screening(done, *forces)
    note = only(rules.out_of_reach(evidence(aimed(done.study, target), [screen, surface])))
    measured = f"The measured maximum force of {target:g} N is out of reach"
    if beyond is None:
        assert note.text == f"{measured}: the factor ranges allow only 98.00 to 102.0 N."
        return
    known_forces = [force for force in forces if force is not None]
    mean = sum(known_forces) / len(known_forces)
    assert note.text.startswith(
        f"{measured} of the varied factors: the response surface allows only 98.00 to 102.0 N. "
    )
    assert beyond.split(" gave ")[0] in note.text and "with other levels of failure_strain" in note.text
    ends = [float(word) for word in note.text.split(" gave ")[1].split(" N ")[0].split(" to ")]
    assert ends == [float(word) for word in beyond.split(" gave ")[1].removesuffix(" N").split(" to ")]
    assert f"The mean of these stages is {mean:.4g} N, and the response at the centre 100 N;" in note.text
    edit = "rsm: {factors: [yield_stress, failure_strain]}"
    assert note.remedy == Remedy(f"Vary failure_strain in the response surface as well: `{edit}`.", edit)


def test_no_screening_or_no_other_factor_to_vary(done: Known) -> None:
    high, surface = aimed(done.study, 130.0), done.of(RsmResult)
    for results in ([narrowed(surface, "yield_stress")], [screening(done, 133.0, 137.0, 90.0, 90.0), surface]):
        assert "of the varied factors" not in only(rules.out_of_reach(evidence(high, results))).text


@pytest.mark.parametrize(
    ("signs", "against"),
    [
        ({"yield_stress": "+", "failure_strain": "+"}, None),
        ({"yield_stress": "-", "failure_strain": "+"}, "yield_stress"),
        ({"yield_stress": "-", "failure_strain": "-"}, "yield_stress and failure_strain"),
        ({}, None),
    ],
)
def test_signs_against_expectation(done: Known, signs: dict[str, str], against: str | None) -> None:
    factors = tuple(f.model_copy(update={"expected_sign": signs.get(f.name)}) for f in done.study.factors)
    study = done.study.model_copy(update={"factors": factors})
    found = list(rules.sign_against_expectation(evidence(study, done.results.done)))
    assert [note.text for note in found] == [
        f"The sign of the effect of {against} is opposite to the expected sign (`expected_sign`)."
    ] * bool(against)
    assert all((note.kind, note.severity) == ("sign_against_expectation", "warning") for note in found)
    assert all(f"and the units of {against}." in str(note.remedy) for note in found)


def test_the_last_significant_effect_counts(done: Known) -> None:
    """A screening that found −, and a surface whose slope is + or not significant."""
    screen, surface = done.of(ScreenResult), done.of(RsmResult)
    falling = [replace(e, effect=-e.effect) if e.factor == "yield_stress" else e for e in screen.effects]
    screen = replace(screen, effects=Rows(falling), significant=("yield_stress",))
    factors = tuple(f.model_copy(update={"expected_sign": "+"}) for f in done.study.factors)
    study = done.study.model_copy(update={"factors": factors})
    flat = Rows([replace(row, low=-1.0, high=1.0) for row in surface.coefficients])
    assert not list(rules.sign_against_expectation(evidence(study, [screen, surface])))
    assert list(rules.sign_against_expectation(evidence(study, [screen, replace(surface, coefficients=flat)])))


@pytest.mark.parametrize(
    ("cv", "repeats", "deterministic", "reported"),
    [
        (3.01, None, True, True),
        (-3.01, None, True, True),
        (3.0, None, True, False),
        (None, None, True, False),
        (3.01, None, False, False),
        (3.01, "equal_repeats", False, True),
        (3.01, "scatter", True, False),
    ],
)
def test_a_rough_response(
    done: Known, cv: float | None, repeats: str | None, deterministic: bool, reported: bool
) -> None:
    pure = None if repeats is None else Note(repeats, "caution", "")
    surface = replace(done.of(RsmResult), cv_percent=cv, pure_error=pure, deterministic=deterministic)
    found = list(rules.rough_response(done.evidence(surface)))
    assert [note.text for note in found] == [
        "The response is not smooth or not quadratic: the residual standard deviation is 3.0 % of the mean response, "
        "although the simulation is deterministic."
    ] * reported
    assert all((note.kind, note.severity) == ("rough_response", "warning") for note in found)
    assert all("runs: 24" in str(note.remedy) for note in found)
    assert not list(rules.rough_response(evidence(done.study, [])))


def test_the_forces_are_those_of_the_spec(done: Known) -> None:
    assert {target.condition: target.response for target in done.study.targets.means} == FORCES
