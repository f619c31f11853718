"""Targets that name the files of whole curves: what stands in their place, what is fitted, what is refused."""

from pathlib import Path
from statistics import fmean, stdev

import numpy as np
import pytest

from stemcal.errors import SpecError
from stemcal.report.curves import measured_band
from stemcal.report.records import RunCurve
from stemcal.solvers import make_solver
from stemcal.solvers.embedded import Embedded
from stemcal.solvers.kept_curve import curve_scores
from stemcal.solvers.program import Command
from stemcal.solvers.protocol import Request
from stemcal.stages.fresh import inputs_of
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

SMOKE = Path(__file__).parents[3] / "configs" / "smoke.yaml"
FORCES = (165.0, 172.0, 178.0, 180.0, 186.0, 195.0)
POWERS = (2.0, 2.4, 1.9, 2.1, 2.6, 2.2)


def sheet(force: float, power: float, end: float = 0.7) -> str:
    u = np.linspace(0.0, end, 200)
    rows = zip([*u, end + 0.01], [*(force * (1.0 - (1.0 - u / end) ** power)), 1.0], strict=True)
    return "Displacement (mm),Load (N)\n" + "".join(f"{travel:.5f},{load:.4f}\n" for travel, load in rows)


def study_in(folder: Path, eight: str = "curves: lab/8mm-*.csv", seven: str = "force: 140 N", more: str = "") -> Study:
    (folder / "lab").mkdir(exist_ok=True)
    for i, (force, power) in enumerate(zip(FORCES, POWERS, strict=True)):
        (folder / "lab" / f"8mm-{i}.csv").write_text(sheet(force, power), encoding="utf-8")
    text = SMOKE.read_text(encoding="utf-8")
    targets = f"{more}targets:\n  - {{diameter: 7 mm, {seven}}}\n  - {{diameter: 8 mm, {eight}}}\n"
    begin, end = text.index("targets:"), text.index("rsm:")
    spec = folder / "study.yaml"
    spec.write_text(text[:begin] + targets + text[end:], encoding="utf-8")
    return load_study(spec)


def test_their_maximum_is_the_force_and_what_they_tell_beside_it_is_fitted_too(tmp_path: Path) -> None:
    study = study_in(tmp_path)
    target = study.targets.means[1]
    assert target.response == pytest.approx(fmean(FORCES), rel=1e-4)
    assert target.sd == pytest.approx(stdev(FORCES), rel=1e-3)
    assert target.n == 6
    names = [named.name for named in study.naming.responses]
    assert names[0] == "force"
    assert names[1:] == list(target.further) == [f"curve_{j}" for j in range(1, len(names))]
    assert study.invert.responses == ("response", *names[1:])
    assert target.mean_of("curve_1")[0] == pytest.approx(fmean(FORCES), rel=1e-4)
    assert target.count_of("curve_1") == 6


def test_a_force_that_is_given_stays(tmp_path: Path) -> None:
    target = study_in(tmp_path, "force: 182 N, sd: 9 N, n: 30, curves: [lab/8mm-*.csv]").targets.means[1]
    assert (target.response, target.sd, target.n, target.count_of("curve_1")) == (182.0, 9.0, 30, 6)


def test_a_simulated_curve_has_their_scores(tmp_path: Path) -> None:
    """The record has them beside the force; other files are other runs and another surface."""
    study = study_in(tmp_path)
    request = Request("rsm", 0, study.midlevels(), 8.0)
    answer = Embedded(study).solve(request)
    assert answer.ok, answer.message
    modes, curve = study.targets.modes[8.0], answer.details["curve"]
    again = modes.scores(np.array(curve["travel"]), np.array(curve["force"]))  # of the 200 points that are kept
    assert list(answer.details["responses"].values()) == pytest.approx(again, rel=0.01)
    whole = tuple(curve["travel"]), tuple(curve["force"])
    end = whole[0][-1]
    swings = RunCurve(
        (*whole[0], end + 0.1), (*whole[1], 500.0), broke=end
    )  # what the released stem does counts nowhere
    drawn = [measured_band(modes, one).axes[0].lines[1].get_ydata() for one in (RunCurve(*whole), swings)]
    assert np.array_equal(*drawn)
    assert curve_scores(modes, *map(np.array, (swings.travel, swings.force)), end + 0.05)["curve_1"] == again[0]
    before = inputs_of(study, None, None, "screen")  # type: ignore[arg-type]
    assert "curves" in before
    (tmp_path / "lab" / "8mm-6.csv").write_text(sheet(200.0, 2.0), encoding="utf-8")
    other = load_study(tmp_path / "study.yaml")
    assert inputs_of(other, None, None, "screen")["curves"] != before["curves"]  # type: ignore[arg-type]
    assert Embedded(other).identity(request) != Embedded(study).identity(request)


