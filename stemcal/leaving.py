"""Ending a process at once."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import NoReturn


def leave_at_once(code: int) -> NoReturn:
    """End this process without taking down what it has loaded: compiled code and libraries would take half a second.

    What is registered to be done at exit is not done.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)
