"""Fit a growing yield stress and a folding stem to all measured diameters, and print their errors.

    python benchmarks/growth_with_diameter.py [FOLDER]
    python benchmarks/growth_with_diameter.py --predict [FILE.png]

Both models are fitted to every set of diameters below. The errors at fitted and held-out diameters are printed next to
those of F = a·d^b through the same forces. Runs are kept in FOLDER; without existing runs the script takes 15 minutes
on one core. With --predict, both calibrated materials are simulated at 8 mm with other gaps, blades and walls.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import stemcal
from stemcal.doe.comparison import formula_elsewhere
from stemcal.python.results import StudyResults
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.validate.result import ValidateResult
from stemcal.study.model.study import Study
from stemcal.study.reading import read_study

SPEC = Path(__file__).parents[1] / "configs" / "wild-chrysanthemum.yaml"
CHOICES = ([7, 9, 11], [8, 11], [7, 8, 9, 10, 11], *([d for d in range(7, 12) if d != out] for out in range(7, 12)))


# Calibrated at 7, 9 and 11 mm.
MATERIALS = {
    "grows": {"yield_stress": 20.42, "growth": 0.555},
    "folds": {"yield_stress": 10.10, "failure_strain": 0.2938},
}
VARIED: dict[str, tuple[str, str, tuple[float, ...]]] = {
    "gap between the supports, mm": ("supports", "clearance", (15, 20, 30, 40)),
    "edge angle, °": ("blade", "edge_angle", (20, 37.5, 60)),
    "bore over outer diameter": ("specimen", "diameter_ratio", (0.2, 0.41, 0.6)),
}
UNITS = {"clearance": " mm", "edge_angle": " deg", "diameter_ratio": ""}


def main() -> None:
    """Print a line per model and choice of diameters, or the forces of other tests."""
    if "--predict" in sys.argv:
        drawn = sys.argv[-1] if sys.argv[-1].endswith(".png") else ""
        show(predicted(), drawn)
        return
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/growth-with-diameter")
    for name, spec in {"grows": SPEC.read_bytes(), "folds": folding()}.items():
        for fitted in CHOICES:
            chosen = read_study(spec, SPEC, {"invert": {"diameters": [f"{d} mm" for d in fitted]}})
            print(f"{name} {line(stemcal.calibrate(chosen, out=folder / name, progress=False), fitted)}", flush=True)


def folding() -> bytes:
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
    return f"{text}specimen: {{length: 32 mm}}\n".encode()


def predicted() -> dict[str, dict[str, list[float]]]:
    """Return the force at 8 mm of both materials in every test."""
    specs = {"grows": SPEC.read_bytes(), "folds": folding()}
    forces: dict[str, dict[str, list[float]]] = {}
    for what, (section, key, values) in VARIED.items():
        forces[what] = {}
        for name, spec in specs.items():
            each = [varied(spec, section, key, value) for value in values]
            forces[what][name] = [stemcal.simulate(one, 8.0, **MATERIALS[name]).peak_force for one in each]
    return forces


def varied(spec: bytes, section: str, key: str, value: float) -> Study:
    """Return the study of a spec with another test; a specimen reaches 6 mm beyond the supports."""
    study = read_study(spec, SPEC)
    gap = value if key == "clearance" else study.supports.clearance
    sections: dict[str, dict[str, object]] = {"specimen": {"length": f"{max(study.specimen.length, gap + 12.0):g} mm"}}
    sections.setdefault(section, {})[key] = f"{value:g}{UNITS[key]}" if UNITS[key] else value
    return read_study(spec, SPEC, sections)


def show(forces: dict[str, dict[str, list[float]]], drawn: str) -> None:
    """Print the forces, and draw them into a file if one is named."""
    import matplotlib.pyplot as plt

    figure, every = plt.subplots(1, 3, figsize=(9, 2.8), sharey=True, layout="constrained")
    for axes, (what, found) in zip(every, forces.items(), strict=True):
        values = VARIED[what][2]
        for name, marker in (("grows", "o-"), ("folds", "s--")):
            print(f"{what} {name}:", ", ".join(f"{x:g}: {f:.1f} N" for x, f in zip(values, found[name], strict=True)))
            axes.plot(values, found[name], marker, label=f"material that {name}")
        axes.set_xlabel(what)
    every[0].set_ylabel("maximum force at 8 mm, N")
    every[0].set_ylim(0.0)
    every[0].legend(frameon=False)
    if drawn:
        figure.savefig(drawn, dpi=150)


def line(results: StudyResults, fitted: list[int]) -> str:
    """Return parameters, errors and those of the formula, percent of the measured force."""
    rows = [row.compared for row in results.of(ValidateResult).rows]
    errors = ", ".join(f"{row.condition:g} mm {row.error_percent:+.1f}" for row in rows)
    out = [abs(row.error_percent or np.nan) for row in rows if row.condition not in fitted]
    pairs = [(row.condition, row.measured) for row in rows]
    formula = formula_elsewhere(
        [pair for pair in pairs if pair[0] in fitted], [pair for pair in pairs if pair[0] not in fitted]
    )
    worst = f"held out {max(out):.1f}, formula {formula.worst_held_out_percent:.1f}" if formula else "none held out"
    values = ", ".join(f"{name} {value:.4g}" for name, value in results.of(InvertResult).point.solution.items())
    return f"fitted to {fitted}: {values}; {errors}; {worst}"


if __name__ == "__main__":
    main()
