"""Known answers, computed anew and written down as a page of the documentation.

The set-ups are those of the verification tests, which become importable here.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "verification"), str(ROOT / "tests" / "fem")]
