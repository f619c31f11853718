"""Sheets of the tests of a validation against the scatter of what was measured."""

from __future__ import annotations

from stemcal.doe.validation.comparison import ValidationRow
from stemcal.report.tables.sheet import Sheet, place_cell, place_head
from stemcal.stages.validate import FurtherRow, ValidateResult
from stemcal.text.numbers import interval, probability, short, significant

_TESTS = ("p differ-\nent", "p\nequal")


def tested_sheets(stage: ValidateResult) -> list[Sheet]:
    """Return the tests of the response; none where nothing could be tested."""
    if all(row.p_different is None for row in stage.compared):
        return []
    naming, response = stage.naming, stage.naming.response
    rows = [(*place_cell(naming, row.condition), *_cells(row)) for row in stage.compared]
    heads = ("Measured ± sd (n)", ",\n"), ("95 % of the\nmean", ", "), ("Simulated", ",\n")
    columns = (*place_head(naming, ",\n"), *(response.headed(*head) for head in heads), *_TESTS)
    foot = (
        f"Different: Welch's test. Equal: two one-sided tests; a small p shows that the {response.plural} agree within "
        "the margin.",
    )
    title = f"Tests against the scatter of the measured {response.noun}"
    return [Sheet(title, columns, tuple(rows), texts=len(place_head(naming)) or 1, foot=foot, claims=True)]


def further_tested_sheets(stage: ValidateResult) -> list[Sheet]:
    """Return the tests of the further responses; none where nothing could be tested."""
    if all(one.p_different is None for row in stage.rows for one in row.further):
        return []
    naming = stage.naming
    rows = [
        (naming.named(one.response).heading(), *place_cell(naming, row.compared.condition), *_cells(one))
        for row in stage.rows
        for one in row.further
    ]
    places = place_head(naming, ",\n")
    columns = ("Response", *places, "Measured ± sd (n)", "95 % of the\nmean", "Simulated", *_TESTS)
    title = "Tests against the scatter of the further responses"
    return [Sheet(title, columns, tuple(rows), texts=1 + len(places), claims=True)]


def _cells(row: ValidationRow | FurtherRow) -> tuple[str, ...]:
    """Return what was measured, the interval of its mean, what was simulated, and p of both tests."""
    bounded = row.measured_low is not None and row.measured_high is not None
    return (
        with_scatter(row.measured, row.sd, row.n),
        interval((row.measured_low or 0.0, row.measured_high or 0.0) if bounded else None),
        significant(row.simulated),
        probability(row.p_different),
        probability(row.p_equivalent),
    )


def with_scatter(mean: float, sd: float | None, n: int | None) -> str:
    """Return a measured mean with its standard deviation and number of specimens, as far as they are known.

    >>> with_scatter(745.0, 6.0, 5), with_scatter(745.0, 6.0, None), with_scatter(745.0, None, 5)
    ('745 ± 6 (5)', '745 ± 6', '745')
    """
    told = short(mean) if sd is None else f"{short(mean)} ± {short(sd)}"
    return f"{told} ({n})" if sd is not None and n is not None else told
