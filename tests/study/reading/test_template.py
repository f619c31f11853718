from __future__ import annotations

from pathlib import Path

import pytest

from stemcal.errors import UsageError
from stemcal.study.model import PARAMETERS
from stemcal.study.reading import read_study
from stemcal.study.reading.template import template


@pytest.mark.parametrize("name", ["my-study", "菊花 2026", "it's", "010", "yes"])
def test_the_template_loads_under_its_name(name: str) -> None:
    study = read_study(template(name).encode(), Path("study.yaml"))
    assert study.name == name
    assert study.names == tuple(PARAMETERS)
    assert study.warnings == ()


def test_every_section_is_explained() -> None:
    lines = template("x").splitlines()
    for number, line in enumerate(lines):
        if line.endswith(":") and line[0].isalpha():
            assert lines[number - 1].startswith("#"), line


def test_names_of_no_folder_are_refused() -> None:
    with pytest.raises(UsageError, match="cannot be in the name of a folder"):
        template("../x")
