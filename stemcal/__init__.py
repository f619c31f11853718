"""Calibrate finite element models of plant stems against measured cutting force.

    study = stemcal.load_study("my-stems.yaml")
    results = stemcal.calibrate(study, workers=2)
    results.parameters, results.surface.anova, results.figure("contour")

Names are loaded on first use, so that importing the package is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from stemcal.version import __version__

if TYPE_CHECKING:
    from stemcal.python.results import Curve as Curve
    from stemcal.python.results import Simulated as Simulated
    from stemcal.python.results import StudyResults as StudyResults
    from stemcal.python.study import calibrate as calibrate
    from stemcal.python.study import load_study as load_study
    from stemcal.python.study import open_results as open_results
    from stemcal.python.study import simulate as simulate
    from stemcal.stages.climb.result import ClimbResult as ClimbResult
    from stemcal.stages.invert.result import InvertResult as InvertResult
    from stemcal.stages.refine.result import RefineResult as RefineResult
    from stemcal.stages.rsm.result import RsmResult as RsmResult
    from stemcal.stages.screen.result import ScreenResult as ScreenResult
    from stemcal.stages.validate.result import ValidateResult as ValidateResult
    from stemcal.study.model.study import Study as Study

_NAMES = {
    **dict.fromkeys(("calibrate", "load_study", "open_results", "simulate"), "stemcal.python.study"),
    **dict.fromkeys(("Curve", "Simulated", "StudyResults"), "stemcal.python.results"),
    "ScreenResult": "stemcal.stages.screen.result",
    "ClimbResult": "stemcal.stages.climb.result",
    "RsmResult": "stemcal.stages.rsm.result",
    "InvertResult": "stemcal.stages.invert.result",
    "RefineResult": "stemcal.stages.refine.result",
    "ValidateResult": "stemcal.stages.validate.result",
    "Study": "stemcal.study.model.study",
}
__all__ = ["__version__", *_NAMES]


def __getattr__(name: str) -> object:
    if name == "errors":
        return import_module("stemcal.errors")
    if name not in _NAMES:
        raise AttributeError(f"module 'stemcal' has no attribute {name!r}")
    return getattr(import_module(_NAMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "errors"])
