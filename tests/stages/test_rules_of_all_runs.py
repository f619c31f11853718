"""The rules about all runs, the use of a result, and the order of the reasons, on results made by hand."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from known_results import Known, evidence, known, spec_of

from stemcal.by_hand.options import SheetSolver
from stemcal.doe.comparison import Formula
from stemcal.notes import Note, Remedy
from stemcal.runs.record import Outcome
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.result import Judged, Prediction
from stemcal.stages.results import Results
from stemcal.stages.stage import STAGES
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict import verdict_rules as rules
from stemcal.stages.verdict.physics import LIMITS, Doubt, Physics, physics_of
from stemcal.stages.verdict.result import Use, Verdict
from stemcal.stages.verdict.verdict_rules import Evidence, verdict_of
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Known:
    return known(tmp_path_factory.mktemp("known"), spec_of())


def seen(study: Study, *judged: Judged, misses: Sequence[float] = (), physics: Any = None, **more: Any) -> Evidence:
    """Return evidence of one result with these errors."""
    result: Any = SimpleNamespace(
        name="validate", judged=lambda _study: list(judged), misses=tuple(misses), prediction=None, **more
    )
    return Evidence(study, Results((result,)), physics or Physics(0, 0, ()), None)  # type: ignore[arg-type]


def errors(*sizes: float | None, response: str = "force", fitted: bool = False) -> list[Judged]:
    return [Judged(response, 7.0 + i, size, fitted) for i, size in enumerate(sizes)]


# ---- most errors


@pytest.mark.parametrize(
    ("judged", "misses", "off"),
    [
        (errors(11.0, -11.0, 9.0), (), True),
        (errors(11.0, 9.0), (), False),  # half of them
        (errors(11.0, 10.0, 10.0), (), False),
        (errors(10.1), (), True),
        (errors(10.0), (), False),
        (errors(None, 11.0), (), True),
        (errors(None), (11.0, -12.0, 1.0), True),  # of the fit, without simulations
        ([], (11.0, 9.0), False),
        ([], (), False),
        # most of all errors are small, but those of one response exceed twice the limit
        (errors(1.0, 2.0, 3.0) + errors(20.1, response="work"), (), True),
        (errors(1.0, 2.0, 3.0) + errors(20.0, response="work"), (), False),
        (errors(1.0, 2.0, 3.0) + errors(21.0, 1.0, response="work"), (), False),
    ],
)
def test_most_errors_are_large(done: Known, judged: list[Judged], misses: tuple[float, ...], off: bool) -> None:
    assert seen(done.study, *judged, misses=misses).mostly_off is off


def test_values_within_ten_percent_are_equal_unless_the_spec_has_another_limit(done: Known, tmp_path: Path) -> None:
    assert seen(done.study).equivalent_percent == 10.0
    spec = tmp_path / "stricter.yaml"
    spec.write_text(spec_of(extra="validate: {tolerance_percent: 3}\n"), encoding="utf-8")
    assert seen(load_study(spec)).equivalent_percent == 3.0


# ---- use


def test_where_a_result_may_be_used(done: Known) -> None:
    judged = [
        *errors(1.0, fitted=True),
        Judged("force", 8.0, -12.0, False),
        Judged("work", 8.0, 4.0, False),
        Judged("force", 9.0, 10.0, False),
        Judged("force", 10.0, 30.0, True),
        Judged("force", 11.0, None, False),
    ]
    use = rules._use(seen(done.study, *judged))
    assert use == Use(
        10.0,
        good=(7.0, 9.0),
        worst=judged[4],
        largest_percent=10.0,
        held_out=judged[1],
        fitted=(7.0, 10.0),
        predictions=(),
    )
    assert rules._use(seen(done.study, *errors(None))) is None
    assert rules._use(seen(done.study)) is None
    all_off = rules._use(seen(done.study, *errors(11.0)))
    assert all_off is not None and (all_off.good, all_off.largest_percent) == ((), 0.0)


@pytest.mark.parametrize(("doubtful", "none"), [(5, False), (6, True)])
def test_no_use_if_most_runs_are_doubtful(done: Known, doubtful: int, none: bool) -> None:
    assert (rules._use(seen(done.study, *errors(1.0), physics=Physics(10, doubtful, ()))) is None) is none


# ---- physics


def doubtful(kind: Any, worst: float | None, runs: int = 3) -> Doubt:
    return Doubt(kind, runs, worst, aim=worst)


@pytest.mark.parametrize(
    ("checked", "share", "severity"),
    [(100, 9, None), (100, 10, "warning"), (100, 50, "warning"), (100, 51, "error")],
)
def test_a_tenth_and_half_of_the_runs(done: Known, checked: int, share: int, severity: str | None) -> None:
    physics = Physics(checked, share, (doubtful("hourglass", 12.3, share),))
    found = list(rules.physics(seen(done.study, physics=physics)))
    assert [(note.kind, note.severity, note.text) for note in found] == [
        (
            "physics",
            severity,
            f"The physical validity of {share} of 100 runs is doubtful: the hourglass energy is up to 12 % of the "
            "internal energy.",
        )
    ] * bool(severity)


@pytest.mark.parametrize(
    ("kind", "worst", "text"),
    [
        ("hourglass", 9.96, "the hourglass energy is up to 10.0 % of the internal energy."),
        ("inertia", 5.25, "inertia contributes up to 5.2 % of the force."),
        ("drift", 7.0, "the error in the energy balance is up to 7.0 %."),
        ("stroke", None, "the stroke is too short to capture the peak force."),
    ],
)
def test_every_doubt_in_words(done: Known, kind: Any, worst: float | None, text: str) -> None:
    (note,) = rules.physics(seen(done.study, physics=Physics(10, 3, (doubtful(kind, worst),))))
    assert note.text == f"The physical validity of 3 of 10 runs is doubtful: {text}"
    assert note.remedy is not None and note.remedy.edit is not None


@pytest.mark.parametrize(
    ("kind", "times", "fitted", "severity"),
    [
        ("inertia", 2.0, True, "warning"),
        ("inertia", 2.01, True, "error"),
        ("inertia", 2.01, False, "warning"),
        ("drift", 2.01, True, "error"),
        ("stroke", None, True, "error"),
        ("stroke", None, False, "warning"),
    ],
)
def test_doubts_about_the_calibrated_runs(
    done: Known, kind: Any, times: float | None, fitted: bool, severity: str
) -> None:
    """Up to twice the limit they are a reservation."""
    worst = None if times is None else times * LIMITS[kind]
    at = Doubt(kind, 1, worst, 8.0, fitted)
    (note,) = rules.physics(seen(done.study, physics=Physics(10, 1, (), (at,))))
    assert (note.kind, note.severity) == ("physics_of_solution", severity)
    assert note.text.startswith("With the calibrated parameters, ") and note.text.endswith(" at a diameter of 8 mm.")


def test_of_each_kind_the_worst_fitted_run_is_named(done: Known) -> None:
    at = tuple(
        Doubt("hourglass", 1, worst, d, fitted)
        for worst, d, fitted in ((12.0, 7.0, True), (15.0, 8.0, True), (40.0, 10.0, False), (14.0, 9.0, True))
    )
    (note,) = rules.physics(seen(done.study, physics=Physics(10, 5, (), at)))
    assert note.text == (
        "With the calibrated parameters, the hourglass energy is 15 % of the internal energy at a diameter of 8 mm. "
        "Hourglass energy above 10 % of the internal energy may change the force by a third, and above 20 % by half."
    )
    assert not list(rules.physics(seen(done.study, physics=Physics(10, 6, (), at))))


def details(done: Known, of: Mapping[str, Mapping[str, Any]]) -> Any:
    """Return a folder whose records have these details, by the label of the run (validate 7 mm, rsm 1)."""
    keys = {label: outcome.key for result in done.results.done for label, outcome in result.runs()}
    by_key = {keys[label]: {"details": dict(found)} for label, found in of.items()}
    return SimpleNamespace(peek=by_key.get)


GOOD = {"hourglass_ratio_percent": 1.0, "inertia_percent": 1.0, "energy_drift_percent": 0.1, "stroke_was_enough": True}


def test_checks_of_the_runs(done: Known) -> None:
    """At its limit a check is not a doubt; runs of other programs without checks do not count."""
    limits = {
        "hourglass_ratio_percent": LIMITS["hourglass"],
        "inertia_percent": LIMITS["inertia"],
        "energy_drift_percent": LIMITS["drift"],
    }
    beyond = {name: limit + 0.1 for name, limit in limits.items()}
    folder = details(
        done,
        {
            "rsm 1": GOOD,
            "rsm 2": limits,
            "rsm 3": {**GOOD, **beyond},
            "rsm 4": {**GOOD, "inertia_percent": 30.0, "added_mass_percent": 1e-9},  # no mass was added
            "rsm 5": {**GOOD, "inertia_percent": 20.0, "stroke_was_enough": False},
            "rsm 6": {"stroke_was_enough": False},
            "rsm 7": {"steps": 7},
            "rsm 8": {"inertia_percent": "unknown"},
            "8 mm": {**GOOD, "inertia_percent": 9.0},
        },
    )
    found = physics_of(done.study, done.results, folder)
    assert (found.checked, found.doubtful, found.share) == (7, 4, pytest.approx(4 / 7))
    assert found.doubts == (
        Doubt("inertia", 3, 20.0, aim=20.0),
        Doubt("stroke", 2, None),
        Doubt("drift", 1, beyond["energy_drift_percent"], aim=beyond["energy_drift_percent"]),
        Doubt("hourglass", 1, beyond["hourglass_ratio_percent"], aim=beyond["hourglass_ratio_percent"]),
    )
    assert found.at_solution == (Doubt("inertia", 1, 9.0, 8.0, True),)
    assert physics_of(done.study, done.results, SimpleNamespace(peek=lambda _key: None)) == Physics(0, 0, ())


def test_a_remedy_may_leave_less_than_a_tenth(done: Known) -> None:
    """Of 11 checked runs one may stay doubtful: the second largest value is aimed at, of 10 runs the largest."""
    worst = {f"rsm {n}": {**GOOD, "inertia_percent": 20.0 + n} for n in (1, 2, 3)}
    rest = {f"rsm {n}": GOOD for n in range(4, 10)}
    ten = physics_of(done.study, done.results, details(done, {**worst, **rest, "7 mm": GOOD}))
    eleven = physics_of(done.study, done.results, details(done, {**worst, **rest, "7 mm": GOOD, "8 mm": GOOD}))
    assert (ten.checked, [doubt.aim for doubt in ten.doubts]) == (10, [23.0])
    assert (eleven.checked, [doubt.aim for doubt in eleven.doubts]) == (11, [22.0])


def test_runs_in_another_model_have_their_own_physics(tmp_path: Path) -> None:
    """Only the runs of the study's own solver are checked."""
    spec = tmp_path / "there.yaml"
    spec.write_text(spec_of(extra="refine: {in: {kind: sheet}}\n"), encoding="utf-8")
    study = load_study(spec)
    results: Any = SimpleNamespace(
        done=[
            SimpleNamespace(
                name=name, runs=lambda key=name: [("run", Outcome(response=1.0, key=key))], judged=lambda _: []
            )
            for name in ("rsm", "refine")
        ]
    )
    folder: Any = SimpleNamespace(
        peek=lambda key: {"details": {**GOOD, "inertia_percent": {"rsm": 6.0, "refine": 50.0}[key]}}
    )
    assert physics_of(study, results, folder).doubts == (Doubt("inertia", 1, 6.0, aim=6.0),)


