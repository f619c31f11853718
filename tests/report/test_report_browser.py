"""The page in a real browser: nothing said on the console, nothing loaded, nothing that sticks out, all readable."""

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

from stemcal.report.page.render import write_page

pytest.importorskip("playwright")
_spec = importlib.util.spec_from_file_location("browser", Path(__file__).with_name("browser.py"))
assert _spec and _spec.loader
browser = importlib.util.module_from_spec(_spec)
sys.modules["browser"] = browser
_spec.loader.exec_module(browser)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(browser.chromium() is None, reason="no Chromium on the PATH or in STEMCAL_CHROMIUM"),
]

BAD = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>bad</title>
<meta name="viewport" content="width=device-width"></head><body>
<h1>Bad</h1><p style="color:#ddd;background:#fff">faint</p><img src="http://127.0.0.1:9/x.png">
<table style="width:2000px"><tr><td>wide</td></tr></table><script>console.log("hello"); throw Error("oh")</script>
</body></html>"""


def test_the_report_has_no_faults(replayed: tuple[Any, Any]) -> None:
    assert browser.faults(write_page(*replayed)) == []


def test_the_check_sees_faults(tmp_path: Path) -> None:
    page = tmp_path / "bad.html"
    page.write_text(BAD, "utf-8")
    found = "\n".join(browser.faults(page))
    for fault in ("console log: hello", "error: oh", "request: http://127.0.0.1:9/x.png", "390 px light: the page is",
                  "390 px light: TABLE. sticks out", "print: TABLE"):  # fmt: skip
        assert fault in found
    if browser.axe():
        assert "axe serious color-contrast" in found and "axe critical image-alt" in found
