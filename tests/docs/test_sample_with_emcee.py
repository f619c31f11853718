"""The page's script draws from the likelihood: its intervals are those of known answers."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from shown import DOCS, ROOT


@pytest.mark.slow
def test_sample_the_parameters_with_emcee(tmp_path: Path) -> None:
    """One force: yield stress is known to about ± 1 MPa, the strain-rate parameter fills its range."""
    pytest.importorskip("emcee", reason="emcee is of the extra `dev` only")
    text = (DOCS / "reference" / "python.md").read_text("utf-8")
    script = next(code for code in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "emcee" in code)
    script = script.replace("configs/", f"{ROOT.as_posix()}/configs/")
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"},
        capture_output=True, encoding="utf-8", timeout=400,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = re.findall(r"^(\w+) (\S+) to (\S+)$", done.stdout, re.MULTILINE)
    found = {name: (float(low), float(high)) for name, low, high in rows}
    assert found["yield_stress"] == pytest.approx((17.1, 19.0), abs=0.2)
    low, high = found["strain_rate_c"]
    assert high - low > 0.6 * 20.0 and len(found) == 3
