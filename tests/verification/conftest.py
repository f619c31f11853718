"""Have the kernels compiled before the first test here."""

from __future__ import annotations

import pytest
from double_precision import warm_double


@pytest.fixture(scope="session", autouse=True)
def _kernels() -> None:
    warm_double()