@pytest.mark.parametrize(
    ("eight", "seven", "more", "message"),
    [
        ("curves: lab/9mm-*.csv", "force: 140 N", "", "no file matches lab/9mm-*.csv; "),
        ("curves: ../*.csv", "force: 140 N", "", "no file matches ../*.csv; "),
        (f"curves: {'x' * 290}.csv", "force: 140 N", "", "no file matches xxx"),
        (
            "curves: lab/8mm-1.csv",
            "force: 140 N",
            "",
            "the scatter of the curves cannot be estimated from only 1 specimen",
        ),
        (
            "curves: [lab/8mm-1.csv, lab/8mm-2.csv]",
            "force: 140 N",
            "",
            "the scatter of the curves cannot be estimated from only 2 specimens",
        ),
        (
            "force: 180 N",
            "curves: lab/8mm-*.csv",
            "",
            "no curves are listed for the calibration diameter of 8 mm",
        ),
        ("curves: 3", "force: 140 N", "", "curves"),
        ("curves: lab/8mm-*.csv, modes: 1", "force: 140 N", "", "unknown key 'modes'"),
        (
            "curves: lab/8mm-*.csv",
            "force: 140 N",
            "machine: {stiffness: 3 mm}\n",
            "stiffness: mm is a unit of length, not of force per length; use N/mm, kJ/m2",
        ),
        (
            "force: 180 N",
            "force: 140 N",
            "machine: {stiffness: 900 N/mm}\n",
            "machine: without curves, the `machine` section has no effect",
        ),
    ],
)
def test_what_cannot_be_compared_is_refused(tmp_path: Path, eight: str, seven: str, more: str, message: str) -> None:
    with pytest.raises(SpecError) as told:
        study_in(tmp_path, eight, seven, more)
    assert message in str(told.value)


def test_of_a_pattern_that_matches_nothing_one_problem_tells_where_and_what_lies_there(tmp_path: Path) -> None:
    """That the force is missing only follows; a diameter that is missing beside it is told too."""
    with pytest.raises(SpecError) as told:
        study_in(tmp_path, "curves: lab/9mm-*.csv")
    (problem,) = told.value.problems
    text = (tmp_path / "study.yaml").read_text(encoding="utf-8").splitlines()
    assert text[problem.line - 1][problem.column - 1 :].startswith("lab/9mm-*.csv")
    assert "no file matches lab/9mm-*.csv" in problem.message
    with pytest.raises(SpecError) as told:
        study_in(tmp_path, "curves: nowhere/*.csv, force: three")
    assert [problem.path for problem in told.value.problems] == ["targets[2].curves", "targets[2].force"]


def test_of_several_wrong_files_each_is_told(tmp_path: Path) -> None:
    """As a Chinese machine writes them, the others are read: a mark of order, semicolons, decimal commas."""
    study_in(tmp_path)
    for file in sorted((tmp_path / "lab").iterdir()):
        text = file.read_text(encoding="utf-8").replace(",", ";").replace(".", ",")
        text = text.replace("Displacement (mm);Load (N)", "位移（毫米）;力（牛）").replace("\n", "\r\n")
        (tmp_path / "lab" / file.name.replace("mm", "毫米")).write_text(text, encoding="utf-8-sig", newline="")
    study = study_in(tmp_path, "curves: lab/8毫米-*.csv")
    assert study.targets.means[1].response == pytest.approx(fmean(FORCES), rel=1e-4)
    (tmp_path / "lab" / "8毫米-1.csv").write_text("a;b\n1;2\n", encoding="utf-8")
    (tmp_path / "lab" / "8毫米-3.csv").write_text("Travel (mm);Force (N)\n0,1;2\n", encoding="utf-8")
    with pytest.raises(SpecError) as told:
        study_in(tmp_path, "curves: lab/8毫米-*.csv")
    first, second = told.value.problems
    assert "8毫米-1.csv: no force column" in first.message
    assert "8毫米-3.csv: the curve has only 1 point" in second.message


def test_each_diameter_has_modes_of_its_own(tmp_path: Path) -> None:
    """No more than where is calibrated, so that each is a response there; a run is scored by those of its diameter."""
    (tmp_path / "lab").mkdir()
    for i, (force, power) in enumerate(zip(FORCES, POWERS, strict=True)):
        text = sheet(0.7 * force, power, 0.8 + 0.03 * np.sin(5.0 * i))
        (tmp_path / "lab" / f"7mm-{i}.csv").write_text(text, encoding="utf-8")
    study = study_in(tmp_path, seven="curves: lab/7mm-*.csv")
    seven, eight = (study.targets.modes[diameter] for diameter in (7.0, 8.0))
    assert seven.force == pytest.approx(0.7 * eight.force, rel=1e-3)
    assert len(seven.weights) == len(eight.weights) == len(study.naming.responses) - 1
    assert study.targets.means[0].mean_of("curve_1")[0] == pytest.approx(seven.force)
    assert study.targets.means[0].specimens_of("curve_1") != study.targets.means[1].specimens_of("curve_1")
    keys = [
        Embedded(study).identity(Request("validate", 0, study.midlevels(), d))["curves"]["force"] for d in (7.0, 8.0)
    ]
    assert keys == [seven.force, eight.force]


