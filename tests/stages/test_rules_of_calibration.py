"""Each rule of the verdict on the calibration: at its threshold, just beyond it, and the whole sentence.

The force is F = (100 + 20a + 8b + 3b²)·(d/8)^(2 + 0.3b), so that three diameters determine a and b.
"""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from known_results import Known, known, spec_of
from planting import Law

from stemcal.notes import Note
from stemcal.stages.fitting import Surfaces
from stemcal.stages.invert import verdict_rules as rules
from stemcal.stages.invert.options import InvertOptions
from stemcal.stages.invert.result import Contradicted, InvertResult, JointFitted, MeasuredMean, PriorRow
from stemcal.stages.refine.options import RefineOptions
from stemcal.stages.result import Judged
from stemcal.stages.rsm.result import RsmResult
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study
from stemcal.study.types.factor import PriorKnowledge
from stemcal.vocabulary import Wording

LAW = Law(growth=0.3)
MEASURED = {d: LAW.at(0.2, 0.3, d)[0] for d in (7.0, 8.0, 10.0)}
ALL = "invert: {diameters: all}\n"


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Known:
    """A joint fit to three diameters."""
    return known(tmp_path_factory.mktemp("joint"), spec_of(MEASURED, ALL, ", sd: 3 N, n: 9"), LAW)


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Known:
    """A fit to the force at 8 mm alone."""
    return known(tmp_path_factory.mktemp("single"), spec_of(MEASURED), LAW)


def seen(
    study: Study, surface: Any = None, solved: Any = None, judged: Sequence[Judged] = (), mostly_off: bool = False
) -> Any:
    """Return evidence with these parts alone; values within 10 % count as equal."""
    found = {Surfaces: surface, RsmResult: surface, InvertResult: solved}
    parameters = {} if solved is None else solved.parameters
    return SimpleNamespace(
        study=study,
        of=found.get,
        names=Wording(study.naming),
        judged=list(judged),
        mostly_off=mostly_off,
        equivalent_percent=10.0,
        results=SimpleNamespace(parameters=parameters, calibrated=solved is not None, done=()),
    )


def only(found: Any) -> Note:
    (note,) = found
    return note


# ---- a fitted value that the simulation misses


def missed(*errors: float | None, fitted: bool = True) -> list[Judged]:
    return [Judged("force", 7.0 + i, error, fitted) for i, error in enumerate(errors)]


TEXT = "The simulated maximum force is {} at a diameter of {} mm, although this measurement was included in the fit."


@pytest.mark.parametrize(
    ("judged", "severity", "what"),
    [
        (missed(2.0), None, ""),
        (missed(-2.01), "warning", TEXT.format("2.0 % too high", 7)),
        (missed(10.0), "warning", TEXT.format("10 % too low", 7)),
        (missed(10.1), "error", TEXT.format("10 % too low", 7)),
        (missed(10.1, 9.0), "warning", TEXT.format("10 % too low", 7)),
        (missed(9.0, -12.6), "warning", TEXT.format("13 % too high", 8)),
        (missed(None, 1.0), None, ""),
        (missed(50.0, fitted=False), None, ""),
    ],
)
def test_a_missed_target(single: Known, judged: list[Judged], severity: str | None, what: str) -> None:
    found = list(rules.target_missed(seen(single.study, judged=judged)))
    assert [(note.severity, note.text) for note in found] == ([(severity, what)] if severity else [])
    for note in found:
        assert (note.kind, note.remedy.edit) == ("target_missed", "refine: {}")
    assert all(note.severity == "error" for note in rules.target_missed(seen(single.study, None, None, judged, True)))


