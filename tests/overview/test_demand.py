"""Demand of the runs that are left, its limits, and settings that are noticed before a study begins."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import pytest
from fakes import SPEC, FakeSolver, make_study

from stemcal.notes import Remedy
from stemcal.overview.foresight import Demand, beforehand, demand_left, demand_of, demand_of_one, excess, lasting
from stemcal.overview.plan import plan
from stemcal.runs.record import Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

GB = 1e9
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"


@dataclass(frozen=True)
class Priced(FakeSolver):
    """10 s and 2 GB at 8 mm, more with the cross-section; the time of the rows in `unknown` is not known."""

    unknown: tuple[int, ...] = ()

    def cost_estimate(self, request: Request) -> float | None:
        return None if request.row in self.unknown else super().cost_estimate(request)

    def memory_estimate(self, request: Request) -> float:
        return 2.0 * GB * (request.condition / 8.0) ** 2


class Immediate(Priced):
    immediate = True


def requests(*diameters: float) -> list[Request]:
    return [Request("validate", row, {"yield_stress": 15.0}, d) for row, d in enumerate(diameters)]


def test_times_add_up_and_memory_does_not() -> None:
    """8 and 16 mm: 10 and 40 s, 2 and 8 GB; a run without an estimate of its time still has its memory."""
    assert demand_of(requests(8.0, 16.0), Priced()) == Demand(2, 50.0, 8.0 * GB)
    assert demand_of(requests(8.0, 16.0), Priced(unknown=(1,))) == Demand(2, 10.0, 8.0 * GB)
    assert demand_of(requests(8.0, 8.0), FakeSolver()) == Demand(2, 20.0, 0.0)
    assert demand_of(requests(8.0), Immediate()) == Demand(0, 0.0, 0.0)


def test_demand_is_that_of_the_runs_left(tmp_path: Path) -> None:
    """16 screening runs, 9 of the surface and 3 of the validation at 7, 8 and 10 mm, (49 + 64 + 100)/64·10 s.

    The screening of nine factors has 12 runs. One of them is recorded, so 11 are left.
    """
    study, folder, solver = make_study(tmp_path, TWO), StudyFolder(tmp_path / "out"), Priced()
    validation = 10.0 * (49.0 + 64.0 + 100.0) / 64.0
    assert demand_left(study, folder, solver, "screen") == Demand(12, 120.0, 2.0 * GB)
    assert demand_left(study, folder, solver, "rsm") == Demand(9, 90.0, 2.0 * GB)
    assert demand_left(study, folder, solver, "validate") == Demand(3, pytest.approx(validation), 3.125 * GB)
    assert demand_left(study, folder, solver) == Demand(24, pytest.approx(210.0 + validation), 3.125 * GB)
    assert demand_left(study, folder, solver, "refine") == Demand(1, 10.0, 2.0 * GB)  # decided run by run
    first = next(iter(plan_requests(study, folder, solver)))
    with folder:
        record(folder, solver, first)
    assert demand_left(study, folder, solver, "screen") == Demand(11, 110.0, 2.0 * GB)
    assert demand_left(study, folder, solver).runs == 23 == plan(study, folder, solver, 1).to_run


def plan_requests(study: Study, folder: StudyFolder, solver: FakeSolver) -> list[Request]:
    from stemcal.stages.ledger import required_runs

    return [request for part in required_runs(study, solver, folder) for request in part.requests]


def record(folder: StudyFolder, solver: FakeSolver, request: Request) -> None:
    run = Run.of(solver, request)
    content = {"key": run.key, "identity": run.identity, "request": asdict(request), **asdict(Answer("ok", 100.0))}
    folder.save({**content, "provenance": {}})


MEMORY = "One run needs about {} of memory{}, but this machine has only 8.0 GB."
LARGER = "Use larger elements (`solver.element_size`) or a shorter specimen."


@pytest.mark.parametrize(
    ("demand", "workers", "text", "remedy"),
    [
        (Demand(20, 60.0, 3 * GB), 8, MEMORY.format("3.0 GB", ", and 8 parallel runs need 24.0 GB"), "2"),
        (Demand(2, 60.0, 5 * GB), 8, MEMORY.format("5.0 GB", ", and 2 parallel runs need 10.0 GB"), "1"),
        (Demand(9, 60.0, 3 * GB), 3, MEMORY.format("3.0 GB", ", and 3 parallel runs need 9.0 GB"), "2"),
        (Demand(1, 60.0, 9 * GB), 8, MEMORY.format("9.0 GB", ""), None),
        (Demand(2, 60.0, 4 * GB), 8, None, None),  # exactly all of it
        (Demand(0, 0.0, 0.0), 0, None, None),
    ],
)
def test_the_most_memory(demand: Demand, workers: int, text: str | None, remedy: str | None) -> None:
    found = excess(demand, workers, 8 * GB)
    assert [note.text for note in found] == ([] if text is None else [text])
    assert all((note.kind, note.severity) == ("too_much_memory", "error") for note in found)
    use = LARGER if remedy is None else f"Use fewer workers (`--workers {remedy}`)."
    assert all(note.remedy is not None and note.remedy.text == use for note in found)


@pytest.mark.parametrize(
    ("runs", "workers", "hours", "shown"),
    [(4, 8, 4 * 48.0, None), (4, 8, 4 * 49.0, "49 h 0 min"), (40, 8, 8 * 49.0, "49 h 0 min"), (40, 8, 8 * 47.0, None)],
)
def test_more_than_two_days_are_announced(runs: int, workers: int, hours: float, shown: str | None) -> None:
    """Four runs use at most four of eight workers."""
    found = excess(Demand(runs, 3600.0 * hours, 0.0), workers, None)
    texts = [f"The runs would take about {shown}, which is more than 48 h."] if shown else []
    assert [(note.kind, note.severity, note.text) for note in found] == [("too_long", "warning", t) for t in texts]
    assert all("`solver.mass_scaling`" in str(note.remedy) for note in found)


def test_both_limits_at_once() -> None:
    found = excess(Demand(1, 3600.0 * 100, 9 * GB), 1, 8 * GB)
    assert [note.kind for note in found] == ["too_much_memory", "too_long"]


def test_the_cost_of_a_single_virtual_test(tmp_path: Path) -> None:
    """At the middle of all ranges; the largest of some diameters."""
    study = make_study(tmp_path)
    small, large = (demand_of_one(study, [d]) for d in (7.0, 10.0))
    assert small.runs == large.runs == 1 and min(small.seconds, large.seconds) > 0.0 and small.memory > 0.0
    assert small != large
    most = Demand(1, max(small.seconds, large.seconds), max(small.memory, large.memory))
    assert demand_of_one(study, [10.0, 7.0]) == demand_of_one(study, [7.0, 10.0]) == most


def stroked(folder: Path, loading: str, extra: str = "") -> Study:
    (folder / "stroke.yaml").write_text(f"{SPEC}loading: {loading}\n{extra}", encoding="utf-8")
    return load_study(folder / "stroke.yaml")


def notes(study: Study) -> dict[str, str]:
    return {note.kind: note.text for note in beforehand(study)}


@pytest.mark.parametrize(
    ("loading", "stroke", "share"),
    [
        ("{stroke: 3.4 mm}", "3.4", "0.34"),
        ("{stroke: 3.51 mm}", None, None),
        ("{stroke: d/4}", "2.5", "0.25"),
        ("{speed: 10 mm/s, duration: 100 ms}", "0.999", "0.1"),  # from 0.001 mm above the stem
    ],
)
def test_a_stroke_below_035_of_the_thickest_stem(
    tmp_path: Path, loading: str, stroke: str | None, share: str | None
) -> None:
    """The thickest of 7, 8 and 10 mm; the stroke begins at first contact."""
    found = notes(stroked(tmp_path, loading)).get("short_stroke")
    if stroke is None:
        assert found is None
    else:
        assert found is not None and found.startswith(
            f"The stroke of {stroke} mm is only {share} times the largest diameter (10 mm). "
        )


def test_a_whole_cut_needs_a_stroke_of_the_whole_stem(tmp_path: Path) -> None:
    """Without a stroke it is 1.5 diameters; stems on two supports are cut through after up to 0.9 diameters."""
    for stroke in ("", ", stroke: d/1", ", stroke: 10 mm"):
        assert "short_stroke" not in notes(stroked(tmp_path, f"{{until: severed{stroke}}}"))
    study = stroked(tmp_path, "{until: severed, stroke: 9.9 mm}")
    assert "9.9 mm is only 0.99 times the largest diameter (10 mm)" in notes(study)["short_stroke"]
    found = lasting(study, 10.0, 10.0)
    assert found.edit == "loading: {stroke: d/1}" and "ends when the stem is cut through" in found.text


def test_the_length_and_the_failure_strain_belong_together(tmp_path: Path) -> None:
    spread = "material: {internal_length: 0.8 mm}\nblade: {edge_spread: 0.5 mm}\n"
    found = notes(stroked(tmp_path, "{stroke: d/2}", spread))
    assert list(found) == ["lengths_belong"]
    assert "`internal_length` (0.8 mm) and `edge_spread` (0.5 mm)" in found["lengths_belong"]
    study = load_study(tmp_path / "stroke.yaml")
    others = tuple(factor for factor in study.factors if factor.name != "failure_strain")
    assert notes(study.model_copy(update={"factors": others})) == {}


@pytest.mark.parametrize(
    ("loading", "travel", "edit"),
    [
        ("{stroke: 2 mm}", 3.5, "loading: {stroke: d/2.8}"),  # 10/3.5 = 2.857, rounded down
        ("{stroke: d/8}", 5.0, "loading: {stroke: d/2}"),
        ("{speed: 10 mm/s, duration: 100 ms}", 3.5, "loading: {duration: 0.36 s}"),  # 0.1·3.5/0.999, rounded up
        ("{speed: 10 mm/s, duration: 2 s}", 41.1, "loading: {duration: 4.2 s}"),  # 2·41.1/19.999, rounded up
    ],
)
def test_a_stroke_that_lasts(tmp_path: Path, loading: str, travel: float, edit: str) -> None:
    found = lasting(stroked(tmp_path, loading), travel, 10.0)
    assert found == Remedy(f"Set `{edit}`; each run still ends at the first fracture.", edit)
    assert replace(found, text="").edit == edit
