"""The settings in the address of a page: of this study only, and so small that nothing overflows."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import stemcal.report.page

NODE = shutil.which("node")
SCRIPT = Path(stemcal.report.page.__file__).parent / "page.js"
FACTORS = [{"center": 15.0, "half": 5.0}, {"center": 0.03, "half": 0.02}]


def addressed(address: str) -> Any:
    """Return what the script of the page reads from an address, with two factors and two surfaces."""
    text = SCRIPT.read_text(encoding="utf-8")
    code = text[text.index("const allowed =") : text.index("const profiler =")]
    call = f"console.log(JSON.stringify(addressed({json.dumps(address)}, {json.dumps(FACTORS)}, 2)))"
    done = subprocess.run([NODE or "node", "-e", f"{code}\n{call}"], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_settings_of_the_study_are_read() -> None:
    found = addressed("at=12,0.02&of=1&keep=16.25,0.05|A, <b>|c&keep=1,2,3|no&keep=x")
    assert found == {"at": [12.0, 0.02], "of": 1, "keep": [["A, <b>|c", [16.25, 0.05]]]}


@pytest.mark.skipif(NODE is None, reason="needs node")
@pytest.mark.parametrize("of", ["constructor", "length", "__proto__", "2", "-1", "0.5", "1e0", "", "at", "000000"])
def test_only_surfaces_of_the_study_are_chosen(of: str) -> None:
    assert addressed(f"at=12,0.02&of={of}")["of"] is None


@pytest.mark.skipif(NODE is None, reason="needs node")
@pytest.mark.parametrize(
    "at", ["1e300,0.02", "1e300", "Infinity,0", "NaN,0.02", "12", "12,", ",0.02", "12,0.02,1", "12,-9"]
)
def test_levels_far_outside_are_refused(at: str) -> None:
    found = addressed(f"at={at}&keep={at}|x")
    assert found["at"] is False and found["keep"] == []


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_stored_settings_are_limited() -> None:
    found = addressed("at=12,0.02" + "&keep=12,0.02|" + 150 * "x" + 200 * "&keep=12,0.02|y")["keep"]
    assert len(found) == 100 and len(found[0][0]) == 100
