"""Published ranges that `stemcal init --crop` begins with."""

from __future__ import annotations

from math import sqrt
from pathlib import Path

import pytest

from stemcal.errors import UsageError
from stemcal.study.model.solver_options import EmbeddedSolver
from stemcal.study.reading import read_study
from stemcal.study.reading.crops import CROPS
from stemcal.study.reading.template import template

# as printed: strengths in shear, in bending or tension, MPa
PRINTED = {
    "wheat": ((4.91, 7.26), (21.2, 31.2)),
    "rice": ((6.06, 14.33), (7.17, 15.99)),
    "rape": ((0.92, 1.32), (44.83, 48.1)),
    "sugarcane": ((3.03, 4.43), (46.0, 46.0)),
    "chickpea": ((), (17.07, 39.20)),
}


@pytest.mark.parametrize("crop", CROPS)
def test_a_spec_with_a_crops_ranges_is_right(crop: str) -> None:
    study = read_study(template("mine", crop).encode(), Path("mine.yaml"))
    modulus = study.factor("elastic_modulus")
    assert (modulus.low, modulus.high) == CROPS[crop].elastic_modulus[:2]
    assert f"# {CROPS[crop].elastic_modulus.source[:60]}" in template("mine", crop)
    stress = study.factor("yield_stress")
    if crop not in PRINTED:
        assert CROPS[crop].yield_stress is None and (stress.low, stress.high) == (10, 20)
        return
    shear, bending = PRINTED[crop]
    strengths = [sqrt(3.0) * value for value in shear] + list(bending)
    assert (stress.low, stress.high) == pytest.approx((min(strengths), max(strengths)), rel=0.01)


@pytest.mark.parametrize("crop", [None, *CROPS])
def test_a_crops_stem_may_not_break_so_its_mesh_and_supports_are_stiffer(crop: str | None) -> None:
    text = template("mine", crop)
    study = read_study(text.encode(), Path("mine.yaml"))
    assert isinstance(study.solver, EmbeddedSolver)
    written = (study.solver.coarsening, study.solver.coarsening_around, study.contact.penalty)
    assert written == ((2.0, 1.0, 0.75) if crop else (6.0, 2.0, 0.25))
    assert max(map(len, text.splitlines())) <= 120


def test_a_crop_that_is_not_known_is_told_which_are() -> None:
    with pytest.raises(UsageError, match="did you mean maize"):
        template("mine", "maiz")
