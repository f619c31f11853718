from __future__ import annotations

import re
from pathlib import Path

import pytest

from stemcal.errors import UsageError
from stemcal.study.model import PARAMETERS
from stemcal.study.reading import read_study
from stemcal.study.reading.json_schema import meaning_of
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


def test_every_key_is_explained_where_it_first_stands() -> None:
    lines = template("x", "wheat").splitlines()
    at = lines.index("  element_size: d/16")
    assert lines[at - 2].startswith(f"  # {meaning_of(('solver', 'embedded', 'element_size'))[:60]}")
    assert "  # Ground on both sides, or on one only. both | one" in lines
    assert "# More keys: runs." in lines
    assert sum("Unit of `low` and `high`" in line for line in lines) == 1
    assert lines[lines.index('    expected_sign: "+"') - 1].startswith("    # What mechanics says")
    assert max(map(len, lines)) <= 120


def test_what_is_switched_off_can_be_switched_on() -> None:
    """Sections after a # are valid once it is removed."""
    on = re.sub(r"(?m)^# (mesh:|transfer:|climb:|  [a-z_]+:|  #)", r"\1", template("x"))
    study = read_study(on.encode(), Path("study.yaml"))
    assert study.mesh is not None and study.mesh.phases == 5
    assert study.transfer is not None and study.transfer.solver.kind == "deck"
    assert study.climb is not None and study.climb.step_sizes == {"yield_stress": 2.0}


def test_names_of_no_folder_are_refused() -> None:
    with pytest.raises(UsageError, match="cannot be in the name of a folder"):
        template("../x")