# ---- unfinished stages, and a formula


def test_unfinished_stages(done: Known) -> None:
    (note,) = rules.unfinished(done.evidence(done=("screen", "rsm")))
    assert (note.kind, note.severity) == ("unfinished", "error")
    assert note.text == "Unfinished stages: Calibration, Validation."
    assert note.remedy == Remedy("Continue with `stemcal run SPEC`.")
    assert not list(rules.unfinished(done.evidence()))
    by_hand = done.study.model_copy(update={"solver": SheetSolver()})
    (note,) = rules.unfinished(evidence(by_hand, done.results.done[:3]))
    assert note.remedy == Remedy("Fill in the run sheet in the study folder. Continue with `stemcal run SPEC`.")


def test_only_the_refinement_in_another_model_is_unfinished(tmp_path: Any) -> None:
    there = known(tmp_path, spec_of(extra="refine: {in: {kind: sheet}}\n"), until="validate")
    (note,) = rules.unfinished(evidence(there.study, there.results.done))
    assert (note.severity, note.text) == ("warning", "Unfinished stages: Refinement.")
    (note,) = rules.unfinished(evidence(there.study, there.results.done[:3]))
    assert (note.severity, note.text) == ("error", "Unfinished stages: Validation, Refinement.")


@pytest.mark.parametrize(
    ("predictions", "judged", "reported"),
    [
        ([Prediction(5.0, Formula(2.5, 1.0, 0.1), (7.0,))], True, True),
        ([Prediction(5.0, Formula(2.5, 1.0, 0.1), (7.0,))], False, False),
        ([Prediction(5.0, Formula(2.5, 1.0, 4.0), (7.0,))], True, False),  # within 1.96·4.0 %
        ([Prediction(1.0, Formula(2.5, 5.0, 0.1), (7.0,))], True, False),
        ([Prediction(5.0, None, (7.0,))], True, False),
        ([], True, False),
        # held-out values count before left-out ones
        ([Prediction(5.0, Formula(2.5, 1.0, 0.1), in_turn="test"), Prediction(1.0, None, (7.0,))], True, False),
        ([Prediction(1.0, None, in_turn="test"), Prediction(5.0, Formula(2.5, 1.0, 0.1), (7.0,))], True, True),
    ],
)
def test_a_formula_that_predicts_better(
    done: Known, predictions: list[Prediction], judged: bool, reported: bool
) -> None:
    results = [
        SimpleNamespace(name=str(n), judged=lambda _: errors(1.0) if judged else [], prediction=prediction, misses=())
        for n, prediction in enumerate(predictions)
    ]
    shown = Evidence(done.study, Results(tuple(results)), Physics(0, 0, ()), None)  # type: ignore[arg-type]
    found = list(rules.no_better_than_formula(shown))
    assert [(note.kind, note.severity, note.text) for note in found] == [
        (
            "no_better_than_formula",
            "warning",
            "At the held-out diameter of 7 mm the error is at most 5.0 % (formula F = a·d^2.5: 1.0 %).",
        )
    ] * reported
    assert all("within the range of the measured diameters, or add another kind of test" in str(n) for n in found)


