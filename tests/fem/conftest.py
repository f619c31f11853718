"""Have the kernels compiled before the first test here."""

import pytest

from stemcal.fem.warm import warm


@pytest.fixture(scope="session", autouse=True)
def _kernels() -> None:
    warm()
