"""A validation of many responses at many conditions: the first figures, the worst rows, with links to the rest."""

from dataclasses import replace
from typing import Any

from stemcal.drawing.table import MOST_ROWS
from stemcal.report.outcome import tables_of
from stemcal.stages.validate.result import FurtherRow, ValidateResult
from stemcal.stages.validate.showing import MOST_RESPONSES, validate_plots
from stemcal.storage.rows import Rows
from stemcal.vocabulary import Variable, Vocabulary, Wording

PLACES, NAMES = range(1, 101), [f"r{number}" for number in range(10)]
NAMING = Vocabulary(Variable("place", "Place", "p", "mm"), tuple(Variable(name, name, name, "N") for name in NAMES))


def wide(results: Any) -> ValidateResult:
    """Ten responses at a hundred places; the largest errors are 30 % (r9 at 77 mm) and 9 % (r0 at 60 mm)."""
    row, rows = results.of(ValidateResult).rows[0], []
    for place in PLACES:
        error = 9.0 if place == 60 else 1.0
        compared = replace(row.compared, condition=float(place), error_percent=error, role="held_out")
        others = [(name, 30.0 if (name, place) == ("r9", 77) else 0.1 * n) for n, name in enumerate(NAMES[1:], 1)]
        further = Rows(FurtherRow(name, "N", 10.0, None, 10.0, error, judged=True) for name, error in others)
        rows.append(replace(row, compared=compared, further=further))
    head = replace(results.of(ValidateResult).head, naming=NAMING)
    return replace(results.of(ValidateResult), head=head, rows=Rows(rows))


def test_tables_have_the_first_and_the_worst_rows(results: Any) -> None:
    first, further = tables_of(wide(results))
    assert len(first.rows) == len(further.rows) == MOST_ROWS
    assert [row[0] for row in first.rows[:20]] == list(range(1, 21)) and 60.0 in [row[0] for row in first.rows]
    assert ("r9", "77") in [(row[0], row[1]) for row in further.cells]
    assert "40 of 100 rows" in first.foot[-1] and "`validate.csv`" in first.foot[-1]
    assert "40 of 900 rows" in further.foot[-1] and "`validate_responses.csv`" in further.foot[-1]


def test_the_page_has_the_figures_of_the_first_responses(results: Any, replayed: Any) -> None:
    study = replayed[0].model_copy()
    study.__dict__["naming"] = NAMING  # worked out once
    found = validate_plots(study, wide(results))
    shown = [plot.name for plot in found if plot.on_page]
    assert len(found) == len(NAMES) and len(shown) == MOST_RESPONSES
    assert shown == ["validation", *(f"validation-r{number}" for number in range(1, 6))]
    assert "Of 10 responses, the report shows the first 6" in found[0].caption


def test_many_conditions_are_counted() -> None:
    names = Wording(NAMING)
    assert names.conditions([1.0, 2.0]) == "place 1 and 2 mm"
    assert "100 values" in names.conditions(PLACES) and "1 to 100 mm" in names.conditions(PLACES)
