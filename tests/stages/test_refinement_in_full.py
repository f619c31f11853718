"""Every row, sentence and note of a refinement whose numbers are known, and the mistakes of its section."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fakes import TWO_FACTORS
from test_words_of_refine import HERE, RUN, STEM, THERE

from stemcal.doe.calibration.search_path import Mover, SearchPath
from stemcal.drawing.table import Table
from stemcal.errors import SpecError, UsageError
from stemcal.runs.record import Outcome
from stemcal.stages.loop import PathSteps, PointToTry
from stemcal.stages.refine.analysis import _adjusted, _model, _path, _rows, refine_notes
from stemcal.stages.refine.options import RefineOptions
from stemcal.stages.refine.result import AdjustedFactor, RefineResult, RefineRow, SimulatedBy
from stemcal.stages.refine.showing import RefineShowing
from stemcal.stages.refine.verdict_rules import refinement
from stemcal.storage.rows import Rows
from stemcal.study.reading import load_study
from stemcal.vocabulary import CUTTING, Wording

SHOWING = RefineShowing()
ALONE = replace(
    HERE,
    parameters={"a": 1.5, "b": 0.25},
    trial_runs=Rows(
        [
            replace(RUN, how="middle", levels={"a": 1.0, "b": 0.25}),
            replace(RUN, run=2, how="probe", levels={"a": 1.5, "b": 0.25}),
        ]
    ),
    undetermined=("b",),
)


# ---- sentences and tables


@pytest.mark.parametrize(
    ("result", "text"),
    [
        (
            HERE,
            "The calibrated parameters were corrected in 2 runs. The error of 0.13 % at the calibrated values is "
            "within the tolerance of 2 %.",
        ),
        (
            replace(HERE, converged=False, error_percent=-5.678, trial_runs=HERE.trial_runs[:1]),
            "The calibrated parameters were checked in 1 run. The error of 5.68 % at the calibrated values exceeds the "
            "tolerance of 2 %.",
        ),
        (
            ALONE,
            "The calibrated parameters were determined in 2 runs from mid-range. The error of 0.13 % at the calibrated "
            "values is within the tolerance of 2 %.",
        ),
        (
            THERE,
            "The simulated maximum force in OpenRadioss with the refined parameters (strain = 0.2600) is 159.1 N. The "
            "target value is 159.2 N.",
        ),
        (
            replace(THERE, adjusted=Rows([replace(THERE.adjusted[0], value=0.035)])),
            "The simulated maximum force in OpenRadioss with the calibrated parameters is 159.1 N. The target value is "
            "159.2 N.",
        ),
        (replace(THERE, rows=Rows([replace(THERE.rows[0], after=None)])), None),
    ],
)
def test_the_outcome(result: RefineResult, text: str | None) -> None:
    assert SHOWING.outcome(result, STEM) == ([] if text is None else [text])


def cells(table: Table) -> list[tuple[str, ...]]:
    return [tuple(cell.strip() for cell in row) for row in table.cells]


def test_parameters_of_a_study_without_a_surface() -> None:
    parameters, *_ = SHOWING.tables(ALONE, STEM)
    assert parameters.title == "Calibrated parameters" and parameters.heads == ("Factor", "Value", "From")
    assert cells(parameters) == [("a", "1.500", "refinement"), ("b", "0.2500", "mid-range")]
    assert ALONE.alone and ALONE.varied == ("a",) and ALONE.determined == ("a",)
    assert SHOWING.cited(ALONE) == {"a": ""} and SHOWING.cited(HERE) == {}
    assert not HERE.alone and HERE.determined == () and HERE.varied == ("strain",)
    assert replace(ALONE, undetermined=("a", "b")).determined == ()


def test_parameters_for_another_program() -> None:
    known = replace(
        THERE,
        adjusted=Rows([replace(THERE.adjusted[0], interval=(0.2, 0.3))]),
        model=SimulatedBy("lsdyna", "R14", {"element size": "1 mm", "law": "none"}),
    )
    parameters, *_ = SHOWING.tables(known, STEM)
    assert parameters.title == "Parameters for LS-DYNA"
    assert parameters.heads == ("Factor", "Calibrated", "Other", "95 % confidence interval", "Range")
    assert cells(parameters) == [("strain", "0.03500", "0.2600", "0.2000 to 0.3000", "0.001000 to 1.000")]
    assert parameters.foot[-1] == "The parameters are valid only with element size 1 mm, law none."
    assert len(parameters.foot) == 3
    plain, *_ = SHOWING.tables(THERE, STEM)
    assert plain.heads == ("Factor", "Calibrated", "Other", "Range")


def test_responses_before_and_after() -> None:
    _, responses, runs = SHOWING.tables(THERE, STEM)
    assert responses.title == "Measured values and simulations in OpenRadioss"
    assert responses.heads == ("Diameter, mm", "Measured, N", "Before, N", "After, N", "Error, %")
    assert cells(responses) == [("8", "159.2", "66.70", "159.1", "0.06 too low")]
    assert runs.title == "Refinement runs"
    assert runs.heads == ("No.", "From", "Diameter, mm", "strain", "Predicted, N", "Simulated, N")
    assert cells(runs) == [
        ("1", "solution", "8", "0.03500", "158.5", "66.70"),
        ("2", "path", "8", "0.2600", "158.5", "159.1"),
    ]
    here, _ = SHOWING.tables(HERE, STEM)
    assert here.title == "Measured values and simulations in the model of the study"
    several = replace(HERE, rows=Rows([*HERE.rows, RefineRow(8.0, "travel", 1.2, None, 1.3, -8.333)]))
    table = SHOWING.tables(several, STEM)[0]
    assert table.heads == ("Diameter, mm", "Response", "Measured", "Before", "After", "Error, %")
    assert cells(table)[1] == ("8", "Travel", "1.2", "–", "1.300", "8.33 too high")


def test_the_closing_tables() -> None:
    setting: Any = SimpleNamespace(study=SimpleNamespace(naming=CUTTING))
    assert len(SHOWING.closing(THERE, setting)) == 2 and SHOWING.closing(HERE, setting) == []
    assert [table.title for table in SHOWING.closing(ALONE, setting)] == ["Calibrated parameters"]


def test_files_and_runs() -> None:
    tables = THERE.tables()
    assert tables["refine"].rows == ((8.0, "force", 159.2, 66.7, 159.1, 0.06),)
    assert tables["refine_runs"].heads[3:6] == ("strain", "predicted", "force")
    assert tables["refine_runs"].rows[1] == (2, "path", 8.0, 0.26, 158.5, 159.1, "ok", "")
    assert [label for label, _ in THERE.runs()] == ["refine 1 at a diameter of 8 mm", "refine 2 at a diameter of 8 mm"]
    assert [label for label, _ in HERE.runs()] == ["refine 1", "refine 2"]
    assert THERE.settles is None and HERE.settles == HERE.parameters
    other = replace(THERE, rows=Rows([RefineRow(7.0, "force", 1.0, None, None, None), *THERE.rows]))
    assert other.fitted.condition == 8.0


# ---- notes


def notes(result: RefineResult) -> dict[str, tuple[str, str | None, str | None]]:
    found = {note.kind: note for note in refine_notes(result)}
    return {
        kind: (note.text, note.remedy and note.remedy.text, note.remedy and note.remedy.edit)
        for kind, note in found.items()
    }


FAR = {"converged": False, "error_percent": -36.7}
MISSED = "The simulated maximum force{} differs from the target by 36.70 % after 2 runs."


@pytest.mark.parametrize(
    ("base", "stopped", "text", "remedy", "edit"),
    [
        (HERE, "budget", MISSED.format(""), "Raise `refine.budget` to 16.", "refine: {budget: 16}"),
        (HERE, "settled", MISSED.format("") + " Neighbouring parameter values do not reduce the error.", None, None),
        (HERE, "out_of_reach", MISSED.format(""), "Widen the range of strain.", None),
        (
            THERE,
            "budget",
            MISSED.format(" in OpenRadioss"),
            "Raise `refine.budget` to 16, or widen the range of strain in `refine.adjust`.",
            "refine: {budget: 16}",
        ),
        (
            THERE,
            "settled",
            MISSED.format(" in OpenRadioss"),
            "Adjust factors other than strain, or average over mesh positions with `replicates`.",
            None,
        ),
        (
            THERE,
            "out_of_reach",
            MISSED.format(" in OpenRadioss"),
            "Widen the range of strain in `refine.adjust`, or add another factor.",
            None,
        ),
    ],
)
def test_a_target_that_was_not_reached(
    base: RefineResult, stopped: Any, text: str, remedy: str | None, edit: str | None
) -> None:
    assert notes(replace(base, stopped=stopped, **FAR))["not_reached"] == (text, remedy, edit)
    assert "not_reached" not in notes(replace(base, **FAR))  # it stopped within the tolerance


def test_a_first_run_outside_its_interval() -> None:
    """Only runs at the first point, by the surface."""
    outside = replace(RUN, prediction_interval=(150.0, 160.0))
    later = replace(outside, run=2, how="surface")
    elsewhere = replace(outside, run=3, condition=10.0)
    text = (
        "The response surface is less accurate than its residuals indicate: the simulated maximum force{} is outside "
        "the prediction interval."
    )
    found = notes(replace(HERE, trial_runs=Rows([outside, later, elsewhere])))["first_outside"]
    assert found == (text.format(" at diameters of 8 and 10 mm"), None, None)
    inside = replace(RUN, prediction_interval=(60.0, 70.0))
    assert "first_outside" not in notes(replace(HERE, trial_runs=Rows([inside, later])))
    other = replace(elsewhere, levels={"strain": 0.5})
    assert "first_outside" not in notes(replace(HERE, trial_runs=Rows([inside, other])))


def test_without_a_surface_the_uncertainty_is_unknown() -> None:
    found = notes(ALONE)
    assert found["no_intervals"] == (
        "The study has no response surface: there is no analysis of variance, and the uncertainty is unknown.",
        "For confidence intervals, choose a design in `rsm.design`.",
        None,
    )
    assert found["not_identified"] == (
        "The runs do not determine b: mid-range or the mean of the prior was used.",
        "Fit further conditions or responses, or replace the range of b with a fixed value.",
        None,
    )
    both = notes(replace(ALONE, undetermined=("a", "b")))["not_identified"]
    assert "do not determine a or b:" in both[0] and "range of b" in str(both[1])
    assert "not_identified" not in notes(replace(ALONE, undetermined=()))


def test_runs_in_another_model() -> None:
    censored = [replace(THERE.trial_runs[0], outcome=Outcome(response=66.7, censored=True)), THERE.trial_runs[1]]
    assert notes(replace(THERE, trial_runs=Rows(censored)))["still_rose"] == (
        "In 1 run, the force had not fallen by the end of the stroke. The recorded maximum is therefore only a lower "
        "bound.",
        "Increase `refine.duration`.",
        None,
    )
    more = replace(THERE, rows=Rows([*THERE.rows, RefineRow(10.0, "force", 200.0, None, None, None)]))
    text = "The refined parameters were not simulated at a diameter of 10 mm because {}."
    assert notes(more)["not_run_there"] == (text.format("the run budget was exhausted"), "Raise `refine.budget`.", None)
    missed = replace(more, converged=False)
    assert notes(missed)["not_run_there"] == (text.format("the target was not reached"), None, None)
    assert "not_run_there" not in notes(THERE)


def test_reasons_of_the_verdict() -> None:
    def reasons(result: RefineResult | None) -> list[str]:
        noted = result and replace(result, notes=tuple(refine_notes(result)))
        seen: Any = SimpleNamespace(of=lambda _kind: noted)
        return [note.kind for note in refinement(seen)]

    assert reasons(ALONE) == ["no_intervals", "not_identified"]
    assert reasons(replace(THERE, stopped="budget", **FAR)) == ["missed_there"]
    assert reasons(replace(HERE, stopped="budget", **FAR)) == [] == reasons(None)


# ---- the analysis


def test_rows_and_errors() -> None:
    first, best = {"a": 1.0}, {"a": 2.0}
    by_levels = {1.0: {8.0: Outcome(response=90.0, travel=1.0)}, 2.0: {8.0: Outcome(response=95.0, travel=1.5)}}
    loop: Any = SimpleNamespace(
        responses=lambda levels: by_levels[levels["a"]],
        points=[SimpleNamespace(point=SimpleNamespace(levels=first))],
        best=SimpleNamespace(point=SimpleNamespace(levels=best)),
    )
    means: Any = [
        SimpleNamespace(condition=8.0, response="response", value=100.0, named=SimpleNamespace(name="force")),
        SimpleNamespace(condition=8.0, response="travel", value=2.0, named=SimpleNamespace(name="travel")),
        SimpleNamespace(condition=10.0, response="response", value=150.0, named=SimpleNamespace(name="force")),
    ]
    assert list(_rows(loop, means)) == [
        RefineRow(8.0, "force", 100.0, 90.0, 95.0, 5.0),
        RefineRow(8.0, "travel", 2.0, 1.0, 1.5, 25.0),
        RefineRow(10.0, "force", 150.0, None, None, None),
    ]


@pytest.mark.parametrize(("own", "recorded", "version"), [("7.1", "8", "7.1"), ("", "8", "8"), ("", None, None)])
def test_the_version_of_the_program(own: str, recorded: str | None, version: str | None) -> None:
    """Of the spec, else of the first record that has one."""
    solver = SimpleNamespace(version=own, program_name="lsdyna")
    records = {"a": None, "b": {"details": {}}, "c": {"details": {"program_version": recorded}}}
    work: Any = SimpleNamespace(
        study=SimpleNamespace(solver=solver, calibration_target=SimpleNamespace(condition=8.0)),
        folder=SimpleNamespace(peek=records.get),
        solver=SimpleNamespace(settings_that_matter=lambda d: {"at": f"{d:g}"}),
    )
    loop: Any = SimpleNamespace(runs=[SimpleNamespace(outcome=SimpleNamespace(key=key)) for key in records])
    assert _model(work, loop) == SimulatedBy("lsdyna", version, {"at": "8"})


def test_the_path_of_the_factors_that_move() -> None:
    """ŷ = 100 + 10a + 4b at a = 0.5, b = 0: 105 N; relative slopes 10/105 and 4/105 per coded unit."""
    surface: Any = SimpleNamespace(
        names=("stress", "failure_strain"),
        scales=SimpleNamespace(to_coded=lambda levels: np.array([(levels[0] - 15.0) / 5.0, (levels[1] - 0.03) / 0.02])),
        fitted=SimpleNamespace(
            gradient=lambda _x: np.array([10.0, 4.0]), predict=lambda x: np.array([100.0 + 10.0 * x[0] + 4.0 * x[1]])
        ),
        coding={"stress": SimpleNamespace(half_step=5.0), "failure_strain": SimpleNamespace(half_step=0.02)},
    )
    ranges = {"stress": (10.0, 20.0), "failure_strain": (0.01, 0.05)}
    study: Any = SimpleNamespace(
        targets=SimpleNamespace(calibrate_at=8.0),
        factor=lambda name: SimpleNamespace(low=ranges[name][0], high=ranges[name][1], unit="1"),
    )

    def path(adjust: dict[str, Any], own: Any = None, other: Any = None) -> SearchPath:
        def work(settings: Any) -> Any:
            solver = SimpleNamespace(settings_that_matter=lambda _d: settings)
            return SimpleNamespace(study=study, solver=solver, result=lambda _kind: surface)

        start = {"stress": 17.5, "failure_strain": 0.03}
        return _path(work(own), work(other), RefineOptions(adjust=adjust), start)

    by_itself = Mover("failure_strain", 0.03, 0.001, 1.0, pytest.approx(4.0 / 105.0 / 0.02))
    assert path({}).movers == (by_itself,)
    assert path({}, {"size": "1"}, {"size": "1"}).movers == (replace(by_itself, low=0.01, high=0.05),)
    assert path({}, {"size": "1"}, {"size": "2"}).movers == (by_itself,)
    both = path({"stress": None, "failure_strain": (0.02, 0.2)}).movers
    assert both == (
        Mover("stress", 17.5, 10.0, 20.0, pytest.approx(10.0 / 105.0 / 5.0)), replace(by_itself, low=0.02, high=0.2),
    )  # fmt: skip
    surface.names = ("stress", "strain")
    surface.coding["strain"] = surface.coding["failure_strain"]
    ranges["strain"] = (0.01, 0.05)
    study_start = {"stress": 17.5, "strain": 0.03}
    work: Any = SimpleNamespace(
        study=study, solver=SimpleNamespace(settings_that_matter=lambda _d: None), result=lambda _kind: surface
    )
    assert [m.name for m in _path(work, work, RefineOptions(), study_start).movers] == ["stress"]  # the strongest
    with pytest.raises(UsageError) as error:
        _path(work, work, RefineOptions(adjust={"density": None, "stress": None}), study_start)
    assert str(error.value) == (
        "refine.adjust: the response surface does not include density. Choose stress or strain."
    )


@pytest.mark.parametrize(
    ("sd", "n", "half"),
    [(4.8, None, 1.96 * 0.04), (4.8, 4, 3.182 * 0.02), (4.8, 1, None), (None, 9, None), (0.0, 9, None)],
)
def test_the_interval_follows_from_the_error_of_the_mean(sd: float | None, n: int | None, half: float | None) -> None:
    """4.8 of 120 N is 4 %; of four specimens the mean is known to 2 %, t(0.975; 3) = 3.182."""
    path = SearchPath((Mover("strain", 0.04, 0.001, 2.0, 25.0),))
    steps = PathSteps(path, {"strain": 0.04}, 8.0, 120.0, 120.0)
    for strain in (0.04, 0.05, 0.03):
        point = PointToTry({"strain": strain}, "path", math.log(strain / 0.04), {})
        steps.judge(point, {8.0: Outcome(response=3000.0 * strain)})
    best: Any = SimpleNamespace(best=SimpleNamespace(point=PointToTry({"strain": 0.04}, "path", 0.0, {})))
    target: Any = SimpleNamespace(sd=sd, n=n, response=120.0)
    (found,) = _adjusted(best, steps, target)
    assert (found.factor, found.calibrated, found.value, found.low, found.high) == ("strain", 0.04, 0.04, 0.001, 2.0)
    assert isinstance(found, AdjustedFactor) and (found.interval is None) is (half is None)
    if half is not None and found.interval is not None:
        assert math.log(found.interval[1] / 0.04) == pytest.approx(half, rel=0.03)


# ---- mistakes of the section


CUT = "targets: [{diameter: 8 mm, force: 110 N}]\nrsm: {factors: [yield_stress, failure_strain]}\n"


def mistake(folder: Path, section: str, more: str = CUT) -> str:
    (folder / "study.yaml").write_text(f"{TWO_FACTORS}{more}{section}", encoding="utf-8")
    with pytest.raises(SpecError) as error:
        load_study(folder / "study.yaml")
    return " ".join(str(error.value).split())


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            "refine: {in: {kind: sheet}, adjust: [failure_stain]}\n",
            "refine.adjust.failure_stain: 'failure_stain' is not a factor of this study; did you mean failure_strain?",
        ),
        (
            "refine: {adjust: [failure_strain]}\n",
            "refine.adjust: this key requires `refine.in`, which is missing; add `refine.in`, or remove this key",
        ),
        (
            "refine: {edge_spread: 0 mm}\n",
            "refine.edge_spread: this key requires `refine.in`, which is missing; add `refine.in`, or remove this key",
        ),
        (
            "refine: {duration: 1 s}\n",
            "refine.duration: this key requires `refine.in`, which is missing; add `refine.in`, or remove this key",
        ),
        (
            "refine: {in: {kind: sheet}, adjust: {failure_strain: [0.2, 0.2]}}\n",
            "refine.adjust.failure_strain: low 0.2 is not below high 0.2; widen the range",
        ),
        ("refine: {in: {kind: sheet}, adjust: [failure_strain, failure_strain]}\n", "failure_strain is listed twice"),
        (
            "refine: {in: {kind: sheet}}\nsolver: {kind: sheet}\n",
            "this study's results are entered by hand; a run sheet can contain the results of only one program; create "
            "a separate study for the other program",
        ),
    ],
)
def test_mistakes_of_the_section(tmp_path: Path, section: str, message: str) -> None:
    assert message in mistake(tmp_path, section)


def test_laboratory_tests_stay_in_the_model_of_the_study(tmp_path: Path) -> None:
    section = (
        "refine: {in: {kind: sheet}}\ntests: [{name: pull, kind: axial-tension, length: 20 mm, stroke: 1 mm}]\n"
        "targets: [{diameter: 8 mm, force: 110 N}, {test: pull, diameter: 8 mm, force: 600 N}]\n"
    )
    message = "refine.in: the laboratory tests cannot be simulated in another model; remove `refine.in` or the tests"
    assert message in mistake(tmp_path, section, "rsm: {factors: [yield_stress, failure_strain]}\n")


def test_settings_that_differ_in_the_other_model() -> None:
    options = RefineOptions.model_validate({"in": {"kind": "sheet"}, "edge_spread": "0 mm", "duration": "2 s"})
    assert options.elsewhere and set(options.changes) == {"blade", "loading"}
    assert options.changes["loading"] == {"duration": 2.0, "stroke": None}
    assert RefineOptions().changes == {} and not RefineOptions().elsewhere
    assert Wording().naming == CUTTING
