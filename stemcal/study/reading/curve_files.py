"""Curves that targets name: their files beside the spec, and what is written in their place."""

from collections.abc import Sequence
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


def with_curves(targets: Any, folder: Path) -> tuple[Any, dict[int, list[Curve]], list[Finding]]:
    """Return targets whose entries with curves have force, SD and n; the curves by entry; what is wrong with them."""
    entries = targets.get("forces") if isinstance(targets, dict) else None
    curves: dict[int, list[Curve]] = {}
    wrong: list[Finding] = []
    if not isinstance(entries, list) or not any(isinstance(entry, dict) and "curves" in entry for entry in entries):
        return targets, curves, wrong
    filled = list(entries)
    for index, entry in enumerate(entries):
        patterns = entry.get("curves") if isinstance(entry, dict) else None
        patterns = [patterns] if isinstance(patterns, str) else patterns
        if not isinstance(patterns, list) or not patterns or not all(isinstance(one, str) for one in patterns):
            continue  # told by the model
        path: NodePath = ("targets", "forces", index, "curves")
        read, unread = _read(patterns, folder, path)
        wrong += unread
        if not unread:
            curves[index] = read
            forces = summarise([float(force.max()) for _, force in read])
            sd = {} if forces.sd is None else {"sd": f"{forces.sd:.4g} N"}
            own = {"force": f"{forces.mean:.5g} N", **sd, "n": forces.n}
            filled[index] = entry if "force" in entry else {**entry, **own}
    return {**targets, "forces": filled}, curves, wrong


def _read(patterns: Sequence[str], folder: Path, path: NodePath) -> tuple[list[Curve], list[Finding]]:
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