@pytest.mark.parametrize(("tolerance", "error", "reported"), [(3, 3.0, 0), (3, 3.1, 1), (1, 2.0, 0), (1, 2.1, 1)])
def test_after_a_refinement_its_tolerance_counts(single: Known, tolerance: float, error: float, reported: int) -> None:
    options = RefineOptions(tolerance_percent=tolerance, budget=7)
    study = single.study.model_copy(update={"refine": options})
    found = list(rules.target_missed(seen(study, judged=missed(error))))
    assert len(found) == reported
    for note in found:
        assert note.remedy is not None and note.remedy.edit == "refine: {budget: 14}"
        assert note.remedy.text.startswith("Raise `refine.budget` to 14, or check whether ")


@pytest.mark.parametrize(("error", "reported"), [(9.9, 0), (10.0, 0), (10.1, 1)])
def test_a_joint_fit_is_a_compromise_within_ten_percent(joint: Known, error: float, reported: int) -> None:
    found = list(rules.target_missed(seen(joint.study, judged=missed(error))))
    assert [note.remedy and note.remedy.edit for note in found] == ["refine: {}"] * reported


# ---- misfit


def with_joint(known_: Known, priors: Sequence[PriorRow] = (), **changes: Any) -> InvertResult:
    solved: InvertResult = known_.of(InvertResult)
    assert solved.joint is not None
    return replace(solved, joint=replace(solved.joint, **changes), priors=Rows(priors))


PRIORS = (
    PriorRow("yield_stress", 15.0, 0.5, "MPa", "a paper"),
    PriorRow("failure_strain", 0.03, 0.002, "1", "a thesis"),
)
ODD = Contradicted("force", 10.0, 190.0, 150.25, 175.0, 4.26, 0.004)


@pytest.mark.parametrize(("p", "reported"), [(0.05, 0), (0.0499, 1), (0.0001, 1)])
def test_a_misfit_beyond_the_scatter(joint: Known, p: float, reported: int) -> None:
    """9.1 with 2 degrees of freedom is 4.5 times what scatter gives."""
    solved = with_joint(joint, misfit=9.1, df=2, p=p)
    found = list(rules.misfit(seen(joint.study, joint.of(RsmResult), solved)))
    assert [(note.kind, note.severity, note.text) for note in found] == [
        (
            "misfit",
            "warning",
            f"The misfit is 4.5 times the value expected from the scatter of the measurements (p = {p:.4f}).",
        )
    ] * reported
    for note in found:
        assert note.remedy is not None and note.remedy.text == (
            "Check the measurements. If the measured values are confirmed, add a factor to the model."
        )


@pytest.mark.parametrize(
    "changes", [{"p": None}, {"misfit": None}, {"contradiction": ODD}, {"p": 0.06}], ids=lambda c: str(list(c))
)
def test_no_misfit_to_report(joint: Known, changes: dict[str, Any]) -> None:
    solved = with_joint(joint, **({"misfit": 9.1, "df": 2, "p": 0.01} | changes))
    assert not list(rules.misfit(seen(joint.study, joint.of(RsmResult), solved)))
    assert not list(rules.misfit(seen(joint.study, joint.of(RsmResult), replace(solved, joint=None))))


@pytest.mark.parametrize(("p", "severity"), [(0.001, "warning"), (0.0009, "error")])
def test_priors_that_the_measurements_contradict(joint: Known, p: float, severity: str) -> None:
    """The solution has 16.01 MPa, two deviations from its prior, and 0.0359, three from the other one."""
    solved = with_joint(joint, PRIORS, misfit=9.1, df=2, p=p, contradiction=ODD)
    note = only(rules.misfit(seen(joint.study, joint.of(RsmResult), solved)))
    assert note.severity == severity and note.remedy is not None
    assert note.remedy.text == (
        "Check the source (a thesis) and the unit of the prior for failure_strain, or remove the prior."
    )
    looser = (PRIORS[0], replace(PRIORS[1], sd=0.02))
    other = with_joint(joint, looser, misfit=9.1, df=2, p=p)
    assert "a paper" in str(only(rules.misfit(seen(joint.study, joint.of(RsmResult), other))))