# ---- order and consequences


def verdict_with(done: Known, monkeypatch: pytest.MonkeyPatch, *reasons: tuple[rules.Rank, str, Any]) -> list[str]:
    """Return the kinds of the reasons, in order, if rules of these ranks yield them."""
    made: list[Any] = []
    for rank, kind, severity in reasons:

        def rule(_evidence: Evidence, kind: str = kind, severity: Any = severity) -> Any:
            yield Note(kind, severity, f"{kind}.")

        made.append(rules.ranked(rank)(rule))
    monkeypatch.setattr(rules, "RULES", tuple(made))
    for stage in STAGES.built_in:
        monkeypatch.setattr(type(stage), "reasons", lambda _self: ())
    return [reason.kind for reason in verdict_of(done.study, done.folder, done.results).reasons]


R = rules.Rank


@pytest.mark.parametrize(
    ("reasons", "order"),
    [
        ([(R.FORMULA, "a", "warning"), (R.TREND, "b", "warning"), (R.DATA, "c", "warning")], "cba"),
        ([(R.TREND, "a", "warning"), (R.PHYSICS, "b", "warning")], "ab"),
        ([(R.TREND, "a", "warning"), (R.PHYSICS, "b", "error")], "ba"),
        ([(R.DATA, "c", "error"), (R.TREND, "probable_unit", "error")], ["c"]),
        ([(R.DATA, "reversed_sign", "error"), (R.MODEL, "a", "error"), (R.PHYSICS, "b", "warning")],
         ["reversed_sign", "b"]),
        ([(R.DATA, "a", "error"), (R.UNFINISHED, "unfinished", "error")], "a"),
        ([(R.REACH, "a", "error"), (R.UNFINISHED, "unfinished", "error")], "a"),
        ([(R.REACH, "a", "warning"), (R.UNFINISHED, "unfinished", "error")], ["unfinished", "a"]),
        ([(R.MODEL, "a", "error"), (R.UNFINISHED, "unfinished", "error")], ["unfinished", "a"]),
    ],
)  # fmt: skip
def test_the_order_of_the_reasons(
    done: Known, monkeypatch: pytest.MonkeyPatch, reasons: list[tuple[rules.Rank, str, Any]], order: Sequence[str]
) -> None:
    """Data first; doubts about most runs before a trend, which they may cause; a wrong unit excludes most."""
    assert verdict_with(done, monkeypatch, *reasons) == list(order)


