"""The sentences of screening and surface, on the paper's own runs."""

from typing import Any

import pytest

from stemcal.cutting.checks import energy_drifts
from stemcal.notes import SEVERITIES
from stemcal.report.outcome import notes_of_all, read_first
from stemcal.stages.result import DesignRuns, Head
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.rsm.showing import RsmShowing
from stemcal.stages.screen.analysis import analyse_screening
from stemcal.stages.screen.result import ScreenResult
from stemcal.stages.screen.showing import ScreenShowing
from stemcal.storage.rows import Rows
from stemcal.vocabulary import Wording

screen, surface = ScreenShowing(), RsmShowing()
NAMES = Wording(labels={"yield_stress": "Yield stress"})


@pytest.mark.parametrize(
    ("rows", "response"),
    [
        ([[-1, -1], [1, -1], [-1, 1], [1, 1]], [0.0, 146.0, 0.0, 146.0]),
        ([[-1, -1], [1, -1], [-1, 1]], [0.0, 146.0, 0.0]),
    ],
)
def test_effects_without_an_error_are_not_called_insignificant(rows: list[list[int]], response: list[float]) -> None:
    found = analyse_screening(rows, response, ["yield_stress", "density"])
    runs: Any = Rows([None] * len(rows))
    stage = ScreenResult(head=Head(2, "screen", "known"), design=DesignRuns("full", runs), **vars(found))
    assert screen.outcome(stage, NAMES) == [
        f"In the screening, 2 factors were varied in {len(rows)} runs.",
        "The effects on the maximum force cannot be tested without an estimate of the error.",
    ]


def test_notes_are_read_by_severity_each_kind_once(results: Any) -> None:
    found = read_first([("runs", energy_drifts(3.0)), *notes_of_all(results, True)])
    places = [SEVERITIES.index(note.severity) for _, note in found]
    assert places == sorted(places) and found[0][0] == "runs"
    kinds = [note.kind for _, note in found]
    assert len(kinds) == len(set(kinds))
    assert {note.kind: note.severity for note in results.of(ScreenResult).notes} == {
        "lenth_decides": "caution",
        "methods_disagree": "warning",
        "partly_aliased": "caution",
    }


def test_the_notes_of_the_published_surface(results: Any) -> None:
    said = {note.kind: note.text for note in results.of(RsmResult).notes}
    assert "(5 degrees of freedom)" in said["scatter"]