def test_responses_at_one_place_may_be_too_many(single: Known, joint: Known) -> None:
    rows = joint.of(InvertResult).joint.rows
    solved = with_joint(joint, misfit=9.1, df=2, p=0.01, rows=Rows([rows[1]]))
    note = only(rules.misfit(seen(joint.study, joint.of(RsmResult), solved)))
    assert note.remedy is not None and note.remedy.text == (
        "Check the measurements. Then add another factor, or fit fewer responses (`invert.responses`)."
    )


# ---- contradictions


def test_a_mean_that_contradicts_the_others(joint: Known) -> None:
    solved = with_joint(joint, contradiction=ODD)
    note = only(rules.conflict(seen(joint.study, joint.of(RsmResult), solved)))
    assert (note.kind, note.severity) == ("conflict", "warning")
    assert note.text == (
        "The measured maximum force at a diameter of 10 mm (190 N) contradicts the other measurements, which predict a "
        "value between 150.2 N and 175 N (difference: 4.3 standard errors)."
    )
    assert note.remedy is not None and note.remedy.edit is None
    assert note.remedy.text.startswith("Check the unit of the measured maximum force at a diameter of 10 mm, the ")
    assert note.remedy.text.endswith(
        "If the measured value is confirmed, add a factor that affects the maximum force at a diameter of 10 mm."
    )
    assert only(rules.conflict(seen(joint.study, joint.of(RsmResult), solved, mostly_off=True))).severity == "error"
    with_priors = with_joint(joint, PRIORS, contradiction=ODD)
    assert not list(rules.conflict(seen(joint.study, joint.of(RsmResult), with_priors)))


@pytest.mark.parametrize(
    ("errors", "trend"), [((-5.0, 1.0, 6.0), True), ((6.0, 1.0, -5.0), True), ((-5.0, 6.0, 5.0), False)]
)
def test_errors_that_grow_with_the_diameter_ask_for_a_growing_parameter(
    joint: Known, errors: tuple[float, ...], trend: bool
) -> None:
    rows = joint.of(InvertResult).joint.rows
    shuffled = [replace(row, error_percent=error) for row, error in zip(rows, errors, strict=True)][::-1]
    solved = with_joint(joint, contradiction=ODD, rows=Rows(shuffled))
    remedy = only(rules.conflict(seen(joint.study, joint.of(RsmResult), solved))).remedy
    assert remedy is not None and ("add a factor that affects" not in remedy.text) is trend


@pytest.mark.parametrize(
    ("places", "df", "p", "severity"),
    [(1, 0, 0.0009, "error"), (1, 0, 0.001, "warning"), (1, 1, 0.0009, "warning"), (3, 0, 0.0009, "warning")],
)
def test_two_values_at_one_place_that_exclude_each_other(
    joint: Known, places: int, df: int, p: float, severity: str
) -> None:
    rows = joint.of(InvertResult).joint.rows
    solved = with_joint(joint, contradiction=replace(ODD, p=p), df=df, rows=Rows(list(rows)[:places]))
    assert only(rules.conflict(seen(joint.study, joint.of(RsmResult), solved))).severity == severity


@pytest.mark.parametrize(("worst", "p", "reported"), [(10.0, None, 0), (10.6, None, 1), (30.0, 0.2, 0)])
def test_a_large_error_of_unknown_scatter(joint: Known, worst: float, p: float | None, reported: int) -> None:
    solved = with_joint(joint, max_abs_error_percent=worst, p=p)
    found = list(rules.conflict(seen(joint.study, joint.of(RsmResult), solved)))
    assert [note.text for note in found] == [f"The largest error of the joint fit is {worst:.0f} %."] * reported
    assert not list(rules.conflict(seen(joint.study, joint.of(RsmResult), None)))
    assert not list(rules.conflict(seen(joint.study, None, solved)))


