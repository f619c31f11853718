"""The article's tables 6 and 7 (Plackett–Burman), 9 and 10 (central composite), arrays and printed cells."""

from dataclasses import dataclass

import numpy as np
import pytest
from printed import read_printed

from stemcal.arrays import Array
from stemcal.doe.coding import Coding
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.stages.screen.analysis import analyse_screening
from stemcal.stages.screen.result import Screening

SYMBOLS = tuple(f"X{i}" for i in range(1, 10))


@dataclass(frozen=True, eq=False)
class Runs:
    coded: Array
    force: Array


@pytest.fixture(scope="session")
def pb_runs() -> Runs:
    rows = read_printed("table06_pb_runs.csv")
    ranges = {row["symbol"]: row for row in read_printed("table05_pb_factors.csv")}
    low, high = ([float(ranges[s][end]) for s in SYMBOLS] for end in ("low", "high"))
    coding = Coding.from_ranges(SYMBOLS, low, high)
    coded = coding.to_coded([[float(row[s]) for s in SYMBOLS] for row in rows])
    return Runs(coded, np.array([float(row["force_N"]) for row in rows]))


@pytest.fixture(scope="session")
def pb(pb_runs: Runs) -> Screening:
    return analyse_screening(pb_runs.coded, pb_runs.force, SYMBOLS)


@pytest.fixture(scope="session")
def coding() -> Coding:
    return Coding(("X4", "X9", "X7"), (14.995, 0.03, 90.0), (2.975, 0.01, 5.95))


@pytest.fixture(scope="session")
def ccd_runs(coding: Coding) -> Runs:
    rows = read_printed("table09_ccd_runs_as_analysed.csv")
    coded = coding.to_coded([[float(row[name]) for name in coding.names] for row in rows])
    return Runs(coded, np.array([float(row["force_N"]) for row in rows]))


@pytest.fixture(scope="session")
def ccd(ccd_runs: Runs, coding: Coding) -> Surface:
    return fit_surface(ccd_runs.coded, ccd_runs.force, coding.names)


@pytest.fixture(scope="session")
def box(coding: Coding) -> tuple[Array, Array]:
    """The article's eq. (2): 10–20 MPa, 0.01–0.05, 80–100 1/s."""
    return coding.to_coded([10.0, 0.01, 80.0]), coding.to_coded([20.0, 0.05, 100.0])