PROGRAM = """
import sys
force, power = float(sys.argv[1]), float(sys.argv[2])
rows = [(0.7 * i / 400, force * (1.0 - (1.0 - i / 400) ** power)) for i in range(401)]
open("out.csv", "w").write("travel,load\\n" + "".join(f"{u},{f / 1000.0}\\n" for u, f in [*rows, (0.71, 1.0)]))
"""
OF_A_PROGRAM = """
name: own
factors:
  - {name: strength, unit: N, low: 150, high: 210}
  - {name: power, low: 1.8, high: 2.7}
solver:
  kind: command
  command: [python, shear.py, "{{strength}}", "{{power}}", "{{diameter}}"]
  files: [shear.py]
  result: {file: out.csv, column: load, RESULT scale: 1000}
targets:
  - {diameter: 8 mm, curves: lab/8mm-*.csv}
"""


def of_a_program(folder: Path, result: str) -> Study:
    study_in(folder)
    (folder / "shear.py").write_text(PROGRAM, encoding="utf-8")
    (folder / "own.yaml").write_text(OF_A_PROGRAM.replace("RESULT", result), encoding="utf-8")
    return load_study(folder / "own.yaml")


def test_the_curve_of_a_program_is_scored_too(tmp_path: Path) -> None:
    """Of the same formula as the specimens' curves, in kN: a specimen's parameters have the specimen's scores."""
    study = of_a_program(tmp_path, "along: travel, reduction: max,")
    answer = Command(study, tmp_path / "runs").solve(Request("rsm", 0, {"strength": 186.0, "power": 2.6}, 8.0))
    assert answer.ok, answer.message
    assert answer.response == pytest.approx(186.0)
    modes = study.targets.modes[8.0]
    travel, force = np.loadtxt(tmp_path / "lab" / "8mm-4.csv", delimiter=",", skiprows=1).T
    assert list(answer.details["responses"].values()) == pytest.approx(modes.scores(travel, force), rel=2e-3)
    assert max(answer.details["curve"]["force"]) == pytest.approx(186.0)


OF_DECKS = {
    "lsdyna": 'kind: deck, program: lsdyna, command: [ls-dyna, "i={{deck}}"], element_size: 2 mm',
    "openradioss": "kind: deck, program: openradioss, element_size: 2 mm, rate_law: cowper_symonds",
    "sheet": "kind: sheet",
}


def of_decks(folder: Path, kind: str, more: str = "") -> Study:
    study_in(folder)
    text = (folder / "study.yaml").read_text(encoding="utf-8")
    begin, end = text.index("solver:"), text.index("targets:")
    solver = f"solver: {{{OF_DECKS[kind]}}}\n"
    (folder / "deck.yaml").write_text(text[:begin] + solver + text[end:] + more, encoding="utf-8")
    return load_study(folder / "deck.yaml")


@pytest.mark.parametrize("kind", ["lsdyna", "openradioss"])
def test_curves_are_for_solvers_that_leave_a_history(tmp_path: Path, kind: str) -> None:
    study = of_decks(tmp_path, kind)
    assert study.invert.responses[:2] == ("response", "curve_1")
    assert "curves" in make_solver(study).identity(Request("rsm", 0, study.midlevels(), 8.0))
    with pytest.raises(SpecError, match="curves cannot be compared with simulations in another model"):
        of_decks(tmp_path, kind, "refine: {in: {kind: embedded}}\n")


def test_runs_by_hand_have_no_curve(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="the sheet solver returns no force–travel curve"):
        of_decks(tmp_path, "sheet")


def test_a_program_without_a_curve_has_none_to_compare(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"own.yaml:12:30: targets\[1\].curves: curves can be fitted only if"):
        of_a_program(tmp_path, "")


def test_their_travel_is_known_without_the_give_of_the_machine(tmp_path: Path) -> None:
    """All peak at 0.7 mm, smoothing moves that by 0.006 mm; they begin at 5 N. The machine gives (F − 5)/2000 mm."""
    first = [0.7 * (1.0 - (1.0 - 5.0 / force) ** (1.0 / power)) for force, power in zip(FORCES, POWERS, strict=True)]
    stiff = study_in(tmp_path).targets.means[1].travel_of_curves
    assert (stiff.value, stiff.n) == (pytest.approx(0.7 - fmean(first), abs=0.01), 6)
    soft = study_in(tmp_path, more="machine: {stiffness: 2000 N/mm}\n").targets.means[1].travel_of_curves
    assert stiff.value - soft.value == pytest.approx((fmean(FORCES) - 5.0) / 2000.0, abs=0.003)
    assert study_in(tmp_path).targets.means[0].travel_of_curves is None