def on_edge(solved: InvertResult, x: float = 1.0) -> InvertResult:
    """Return the result with its coded point at a distance of `x` radii along the yield stress."""
    point = replace(solved.point, coded={"yield_stress": x * 2**0.5, "failure_strain": 0.0})
    parameters = {**solved.parameters, "yield_stress": 15.0 + 5.0 * x, "failure_strain": 0.03}
    return replace(solved, point=point, parameters=parameters)


def out_of_reach(joint: Known, errors: Sequence[float], *where: float, x: float = 1.0) -> InvertResult:
    rows = joint.of(InvertResult).joint.rows
    changed = [replace(row, error_percent=error) for row, error in zip(rows, errors, strict=True)]
    missing = Rows(MeasuredMean("force", d) for d in where)
    return on_edge(
        with_joint(
            joint, rows=Rows(changed), out_of_reach=missing, max_abs_error_percent=max(map(abs, errors)), p=None
        ),
        x,
    )


@pytest.mark.parametrize(
    ("errors", "x", "kind"),
    [
        ((20.0, 25.0, 30.0), 1.0, "out_of_reach"),
        ((-7.5, 25.0, 30.0), 1.0, "out_of_reach"),  # a quarter of the largest
        ((-7.6, 25.0, 30.0), 1.0, "conflict"),
        ((20.0, 25.0, 30.0), 0.5, "conflict"),  # wider ranges would not help
        ((-20.0, -25.0, -30.0), 1.0, "out_of_reach"),
    ],
)
def test_ranges_that_are_too_narrow_for_the_means(joint: Known, errors: tuple[float, ...], x: float, kind: str) -> None:
    """At 10 mm and b = 0 … the region allows F(10 mm) between its extremes."""
    surface, solved = joint.of(RsmResult), out_of_reach(joint, errors, 10.0, 8.0, x=x)
    note = only(rules.conflict(seen(joint.study, surface, solved)))
    assert note.kind == kind and note.severity == "warning"
    if kind == "out_of_reach":
        start = (
            "The factor ranges are too narrow for 2 of 3 measured values: the maximum force at a diameter of 10 mm is "
            f"{MEASURED[10.0]:.4g} N, but the ranges allow only "
        )
        assert note.text.startswith(start)
        low, high = map(float, note.text.removeprefix(start).removesuffix(" N.").split(" to "))
        angles = np.linspace(0.0, 2.0 * np.pi, 721)
        circle = [LAW.at(float(np.cos(t)), float(np.sin(t)), 10.0)[0] for t in angles]
        assert (low, high) == (pytest.approx(min(circle), rel=2e-3), pytest.approx(max(circle), rel=2e-3))
    assert (note.remedy is not None and note.remedy.edit is not None) is (x == 1.0)


# ---- edges


@pytest.mark.parametrize(
    ("coded", "edge"),
    [
        ((0.0, 0.0), False),
        ((2**0.5 * 0.981, 0.0), True),  # 0.98 of the radius
        ((2**0.5 * 0.979, 0.0), False),
        ((0.979, 0.979), False),
        ((1.0, 1.0), True),
    ],
)
def test_near_the_radius_or_near_an_end(joint: Known, coded: tuple[float, float], edge: bool) -> None:
    assert rules._on_edge(joint.of(RsmResult), list(coded)) is edge


@pytest.mark.parametrize(("a", "edge"), [(0.9801, True), (0.9799, False), (-0.9801, True), (-0.9799, False)])
def test_a_hundredth_of_the_range_is_near_its_end(joint: Known, a: float, edge: bool) -> None:
    """Without the limit of the radius; the coded range is ±√2."""
    surface = replace(joint.of(RsmResult), radius=100.0)
    assert rules._on_edge(surface, [a * 2**0.5, 0.0]) is edge
    assert rules._on_edge(surface, [0.0, a * 2**0.5]) is edge


