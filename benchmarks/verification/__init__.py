"""Known solutions: computed and written to a page of the documentation.

The models are those of the verification tests, which can be imported here.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "verification"), str(ROOT / "tests" / "fem")]
