"""The `targets` section of a spec, written from measured forces; a spec's other lines stay as they are."""

import re
from collections.abc import Sequence

from stemcal.errors import UsageError
from stemcal.measured.shear import GradeForces, ShearTests
from stemcal.measured.statistics import Summary

_DIGITS = 4


def targets_section(tests: ShearTests, calibrate_at: float | None = None, travel_and_work: bool = False) -> str:
    """Return the section as YAML: mean, standard deviation and number of specimens of every grade.

    Without `calibrate_at` the parameters are calibrated at the middle grade. With `travel_and_work` the travel to the
    maximum and the work done by then stand beside the force.
    """
    diameters = [grade.diameter for grade in tests.grades]
    chosen = diameters[len(diameters) // 2] if calibrate_at is None else calibrate_at
    if chosen not in diameters:
        listed = ", ".join(f"{diameter:g}" for diameter in diameters)
        raise UsageError(f"--calibrate-at {chosen:g}: not measured; take one of {listed}")
    made_up = "  # SYNTHETIC data, not measured" if tests.synthetic else ""
    lines = [f"targets:{made_up}", f"  calibrate_at: {chosen:g} mm", "  forces:"]
    lines += [_entry(grade, travel_and_work) for grade in tests.grades]
    return "\n".join(lines) + "\n"


def _entry(grade: GradeForces, travel_and_work: bool) -> str:
    sd = _spread("sd", grade.summary, "N")
    line = f"    - {{diameter: {grade.diameter:g} mm, force: {_short(grade.summary.mean)} N{sd}, n: {grade.summary.n}"
    if travel_and_work:
        travel, work = grade.travel, grade.work
        line += f",\n       travel: {_short(travel.mean)} mm{_spread('travel_sd', travel, 'mm')}"
        line += f",\n       work: {_short(work.mean)} mJ{_spread('work_sd', work, 'mJ')}"
    return f"{line}}}"


def _spread(name: str, summary: Summary, unit: str) -> str:
    return f", {name}: {_short(summary.sd)} {unit}" if summary.sd is not None else ""


def _short(value: float) -> str:
    """Return a value with as many digits as a laboratory has."""
    return f"{value:.{_DIGITS}g}" if value < 1000 else f"{value:.1f}"


def with_targets(spec: str, section: str) -> str:
    """Return a spec's text with its `targets` section replaced, or appended if it has none.

    >>> spec = "name: a\\ntargets:\\n  old: 1\\n\\n# next\\nscreen: {}\\n"
    >>> print(with_targets(spec, "targets:\\n  new: 2\\n"), end="")
    name: a
    targets:
      new: 2
    <BLANKLINE>
    # next
    screen: {}
    """
    lines = spec.splitlines()
    begins = [index for index, line in enumerate(lines) if re.match(r"targets\s*:", line)]
    if not begins:
        return spec.rstrip("\n") + "\n\n" + section
    begin = begins[0]
    end = begin + 1 + _indented(lines[begin + 1 :])
    return "\n".join([*lines[:begin], *section.rstrip("\n").splitlines(), *lines[end:]]) + "\n"


def _indented(lines: Sequence[str]) -> int:
    """Return how many lines belong to a section: up to the last one that is indented or a list item."""
    last = 0
    for index, line in enumerate(lines):
        if line.strip() and not line.startswith((" ", "\t", "-", "#")):
            break
        if line.strip() and not line.startswith("#"):
            last = index + 1
    return last
