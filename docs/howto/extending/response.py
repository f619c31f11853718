# ruff: noqa: D100
# fmt: off
from stemcal.responses import Response

RELATIVE_TRAVEL = Response(
    name="relative_travel",
    label="Relative travel at maximum force",
    symbol="u/d",
    unit="%",
    of=lambda test: 100.0 * test.peak_travel / test.diameter,
    meaning="Mean travel to the maximum force as a share of the diameter.",
)
