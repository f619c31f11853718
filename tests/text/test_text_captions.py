"""What stands below figures."""

from __future__ import annotations

import re
from pathlib import Path

import stemcal
from stemcal.naming import Named, Naming
from stemcal.text.captions import SENTENCES, caption
from stemcal.text.names import Names

ANGLE = Naming(None, (Named("angle", "angle of repose", "θ", "deg"),))


def test_every_sentence_is_used_by_the_gallery() -> None:
    code = (Path(stemcal.__file__).parent / "report" / "figures" / "gallery.py").read_text("utf-8")
    used = set(re.findall(r'"([a-z -]+)"', code))
    held = {f"{name} at the {where}" for name in ("contour", "relief") for where in ("solution", "centre")}
    assert set(SENTENCES) - held <= used | {"contour", "relief"}


def test_a_contour_of_two_factors_of_three() -> None:
    names = Names(labels={"yield_stress": "Yield stress"})
    factors = ("yield_stress", "failure_strain")
    assert caption(names, "contour at the solution", "lines in", "met", factors=factors) == (
        "Force over Yield stress and failure_strain, the others at the solution. The lines have their values in "
        "N. Orange: where the measured force is met; star: the solution."
    )


def test_own_names() -> None:
    names = Names(ANGLE)
    assert caption(names, "observed") == "Simulated angle of repose against the surface's prediction."
    assert caption(names, "validation") == "Measured and simulated angle of repose."
