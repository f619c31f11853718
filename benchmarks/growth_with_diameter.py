"""How well one material fits all measured diameters, with a yield stress that grows and with a stem that folds.

    python benchmarks/growth_with_diameter.py [FOLDER]

Fits both models to every choice of diameters below and prints the errors at fitted and held-out diameters next to
those of F = a·d^b through the same forces. Runs are kept in FOLDER (15 minutes on one core without them).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import stemcal
from stemcal.doe.validation.null_model import formula_elsewhere
from stemcal.python.results import StudyResults
from stemcal.study.model import Study
from stemcal.study.reading import read_study

SPEC = Path(__file__).parents[1] / "configs" / "wild-chrysanthemum.yaml"
CHOICES = ([7, 9, 11], [8, 11], [7, 8, 9, 10, 11], *([d for d in range(7, 12) if d != out] for out in range(7, 12)))


def main() -> None:
    """Print a line per model and choice of diameters."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/growth-with-diameter")
    for name, study in {"grows": stemcal.load_study(SPEC), "folds": folding()}.items():
        for fitted in CHOICES:
            chosen = study.with_(invert={"diameters": [f"{d} mm" for d in fitted]})
            print(f"{name} {line(stemcal.calibrate(chosen, out=folder / name, progress=False), fitted)}", flush=True)


def folding() -> Study:
    """Return one material with failure strains of 0.2 to 0.4, and elements that resolve the contact at the supports."""
    text = SPEC.read_text(encoding="utf-8")
    changes = {
        "growth, label: Exponent of the yield stress, low: -0.25, high: 1.25": "failure_strain, low: 0.2, high: 0.4",
        "low: 12, high: 24": "low: 8, high: 13",
        "  yield_stress: {at: 9 mm, exponent: growth}": "",
        "  failure_strain: 0.03\n": "",
        "[yield_stress, growth]": "[yield_stress, failure_strain]",
        "duration: 2.5 s": "duration: 3 s",
        "rate_law: none": "rate_law: none, coarsening: 2, mass_scaling: 1e5, time_step: 120 us, filter_window: 50 ms",
    }
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new)
    return read_study(f"{text}specimen: {{length: 32 mm}}\n".encode(), SPEC)


def line(results: StudyResults, fitted: list[int]) -> str:
    """Return parameters, errors and those of the formula, percent of the measured force."""
    rows = [row.compared for row in results.validation.rows]
    errors = ", ".join(f"{row.condition:g} mm {row.error_percent:+.1f}" for row in rows)
    out = [abs(row.error_percent or np.nan) for row in rows if row.condition not in fitted]
    pairs = [(row.condition, row.measured) for row in rows]
    formula = formula_elsewhere(
        [pair for pair in pairs if pair[0] in fitted], [pair for pair in pairs if pair[0] not in fitted]
    )
    worst = f"held out {max(out):.1f}, formula {formula:.1f}" if out else "none held out"
    values = ", ".join(f"{name} {value:.4g}" for name, value in results.inversion.point.solution.items())
    return f"fitted to {fitted}: {values}; {errors}; {worst}"


if __name__ == "__main__":
    main()