def test_a_solution_on_the_edge(joint: Known, single: Known) -> None:
    for done in (joint, single):
        surface, solved = done.of(RsmResult), done.of(InvertResult)
        assert not list(rules.on_the_edge(seen(done.study, surface, solved)))
        note = only(rules.on_the_edge(seen(done.study, surface, on_edge(solved))))
        assert (note.kind, note.severity) == ("on_the_edge", "warning")
        assert note.text == "The solution is at the limit of the search range."
        assert note.remedy is not None and note.remedy.edit == "factors: [{name: yield_stress, high: 25}]"
        assert not list(rules.on_the_edge(seen(done.study, surface, None)))
        assert not list(rules.on_the_edge(seen(done.study, None, on_edge(solved))))
    contradicted = on_edge(with_joint(joint, contradiction=ODD))
    assert not list(rules.on_the_edge(seen(joint.study, joint.of(RsmResult), contradicted)))
    flat = on_edge(with_joint(joint, separated=False))
    remedy = only(rules.on_the_edge(seen(joint.study, joint.of(RsmResult), flat))).remedy
    assert remedy is not None and remedy.edit is None and remedy.text.startswith("Measure another response, perform ")


def test_only_a_joint_fit_without_priors_is_extended_to_where_its_means_are(joint: Known, single: Known) -> None:
    """With forces twice as large the means lie far beyond the ranges; others are widened by half."""

    def edit(done: Known, *priors: PriorRow) -> str:
        means = [t.model_copy(update={"response": 2.0 * t.response}) for t in done.study.targets.means]
        targets = done.study.targets.model_copy(update={"means": tuple(means)})
        study = done.study.model_copy(update={"targets": targets})
        solved = on_edge(replace(done.of(InvertResult), priors=Rows(priors)))
        remedy = only(rules.on_the_edge(seen(study, done.of(RsmResult), solved))).remedy
        assert remedy is not None and remedy.edit is not None
        return remedy.edit

    widened = "factors: [{name: yield_stress, high: 25}]"
    assert edit(single) == edit(joint, *PRIORS) == widened != edit(joint)


# ---- what the measurements do not determine


@pytest.mark.parametrize(
    ("free", "loosest", "text"),
    [
        (
            ("failure_strain",),
            {"failure_strain": 0.01},
            "The fit does not determine failure_strain because the fitted responses hardly depend on failure_strain.",
        ),
        (
            ("yield_stress", "failure_strain"),
            {"yield_stress": -1.5, "failure_strain": 0.0123},
            "The fit does not determine yield_stress or failure_strain. If yield_stress decreases by 1.5 MPa and "
            "failure_strain increases by 0.0123, the fitted responses hardly change.",
        ),
        ((), {}, None),
    ],
)
def test_factors_that_are_not_determined(
    joint: Known, free: tuple[str, ...], loosest: dict[str, float], text: str | None
) -> None:
    solved = joint.of(InvertResult)
    loose = replace(solved, certainty=replace(solved.certainty, not_identified=free, loosest=loosest))
    found = list(rules.not_identified(seen(joint.study, joint.of(RsmResult), loose)))
    assert [note.text for note in found] == ([] if text is None else [text])
    for note in found:
        assert (note.kind, note.severity) == ("not_identified", "warning") and note.remedy is not None
        curve = "" if len(free) == 1 else (
            ", and the sets that fit equally well: they change together (yield_stress decreases by 1.5 MPa and "
            "failure_strain increases by 0.0123)"
        )  # fmt: skip
        assert note.remedy.text == (
            "Measure another response, perform another kind of test, or add a prior for failure_strain from the "
            f"literature. Without new data, publish the 95 % confidence intervals instead of single values{curve}."
        )


@pytest.mark.parametrize(("listed", "edit"), [(None, "invert: {diameters: all}"), ((8.0,), None), ((7.0, 8.0), None)])
def test_further_measured_diameters_are_fitted_unless_the_spec_lists_some(
    single: Known, listed: tuple[float, ...] | None, edit: str | None
) -> None:
    options = InvertOptions() if listed is None else InvertOptions.model_validate({"diameters": listed})
    study = single.study.model_copy(update={"invert": options})
    known_ = single.of(InvertResult).certainty
    remedy = rules._to_identify(seen(study, single.of(RsmResult)), known_)
    assert remedy.edit == edit
    assert ("If failure_strain remains undetermined, measure another response" in remedy.text) is (edit is not None)


