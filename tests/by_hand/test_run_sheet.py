"""The headings of a sheet, and the names of its runs."""

from stemcal.by_hand.run_sheet import Field, narrow, run_name
from stemcal.solvers.protocol import Request


def test_names_and_headings() -> None:
    assert run_name(Request("screen", 2, {}, 8.0)) == "screen 3"
    assert Field("force", "N", "response").heading == "force (N)"
    assert Field("ratio", "1", "factor").heading == "ratio"


def test_wide_signs_are_plain_ones() -> None:
    assert narrow("１２．５（Ｎ）") == "12.5(N)"