@pytest.mark.parametrize(
    ("severities", "word", "holds", "may_hold"),
    [
        ((), "calibrated", True, True),
        (("info",), "with_reservations", True, True),
        (("warning", "caution"), "with_reservations", True, True),
        (("warning", "error"), "not_calibrated", False, False),
    ],
)
def test_the_word_of_a_verdict(severities: tuple[Any, ...], word: str, holds: bool, may_hold: bool) -> None:
    reasons = [Note(str(n), severity, "") for n, severity in enumerate(severities)]
    verdict = Verdict.of(reasons, None)
    assert (verdict.verdict, verdict.holds, verdict.may_hold) == (word, holds, may_hold)
    assert Verdict.of(reasons, None, goal=True).holds
    assert verdict.has("0") is bool(severities) and not verdict.has("9")


def test_unfinished_stages_alone_do_not_hide_the_intervals() -> None:
    unfinished, other = Note("unfinished", "error", ""), Note("a", "error", "")
    warning = Note("b", "warning", "")
    assert Verdict.of([unfinished, warning], None).may_hold and not Verdict.of([unfinished], None).holds
    assert not Verdict.of([unfinished, other], None).may_hold


def test_a_calibrated_study_has_results_to_use(done: Known) -> None:
    verdict = verdict_of(done.study, done.folder, done.results)
    assert verdict.use is not None and verdict.use.fitted == (8.0,) and not verdict.goal and verdict.gains == ()
    checked, solved = done.of(ValidateResult), done.of(InvertResult)
    assert [row.condition for row in checked.compared] == [7.0, 8.0, 10.0]
    gone = replace(checked, rows=Rows([]))
    assert verdict_of(done.study, done.folder, Results((*done.results.done[:2], solved, gone))).use is None