def test_the_factor_with_the_widest_interval_needs_a_prior(single: Known) -> None:
    """Unless it has one; with a prior for each, the text says so without a comma."""
    known_ = replace(single.of(InvertResult).certainty, share={"yield_stress": 0.9, "failure_strain": 0.8})
    prior = PriorKnowledge(mean=15.0, sd=1.0, source="a paper")

    def advised(*with_prior: str, free: tuple[str, ...] = ("yield_stress", "failure_strain")) -> str:
        factors = [
            f.model_copy(update={"prior": prior if f.name in with_prior else None}) for f in single.study.factors
        ]
        study = single.study.model_copy(update={"factors": tuple(factors)})
        return rules._to_identify(seen(study, single.of(RsmResult)), replace(known_, not_identified=free)).text

    assert "If yield_stress remains undetermined" in advised()
    assert "or add a prior for failure_strain from the literature" in advised("yield_stress")
    assert advised("yield_stress", "failure_strain").endswith(
        "measure another response or perform another kind of test."
    )
    assert "If yield_stress remains undetermined" in advised(free=())


# ---- trend


def test_a_trend_needs_a_joint_fit_within_reach(joint: Known, single: Known) -> None:
    """Measured over predicted grows as d^0.5."""
    rows = joint.of(InvertResult).joint.rows
    grown = [replace(row, predicted=row.measured * (row.condition / 8.0) ** -0.5) for row in rows]
    solved = with_joint(joint, rows=Rows(grown), max_abs_error_percent=12.34)
    surface = joint.of(RsmResult)
    note = only(rules.trend(seen(joint.study, surface, solved)))
    assert (note.kind, note.severity) == ("trend", "warning")
    assert note.text == (
        "The error depends on diameter d: the measured force increases more steeply than the simulated force, by a "
        "factor of d^0.50. The largest error of the simulation is 12.3 %."
    )
    assert only(rules.trend(seen(joint.study, surface, solved, mostly_off=True))).severity == "error"
    for unfit in (seen(joint.study, None, solved), seen(joint.study, surface, None)):
        assert not list(rules.trend(unfit))
    assert not list(rules.trend(seen(single.study, single.of(RsmResult), single.of(InvertResult))))
    beyond = on_edge(replace(solved, joint=replace(solved.joint, out_of_reach=Rows([MeasuredMean("force", 10.0)]))))
    assert isinstance(beyond.joint, JointFitted)
    same_side = replace(beyond, joint=replace(beyond.joint, rows=Rows([replace(r, error_percent=9.0) for r in grown])))
    assert not list(rules.trend(seen(joint.study, surface, same_side)))


def test_a_trend_that_priors_cause_is_theirs(joint: Known) -> None:
    """Without the prior the surfaces reproduce the means, so no trend is left; with one in the means there is."""
    rows = joint.of(InvertResult).joint.rows
    grown = [replace(row, predicted=row.measured * (row.condition / 8.0) ** -0.5) for row in rows]
    solved, surface = with_joint(joint, PRIORS, rows=Rows(grown)), joint.of(RsmResult)
    assert not list(rules.trend(seen(joint.study, surface, solved)))
    means = [
        t.model_copy(update={"response": t.response * (t.condition / 8.0) ** 1.5}) for t in joint.study.targets.means
    ]
    steep = joint.study.model_copy(update={"targets": joint.study.targets.model_copy(update={"means": tuple(means)})})
    steeper = [replace(r, measured=t.response, predicted=r.measured) for r, t in zip(rows, means, strict=True)]
    assert list(rules.trend(seen(steep, surface, with_joint(joint, PRIORS, rows=Rows(steeper)))))
