"""The profiler's script computes what the surfaces do, also of one surface over factors and conditions."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from stemcal.doe.coding import Coding
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.section import Place, Section, fit_whole
from stemcal.report.page import page
from stemcal.stages.fitting import Measured
from stemcal.stages.rsm.profiler import _surface
from stemcal.study.reading import load_study

ROOT = Path(__file__).parents[2]
NODE = shutil.which("node")


@pytest.mark.skipif(NODE is None, reason="needs node")
@pytest.mark.parametrize("logarithm", [True, False])
@pytest.mark.parametrize("growing", [{}, {0: (2, 0.3)}])
def test_the_script_predicts_as_the_surface(logarithm: bool, growing: dict[int, tuple[int, float]]) -> None:
    """Over x and the condition; with growth a third factor is the exponent of the first, e^(0.3·0.5·x₂) times it."""
    design, k = central_composite(3, 1), 3 if growing else 2
    response = 100.0 * np.exp(design @ [0.2, -0.1, 0.3]) + 5.0 * design[:, 0] ** 2 + 0.5 * np.arange(15) % 3
    coding = Coding(("a", "b", "e")[:k], (15.0, 0.03, 0.5)[:k], (5.0, 0.02, 0.5)[:k])
    whole = fit_whole(design, response, ["a", "b", "d"], None, logarithm)
    section = Section(whole, Place(coding, 0.4, growing), logarithm)
    data = _surface(load_study(ROOT / "configs/smoke.yaml"), Measured(8.0, "response", 100.0), section)
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (6, k))
    script = Path(page.__file__).with_name("page.js").read_text("utf-8")
    functions = script[script.index("const terms") : script.index("// ---- drawing")]
    given = f"const surface = {json.dumps(data)}, points = {json.dumps(points.tolist())};"
    tail = f"{given} console.log(JSON.stringify(points.map(x => predict(surface, x))))"
    done = subprocess.run([str(NODE), "-e", functions + tail], capture_output=True, text=True, check=True, timeout=60)
    found = json.loads(done.stdout)
    assert [one["y"] for one in found] == pytest.approx(section.predict(points).tolist(), rel=1e-10)
    for key, ends in (("mean", section.mean_interval(points)), ("run", section.prediction_interval(points))):
        assert np.array([one[key] for one in found]) == pytest.approx(ends, rel=1e-7)
