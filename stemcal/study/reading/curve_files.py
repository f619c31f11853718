"""Curves that targets name: their files next to the spec, and the force calculated from them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stemcal.errors import UsageError
from stemcal.measured.curve_modes import FEWEST, Curve, smoothed
from stemcal.measured.shear_curves import CurveOptions, read_curves
from stemcal.measured.statistics import summarise
from stemcal.study.rules.draft import Finding
from stemcal.study.types.strict_yaml import NodePath
from stemcal.words import counted

_MOST_FILES, _MOST_NAMES = 1000, 10
_WHOLE = CurveOptions(preload=0.0)  # where noisy points pass the preload is found once they are smoothed


def summarised(curves: Sequence[Curve], row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row of targets with force, standard deviation and number of specimens of its curves."""
    forces = summarise([float(force.max()) for _, force in curves])
    given = row.get("sd")
    sd = dict(given) if isinstance(given, dict) else {}
    if forces.sd is not None:
        sd["force"] = f"{forces.sd:.4g} N"
    return {**row, "force": f"{forces.mean:.5g} N", "n": forces.n, **({"sd": sd} if sd else {})}


def curves_in(patterns: Sequence[str], folder: Path, path: NodePath) -> tuple[list[Curve], list[Finding]]:
    """Return the smoothed curves of all files, and what is wrong with these."""
    read: list[Curve] = []
    wrong: list[Finding] = []
    try:
        files = _files(patterns, folder)
    except UsageError as error:
        return read, [Finding(path, str(error), "name files of force over travel, beside the spec")]
    for file in files:
        try:
            read += [smoothed(curve.travel, curve.force) for curve in read_curves(file, _WHOLE)]
        except UsageError as error:
            wrong.append(Finding(path, str(error), "mend the file; head columns Travel (mm) and Force (N), say"))
    if not wrong and len(read) < FEWEST:
        message = f"curves of only {counted(len(read), 'specimen')}: how they scatter is not known"
        wrong.append(Finding(path, message, f"measure {FEWEST} or more, or give force and sd alone"))
    return read, wrong[:_MOST_NAMES]


def _files(patterns: Sequence[str], folder: Path) -> list[Path]:
    """Return the files that patterns name, in their order; each pattern some, none outside the folder of the spec."""
    found: dict[Path, None] = {}
    for pattern in patterns:
        try:
            files = sorted(path for path in folder.glob(pattern) if path.is_file())
        except (ValueError, NotImplementedError, OSError):
            files = []
        inside = [path for path in files if path.resolve().is_relative_to(folder.resolve())]
        if not inside:
            raise UsageError(f"no file matches {pattern[:100]}; {_lying(folder, pattern)}")
        found |= dict.fromkeys(inside)
    if len(found) > _MOST_FILES:
        raise UsageError(f"{len(found)} files are too many")
    return list(found)


def _lying(folder: Path, pattern: str) -> str:
    """Tell what lies in the last folder of a pattern that there is, the spec's own or one below it."""
    place = folder
    for step in Path(pattern).parts[:-1]:
        place = next((one for one in place.glob("*") if one.name == step and one.is_dir()), place)
    names = sorted(path.name for path in place.glob("*"))
    return f"{place} holds {', '.join(names[:_MOST_NAMES]) or 'nothing'}{', …' if names[_MOST_NAMES:] else ''}"
